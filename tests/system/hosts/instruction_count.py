"""Counts what the processor executes in a run to which nobody connects, and for each SU, outside of the system.

    python3 tests/system/hosts/instruction_count.py --serve BINARY

A count depends neither on the machine nor on its load as a time does: what comes in by mistake shows at once. That of a start is
the same each time within a thousandth; that of an SU differs by a tenth, with how often the loop looks in vain, so the least of a few
runs counts. The
benchmarks say what it means in time, beside an echo. That of a start is shown alone: what a user waits for is held beside a
bare listener (`benches/`), and a fifth of it is the work of the loader, which the linker decides. Exit code 1 if an
SU takes more than its limit. Needs valgrind.
"""

import os
import re
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Emulator  # noqa: E402
from steps import program, serving, true  # noqa: E402
from wire import CR, ETX, STX, Line  # noqa: E402

# 38,900 to 39,900 in one quarter of an hour; one and the same program differs by a tenth, hour by hour (how often the loop
# looks in vain), and the limit has that tenth above the highest.
MOST_SU = 44_000
FEW, MANY = 100, 600
RUNS = 4


def count(binary, requests):
    """Instructions of a run with so many SU, each answered before the next."""
    with tempfile.NamedTemporaryFile() as out:
        with Emulator(binary, prefix=("valgrind", "--tool=callgrind", "--callgrind-out-file=" + out.name)) as emulator:
            host = Line(emulator.address("ip0")) if requests else None
            for _ in range(requests):
                host.raw(STX + b"SU" + CR + ETX)
                answer = host.until(ETX)
                if not answer.startswith(STX + b"FL,MODE:"):
                    true("an answer to SU", False, answer)
        found = re.search(r"Collected : (\d+)", emulator.log())
        true("valgrind counted a run with %d SU" % requests, found, emulator.log())
        return int(found.group(1))


def main():
    binary = serving(__doc__).parse_args().serve
    each = min((count(binary, MANY) - count(binary, FEW)) / (MANY - FEW) for _ in range(RUNS))
    print("start: %d instructions" % count(binary, 0))
    true("SU: %d instructions, at most %d" % (each, MOST_SU), each <= MOST_SU)


if __name__ == "__main__":
    sys.exit(program(main))
