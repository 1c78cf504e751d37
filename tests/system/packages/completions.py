#!/usr/bin/env python3
"""Completions in a real shell: Bash at a terminal, with the keys of a person.

    python3 tests/system/packages/completions.py --serve target/dist/ts3100

Types the beginning of a command line, presses TAB, and reads what the shell made of it. The exit code is 0 when every word was
completed as it should be."""

import argparse
import os
import pty
import select
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from steps import Failed, equal, program  # noqa: E402

ANSWER_LIMIT = 20
# Printed behind a completed line, so that the end of it is known.
END = "#end"
PROMPT = "at-your-service> "
LINES = [
    ("ts3100 ser", "ts3100 serve "),
    ("ts3100 serve --time st", "ts3100 serve --time stepped "),
    ("ts3100 serve --model tsl3000-thl3", "ts3100 serve --model tsl3000-thl300 "),
    ("ts3100 serve --set text.st", "ts3100 serve --set text.stx="),
    ("ts3100 serve --set text.stx=r", "ts3100 serve --set text.stx=required "),
    ("ts3100 exec --fault late-r", "ts3100 exec --fault late-reply "),
    ("ts3100 exec --fault late-reply:del", "ts3100 exec --fault late-reply:delay="),
    ("ts3100 serve --load pi", "ts3100 serve --load pick.scol "),
    ("ts3100 serve --load pick.scol --select P", "ts3100 serve --load pick.scol --select PICK "),
    ("ts3100 exec --scenario p", "ts3100 exec --scenario pick.toml "),
    ("ts3100 check p", "ts3100 check pick.scol "),
    ("ts3100 ctl emergency-stop pr", "ts3100 ctl emergency-stop press "),
]


class Shell:
    """Bash at a terminal, in a folder with a program and a scenario."""

    def __init__(self, ts3100, folder):
        child, self.terminal = pty.fork()
        if child == 0:
            os.chdir(folder)
            os.environ.update(PATH="%s:%s" % (os.path.dirname(ts3100), os.environ["PATH"]), PS1=PROMPT, TERM="dumb", COLUMNS="200")
            os.execvp("bash", ["bash", "--noprofile", "--norc", "-i"])
        self.shown, self.count = "", 0
        self.until(PROMPT)
        self.type("bind 'set enable-bracketed-paste off'; source <(ts3100 completions bash); echo ready$((1))\n")
        self.until("ready1")
        self.until(PROMPT)

    def type(self, keys):
        os.write(self.terminal, keys.encode())

    def until(self, end):
        """What the terminal shows up to `end`; what follows is kept for the next call."""
        limit = time.monotonic() + ANSWER_LIMIT
        while end not in self.shown:
            ready, _, _ = select.select([self.terminal], [], [], max(0, limit - time.monotonic()))
            if not ready:
                raise Failed("%r at the terminal\n     found    %r" % (end, self.shown))
            self.shown += os.read(self.terminal, 4096).decode()
        before, self.shown = self.shown.split(end, 1)
        return before

    def completed(self, line):
        """The line after a TAB."""
        self.type(line + "\t" + END)
        shown = self.until(END)
        self.count += 1
        # Away with the line, and a prompt that no other can be taken for.
        self.type("\x15echo line$((%d))\n" % self.count)
        self.until("line%d" % self.count)
        self.until(PROMPT)
        return shown.replace("\x07", "")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--serve", required=True, help="the program")
    ts3100 = os.path.abspath(arguments.parse_args().serve)
    with tempfile.TemporaryDirectory() as folder:
        for name in ("pick.scol", "pick.toml", "pick.png"):
            with open(os.path.join(folder, name), "w", encoding="utf-8"):
                pass
        shell = Shell(ts3100, folder)
        for line, expected in LINES:
            equal("TAB after `%s`" % line, expected, shell.completed(line))


if __name__ == "__main__":
    sys.exit(program(main))
