#!/usr/bin/env python3
"""Hosts in trouble and hosts that make it: a reader that does not read, floods, resets, half-closed lines,
hundreds of connections, a kill in mid-download, a restart on the same drive.

    python3 tests/system/hosts/rough_weather.py --serve target/release/ts3100"""

import os
import random
import socket
import struct
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Emulator, options  # noqa: E402
from steps import Failed, equal, ok, program, true, until  # noqa: E402
from wire import CR, ETX, STX, Host, Line  # noqa: E402

CHATTER = b"""PROGRAM CHATTER
AGAIN:
PRINT IP1, "0123456789012345678901234567890123456789012345678901234567890123456789012345678901234567890123456789", CR
GOTO AGAIN
END
"""
TALK = b"""PROGRAM TALK
N = 0
AGAIN:
INPUT IP1, N
PRINT IP1, N, CR
GOTO AGAIN
END
"""
MANY = 200
PIPELINED = 50


def reset(line):
    """Vanish with a reset instead of a proper end."""
    line.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    line.close()


def served(address, stx, what):
    """A new host, which has to be served within a second."""
    def host():
        try:
            host = Host(address, stx)
            host.status()
            return host
        except (Failed, ConnectionError):
            return None

    host = until("%s: the next host is served" % what, host, 1.0, pause=0.01)
    ok("%s: the next host is served" % what)
    return host


def prepare(host, name, program):
    """Download, select, servo on, run."""
    host.download(name, program)
    for command in (b"SL," + name, b"SO", b"RN"):
        host.command(command)


def deaf_reader(emulator, stx):
    """A peer of IP1 that reads nothing must not hold up IP0."""
    host = Host(emulator.address("ip0"), stx)
    deaf = Line(emulator.address("ip1"))
    prepare(host, b"CHATTER", CHATTER)
    slowest = 0.0
    for _ in range(30):
        asked = time.monotonic()
        host.text(b"SU\r")
        host.reply()
        slowest = max(slowest, time.monotonic() - asked - 0.05)
        host.text(b"OK\r")
    true("a deaf reader on IP1 does not hold up IP0 (%.0f ms at most)" % (slowest * 1e3), slowest < 0.2)
    host.command(b"BR")
    host.command(b"RS,PRG")
    reset(deaf)
    host.close()


def floods(emulator, stx):
    """Random bytes on every port, by a fixed seed."""
    seeded = random.Random(3100)
    for channel in ("ip0", "ip1", "ip2", "ip3"):
        for _ in range(5):
            line = Line(emulator.address(channel))
            try:
                for _ in range(20):
                    line.raw(seeded.randbytes(seeded.randrange(1, 3000)))
            except OSError:
                pass  # It may hang up on this.
            reset(line)
            time.sleep(0.01)
    served(emulator.address("ip0"), stx, "random bytes on every port").close()


def comings_and_goings(emulator, stx):
    """Many hosts one after the other, each leaving in its own bad way."""
    address = emulator.address("ip0")
    for number in range(MANY):
        line = Line(address)
        line.raw((STX if stx else b"") + b"SU\r"[:number % 4] + (ETX if number % 5 == 0 else b""))
        if number % 2:
            reset(line)
        else:
            line.close()
    host = served(address, stx, "%d hosts that leave in mid-text" % MANY)
    for _ in range(PIPELINED):
        host.raw(host.stx + b"SP\r" + ETX)
    answers = b"".join(host.stx + host.reply() + ETX for _ in range(PIPELINED))
    equal("%d commands in a row without waiting: as many answers" % PIPELINED,
          (host.stx + b"OK\r" + ETX) * PIPELINED, answers)
    host.socket.shutdown(socket.SHUT_WR)
    true("a host that has closed its side is hung up on", host.closed_by_peer(2.0))
    host.close()
    served(address, stx, "after that").close()


def lost_peer(emulator, stx):
    """PRINT to a peer that has gone: alarm 2-046, and the host is told by SP."""
    host = served(emulator.address("ip0"), stx, "now")
    peer = Line(emulator.address("ip1"))
    prepare(host, b"TALK", TALK)
    peer.raw(b"1\r")
    equal("the peer is answered", b"1".rjust(12) + CR, peer.until(CR))
    peer.close()
    time.sleep(0.1)
    equal("a peer that leaves while INPUT waits is an alarm or is waited for", True,
          host.total()[2] in (1, 2, 3))
    peer = Line(emulator.address("ip1"))
    time.sleep(0.05)
    if host.total()[2] == 1:
        peer.raw(b"2\r")
        equal("a new peer is served by the INPUT that waits", b"2".rjust(12) + CR, peer.until(CR))
    else:
        history = host.file(b"EU")
        true("the alarm is 2-046", b"002-046" in history, history)
    host.command(b"BR")
    host.close()
    peer.close()


def drive(binary, stx):
    """Files outlive a kill; half a download does not."""
    with tempfile.TemporaryDirectory(prefix="ts3100-drive-") as folder:
        with Emulator(binary, "--drive", folder) as emulator:
            host = Host(emulator.address("ip0"), stx)
            host.download(b"KEEP", TALK)
            host.command(b"DL,KEEP")
            host.text(b"FL," + CHATTER[:100])
            host.reply()
            emulator.kill()
        with Emulator(binary, "--drive", folder, "--select", "KEEP", "--servo-on") as emulator:
            host = Host(emulator.address("ip0"), stx)
            equal("a kill in mid-download leaves the old file whole", TALK, host.file(b"UL,KEEP"))
            equal("--select has selected it", "KEEP", host.status()["FILE"])
            equal("--servo-on has turned the servo on", 1, host.total()[0])
            host.command(b"RS,SEL")
            host.command(b"ER,KEEP")
        with Emulator(binary, "--drive", folder) as emulator:
            host = Host(emulator.address("ip0"), stx)
            equal("an erased file stays erased", b"NG\r", host.ask(b"UL,KEEP"))


def fast_clock(binary, stx):
    """--time x10 and auto: the same answers, sooner."""
    program = b"PROGRAM SLEEPY\nDELAY 3.0\nEND\n"
    for clock, least, most in (("x10", 0.25, 0.8), ("auto", 0.0, 1.0), ("real", 2.9, 3.5)):
        with Emulator(binary, "--time", clock) as emulator:
            host = Host(emulator.address("ip0"), stx)
            prepare(host, b"SLEEPY", program)
            started = time.monotonic()
            if host.unsolicited == 0:
                equal("--time %s: the program ends" % clock, b"SP\r", host.receive())
            seconds = time.monotonic() - started
            true("--time %s: DELAY 3.0 takes %.2f s" % (clock, seconds), least <= seconds <= most)


def main():
    arguments = options("Hosts in trouble.").parse_args()
    if not arguments.serve:
        print("rough_weather needs --serve", file=sys.stderr)
        return 2
    with Emulator(arguments.serve) as emulator:
        for part in (deaf_reader, floods, comings_and_goings, lost_peer):
            part(emulator, arguments.stx)
    drive(arguments.serve, arguments.stx)
    fast_clock(arguments.serve, arguments.stx)


if __name__ == "__main__":
    sys.exit(program(main))
