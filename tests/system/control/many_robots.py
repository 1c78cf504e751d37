#!/usr/bin/env python3
"""Many robots in one process: their addresses, what they cost, and that each is a robot of its own.

    python3 tests/system/control/many_robots.py --serve target/release/ts3100

Uses the addresses from 127.1.0.1 on, with ports from 25000. Figures are in the benchmarks."""

import json
import os
import re
import socket
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Fleet, NotStarted  # noqa: E402
from steps import Failed, equal, program, serving, true  # noqa: E402

OFFSET = 24000
FIRST = "127.1.0.1"
LIMIT = 20.0
# The first letters of the answer to SU.
STATUS = b"\x02FL,"


def status_of(connection):
    """Asks for SU; the first letters of the answer."""
    connection.sendall(b"\x02SU\r\x03")
    answer = b""
    while not answer.endswith(b"\x03"):
        piece = connection.recv(4096)
        if not piece:
            raise Failed("an answer to SU\n     found    the end of the connection")
        answer += piece
    connection.sendall(b"\x02OK\r\x03")
    return answer[:4]


def is_reset(address, port):
    """Whether a connection is cut off at once."""
    try:
        with socket.create_connection((address, port), LIMIT) as connection:
            connection.settimeout(LIMIT)
            return connection.recv(1) == b""
    except ConnectionError:
        return True


def sleeping_robots(binary):
    with Fleet(binary, "--robots", "300", "--listen", FIRST, "--port-offset", str(OFFSET)) as fleet:
        equal("robot-300 has its address", "127.1.1.44", fleet.robots["robot-300"]["address"])
        equal("nobody has started", [], fleet.started())
        descriptors = len(os.listdir("/proc/%d/fd" % fleet.process.pid))
        true("all listen with a few sockets: %d files are open" % descriptors, descriptors < 40)
        # The program's channel is known before the command that comes after it.
        with fleet.dial("robot-200", "ip1"), fleet.dial("robot-200") as host:
            equal("the first connection starts its robot", STATUS, status_of(host))
            channels = fleet.connect("robot-200").state["channels"]
            equal("its IP1 has its peer", ["IP0", "IP1"], [c["port"] for c in channels if c.get("peer")])
        true("its page is there before it", b"<title>" in fleet.get("/robots/robot-9/")[1])
        equal("and starts no other", ["robot-200"], fleet.started())
        robot = fleet.connect("robot-7")
        robot.servo = True
        equal("a call starts its robot", ["robot-7", "robot-200"], fleet.started())
        with fleet.dial("robot-7") as host:
            equal("it is the one that was called", (STATUS, True), (status_of(host), robot.servo))
        true("an address without a robot is reset", is_reset("127.1.1.45", 1000 + OFFSET))
        robot.power_off()
        true("a robot without power is reset", is_reset(fleet.robots["robot-7"]["address"], 1000 + OFFSET))
        robot.power_on()
        with fleet.dial("robot-7") as host:
            equal("with power it answers again", STATUS, status_of(host))
        equal("robot-301 is unknown", 404, fleet.get("/robots/robot-301/state")[0])


def thousand(binary):
    for flags in (["--ports", "auto"], ["--listen", FIRST, "--port-offset", str(OFFSET)]):
        with Fleet(binary, "--robots", "1", *flags) as one:
            with one.dial("robot-1") as host:
                status_of(host)
            alone = one.memory()
        begun = time.monotonic()
        with Fleet(binary, "--robots", "1000", *flags) as fleet:
            hosts = [fleet.dial(name) for name in fleet.robots]
            answers = {status_of(host) for host in hosts}
            seconds = time.monotonic() - begun
            equal("1000 robots answer (%s), after %.2f s" % (flags[0], seconds), {STATUS}, answers)
            each = (fleet.memory() - alone) / 999
            true("each further robot costs %.0f kB, at most 100" % each, each <= 100)
            # On a busy machine the last OK texts are still on their way.
            time.sleep(0.5)
            before = fleet.worked()
            time.sleep(2)
            used = round(fleet.worked() - before, 2)
            true("idle they use %.2f s of 2 s" % used, used <= 0.02)
            for host in hosts:
                host.close()


def ten_thousand(binary):
    begun = time.monotonic()
    with Fleet(binary, "--robots", "10000", "--listen", FIRST, "--port-offset", str(OFFSET)) as fleet:
        ready = time.monotonic() - begun
        for name in ("robot-1", "robot-5000", "robot-10000"):
            with fleet.dial(name) as host:
                equal("of 10000, ready after %.2f s, %s answers" % (ready, name), STATUS, status_of(host))
        equal("three have started", 3, len(fleet.started()))


def refusals(binary):
    for flags, files, words in (
            (("--robots", "400", "--ports", "auto"), 1000, "400 robots need 3328 open files, and this process may have 1000"),
            (("--robots", "2", "--listen", "203.0.113.7"), None, "203.0.113.7 is not an address of this computer, and 1 more")):
        try:
            Fleet(binary, *flags, files=files).kill()
            raise Failed("a refusal\n     found    a fleet with %s" % " ".join(flags))
        except NotStarted as refused:
            true("refused: %s" % refused.log.split("\n", maxsplit=1)[0], words in refused.log, refused.log)
    with Fleet(binary, "--robots", "20", "--port-offset", str(OFFSET), "--port-step", "10") as fleet:
        ports = {"ip%d" % number: 1000 + OFFSET + 190 + number for number in range(4)}
        equal("with a step all are at one address", {"address": "127.0.0.1", "ports": ports}, fleet.robots["robot-20"])
        with fleet.dial("robot-20") as host:
            equal("and answer", STATUS, status_of(host))


def main():
    binary = serving(__doc__).parse_args().serve
    for check in (sleeping_robots, refusals, thousand, ten_thousand):
        check(binary)


if __name__ == "__main__":
    sys.exit(program(main))
