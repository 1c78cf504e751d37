"""Validates the SARIF of `check` and of a run: by the schema, and by what GitHub requires of code scanning.

    python3 tests/system/control/sarif_reports.py --serve target/release/ts3100"""

import json
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from steps import Failed, equal, program, serving, true  # noqa: E402

# The validator of the format's maker, for Linux on x86-64; it has the schema and the rules of GitHub.
VALIDATOR = "@microsoft/sarif-multitool-linux@5.7.0"
HOST = """import os, socket
host, port = os.environ["TS3100_IP0"].split(":")
with socket.create_connection((host, int(port))) as line:
    for text in (b"so", b"XX", b"SU "):
        line.sendall(b"\\x02" + text + b"\\r\\x03")
        line.recv(512)
"""
BAD = "PROGRAM BAD\nSPARE = 1\nMOV A1\nGOTO NOWHERE\nEND\n"


def validator(folder):
    """The path of the validator, fetched into a folder."""
    packed = subprocess.run(["npm", "pack", "--silent", VALIDATOR], cwd=folder, check=True, capture_output=True, text=True)
    subprocess.run(["tar", "-xzf", packed.stdout.strip().splitlines()[-1]], cwd=folder, check=True)
    path = os.path.join(folder, "package", "Sarif.Multitool")
    os.chmod(path, 0o755)
    return path


def documents(binary, folder):
    """SARIF of every kind: checked programs by relative and absolute path, runs with and without a transcript."""
    for name in ("bad.scol", "with blank.scol"):
        with open(os.path.join(folder, name), "w", encoding="ascii") as file:
            file.write(BAD)
    with open(os.path.join(folder, "host.py"), "w", encoding="ascii") as file:
        file.write(HOST)
    for name, source in (("relative.sarif", "with blank.scol"), ("absolute.sarif", os.path.join(folder, "bad.scol"))):
        done = subprocess.run([binary, "check", "--format", "sarif", source, "missing.scol"], cwd=folder, stdout=subprocess.PIPE, check=False)
        with open(os.path.join(folder, name), "wb") as file:
            file.write(done.stdout)
        yield name, 2
    for name, words in (("run.sarif", []), ("recorded.sarif", ["--transcript", os.path.join(folder, "day 1.txt")])):
        subprocess.run([binary, "exec", "--findings", name, *words, "--", sys.executable, "host.py"], cwd=folder, check=True,
                       stderr=subprocess.DEVNULL)
        yield name, 2


def check_places(path, least):
    """Each result lies in a file and has a line; there are enough of them to prove something."""
    with open(path, encoding="utf-8") as file:
        (run,) = json.load(file)["runs"]
    for result in run["results"]:
        place = result["locations"][0]["physicalLocation"]
        if not place["artifactLocation"]["uri"] or place["region"]["startLine"] < 1:
            raise Failed("%s: each result has a place\n     found    %s" % (path, result))
    true("%s has at least %d results" % (os.path.basename(path), least), len(run["results"]) >= least, run["results"])


def errors(tool, path):
    """The lines of the validator that GitHub or the schema refuses."""
    done = subprocess.run([tool, "validate", path, "--rule-kind", "Sarif;Ghas", "--level", "Error;Warning;Note"], capture_output=True,
                          text=True, check=False, env={**os.environ, "DOTNET_SYSTEM_GLOBALIZATION_INVARIANT": "1"})
    if "1 files scanned" not in done.stdout:
        raise Failed("the validator reads %s\n     found    %s%s" % (path, done.stdout, done.stderr))
    return [line for line in done.stdout.splitlines() if ": error " in line]


def main():
    binary = serving(__doc__).parse_args().serve
    with tempfile.TemporaryDirectory(prefix="ts3100-sarif-") as folder:
        tool = validator(folder)
        for name, least in documents(binary, folder):
            path = os.path.join(folder, name)
            check_places(path, least)
            equal("%s: valid, and GitHub takes it" % name, [], errors(tool, path))
        with open(path, encoding="utf-8") as file:
            broken = json.load(file)
        broken["runs"][0]["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] = "C:\\no uri"
        with open(path, "w", encoding="utf-8") as file:
            json.dump(broken, file)
        true("the validator refuses a URI that is none", errors(tool, path))


if __name__ == "__main__":
    sys.exit(program(main))
