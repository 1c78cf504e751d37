"""What a page shows of a console: the commands that a reader types, what they print, and a command that stays."""

import os
import re
import signal
import subprocess
import tempfile
import time

from steps import Failed

LIMIT = 120


def commands(lines):
    """(what is typed, the lines that it is to print) of a console block: `$ ` and what a here-document needs."""
    at = 0
    while at < len(lines):
        if not lines[at].startswith("$ "):
            raise Failed("a console block begins with `$ `, not with %r" % lines[at])
        typed = [lines[at][2:]]
        at += 1
        document = re.search(r"<<'?(\w+)'?", typed[0])
        while document and typed[-1] != document.group(1):
            typed.append(lines[at])
            at += 1
        shown = []
        while at < len(lines) and not lines[at].startswith("$ "):
            shown.append(lines[at])
            at += 1
        yield "\n".join(typed), shown


class Served:
    """A command of a page that stays, in a process group of its own, with its log."""

    def __init__(self, command, directory, environment):
        self.log = tempfile.NamedTemporaryFile(prefix="ts3100-docs-", suffix=".log")
        self.process = subprocess.Popen(["bash", "-c", "exec " + command], cwd=directory, env=environment, stdin=subprocess.DEVNULL,
                                        stdout=self.log, stderr=self.log, start_new_session=True)

    def printed(self):
        with open(self.log.name, encoding="utf-8", errors="replace") as log:
            return log.read()

    def says(self, line):
        """Whether a line of the log ends so, sooner or later."""
        limit = time.monotonic() + LIMIT
        while time.monotonic() < limit and self.process.poll() is None:
            if any((" " + " ".join(found.split())).endswith(" " + line) for found in self.printed().split("\n")):
                return True
            time.sleep(0.05)
        return False

    def close(self):
        """Ends the group; the exit code."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGTERM)
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                os.killpg(self.process.pid, signal.SIGKILL)
        self.log.close()
        return self.process.wait()
