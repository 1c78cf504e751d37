#!/usr/bin/env python3
"""A fleet for weeks of virtual time: every robot runs its cycles all day, a host polls it and, once a day, does whatever hosts do.
At the end of the days the cycles are as long as on the first, the clock shows what has passed, the arm is where it was to the
last digit, and the memory of the process is flat.

    python3 tests/system/hosts/soak.py --serve target/release/ts3100 [--robots 4] [--days 4] [--polls 4]
    python3 tests/system/hosts/soak.py --serve target/release/ts3100 --robots 100 --days 30 --polls 30

The transcript that is kept of each robot grows to 8 MiB before its oldest part gives way. It is counted as flat what comes after
the first half of the days, so the polls of that half have to fill it: about 10,000. Fewer are a look at everything else."""

import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Fleet  # noqa: E402
from steps import Failed, ok, program, serving, true  # noqa: E402
from wire import Fast  # noqa: E402

HOUR = 3600.0
# Polls that fill the transcript kept of a robot: one of SF takes some 800 bytes of it.
FILLING = 10_000
# The most that a robot's memory grows in a day, once everything that is kept is full.
SLOPE = 2.0
# A cycle: moves of every kind, lines, a variable that is kept, and a long pause.
PROGRAM = b"""GLOBAL
N = 0
END
PROGRAM DAILY
SPEED = 80
MOVE HOME
MOVES A
PASS = 40
MOVEC B, C
MOVE HOME
DOUT(3)
DELAY 0.5
DOUT(-3)
N = N + 1
RESTORE N
DELAY 100
END
DATA
POINT HOME=400,0,200,0,0,0,0,0/
POINT A=420,60,200,0,0,0,0,0/
POINT B=440,30,190,0,0,0,0,0/
POINT C=440,0,180,0,0,0,0,0/
END
"""


class Worker:
    """A robot at work, with its host."""

    def __init__(self, fleet, name):
        self.fleet, self.name = fleet, name
        self.control = fleet.connect(name)
        self.begun = self.control.clock.now
        self.host = Fast(fleet.dial(name), True)
        self.exchanges, self.passed = 0, 0.0
        # Of each day: its cycles, and where the arm stood after the last.
        self.days = []
        self.start()

    def ask(self, *texts):
        """Commands that are answered OK."""
        for text in texts:
            self.host.command(text)
        self.exchanges += len(texts)

    def start(self):
        """Loads the work and runs it."""
        self.ask(b"RS,ERR", b"SP", b"RS,PRG")
        if self.host.load(b"DAILY", PROGRAM) != b"OK":
            raise Failed("%s takes its program" % self.name)
        self.ask(b"SO", b"SL,DAILY", b"EC,MODE CONT", b"RN")

    def hour(self, polls):
        """An hour of cycles, polled."""
        for _ in range(polls):
            self.host.total()
            self.control.advance(HOUR / polls)
            self.passed += HOUR / polls
        self.exchanges += polls

    def evening(self):
        """Notes the day. An alarm, a stop, files, statuses, and the next day begins with a new connection."""
        cycles = self.control.variables["N"]
        # In the long pause of a cycle.
        self.passed += self.control.advance_until("output 3 on", within=240).passed
        self.control.advance(2)
        self.passed += 2
        self.days.append((cycles, self.control.pose))
        self.control.raise_alarm("8-014")
        statuses = (b"SU", b"CA", b"EU", b"AC", b"VR", b"UL,DAILY")
        for status in statuses:
            self.host.file(status)
        self.exchanges += len(statuses)
        self.host.close()
        self.host = Fast(self.fleet.dial(self.name), True)
        self.start()


def slope(samples):
    """How much the last half of these grows from one to the next: the straight line that fits best."""
    half = samples[len(samples) // 2:]
    middle, mean = (len(half) - 1) / 2, sum(half) / len(half)
    return sum((at - middle) * (value - mean) for at, value in enumerate(half)) / sum((at - middle) ** 2 for at in range(len(half)))


def soak(binary, robots, days, polls):
    memory = []
    with Fleet(binary, "--robots", str(robots), "--time", "stepped", "--ports", "auto") as fleet:
        workers = [Worker(fleet, name) for name in fleet.robots]
        for day in range(1, days + 1):
            for worker in workers:
                for _ in range(24):
                    worker.hour(polls)
                worker.evening()
            memory.append(fleet.memory())
            print("day %d: %.1f MB" % (day, memory[-1] / 1000), flush=True)
        exchanges = sum(worker.exchanges for worker in workers)
        cycles = sum(day[0] for worker in workers for day in worker.days)
        for worker in workers:
            # The first begins where an arm is after its birth.
            kinds = set(worker.days[1:])
            if len(kinds) != 1:
                raise Failed("%s: each day is like the second\n     found    %s" % (worker.name, worker.days))
            drift = worker.control.clock.now - worker.begun - worker.passed
            if abs(drift) > 1e-6 * worker.passed / HOUR:
                raise Failed("%s: the clock shows what has passed\n     found    %g s more" % (worker.name, drift))
        ok("%d robots, %d days, %d exchanges, %d cycles: every day has as many cycles as the second, and ends with the same pose"
           % (robots, days, exchanges, cycles))
        grown = slope(memory) / robots
        if polls * 12 * days >= FILLING:
            true("memory: %.1f MB after the first day, %.1f at the end; in the second half %.2f kB a day and robot, at most %g"
                 % (memory[0] / 1000, memory[-1] / 1000, grown, SLOPE), grown <= SLOPE)


def main():
    parser = serving(__doc__)
    parser.add_argument("--robots", type=int, default=4)
    parser.add_argument("--days", type=int, default=4)
    parser.add_argument("--polls", type=int, default=4, help="polls an hour")
    options = parser.parse_args()
    return program(soak, options.serve, options.robots, options.days, options.polls)


if __name__ == "__main__":
    sys.exit(main())
