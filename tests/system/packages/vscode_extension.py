#!/usr/bin/env python3
"""The extension of Visual Studio Code without an editor: its own tests, the types that it uses, and what its package holds.

    python3 tests/system/packages/vscode_extension.py --serve target/dist/ts3100 [--tools target/tools]

Needs Node.js 20 or newer and npm. tests/system/packages/vscode.py uses the package in a workbench."""

import glob
import os
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", "editors", "vscode"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", "packaging"))
import verify  # noqa: E402
import vsix  # noqa: E402
from emulator import ROOT  # noqa: E402
from steps import Failed, equal, ok, program, serving, true  # noqa: E402

EXAMPLE = os.path.join("walkthrough", "pick.scol")


def said(*command, cwd):
    """What a command prints that has to succeed."""
    ended = subprocess.run(command, cwd=cwd, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if ended.returncode:
        raise Failed("%s: exit code %d\n%s" % (" ".join(command), ended.returncode, ended.stdout))
    return ended.stdout


def main():
    parser = serving(__doc__)
    parser.add_argument("--tools", metavar="DIR", default=os.path.join(ROOT, "target", "tools"), help="where tools are kept")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ts3100-vscode-") as work:
        stage = os.path.join(work, "stage")
        os.mkdir(stage)
        vsix.staged(stage, options.tools)
        tests = sorted(glob.glob(os.path.join(stage, "test", "*.test.js")))
        passed = re.search(r"^# pass (\d+)$", said("node", "--test", "--test-reporter=tap", *tests, cwd=stage), re.MULTILINE)
        true("the tests of the extension: %s" % (passed and passed[1]), passed and int(passed[1]) > 15, passed)
        said("npm", "run", "--silent", "types", cwd=stage)
        ok("its types fit those of the editor")
        listed = said("npx", "vsce", "ls", "--no-dependencies", cwd=stage).splitlines()
        (package,) = vsix.pack("0.1.0", {}, os.path.join(work, "out"), options.tools)
        held = verify.contents(package)
        equal("everything in the package belongs there", [], [name for name, (_, refused) in held.items() if refused])
        own = {name.removeprefix("extension/").lower() for name in held if name.startswith("extension/")}
        equal("vsce lists what the package holds", sorted(own), sorted(name.lower() for name in listed))
        for words in (["check", "--deny-warnings"], ["fmt", "--check"], ["run"]):
            said(options.serve, *words, os.path.join(stage, EXAMPLE), cwd=work)
        ok("the example program has no errors, is formatted, and runs to its end")


if __name__ == "__main__":
    sys.exit(program(main))
