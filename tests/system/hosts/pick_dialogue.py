#!/usr/bin/env python3
"""A vision system's pick dialogue on IP1 (hosts.md 4): the robot prints REQ, the host answers one record
ID,CMD,X,Y,Z,C,SHP, the robot acknowledges with the number and a check sum, the host says go or not, the
robot reports. Also records that end in CR LF, records with a trailing comma, and values in single records.

The program is downloaded and started with STX and without the advised pause, as the vendor's library does.

    python3 tests/system/hosts/pick_dialogue.py --serve target/release/ts3100"""

import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import options, run  # noqa: E402
from steps import Failed, equal, true  # noqa: E402
from wire import ETX, STX, EOF, Line  # noqa: E402

PROGRAM = b"""PROGRAM PICK
REMARK Serves picks until a command of 0 comes.
ID = 0
CMD = 0
SHP = 0
GO = 0
X = 0.0
Y = 0.0
Z = 0.0
C = 0.0
ACC = 0
CKSUM = 0
ZSAFE = 60.0
NEXTONE:
PRINT IP1, "REQ", CR
INPUT IP1, ID, CMD, X, Y, Z, C, SHP
IF CMD == 0 THEN GOTO LEAVE
ACC = ID * 1009 + CMD * 10007 + INT(X * 8) + INT(Y * 8) + INT(Z * 8) + INT(C * 8) + SHP + 131072
CKSUM = ACC - INT(ACC / 65536) * 65536
PRINT IP1, "ACK ", ID, " ", CKSUM, CR
INPUT IP1, GO
IF GO == 0 THEN GOTO RELEASE
IF X > 390.0 THEN GOTO OUTSIDE
P = POINT(X + 10, Y, ZSAFE, C, 0.0, LEFTY)
MOVE P
WAIT MOTION >= 100
PRINT IP1, "AT_PICK", CR
P = POINT(X, Y, Z, C, 0.0, LEFTY)
MOVES P
DELAY 0.1
WAIT MOTION >= 100
PRINT IP1, "ARRIVED", CR
MOVE PLACE
WAIT MOTION >= 100
PRINT IP1, "DONE", CR
GOTO NEXTONE
RELEASE:
PRINT IP1, "REL", CR
GOTO NEXTONE
OUTSIDE:
PRINT IP1, "OUT", CR
GOTO NEXTONE
LEAVE:
PRINT IP1, "BYE", CR
END
DATA
POINT PLACE=250,150,50,0,0/LEFTY
END
"""


class Vision:
    """The host's side of the dialogue."""

    def __init__(self, line):
        self.line = line

    def word(self):
        """The next record of the robot: split on CR, stripped."""
        return self.line.until(b"\r", 20.0)[:-1].strip().decode("ascii")

    def ack(self):
        """Number and check sum of an ACK, read as the vision system reads them."""
        words = self.word().split()
        if words[0] != "ACK":
            raise Failed("ACK comes\n     found    %r" % words)
        return [int(float(word)) for word in words[1:]]


def cksum(number, command, x, y, z, c, shape):
    """The check sum of the program above, computed a second time."""
    parts = (int(value * 8) for value in (x, y, z, c))
    return (number * 1009 + command * 10007 + sum(parts) + shape + 131072) % 65536


def library(line, command, answer=b"OK\r" + ETX):
    """A command in the form of the vendor's library, with STX."""
    line.raw(STX + command)
    found = line.until(ETX)[len(STX):]
    if found != answer:
        raise Failed("%r is answered\n     expected %r\n     found    %r" % (command[:40], answer, found))


def prepare(line):
    """Servo on, download in texts that end in mid-line, select, run."""
    library(line, b"SO\r" + ETX)
    library(line, b"DL,PICK\r" + ETX)
    whole = b"FL," + PROGRAM + EOF
    for at in range(0, len(whole), 226):
        library(line, whole[at:at + 226] + ETX)
    library(line, b"SL,PICK\r" + ETX)
    library(line, b"RN\r" + ETX)


def pick(vision, number, record, values):
    """One whole pick."""
    equal("pick %d: the robot asks" % number, "REQ", vision.word())
    vision.line.raw(record)
    equal("pick %d: it acknowledges" % number, [number, cksum(*values)], vision.ack())
    vision.line.raw(b"1\r")
    for state in ("AT_PICK", "ARRIVED", "DONE"):
        equal("pick %d: it reports" % number, state, vision.word())


def job(ip0, ip1):
    line = Line(ip0)
    vision = Vision(Line(ip1))
    prepare(line)
    pick(vision, 1, b"1,2,0.000,-250.000,28.000,89.125,2\r", (1, 2, 0.0, -250.0, 28.0, 89.125, 2))
    pick(vision, 2, b"2,1,200.500,200.250,30.000,0.000,1\r\n", (2, 1, 200.5, 200.25, 30.0, 0.0, 1))
    pick(vision, 3, b"3,1,250.000,-100.000,28.000,-45.000,0,\r", (3, 1, 250.0, -100.0, 28.0, -45.0, 0))
    pick(vision, 4, b"4\r2\r100.000\r250.000\r28.000\r10.000\r3\r", (4, 2, 100.0, 250.0, 28.0, 10.0, 3))

    equal("the robot asks", "REQ", vision.word())
    vision.line.raw(b"5,1,200.000,0.000,28.000,0.000,0\r")
    equal("ACK to the byte", b"ACK " + b"5".rjust(12) + b" " + str(cksum(5, 1, 200.0, 0.0, 28.0, 0.0, 0)).encode()
          .rjust(12) + b"\r", vision.line.until(b"\r"))
    vision.line.raw(b"0\r")
    equal("not to go: released", "REL", vision.word())

    equal("the robot asks", "REQ", vision.word())
    vision.line.raw(b"6,1,395.000,0.000,28.000,0.000,0\r")
    vision.ack()
    vision.line.raw(b"1.000\r")
    equal("beyond its bound: out", "OUT", vision.word())

    equal("the robot asks", "REQ", vision.word())
    vision.line.raw(b"0,0,0,0,0,0,0\r")
    equal("command 0 ends the program", "BYE", vision.word())
    equal("which SP tells on IP0", STX + b"SP\r" + ETX, line.until(ETX))
    line.raw(STX + b"SU\r" + ETX)
    true("SU says stop(reset)", line.until(ETX).endswith(b"STATUS:stop(reset)" + EOF + ETX))
    line.raw(STX + b"OK\r" + ETX)
    line.close()
    vision.line.close()


def main():
    arguments = options("A pick dialogue on IP1.").parse_args()
    return run(job, arguments, "--model", "tsl3000-thl400")


if __name__ == "__main__":
    sys.exit(main())
