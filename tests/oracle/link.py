"""A host that asks as fast as it is answered, and the emulator it asks. The bytes are spelled out in `tests/system/lib/wire.py`."""

import contextlib
import io
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "system", "lib"))
import emulator  # noqa: E402
from emulator import NotReached  # noqa: E402, F401
from steps import Failed, show  # noqa: E402, F401
from wire import CR, EOF, ETX, STX, Line  # noqa: E402, F401

STEPPED, RUNNING = ("--time", "stepped"), ("--time", "x1000")
# The controller sends no SP of its own accord, serial lines are as fast as TCP, a new connection replaces the old one.
QUIET = ("--set", "sp.unsolicited=false", "--set", "serial.pacing=false", "--set", "channel.second=replace")
ARMS = {"six-axis": (), "scara": ("--model", "tsl3000-thl400")}
# Key switch and control right of each column of the permission tables.
KEYS = {"TEACHING": ("teaching", "ether"), "INTERNAL": ("internal", "ether"), "SIG": ("ext", "sig"), "RS-232C": ("ext", "rs232c"),
        "ETHER": ("ext", "ether")}
OK_TEXT = STX + b"OK" + CR + ETX


class Emulator(emulator.Emulator):
    """An emulator whose end is looked at, but no step to report."""

    def stop(self, *arguments, **more):
        with contextlib.redirect_stdout(io.StringIO()):
            super().stop(*arguments, **more)

    def __exit__(self, failure, *more):
        # Cases that are no longer asked for are no failure.
        super().__exit__(None if failure is GeneratorExit else failure, *more)


def robots(binary, *more):
    """A robot of each arm in each dialect, one after the other: the emulator, its arm and its dialect."""
    for arm, flags in ARMS.items():
        for dialect in ("field", "manual"):
            with Emulator(binary, *QUIET, *STEPPED, *flags, "--dialect", dialect, *more) as emulator:
                yield emulator, arm, dialect


class Case:
    """One comparison: what was asked, what the oracle says, what the emulator says, and the sentence that the oracle rests on."""

    def __init__(self, what, expected, found, rests_on):
        self.what, self.expected, self.found, self.rests_on = what, expected, found, rests_on

    @property
    def holds(self):
        return self.expected == self.found


class Asking(Line):
    """Texts with STX, answers without the advised pause."""

    def answer(self):
        """The data section of the next text of characters."""
        text = self.until(ETX)
        if text[:1] != STX:
            raise Failed("an answer begins with STX\n     found    %s" % show(text))
        return text[1:-1]

    def ask(self, command):
        """The whole answer to a command: OK, NG, or the content of FL without EOF."""
        self.raw(STX + command.encode("ascii") + CR + ETX)
        data = self.answer()
        if not data.startswith(b"FL,"):
            return data.rstrip(b"\r").decode("ascii")
        content = data[3:]
        while True:
            self.raw(OK_TEXT)
            if EOF in content:
                return content[:content.index(EOF)].decode("ascii")
            content += self.answer()

    def total_status(self, arm, dialect):
        """The body of SF, None for NG: 276 bytes and EOF, in the manual dialect in two texts (SF-02); 250 on a SCARA (S23)."""
        if arm == "scara":
            return self.binary("SF", 250, ETX)
        return self.binary("SF", 276, EOF + ETX, split=dialect == "manual")

    def binary(self, command, length, end, split=False):
        """A body that is read by its length; None for NG. `split`: in texts of 253 data bytes."""
        self.raw(STX + command.encode("ascii") + CR + ETX)
        head = self.count(4)
        if head != STX + b"FL,":
            self.until(ETX)
            return None
        body = b""
        if split:
            body = self.count(250)
            self.count(1)
            self.raw(OK_TEXT)
            self.count(1)
        body += self.count(length - len(body))
        found = self.count(len(end))
        if found != end:
            raise Failed("%s ends with %s\n     found    %s" % (command, show(end), show(found)))
        self.raw(OK_TEXT)
        return body


def turn(robot, mode):
    """Brings the key switch and the control right to a column of the permission tables."""
    key, right = KEYS[mode]
    robot.call("put_key_switch", {"position": key})
    robot.call("put_control_right", {"holder": right})


def serial(emulator, port):
    """The address of a serial line that is served as raw TCP, `host` or `com1`."""
    host, number = emulator.ready["serial"][port].rsplit("/", 1)[-1].rsplit(":", 1)
    return (host, int(number))
