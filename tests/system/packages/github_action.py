#!/usr/bin/env python3
"""action.yml as a runner does it: its steps by hand, with the inputs of a workflow, against a server that stands for the
releases. A host that is right passes; one that is wrong fails, and the summary of the job says why.

    python3 tests/system/packages/github_action.py --serve target/release/ts3100

What only the hosted service can do, the upload of reports, is not run. The schema of the action is checked."""

import functools
import hashlib
import http.server
import os
import platform
import re
import subprocess
import sys
import tarfile
import tempfile
import threading

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import python_environment  # noqa: E402
from steps import equal, program, serving, true  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
VERSION, LIMIT = "0.1.0", 120
SCHEMAS = "check-jsonschema==0.33.0"
RIGHT = r"""python3 -c '
import os, socket
with socket.create_connection((os.environ["TS3100_HOST"], int(os.environ["TS3100_IP0_PORT"])), 5) as host:
    host.sendall(b"\x02SO\r\x03")
    assert host.recv(64) == b"\x02OK\r\x03"
'"""
WRONG = RIGHT.replace("SO", "QQ").replace(r"OK", "NG")


def action():
    """The inputs with their defaults, and the steps: environment and command."""
    yaml = __import__("yaml")
    with open(os.path.join(ROOT, "action.yml"), encoding="utf-8") as file:
        document = yaml.safe_load(file)
    defaults = {name: entry.get("default", "") for name, entry in document["inputs"].items()}
    return defaults, document["runs"]["steps"]


class Runner:
    """What a hosted runner gives to the steps of a job."""

    def __init__(self, folder, releases):
        self.folder = folder
        os.makedirs(folder)
        self.files = {name: os.path.join(folder, name) for name in ("GITHUB_PATH", "GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY")}
        self.environment = {
            **{name: value for name, value in os.environ.items() if not name.startswith(("TS3100_", "INPUT_"))}, **self.files,
            "RUNNER_TEMP": os.path.join(folder, "temp"), "RUNNER_OS": "Linux", "GITHUB_ACTION_PATH": ROOT,
            "RUNNER_ARCH": {"x86_64": "X64", "aarch64": "ARM64"}[platform.machine()], "TS3100_RELEASES": releases,
        }

    def read(self, name):
        """What the steps have written to a file of the runner."""
        if not os.path.exists(self.files[name]):
            return ""
        with open(self.files[name], encoding="utf-8") as file:
            return file.read()

    def job(self, **inputs):
        """Runs the steps. Returns the exit code of the one that failed, or 0, and all output."""
        defaults, steps = action()
        values = {**defaults, **inputs}

        def filled(text):
            return re.sub(r"\$\{\{ (inputs\.([a-z-]+)|github\.action_repository) \}\}",
                          lambda match: values[match.group(2)] if match.group(2) else "owner/ts3100", text)

        said = ""
        for step in steps:
            if "run" not in step:
                continue
            variables = {name: filled(value) for name, value in step.get("env", {}).items()}
            path = os.pathsep.join([*reversed(self.read("GITHUB_PATH").split()), self.environment["PATH"]])
            done = subprocess.run(["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]], cwd=self.folder,
                                  env={**self.environment, "PATH": path, **variables}, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True, timeout=LIMIT, check=False)
            said += done.stdout
            if done.returncode:
                return done.returncode, said
        return 0, said


def release(folder, binary):
    """A server with a release: the archive of this machine, and the checksums."""
    name = "ts3100-%s-%s-unknown-linux-musl" % (VERSION, platform.machine())
    place = os.path.join(folder, "v" + VERSION)
    os.makedirs(place)
    archive = os.path.join(place, name + ".tar.gz")
    with tarfile.open(archive, "w:gz") as tar:
        tar.add(binary, name + "/ts3100")
    with open(archive, "rb") as file:
        digest = hashlib.sha256(file.read()).hexdigest()
    with open(os.path.join(place, "SHA256SUMS"), "w", encoding="utf-8") as file:
        file.write("%s  %s\n" % (digest, os.path.basename(archive)))
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=folder)
    handler.log_message = lambda *_: None
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server, archive


def jobs(folder, binary):
    """A right host, a wrong one, a damaged release, a program of one's own."""
    server, archive = release(os.path.join(folder, "releases"), binary)
    releases = "http://127.0.0.1:%d" % server.server_address[1]
    runner = Runner(os.path.join(folder, "right"), releases)
    code, said = runner.job(run=RIGHT)
    equal("a right host passes: %s" % said.strip()[-60:], 0, code)
    true("its exit code is an output", "exit-code=0" in runner.read("GITHUB_OUTPUT"), runner.read("GITHUB_OUTPUT"))
    summary = runner.read("GITHUB_STEP_SUMMARY")
    true("the summary says so, with the coverage", "No protocol mistakes." in summary and "% of the permission tables" in summary,
         summary)
    reports = sorted(os.listdir(os.path.join(runner.folder, "ts3100-report")))
    equal("reports for the artifact", ["coverage.html", "findings.json", "findings.md", "findings.sarif", "findings.xml",
                                       "transcript.txt"], reports)

    runner = Runner(os.path.join(folder, "wrong"), releases)
    code, said = runner.job(run=WRONG)
    equal("a wrong host fails, although its own assertions hold", 64, code)
    summary = runner.read("GITHUB_STEP_SUMMARY")
    true("the summary has the finding, and what to do",
         "unknown-command" in summary and "Use a command that" in summary, summary)
    equal("with deny: none it passes", 0, Runner(os.path.join(folder, "none"), releases).job(run=WRONG, deny="none")[0])
    runner = Runner(os.path.join(folder, "fails"), releases)
    equal("the exit code of the tests is kept", 7, runner.job(run="exit 7")[0])

    with open(archive, "r+b") as file:
        file.seek(100)
        file.write(b"x")
    code, said = Runner(os.path.join(folder, "damaged"), releases).job(run=RIGHT)
    true("a damaged release is refused: %s" % said.strip().splitlines()[-1], code == 1 and "damaged or replaced" in said, said)
    code, said = Runner(os.path.join(folder, "own"), "http://127.0.0.1:9").job(run=RIGHT, binary=binary)
    equal("a program of one's own needs no download", 0, code)
    server.shutdown()


def schemas(folder, python):
    """action.yml and the snippets of the documents keep to the schemas of their services."""
    check = [os.path.join(os.path.dirname(python), "check-jsonschema"), "--builtin-schema"]
    for name, page in (("github-workflows", "github-actions"), ("gitlab-ci", "gitlab-ci"), ("azure-pipelines", "azure-pipelines")):
        with open(os.path.join(ROOT, "docs", "how-to", page + ".md"), encoding="utf-8") as file:
            blocks = re.findall(r"^```yaml\n(.*?)^```", file.read(), re.MULTILINE | re.DOTALL)
        for number, block in enumerate(block for block in blocks if re.match(r"\S", block)):
            path = os.path.join(folder, "%s-%d.yml" % (page, number))
            with open(path, "w", encoding="utf-8") as file:
                file.write(block)
            more = ["--regex-variant", "nonunicode", "--data-transform", "azure-pipelines"] if name == "azure-pipelines" else []
            done = subprocess.run([*check, "vendor." + name, *more, path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                  check=False)
            equal("%s.md, example %d keeps to the schema of its service%s"
                  % (page, number + 1, "" if done.returncode == 0 else "\n" + done.stdout), 0, done.returncode)
    done = subprocess.run([*check, "vendor.github-actions", os.path.join(ROOT, "action.yml")], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False)
    equal("action.yml keeps to the schema of actions%s" % ("" if done.returncode == 0 else "\n" + done.stdout), 0, done.returncode)


def main():
    arguments = serving(__doc__).parse_args()
    code = python_environment.run_with(SCHEMAS, "pyyaml")
    if code is not None:
        return code
    with tempfile.TemporaryDirectory() as folder:
        jobs(folder, os.path.realpath(arguments.serve))
        schemas(folder, sys.executable)


if __name__ == "__main__":
    sys.exit(program(main))
