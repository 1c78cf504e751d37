#!/usr/bin/env python3
"""The hosts of this folder under legal variation: each gets its work done under every seed. And one that does not: it
takes what one read gives for one text, gets by without variation, and fails under every seed.

    python3 tests/system/hosts/legal_variation.py --serve target/release/ts3100 [--seeds 20] [--jobs 2]"""

import concurrent.futures
import os
import socket
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "lib"))
from emulator import Emulator  # noqa: E402
from steps import Failed, ok, program, serving  # noqa: E402
from wire import ADVISED_PAUSE  # noqa: E402

# rough_weather looks at times, which are what varies. scara_client is a program of the field that takes five bytes of
# one receive for OK: it relies on what the manual does not guarantee, and is run to show it.
HOSTS = [("whole_job.py",), ("pick_dialogue.py",), ("library_client.py", "--short"),
         ("production.py", "--cycles", "20", "--hours", "0.05")]
LUCKY = ("scara_client.py",)
LIMIT = 300


def careful(binary, host, seed):
    """One host under one seed: what it printed when it failed, or None."""
    environment = dict(os.environ, TS3100_VARY=str(seed))
    command = [sys.executable, os.path.join(HERE, host[0]), "--serve", binary, *host[1:]]
    ended = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=LIMIT)
    return ended.stdout.decode("utf-8", "replace") if ended.returncode else None


def careless(binary, seed):
    """Twenty times SU by a host that leans on luck; what it stumbled over, or None."""
    with Emulator(binary, *(("--vary", str(seed)) if seed is not None else ())) as emulator:
        try:
            line = socket.create_connection(emulator.address("ip0"), timeout=2.0)
            for number in range(20):
                time.sleep(ADVISED_PAUSE)
                line.sendall(b"\x02SU\r\x03")
                text = line.recv(4096)
                if not (text.startswith(b"\x02FL,MODE:") and text.endswith(b"\x1a\x03")):
                    return "SU number %d: %r" % (number + 1, text)
                time.sleep(ADVISED_PAUSE)
                line.sendall(b"\x02OK\r\x03")
        except OSError as error:
            return str(error)
    return None


def main():
    parser = serving(__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="how many (default 20)")
    parser.add_argument("--first", type=int, default=1, help="the first of them (default 1)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="hosts at a time (default: processors)")
    arguments = parser.parse_args()
    binary = arguments.serve
    seeds = range(arguments.first, arguments.first + arguments.seeds)
    failures = 0
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        runs = [(host, seed, pool.submit(careful, binary, host, seed)) for seed in seeds for host in HOSTS]
        lucky = [(seed, pool.submit(careful, binary, LUCKY, seed)) for seed in seeds]
        plain = pool.submit(careless, binary, None)
        hasty = [(seed, pool.submit(careless, binary, seed)) for seed in seeds]
    for host, seed, run in runs:
        failed = run.result()
        if failed:
            failures += 1
            # Behind it stands the robot's log, which is long.
            at = max(failed.find("FAIL"), 0)
            print("FAIL %s with --vary %d\n%s\n[...]\n%s" % (host[0], seed, failed[at:at + 1500], failed[-1500:]),
                  flush=True)
    if not failures:
        ok("%d hosts get their work done under %d seeds" % (len(HOSTS), len(seeds)))
    gets_by = [seed for seed, run in lucky if run.result() is None]
    if gets_by:
        raise Failed("scara_client fails under every seed\n     found    it gets by under %s" % gets_by)
    ok("scara_client, which takes five bytes of one receive for OK, fails under every seed")
    if plain.result():
        raise Failed("a host that takes a read for a text gets by without variation\n     found    " + plain.result())
    gets_by = [seed for seed, run in hasty if run.result() is None]
    if gets_by:
        raise Failed("it fails under every seed\n     found    it gets by under %s" % gets_by)
    ok("a host that takes a read for a text gets by without variation and fails under every seed")
    return failures > 0


if __name__ == "__main__":
    sys.exit(program(main))
