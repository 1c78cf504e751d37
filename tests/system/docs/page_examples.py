#!/usr/bin/env python3
"""Runs the commands of docs/**/*.md, the README and the other pages as they are written.

    python3 tests/system/docs/page_examples.py --serve target/release/ts3100 [docs/reference/ctl.md ...]

Every fenced block of sh, console or powershell has one of these lines before it; one without fails. Commands are run by
`bash -euo pipefail`, with the program and `tests/system/docs/files` in PATH, in a folder that the blocks of a page share: it
looks like a clone in which the program is built, and has those files.

    <!-- ci:run-example -->               the block is a script
    <!-- ci:commands [FLAGS] -->          each line is a command, with these flags added to those of `ts3100`. `ts3100 serve`
                                          and `ts3100 tap` stay, once they are ready, until the next of them
    <!-- ci:console -->                   lines after `$ ` are commands as above, or `&` at their end lets them stay; the other
                                          lines are what they print
    <!-- ci:control FLAGS -->             a script against a fresh `ts3100 serve --ports auto --ready-json FLAGS`: its control
                                          interface is in TS3100_CONTROL_URL, its ports in IP0 to IP3 as HOST:PORT
    <!-- ci:output -->                    the block is what the one before it printed; a line of three dots matches any lines,
                                          and three dots in a line match any text, here as in a console
    <!-- ci:log -->                       each line is in the log of the command that stays, after its time
    <!-- ci:file NAME -->                 the block is a file for the commands after it
    <!-- ci:check [CODE] -->              the block is a SCOL file in which `ts3100 check` finds this code and no other,
                                          or nothing; one that begins with `' arm: scara` is checked for that arm
    <!-- ci:not-run REASON -->            CI cannot run it, for this reason

`@packages/python_package` after the kind has that program of tests/system run the block, with what it has installed; what follows
a colon there names one of its parts. The README
has blocks with marks of their own, for docs/readme_session.py and .ci/phases.py. The robot at 192.168.0.124 is an emulator.

The exit code is 0 when every block ended with 0 and printed what the page says."""

import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import pages  # noqa: E402
from steps import Failed, program, serving, true  # noqa: E402


def main():
    parser = serving(__doc__)
    parser.add_argument("pages", nargs="*", help="all of them if none is given")
    options = parser.parse_args()
    chosen = options.pages or pages.every()
    problems = [problem for page in chosen for problem in pages.problems(page)]
    if problems:
        raise Failed("marks of the pages\n     " + "\n     ".join(problems))
    count = len(pages.run(None, options.serve, chosen))
    true("%d blocks did what their pages say" % count, count)


if __name__ == "__main__":
    sys.exit(program(main))
