"""Counts what the processor executes in a run to which nobody connects, and for each SU, outside of the system.

    python3 tests/instructions.py --serve BINARY

A count depends neither on the machine nor on its load as a time does: what comes in by mistake shows at once. That of a start is
the same each time within a thousandth; that of an SU differs by a tenth, with how often the loop looks in vain. The
benchmarks say what it means in time, beside an echo. Exit code 1 if a count is above its limit. Needs valgrind.
"""

import argparse
import re
import sys
import tempfile

from wire import CR, ETX, STX, Emulator, Line, true

MOST = {"start": 1_000_000, "SU": 38_000}
FEW, MANY = 100, 600


def count(binary, requests):
    """Instructions of a run with so many SU, each answered before the next."""
    with tempfile.NamedTemporaryFile() as out:
        emulator = Emulator(binary, prefix=("valgrind", "--tool=callgrind", "--callgrind-out-file=" + out.name))
        try:
            host = Line(emulator.address("ip0")) if requests else None
            for _ in range(requests):
                host.raw(STX + b"SU" + CR + ETX)
                answer = host.until(ETX)
                if not answer.startswith(STX + b"FL,MODE:"):
                    true("an answer to SU", False, answer)
            emulator.stop()
        finally:
            emulator.kill()
        found = re.search(r"Collected : (\d+)", emulator.log())
        true("valgrind counted a run with %d SU" % requests, found, emulator.log())
        return int(found.group(1))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--serve", required=True)
    binary = parser.parse_args().serve
    each = (count(binary, MANY) - count(binary, FEW)) / (MANY - FEW)
    for name, instructions in (("start", count(binary, 0)), ("SU", each)):
        true("%s: %d instructions, at most %d" % (name, instructions, MOST[name]), instructions <= MOST[name])


if __name__ == "__main__":
    sys.exit(main())
