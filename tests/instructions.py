"""Counts what the processor executes in a run to which nobody connects, and for each SU, outside of the system.

    .ci/instructions.py BINARY

A count is the same on every machine and at any load, where a time is not: what comes in here by mistake shows at once. The
benchmarks say what it means in time, beside an echo. Exit code 1 if a count is above its limit. Needs valgrind.
"""

import json
import os
import re
import socket
import subprocess
import sys
import tempfile

# A twentieth above what was counted: a compiler or a C library of another version moves a count by a few percent.
MOST = {"start": 1_000_000, "SU": 46_000}
FEW, MANY = 100, 600
SU = b"\x02SU\r\x03"
TIMEOUT = 60


def ask(port, requests):
    """Sends SU so many times."""
    with socket.create_connection(("127.0.0.1", port), timeout=TIMEOUT) as host:
        host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for _ in range(requests):
            host.sendall(SU)
            answer = b""
            while not answer.endswith(b"\x03"):
                piece = host.recv(4096)
                if not piece:
                    raise SystemExit("the connection ended after %r" % answer)
                answer += piece
            if not answer.startswith(b"\x02FL,MODE:"):
                raise SystemExit("no answer to SU: %r" % answer)


def count(binary, requests):
    """Instructions of a run with so many SU, each answered before the next."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["valgrind", "--tool=callgrind", "--callgrind-out-file=" + os.path.join(folder, "out"), binary, "serve",
                 "--ports", "auto", "--ready-json"]
        environment = dict(os.environ, XDG_RUNTIME_DIR=folder)
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment) as process:
            try:
                port = json.loads(process.stdout.readline())["ports"]["ip0"]
                if requests:
                    ask(port, requests)
            finally:
                process.terminate()
            errors = process.communicate(timeout=TIMEOUT)[1]
    found = re.search(r"Collected : (\d+)", errors)
    if not found:
        raise SystemExit("valgrind counted nothing:\n" + errors)
    return int(found.group(1))


def main():
    binary = sys.argv[1]
    each = (count(binary, MANY) - count(binary, FEW)) / (MANY - FEW)
    counted = {"start": count(binary, 0), "SU": each}
    for name, instructions in counted.items():
        print("%-6s %10.0f instructions, at most %d" % (name, instructions, MOST[name]))
    return any(instructions > MOST[name] for name, instructions in counted.items())


if __name__ == "__main__":
    sys.exit(main())
