#!/usr/bin/env python3
"""A host in the style of a raw-socket client of a six-axis arm (hosts.md 8, client D): STX in every text, commands
without CR, which have to be answered OK all the same, SF of 282 bytes read by its length, motions ended by the motion
status of SF.

    python3 tests/system/hosts/six_axis_client.py --serve target/release/ts3100"""

import os
import struct
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import options, run  # noqa: E402
from steps import Failed, equal, ok, true  # noqa: E402
from wire import Line  # noqa: E402

OK = b"\x02OK\r\x03"
SF_FRAME = 282
STATUS, WORLD = 6, 152
POLLS = 300


class Client:
    """The client's one socket."""

    def __init__(self, address):
        self.line = Line(address)

    def order(self, statement, end=b""):
        """A command; this client leaves out its CR."""
        self.line.raw(b"\x02" + statement + end + b"\x03")
        return self.line.count(5)

    def frame(self):
        """SF, read by its length and acknowledged 60 ms later."""
        self.line.raw(b"\x02SF\r\x03")
        frame = self.line.count(SF_FRAME)
        if frame[:4] != b"\x02FL," or frame[-2:] != b"\x1a\x03":
            raise Failed("SF from STX FL, to EOF ETX\n     found    %s" % frame.hex(" "))
        time.sleep(0.060)
        self.line.raw(OK)
        return frame

    def motion(self, what):
        """Wait until the status becomes 1, then until it leaves 1; the last frame."""
        for wanted in (True, False):
            for _ in range(POLLS if not wanted else 4):
                frame = self.frame()
                if (frame[STATUS] == 1) == wanted:
                    break
            else:
                raise Failed("%s: the motion status %s 1\n     found    %d for ever"
                             % (what, "becomes" if wanted else "leaves", frame[STATUS]))
        ok("%s: the motion status becomes 1 and leaves it" % what)
        return frame


def place(frame):
    """World X, Y, Z of a frame."""
    return [round(value, 3) + 0.0 for value in struct.unpack(">3f", frame[WORLD:WORLD + 12])]


def job(ip0, _ip1):
    client = Client(ip0)
    equal("SO without CR: OK", OK, client.order(b"SO"))
    equal("EC,OVRD 50 without CR: OK", OK, client.order(b"EC,OVRD 50"))
    equal("EC,OVRD 100 with CR: OK", OK, client.order(b"EC,OVRD 100", b"\r"))
    true("at rest the status is not 1", client.frame()[STATUS] != 1)
    for x, y, z in ((400, 100, 250), (380, -120, 300), (400, 100, 250)):
        statement = b"DO,MOVE POINT (%d,%d,%d,0,0,0) WITH ACCEL=50, DECEL=60, SPEED=70" % (x, y, z)
        equal("DO,MOVE: OK", OK, client.order(statement, b"\r"))
        equal("it ends where it was sent", [x, y, z], place(client.motion("DO,MOVE")))
    equal("out of reach: OK", OK, client.order(b"DO,MOVE POINT (1900,100,250,0,0,0) WITH SPEED=70", b"\r"))
    frame = client.motion("a DO that fails at once")
    equal("its alarm is 8-035", 34, struct.unpack(">H", frame[8:10])[0])
    equal("the arm stays", [400, 100, 250], place(frame))
    equal("RS,ERR without CR: OK", OK, client.order(b"RS,ERR"))
    equal("EC,BREAK without CR: OK", OK, client.order(b"EC,BREAK"))
    equal("BR without CR: OK", OK, client.order(b"BR"))
    client.line.close()


def main():
    arguments = options("A six-axis client on IP0.").parse_args()
    return run(job, arguments)


if __name__ == "__main__":
    sys.exit(main())
