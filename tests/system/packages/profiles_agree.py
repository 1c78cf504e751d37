#!/usr/bin/env python3
"""Programs of several build profiles do the same: what people build for themselves, and what packages have.

    python3 tests/system/packages/profiles_agree.py target/release/ts3100 target/dist/ts3100

Each runs every program of fixtures/scol/run with its trace, and plays every transcript of fixtures/transcripts. What they print has
to be equal to the byte: floating point in another order, or an optimisation of ours, would show here. The exit code is 0 when they
agree."""

import argparse
import glob
import os
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from steps import equal, program, true  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
FIXTURES = os.path.join(ROOT, "fixtures")
LIMIT = 60
# More than this many work; fewer, and the folders have moved.
LEAST = 100


def printed(ts3100, *words):
    """Exit code, stdout and stderr."""
    done = subprocess.run([ts3100, *words], cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True, timeout=LIMIT, check=False)
    return done.returncode, done.stdout, done.stderr


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("programs", nargs="+", help="the programs, the first of which is the measure")
    first, *others = (os.path.abspath(name) for name in arguments.parse_args().programs)
    runs = [("run", file, "--json", "--trace", "--max-time", "60s", "--input-optional")
            for file in sorted(glob.glob(os.path.join(FIXTURES, "scol", "run", "*.scol")))]
    plays = [("diff", file) for file in sorted(glob.glob(os.path.join(FIXTURES, "transcripts", "*.txt")))]
    moved = 0
    for words in runs + plays:
        expected = printed(first, *words)
        moved += b'"trace"' in expected[1] or words[0] == "diff"
        for other in others:
            if printed(other, *words) != expected:
                equal("%s of %s" % (" ".join(words), other), expected, printed(other, *words))
    true("%d runs and %d transcripts are equal, %d with something in them" % (len(runs), len(plays), moved), moved > LEAST)


if __name__ == "__main__":
    sys.exit(program(main))
