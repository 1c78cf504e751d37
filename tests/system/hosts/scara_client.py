#!/usr/bin/env python3
"""A host in the style of a raw-socket SCARA cell client (hosts.md 3): STX in every text, an OK taken only if
it is five bytes in one receive, SF read in one receive and acknowledged 60 ms later, DO,MOVE with a blank
before the parenthesis, then polling SF until the motion status becomes 1 and until it leaves 1.

    python3 tests/system/hosts/scara_client.py --serve target/release/ts3100"""

import os
import struct
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import options, run  # noqa: E402
from steps import Failed, equal, ok, true  # noqa: E402
from wire import Line  # noqa: E402

OK = b"\x02OK\r\x03"
SF_FRAME = 255
STATUS, JOINT, WORLD, WORK = 6, 120, 144, 168
POLLS = 300


class Client:
    """The client's one socket and its two ways of receiving."""

    def __init__(self, address):
        self.socket = Line(address).socket

    def order(self, statement):
        """A command; the client compares what one receive of 300 bytes brings."""
        self.socket.sendall(b"\x02" + statement + b"\r\x03")
        return self.socket.recv(300)

    def frame(self):
        """One turn of its status loop."""
        self.socket.sendall(b"\x02SF\r\x03")
        frame = self.socket.recv(300)
        if len(frame) != SF_FRAME:
            raise Failed("SF of %d bytes in one receive\n     found    %d: %s"
                         % (SF_FRAME, len(frame), frame[:40].hex(" ")))
        time.sleep(0.060)
        self.socket.sendall(OK)
        time.sleep(0.001)
        return frame

    def motion(self, what):
        """Wait until the status becomes 1, then until it leaves 1; the frames on the way."""
        seen = []
        while not seen or seen[-1][STATUS] != 1:
            seen.append(self.frame())
            if len(seen) > 10:
                raise Failed("%s: the motion status becomes 1\n     found    %d for ever" % (what, seen[-1][STATUS]))
        while seen[-1][STATUS] == 1:
            seen.append(self.frame())
            if len(seen) > POLLS:
                raise Failed("%s: the motion status leaves 1\n     found    1 for ever" % what)
        ok("%s: the motion status becomes 1 and leaves it" % what)
        return seen


def floats(frame, offset, count):
    """Big-endian floats of a frame, rounded to three decimals."""
    return [round(value, 3) + 0.0 for value in struct.unpack(">%df" % count, frame[offset:offset + 4 * count])]


def job(ip0, _ip1):
    client = Client(ip0)
    equal("SO: five bytes in one receive", OK, client.order(b"SO"))
    first = client.frame()
    equal("SF ends 00 00 03, without EOF", b"\x00\x00\x03", first[-3:])
    true("at rest the status is not 1", first[STATUS] != 1)

    move = b"DO,MOVE POINT (300,100.5,-20.123,45) WITH ACCEL=50, DECEL=60, SPEED=70"
    equal("DO,MOVE as the client writes it: OK", OK, client.order(move))
    seen = client.motion("DO,MOVE")
    equal("world X Y Z C at offset 144", [300.0, 100.5, -20.123, 45.0], floats(seen[-1], WORLD, 4))
    equal("work is world while no WORK is chosen", floats(seen[-1], WORLD, 4), floats(seen[-1], WORK, 4))
    true("the joints at offset 120 have moved", floats(seen[-1], JOINT, 4) != floats(first, JOINT, 4))

    equal("the same move again, of no length: OK", OK, client.order(move))
    client.motion("DO,MOVE of no length")

    equal("DO,MOVES: OK", OK, client.order(b"DO,MOVES POINT (320,80.5,-20.123,45) WITH ACCEL=50, DECEL=60, SPEED=70"))
    seen = client.motion("DO,MOVES")
    equal("MOVES ends where it was sent", [320.0, 80.5, -20.123, 45.0], floats(seen[-1], WORLD, 4))
    equal("DO,MOVEC with two positions: OK", OK, client.order(
        b"DO,MOVEC  POINT (330,90.5,-20.123,45)  POINT (320,100.5,-20.123,45) WITH ACCEL=50, DECEL=60, SPEED=70"))
    seen = client.motion("DO,MOVEC")
    equal("MOVEC ends where it was sent", [320.0, 100.5, -20.123, 45.0], floats(seen[-1], WORLD, 4))
    equal("DO,MOVEA: OK", OK, client.order(b"DO,MOVEA 1, 12.5 WITH ACCEL=50, DECEL=60, SPEED=70"))
    seen = client.motion("DO,MOVEA")
    equal("MOVEA turns axis 1", 12.5, floats(seen[-1], JOINT, 1)[0])

    equal("a slow move: OK", OK, client.order(b"DO,MOVE POINT (300,-100,-20,0) WITH ACCEL=50, DECEL=60, SPEED=2"))
    true("it runs", client.frame()[STATUS] == 1)
    equal("EC,BREAK: OK", OK, client.order(b"EC,BREAK"))
    for _ in range(20):
        last = client.frame()
        if last[STATUS] != 1:
            break
    true("EC,BREAK ends it", last[STATUS] != 1)
    true("on its way", floats(last, WORLD, 2) != [300.0, -100.0], repr(floats(last, WORLD, 4)))

    equal("a DO out of reach: OK", OK, client.order(b"DO,MOVE POINT (900,0,0,0) WITH ACCEL=50, DECEL=60, SPEED=70"))
    client.motion("a DO that fails at once")
    client.socket.sendall(b"\x02EC,OVRD 50\x03")
    equal("its older commands, without CR: OK", OK, client.socket.recv(300))
    equal("BR on leaving: OK", OK, client.order(b"BR"))
    client.socket.shutdown(1)
    client.socket.settimeout(2.0)
    equal("the controller closes when the client has", b"", client.socket.recv(300))


def main():
    arguments = options("A SCARA cell client on IP0.").parse_args()
    return run(job, arguments, "--model", "tsl3000-thl400")


if __name__ == "__main__":
    sys.exit(main())
