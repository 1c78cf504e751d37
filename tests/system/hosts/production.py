#!/usr/bin/env python3
"""A cell in production: the robot asks on IP1 for work, the host names one of the taught places and a number, the robot
acknowledges with a check sum of both, picks there, places, and reports DONE with its own clock. Many cycles in
`--time auto`; then the same until a shift of eight hours is over. Prints simulated hours per second of wall clock.

    python3 tests/system/hosts/production.py --serve target/release/ts3100 [--cycles 1000] [--hours 8]"""

import os
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import options, run  # noqa: E402
from steps import Failed, equal, ok, true  # noqa: E402
from wire import CR, Host, Line  # noqa: E402

NAME = b"CELL"
PROGRAM = b"""PROGRAM CELL
REMARK Part N lies at place K of four; 0 ends the shift.
N = 0
K = 0
SUM = 0
SPEED = 60
TIMER = 0.0
MOVE REST
NEXTPART:
PRINT IP1, "REQ", CR
INPUT IP1, N, K
IF K == 0 THEN GOTO LEAVE
SUM = (N * 31 + K * 1009) - INT((N * 31 + K * 1009) / 997) * 997
PRINT IP1, "ACK", N, SUM, CR
GOTO(K) FIRST, SECOND, THIRD, FOURTH
PRINT IP1, "NAK", N, K, CR
GOTO NEXTPART
FIRST:
SPOT = PICK1
GOTO FETCH
SECOND:
SPOT = PICK2
GOTO FETCH
THIRD:
SPOT = PICK3
GOTO FETCH
FOURTH:
SPOT = PICK4
FETCH:
MOVE SPOT + POINT(0, 0, 60)
MOVES SPOT WITH SPEED=20
WAIT MOTION >= 100
CLOSE1
DELAY 0.2
MOVES SPOT + POINT(0, 0, 60)
MOVE PLACE + POINT(0, 0, 60)
MOVES PLACE WITH SPEED=20
WAIT MOTION >= 100
OPEN1
DELAY 0.15
MOVES PLACE + POINT(0, 0, 60)
WAIT MOTION >= 100
PRINT IP1, "DONE", N, TIMER, CR
GOTO NEXTPART
LEAVE:
PRINT IP1, "SHIFT OVER", TIMER, CR
END
DATA
POINT REST=420,0,260,0,0,0,0,0/
POINT PLACE=300,-260,120,0,0,0,0,0/
POINT PICK1=380,180,100,0,0,0,0,0/
POINT PICK2=380,220,100,0,0,0,0,0/
POINT PICK3=420,180,100,0,0,30,0,0/
POINT PICK4=420,220,100,0,0,-30,0,0/
END
"""
PLACES = 4


def check_sum(number, place):
    """The check sum of the program, computed a second time."""
    return (number * 31 + place * 1009) % 997


def words(line, first):
    """The robot's next record, which begins with `first`: the numbers behind it."""
    record = line.until(CR)
    if not record.startswith(first):
        raise Failed("a record %r comes\n     found    %r" % (first, record))
    return [float(word) for word in record[len(first):].split()]


def cycle(line, number):
    """One part; the robot's clock at its end, in seconds."""
    words(line, b"REQ")
    place = number % PLACES + 1
    line.raw(b"%d,%d\r" % (number, place))
    found = words(line, b"ACK")
    if found != [number, check_sum(number, place)]:
        raise Failed("part %d is acknowledged\n     found    %r" % (number, found))
    found = words(line, b"DONE")
    if found[0] != number:
        raise Failed("part %d is done\n     found    %r" % (number, found))
    return found[1]


def produce(line, first, enough):
    """Parts from `first` on until `enough(parts, clock)`; how many, and the robot's clock."""
    parts, clock = 0, 0.0
    while not enough(parts, clock):
        clock = cycle(line, first + parts)
        parts += 1
    return parts, clock


def report(what, parts, simulated, wall):
    """The figures of a run."""
    ok("%s: %d cycles, %.0f s of production in %.1f s: %.2f hours a second"
       % (what, parts, simulated, wall, simulated / 3600.0 / wall))


def job(arguments):
    """The job for these options."""
    def work(ip0, ip1):
        host, line = Host(ip0, arguments.stx), Line(ip1)
        host.command(b"SO")
        host.download(NAME, PROGRAM)
        host.command(b"SL," + NAME)
        host.command(b"RN")
        begun = time.monotonic()
        parts, clock = produce(line, 1, lambda parts, _: parts == arguments.cycles)
        report("the first parts", parts, clock, time.monotonic() - begun)
        begun, before = time.monotonic(), clock
        more, clock = produce(line, parts + 1, lambda _, clock: clock >= arguments.hours * 3600.0)
        report("the shift", more, clock - before, time.monotonic() - begun)
        words(line, b"REQ")
        line.raw(b"0,0\r")
        over = words(line, b"SHIFT OVER")[0]
        true("the shift took %.2f hours of the robot's clock" % (over / 3600.0), over >= arguments.hours * 3600.0)
        equal("the end of the cycle is told on IP0", b"SP\r", host.receive())
        equal("the program stands at its beginning", "stop(reset)", host.status()["STATUS"])
    return work


def main():
    parser = options(__doc__.splitlines()[0])
    parser.add_argument("--cycles", type=int, default=1000, help="parts before the clock is looked at (default 1000)")
    parser.add_argument("--hours", type=float, default=8.0, help="length of the shift (default 8)")
    arguments = parser.parse_args()
    return run(job(arguments), arguments, "--time", "auto")


if __name__ == "__main__":
    sys.exit(main())
