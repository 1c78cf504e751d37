#!/usr/bin/env python3
"""The OpenAPI document, as those who generate clients from it read it.

    python3 tests/system/control/openapi_document.py --serve target/release/ts3100 [--venv DIR]
    python3 tests/system/control/openapi_document.py --serve target/release/ts3100 --record

openapi-spec-validator validates the document, and every example is validated against its schema. Then
openapi-python-client generates a client, which drives a running emulator. The exit code is 0 when all of it passes.
`--record` replays the requests of crates/control/assets/examples.json and writes the responses into it."""

import json
import os
import subprocess
import sys
import tempfile
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import python_environment  # noqa: E402
import recorded_calls  # noqa: E402
from emulator import ROOT, Emulator  # noqa: E402
from steps import equal, ok, program, serving  # noqa: E402

PACKAGES = ["openapi-spec-validator==0.9.0", "openapi-python-client==0.29.1"]
EXAMPLES = os.path.join(ROOT, "crates", "control", "assets", "examples.json")
TOKEN = "a-token-of-the-test-0123456789"
LIMIT = 300
# Longer lists and texts are cut in an example.
LONGEST_LIST, LONGEST_TEXT = 2, 400

# Runs in the virtual environment: DOCUMENT.
VALIDATE = """
import json, sys
from openapi_schema_validator import OAS31Validator
from openapi_spec_validator import validate

document = json.load(open(sys.argv[1]))
validate(document)
print("ok   the document is valid")


def contents(operation):
    yield "request", operation.get("requestBody", {}).get("content", {})
    for status, response in operation["responses"].items():
        yield status, response.get("content", {})


count = 0
for path, item in document["paths"].items():
    for method, operation in item.items():
        for place, content in contents(operation):
            for kind, media in content.items():
                if kind != "application/json":
                    continue
                schema = {**media["schema"], "components": document["components"]}
                for name, example in media.get("examples", {}).items():
                    errors = [error.message for error in OAS31Validator(schema).iter_errors(example["value"])]
                    if errors:
                        sys.exit("%s %s, %s, example %s: %s" % (method.upper(), path, place, name, errors[0]))
                    count += 1
if count < 100:
    sys.exit("at least 100 examples expected, found %d" % count)
print("ok   %d examples match their schemas" % count)
"""

# Runs in the virtual environment, beside the generated package: URL, TOKEN.
USE = """
import sys
from ts3100_client import AuthenticatedClient
from ts3100_client.api.clock import advance_time
from ts3100_client.api.files import delete_file, get_file, put_file
from ts3100_client.api.panel import get_emergency_stop, put_emergency_stop, put_servo
from ts3100_client.api.state import get_state
from ts3100_client.models import Advance, BytesType0, Button, Problem, Switch

client = AuthenticatedClient(base_url=sys.argv[1], token=sys.argv[2], raise_on_unexpected_status=True)


def same(what, found, expected):
    if found != expected:
        sys.exit("%s: %r expected, found %r" % (what, expected, found))
    print("ok   %s: %r" % (what, found))


with client:
    state = get_state.sync(client=client)
    same("power", state.power, True)
    same("virtual time", state.t, 0.0)

    same("press the emergency stop", put_emergency_stop.sync(client=client, body=Button(pressed=True)).pressed, True)
    same("emergency stop", get_emergency_stop.sync(client=client).pressed, True)
    same("alarms", [alarm.number for alarm in get_state.sync(client=client).alarms], ["8-014"])
    refusal = put_servo.sync_detailed(client=client, body=Switch(on=True))
    same("servo on", (int(refusal.status_code), isinstance(refusal.parsed, Problem)), (409, True))
    put_emergency_stop.sync(client=client, body=Button(pressed=False))

    text = "PROGRAM PICK\\nEND\\n"
    same("write a file", put_file.sync("PICK", client=client, body=BytesType0(text=text)).size, len(text))
    same("read it", get_file.sync("PICK", client=client).text, text)
    delete_file.sync("PICK", client=client)
    same("read it after it was erased", int(get_file.sync_detailed("PICK", client=client).status_code), 404)

    ended = advance_time.sync(client=client, body=Advance(seconds=2.5))
    same("advance time", (ended.reached, ended.now), (True, 2.5))
    same("virtual time", get_state.sync(client=client).t, 2.5)
"""


def run(what, command, directory):
    done = subprocess.run(command, cwd=directory, timeout=LIMIT, check=False)
    equal("%s ends well" % what, 0, done.returncode)


def check(binary, python, directory):
    """The document is valid; a client generated from it works."""
    with Emulator(binary, "--time", "stepped", token=TOKEN) as emulator:
        path = os.path.join(directory, "openapi.json")
        with open(path, "w", encoding="utf-8") as file:
            json.dump(emulator.robot.request("GET", "/openapi.json"), file)
        run("the validation", [python, "-c", VALIDATE, path], directory)
        config = os.path.join(directory, "config.json")
        with open(config, "w", encoding="utf-8") as file:
            # Without the formatters that it would call afterwards.
            json.dump({"package_name_override": "ts3100_client", "post_hooks": []}, file)
        run("openapi-python-client", [python, "-m", "openapi_python_client", "generate", "--path", path, "--config",
                                      config, "--meta", "none", "--output-path",
                                      os.path.join(directory, "ts3100_client"), "--fail-on-warning"], directory)
        ok("a client is generated without a warning")
        run("the generated client", [python, "-c", USE, emulator.url, TOKEN], directory)


def shortened(value):
    """An example shows what there is, not all of it; its ports are those of the real controller."""
    if isinstance(value, dict):
        value = {key: shortened(item) for key, item in value.items()}
        if "accepts" in value:
            value["accepts"] = 1000 + int(value["port"][2:])
        return value
    if isinstance(value, list):
        whole = all(isinstance(item, (int, float)) for item in value)
        return value if whole else [shortened(item) for item in value[:LONGEST_LIST]]
    return value


def path_of(recorded, query):
    """The path of a recorded call with its parameters; `query` are those that do not belong into the path."""
    _, path = recorded["call"].split(" ")
    for name, value in recorded.get("parameters", {}).items():
        place = "{%s}" % name
        if place in path:
            path = path.replace(place, urllib.parse.quote(str(value)))
        else:
            query[name] = value
    return path + ("?" + urllib.parse.urlencode(query) if query else "")


def record(binary):
    """Replays the session and writes the responses down."""
    with open(EXAMPLES, encoding="utf-8") as file:
        session = json.load(file)
    with Emulator(binary, "--time", "stepped") as emulator, recorded_calls.cell(binary) as cell:
        for recorded in session:
            method, _ = recorded["call"].split(" ")
            robot = (cell if recorded["call"] in recorded_calls.NEED_CELL else emulator).robot
            answer = robot.request(method, path_of(recorded, {}), recorded.get("request"))
            is_text = isinstance(answer, str)
            recorded["response"] = answer[:LONGEST_TEXT].rpartition("\n")[0] + "\n" if is_text else shortened(answer)
            if "snapshot" in recorded["call"] and method == "GET" and recorded["call"] != "GET /snapshots":
                # The whole controller is no example.
                del recorded["response"]
    lines = ",\n".join(json.dumps(recorded) for recorded in session)
    with open(EXAMPLES, "w", encoding="utf-8") as file:
        file.write("[\n%s\n]\n" % lines)
    print("%d calls recorded" % len(session))


def main():
    parser = serving(__doc__)
    parser.add_argument("--venv", help="where the packages are, or are put; default: a temporary directory")
    parser.add_argument("--record", action="store_true", help="record the examples again")
    options = parser.parse_args()
    if options.record:
        record(options.serve)
        return
    with tempfile.TemporaryDirectory(prefix="ts3100-openapi-") as directory:
        python = python_environment.python_with(options.venv or os.path.join(directory, "venv"), *PACKAGES)
        check(options.serve, python, directory)


if __name__ == "__main__":
    sys.exit(program(main))
