#!/usr/bin/env python3
"""The control interface against a fuzzer and a hostile page.

    python3 tests/system/control/http_attacks.py --serve target/release/ts3100 [--examples 40] [--venv DIR]

schemathesis reads the interface's own OpenAPI document and calls every operation with values that fit it and values
that do not, all of its checks on. A hostile page is a client with a foreign Origin, a foreign Host, or no token. The
exit code is 0 when nothing was found."""

import argparse
import http.client
import json
import os
import subprocess
import sys
import tempfile
import venv

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Emulator, fail  # noqa: E402

SCHEMATHESIS = "schemathesis==4.32.5"
TOKEN = "a-token-of-the-test-0123456789"
LIMIT = 420
# It has no end unless `count` is given, and is asked for by hand below.
STREAM = "/events"


class Client(Emulator):
    """An emulator with a token, and any request to it."""

    def __init__(self, binary):
        super().__init__(binary, TOKEN)

    def ask(self, method, path, headers, body=None):
        connection = http.client.HTTPConnection(self.authority, timeout=20)
        try:
            connection.putrequest(method, path, skip_host="Host" in headers, skip_accept_encoding=True)
            for name, value in headers.items():
                connection.putheader(name, value)
            if body is not None:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            answer = connection.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read()
        finally:
            connection.close()


def environment_of(directory):
    """A virtual environment with schemathesis in it."""
    directory = os.path.abspath(directory)
    python = os.path.join(directory, "bin", "python")
    if not os.path.exists(python):
        venv.create(directory, with_pip=True)
    have = subprocess.run([python, "-c", "import schemathesis"], capture_output=True, check=False)
    if have.returncode != 0:
        subprocess.run([python, "-m", "pip", "install", "--quiet", SCHEMATHESIS], check=True)
    return os.path.join(directory, "bin", "schemathesis")


def fuzz(emulator, tool, examples, seed):
    """All checks of schemathesis on every operation."""
    command = [tool, "run", emulator.url + "/openapi.json", "--header", "Authorization: Bearer " + TOKEN,
               "--checks", "all", "--max-examples", str(examples), "--seed", str(seed), "--request-timeout", "20",
               "--max-failures", "20", "--exclude-path", STREAM, "--no-color",
               # Waiting for what never comes is what these two are for.
               "--exclude-path", "/wait"]
    with tempfile.TemporaryDirectory(prefix="ts3100-api-") as directory:
        # It keeps examples in the directory in which it runs.
        done = subprocess.run(command, timeout=LIMIT, cwd=directory, check=False)
    if done.returncode != 0:
        fail("schemathesis (seed %d) ended with %d" % (seed, done.returncode))


def hostile_page(emulator):
    """What a browser would send for a page of somebody else."""
    good = {"Authorization": "Bearer " + TOKEN}
    json_body = {**good, "Content-Type": "application/json"}
    own = emulator.authority
    calls = [
        ("no token", 401, "GET", "/state", {}, None),
        ("another token", 401, "GET", "/state", {"Authorization": "Bearer 0123456789abcdef"}, None),
        # Where a token is needed any name will do: such a page has none.
        ("a name that resolves to this machine", 401, "GET", "/state", {"Host": "evil.example"}, None),
        ("the same with the port", 401, "GET", "/events", {"Host": "evil.example:3100"}, None),
        ("the same with its own origin", 401, "GET", "/state",
         {"Host": "evil.example", "Origin": "http://evil.example", "Sec-Fetch-Site": "same-origin"}, None),
        ("another name of this machine, with the token", 200, "GET", "/state", {**good, "Host": "robot"}, None),
        ("a foreign origin reads", 403, "GET", "/state", {**good, "Origin": "http://evil.example"}, None),
        ("a foreign origin listens", 403, "GET", "/events?since=1", {**good, "Origin": "null"}, None),
        ("a foreign origin writes", 403, "PUT", "/servo", {**json_body, "Origin": "http://evil.example"}, b'{"on":true}'),
        ("another port of this machine", 403, "PUT", "/servo", {**json_body, "Origin": "http://localhost:1"}, b'{"on":true}'),
        ("an image", 403, "GET", "/metrics", {**good, "Sec-Fetch-Site": "cross-site"}, None),
        ("a form", 415, "POST", "/reset", {**good, "Content-Type": "application/x-www-form-urlencoded"}, b"a=1"),
        ("a beacon", 415, "POST", "/power/off", {**good, "Content-Type": "text/plain"}, b"{}"),
        ("a preflight", 403, "OPTIONS", "/servo", {"Origin": "http://evil.example",
                                                   "Access-Control-Request-Method": "PUT"}, None),
        ("the own page", 200, "GET", "/state", {**good, "Origin": "http://" + own, "Sec-Fetch-Site": "same-origin"}, None),
    ]
    for name, expected, method, path, headers, body in calls:
        status, answered, _ = emulator.ask(method, path, headers, body)
        if status != expected:
            fail("%s: %d expected, %d found" % (name, expected, status))
        told = [header for header in answered if header.lower().startswith("access-control-")]
        if told:
            fail("%s: no CORS header expected, found %s" % (name, told))
        print("ok   %s: %d" % (name, status))
    status, _, body = emulator.ask("GET", "/state", good)
    state = json.loads(body)
    if status != 200 or not state["power"]:
        fail("the emulator is as it was expected, found %s" % body[:200])
    emulator.ask("PUT", "/battery", json_body, b'{"low":true}')
    status, _, body = emulator.ask("GET", "/events?since=1&count=1", good)
    if status != 200 or not body.startswith(b"event: "):
        fail("an event expected, found %d %s" % (status, body[:200]))
    print("ok   nothing came of it")


def main():
    parser = argparse.ArgumentParser(description="the control interface against a fuzzer and a hostile page")
    parser.add_argument("--serve", required=True, metavar="BINARY")
    parser.add_argument("--examples", type=int, default=40, help="examples an operation")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--venv", help="where schemathesis is, or is put; a temporary directory if not said")
    options = parser.parse_args()
    binary = os.path.abspath(options.serve)
    for part in (hostile_page, None):
        with Client(binary) as emulator:
            if part:
                part(emulator)
                continue
            if options.venv:
                fuzz(emulator, environment_of(options.venv), options.examples, options.seed)
            else:
                with tempfile.TemporaryDirectory(prefix="ts3100-api-") as directory:
                    fuzz(emulator, environment_of(directory), options.examples, options.seed)
            status, _, body = emulator.ask("GET", "/health", {"Authorization": "Bearer " + TOKEN})
            if status != 200:
                fail("the emulator answers behind it expected, found %d %s" % (status, body[:200]))
    print("the control interface stood up to it")


if __name__ == "__main__":
    main()
