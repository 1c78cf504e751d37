#!/usr/bin/env python3
"""Runs what README.md shows as its reader does: the command that starts the robot, the session with it word for word, and its end.

    python3 tests/system/docs/readme_session.py [--target DIRECTORY_OF_CARGO]

The block after the line <!-- ci:run --> starts the robot. Each fenced block after a line <!-- ci:session --> is taken: of `sh`
every line is typed, of `console` the lines after `$ ` and what a here-document needs, the others are what has to be printed; of
`text` each line is in the log of the robot, after its time. The blocks share one shell, in a directory with `target` only.

Before that, the commands that install from a clone are run, of the README and of other pages, into a directory that is removed."""

import argparse
import os
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import console  # noqa: E402
import pages  # noqa: E402
from emulator import ROOT  # noqa: E402
from steps import Failed, equal, ok, program, true, until  # noqa: E402
from wire import Host  # noqa: E402

PAGE = os.path.join(ROOT, "README.md")
RUN, SESSION = "<!-- ci:run -->", "<!-- ci:session -->"
LIMIT = 60.0
# cargo may have to build first.
STARTED = 900.0
END = "--- end of this command ---"


def blocks(mark):
    """(language, lines) of each block after this mark."""
    with open(PAGE, encoding="utf-8") as page:
        lines = page.read().split("\n")
    for number, line in enumerate(lines):
        if line == mark:
            begin = next(k for k in range(number, len(lines)) if lines[k].startswith("```"))
            end = next(k for k in range(begin + 1, len(lines)) if lines[k].startswith("```"))
            yield lines[begin][3:], lines[begin + 1:end]


def commands(language, lines):
    """(what is typed, what is to be printed or None where the page does not say) of a block."""
    return [("\n".join(lines), None)] if language == "sh" else console.commands(lines)


def port_of(command):
    """IP0: 1000 as in the factory's ETHERNET.PAR, and the offset the command asks for."""
    offset = re.search(r"--port-offset[ =](\d+)", command)
    return 1000 + (int(offset.group(1)) if offset else 0)


def answers(served, port):
    """Whether SU is answered; fails when the command has ended."""
    if served.process.poll() is not None:
        raise Failed("the robot starts\n     found    its end:\n%s" % served.printed())
    try:
        return len(Host(("127.0.0.1", port), True).status()) == 6
    except OSError:
        return False


def session(target):
    """Types the commands and compares what they print; how many there were."""
    steps = [step for language, lines in blocks(SESSION) if language != "text" for step in commands(language, lines)]
    true("README.md shows a session of %d commands" % len(steps), steps)
    script = "shopt -s expand_aliases\n" + "".join("%s\necho '%s'\n" % (typed, END) for typed, _ in steps)
    with tempfile.TemporaryDirectory(prefix="ts3100-session-") as directory:
        os.symlink(os.path.abspath(target), os.path.join(directory, "target"))
        shell = subprocess.run(["bash"], input=script, cwd=directory, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               timeout=LIMIT, check=False)
    answers = shell.stdout.split(END + "\n")
    if len(answers) != len(steps) + 1:
        raise Failed("the session comes to its end\n     found    %s" % shell.stdout)
    for (typed, expected), printed in zip(steps, answers):
        if expected is not None and printed.rstrip("\n").split("\n") != (expected or [""]):
            raise Failed("$ %s\n     expected\n%s\n     found\n%s" % (typed, "\n".join(expected), printed))
    ok("each command prints what README.md shows")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--target", metavar="DIRECTORY", default=os.path.join(ROOT, "target"), help="where cargo builds")
    target = parser.parse_args().target
    with tempfile.TemporaryDirectory(prefix="ts3100-installed-") as installed:
        pages.run("docs/readme_session", os.path.join(target, "release", "ts3100"), directory=ROOT, limit=STARTED, CARGO_INSTALL_ROOT=installed)
    (_, lines), = blocks(RUN)
    command = "\n".join(lines)
    served = console.Served(command, ROOT, dict(os.environ))
    try:
        until("`%s` answers SU" % command, lambda: answers(served, port_of(command)), STARTED, served.printed, pause=0.2)
        session(target)
        for line in (line for language, lines in blocks(SESSION) if language == "text" for line in lines):
            true("the log says %r" % line, served.says(line), served.printed())
    finally:
        code = served.close()
    equal("SIGTERM ends it with exit code 0", 0, code)


if __name__ == "__main__":
    sys.exit(program(main))
