#!/usr/bin/env python3
"""A second opinion: the rules of the controller, written a second time from the manuals' text, compared with the emulator.

    python3 tests/oracle/compare.py --serve target/release/ts3100 [--cases N] [--seed S] [PART...]
    python3 tests/oracle/compare.py --serve target/release/ts3100 --canary PART|all

The rules are in `tests/oracle/<part>.py`: pure functions, each with its page. The traffic that puts them to the test is in
`tests/oracle/drives/<part>.py`; the seed draws it. A difference prints the seed, the case, both answers and the sentence that
the oracle rests on; the exit code is 1. `--canary` alters one rule of a part, or of each part in turn: the exit code is 0 if a
difference is reported each time."""

import argparse
import importlib
import os
import random
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from link import Failed  # noqa: E402

# Part, and its number of cases without --cases.
PARTS = {"permissions": 1500, "total_status": 300, "alarms": 200, "printing": 1500, "records": 800, "text_end": 500, "events": 500,
         "variables": 2000, "lines": 1000, "motion": 600}
SHOWN = 10


def compare(name, binary, seed, cases, shown=SHOWN, enough=None):
    """Number of differences of a part; it ends at `enough` of them."""
    drive = importlib.import_module("drives." + name)
    begun = time.monotonic()
    number = differences = 0
    try:
        for number, case in enumerate(drive.cases(binary, random.Random("%s/%s" % (seed, name)), cases), 1):
            if case.holds:
                continue
            differences += 1
            if differences <= shown:
                print("DIFFERENCE in %s, seed %s, case %d: %s\n     oracle   %s\n     emulator %s\n     %s"
                      % (name, seed, number, case.what, case.expected, case.found, case.rests_on), flush=True)
            if differences == enough:
                break
    except Failed as error:
        raise Failed("%s, seed %s, after case %d: %s" % (name, seed, number, error)) from error
    print("%s: %d cases, %d differences, %.1f s" % (name, number, differences, time.monotonic() - begun), flush=True)
    return differences


def canary(name, binary, seed, cases):
    """Whether the altered rule makes more differences than the rule itself."""
    before = compare(name, binary, seed, cases, shown=0)
    print("canary: " + importlib.import_module("drives." + name).plant_canary(), flush=True)
    found = compare(name, binary, seed, cases, shown=1, enough=before + 1) > before
    print("the canary was %s" % ("found" if found else "NOT found"), flush=True)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--serve", metavar="TS3100", required=True, type=os.path.abspath, help="the program to compare with")
    parser.add_argument("--cases", metavar="N", type=int, help="cases of each part")
    parser.add_argument("--seed", metavar="S", default="1", help="draws the cases [default: 1]")
    parser.add_argument("--canary", metavar="PART", choices=[*PARTS, "all"], help="alter a rule of this part, or of all; it has to be found")
    parser.add_argument("parts", metavar="PART", nargs="*", help="parts to compare [default: all]: " + ", ".join(PARTS))
    options = parser.parse_args()
    unknown = [name for name in options.parts if name not in PARTS]
    if unknown:
        parser.error("unknown part %s; the parts are %s" % (unknown[0], ", ".join(PARTS)))
    if options.canary == "all":
        # Parts share rules, and an altered one stays so.
        arguments = [word for word in sys.argv[1:] if word != "all"]
        return max(subprocess.run([sys.executable, __file__, *arguments, name], check=False).returncode for name in PARTS)
    try:
        if options.canary:
            return 0 if canary(options.canary, options.serve, options.seed, options.cases or PARTS[options.canary]) else 1
        differences = [compare(name, options.serve, options.seed, options.cases or PARTS[name]) for name in options.parts or PARTS]
    except (Failed, OSError) as error:
        print("FAIL %s" % error, flush=True)
        return 1
    return 1 if any(differences) else 0


if __name__ == "__main__":
    sys.exit(main())
