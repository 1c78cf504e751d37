#!/usr/bin/env python3
"""The cable between host and robot is cut, in every state an exchange can be in: without a word (the host's network is
gone: no FIN, no RST, keepalive has to find it), by a reset in mid-text, and on a serial line by a closed terminal.
Each time: the next host is served, nothing is lost, and [E10] raises the alarm it asks for, or none.

    python3 tests/system/hosts/cut_cable.py --serve target/release/ts3100

Two network namespaces are made for it, by root or in a user namespace; without them it fails."""

import ctypes
import os
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from transport import Settings, Terminal  # noqa: E402
from emulator import Emulator, options  # noqa: E402
from steps import Failed, program  # noqa: E402
from wire import CR, STX, Host, Line  # noqa: E402

# The cable that is cut, and one on which the next host comes.
FIRST = ("10.31.0.1", "10.31.0.2")
SECOND = ("10.31.1.1", "10.31.1.2")
# Keepalive of decision D3 finds a vanished peer within 10 s + 3 x 5 s; unanswered data is given up after 30 s.
FOUND = 40.0
# A connection beside the one a channel has is closed at once.
REFUSED_WITHIN = 0.5
OLD = b"PROGRAM KEPT\nEND\n"
NEW = b"PROGRAM KEPT\n" + b"REMARK This version must never arrive in part.\n" * 20 + b"END\n"
PROGRAM = b"""PROGRAM CABLE
N = 0
M = 0
PRINT CHANNEL, "READY", CR
INPUT CHANNEL, N, M
PRINT CHANNEL, "GOT", N, M, CR
END
PROGRAM NEVER
END
"""
TRIP = b"""PROGRAM TRIP
MOVE HOME WITH SPEED=100
MOVE FAR WITH SPEED=3
MOVE HOME WITH SPEED=100
END
DATA
POINT HOME=400,0,200,0,0,0,0,0/
POINT FAR=400,200,50,0,0,0,0,0/
END
"""
FAR = (400.0, 200.0, 50.0)
CLONE_NEWNET = 0x40000000
NO_ALARM = 0xFFFF
RUNNING, RETRY, CONTINUE = 1, 2, 3


def alarms(body):
    """The alarm words of an SF body."""
    return [word for word in struct.unpack(">10H", body[4:24]) if word != NO_ALARM]


def level(word):
    """Level of an alarm word (SF-06)."""
    return next(level for level, base in ((1, 736), (2, 512), (4, 368), (8, 0)) if word >= base)


def world(body):
    """X, Y, Z of the tool point."""
    return struct.unpack(">3f", body[148:160])


def check(what, condition, found):
    """Raise when a condition does not hold."""
    if not condition:
        raise Failed("%s\n     found    %r" % (what, found))


class Idle:
    """Connected, nothing under way."""
    name, levels, mid_text = "idle", (2, 2), b"SU"

    def arrange(self, host, robot):
        host.status()

    def verify(self, host, robot):
        body = host.total()
        check("a cut while the robot stands raises no alarm", alarms(body) == [], alarms(body))
        check("nor is one in the history", host.file(b"EU") == b"0\r", "an entry")


class OpenUpload(Idle):
    """The first text of UL is not yet answered."""
    name, mid_text = "open UL", b"O"

    def arrange(self, host, robot):
        host.download(b"LONG", NEW)
        host.text(b"UL,LONG\r")
        check("UL begins", host.reply().startswith(b"FL,"), "something else")

    def verify(self, host, robot):
        super().verify(host, robot)
        check("UL from its beginning", host.file(b"UL,LONG") == NEW, "other bytes")


class OpenDownload(Idle):
    """Two texts of DL have come, the last one has not."""
    name, mid_text = "open DL", b"REMARK half a te"

    def arrange(self, host, robot):
        host.download(b"KEPT", OLD)
        host.command(b"DL,KEPT")
        for block in (b"FL," + NEW[:250], NEW[250:503]):
            host.text(block)
            check("the text is taken", host.reply() == b"OK\r", "not OK")

    def verify(self, host, robot):
        super().verify(host, robot)
        check("the old file is whole", host.file(b"UL,KEPT") == OLD, "other bytes")
        host.download(b"KEPT", NEW)
        check("the new one arrives now", host.file(b"UL,KEPT") == NEW, "other bytes")


def begin(host, name, program):
    """Servo on, download, select, run, so slowly that a cut is found on the way."""
    host.download(name, program)
    for command in (b"EC,OVRD 10", b"SO", b"SL," + name, b"RN"):
        host.command(command)


class WaitingInput:
    """A program waits for the second of two values; [E10] asks for a warning on IP0 and for level 2 on IP1."""
    name, levels, mid_text = "waiting INPUT", (1, 2), b"S"

    def arrange(self, host, robot):
        begin(host, b"CABLE", PROGRAM.replace(b"CHANNEL", robot.channel))
        check("the program asks", robot.until(CR) == b"READY\r", "nothing")
        robot.raw(b"11,")

    def verify(self, host, robot):
        body = host.total()
        found = sorted(level(word) for word in alarms(body))
        # Once level 2 has stopped the program, a drop of IP0 raises nothing: which is found first is chance.
        check("the alarms [E10] asks for: level 1 of IP0, level 2 of IP1", found in ([1, 2], [2]), found)
        check("level 2 has stopped the program: stop (continue)", body[2] == CONTINUE, body[2])
        host.command(b"RS,ERR")
        host.command(b"RN")
        got = robot.until(CR)
        check("the INPUT was cancelled: the value it had, and 0", got.split() == [b"GOT", b"11", b"0"], got)


class WaitingInputUnwatched:
    """The same with [E10] = 0: the INPUT waits on and takes its second value from the next host."""
    name, levels, mid_text = "waiting INPUT, [E10] = 0", (0, 0), b"S"
    arrange = WaitingInput.arrange

    def verify(self, host, robot):
        body = host.total()
        check("no alarm", alarms(body) == [], alarms(body))
        check("the program runs", body[2] == RUNNING, body[2])
        robot.raw(b"12\r")
        got = robot.until(CR)
        check("the first value is not lost", got.split() == [b"GOT", b"11", b"12"], got)


class RunningMotion:
    """The arm is on a slow way; [E10] asks for level 4 on IP0."""
    name, levels, mid_text = "running motion", (4, 0), b"SF"

    def arrange(self, host, robot):
        begin(host, b"TRIP", TRIP)
        limit = time.monotonic() + 20.0
        while host.total()[2] != RUNNING and time.monotonic() < limit:
            pass

    def verify(self, host, robot):
        body = host.total()
        found = [level(word) for word in alarms(body)]
        check("level 4, once", found == [4], found)
        check("it stands: stop (retry)", body[2] == RETRY, body[2])
        check("on its way", world(body) == world(host.total()) and world(body) != FAR, world(body))
        host.command(b"RS,ERR")
        host.command(b"EC,OVRD 100")
        host.command(b"RN")
        limit = time.monotonic() + 60.0
        while host.total()[2] == RUNNING:
            check("the way is completed after RN", time.monotonic() < limit, "still running")


class RunningMotionUnwatched:
    """The same with [E10] = 0: the robot does not care."""
    name, levels, mid_text = "running motion, [E10] = 0", (0, 0), b"SF"
    arrange = RunningMotion.arrange

    def verify(self, host, robot):
        body = host.total()
        check("no alarm", alarms(body) == [], alarms(body))
        check("the program has gone on or has ended", body[2] in (0, RUNNING), body[2])


SERIAL_STATES = (Idle, OpenUpload, OpenDownload, WaitingInputUnwatched, RunningMotionUnwatched)
STATES = (Idle, OpenUpload, OpenDownload, WaitingInput, WaitingInputUnwatched, RunningMotion, RunningMotionUnwatched)


def prepare_drive(binary, folder, levels):
    """A drive whose ETHERNET.PAR asks for these levels of IP0 and IP1."""
    with Emulator(binary, "--drive", folder) as emulator:
        host = Host(emulator.address("ip0"), True)
        whole = host.file(b"UL,ETHERNET.PAR")
        at = whole.index(b"[E10]")
        head, tail = whole[at:].split(b"=", 1)
        values = tail.split(None, 4)
        new = b" ".join(str(value).encode() for value in levels) + b" 0 0\n"
        host.download(b"ETHERNET.PAR", whole[:at] + head + b"= " + new + values[4])


def reset(line):
    """Vanish with a reset."""
    line.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    line.close()


class Case:
    """One state, one emulator, one kind of cut."""

    def __init__(self, binary, state, cut, prefix=(), at=("127.0.0.1", "127.0.0.1")):
        self.state, self.cut, self.at = state(), cut, at
        self.folder = tempfile.mkdtemp(prefix="ts3100-cable-")
        prepare_drive(binary, self.folder, state.levels)
        self.emulator = Emulator(binary, "--drive", self.folder, *self.flags(), prefix=prefix, at=at[0])
        self.host, self.robot = self.connect()
        self.state.arrange(self.host, self.robot)

    def flags(self):
        """What serve needs for it."""
        return ("--listen", "0.0.0.0")

    def connect(self):
        """A host, and one for the program."""
        robot = Line(self.emulator.address("ip1"))
        robot.channel = b"IP1"
        return Host(self.emulator.address("ip0"), True), robot

    def title(self):
        return "%s, %s" % (self.state.name, self.cut)

    def sever(self):
        """The reset in mid-text."""
        self.host.raw(STX + self.state.mid_text)
        time.sleep(0.05)
        reset(self.host)
        reset(self.robot)

    def aftermath(self, wait):
        """The next host on the other address."""
        self.emulator.at = self.at[1]
        host, robot = self.next_hosts(wait)
        self.state.verify(host, robot)
        host.close()
        robot.close()

    def next_hosts(self, wait):
        """The hosts that come when the cable is whole again."""
        limit = time.monotonic() + wait
        while True:
            lines = ()
            try:
                lines = host, robot = self.connect()
                host.status()
                # Each channel finds its vanished peer by itself, and closes the next connection at once until then.
                robot.more(REFUSED_WITHIN)
                return lines
            except (Failed, OSError) as error:
                for line in lines:
                    line.close()
                if time.monotonic() > limit:
                    raise Failed("the next host is served within %.0f s\n     found    %s" % (wait, error))
                time.sleep(0.1)

    def end(self):
        self.emulator.kill()
        for folder in (self.folder, self.folder + ".lines"):
            shutil.rmtree(folder, ignore_errors=True)


class SerialCase(Case):
    """The same on HOST and COM1, of which [E10] knows nothing."""

    def flags(self):
        return ("--serial-dir", self.folder + ".lines", "--control-right", "rs232c")

    def connect(self):
        host, robot = (Terminal(os.path.join(self.folder + ".lines", port), Settings()) for port in ("host", "com1"))
        robot = Line(robot)
        robot.channel = b"COM1"
        return Host(host, True), robot

    def sever(self):
        """The terminals are closed in mid-text."""
        self.host.raw(STX + self.state.mid_text)
        self.host.close()
        self.robot.close()


def each(cases, step):
    """`step` for all cases at once; the failures."""
    failures = []

    def one(case):
        try:
            step(case)
        except Exception as error:  # In a thread: whatever it is, it is a failure of this case.
            failures.append("%s: %s: %s" % (case.title(), type(error).__name__, error))
    threads = [threading.Thread(target=one, args=(case,)) for case in cases]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return failures


def run_cases(cases, sever, wait):
    """Cut all, look at what follows; the number of failures."""
    try:
        failures = sever() or each(cases, lambda case: case.aftermath(wait))
        for failure in failures:
            print("FAIL %s" % failure)
        if not failures:
            for case in cases:
                print("ok   %s: the next host is served, nothing is lost" % case.title())
        return len(failures)
    finally:
        for case in cases:
            case.end()


def resets(binary):
    """A reset in mid-text."""
    cases = [Case(binary, state, "reset in mid-text") for state in STATES]
    return run_cases(cases, lambda: each(cases, lambda case: case.sever()), 2.0)


def closed_terminals(binary):
    """A serial line that is closed in mid-text."""
    cases = [SerialCase(binary, state, "terminal closed in mid-text") for state in SERIAL_STATES]
    return run_cases(cases, lambda: each(cases, lambda case: case.sever()), 2.0)


class Namespaces:
    """This process in a network of its own, a second one for the robots, two cables between them."""

    def __init__(self):
        libc = ctypes.CDLL(None, use_errno=True)
        if libc.unshare(CLONE_NEWNET) != 0:
            raise PermissionError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
        self.holder = subprocess.Popen(["unshare", "-n", "sleep", "600"])
        time.sleep(0.3)
        self.ip("link", "set", "lo", "up")
        self.ip("link", "set", "lo", "up", inside=True)
        for number, (robot, host) in enumerate((FIRST, SECOND)):
            ours, theirs = "host%d" % number, "robot%d" % number
            self.ip("link", "add", ours, "type", "veth", "peer", "name", theirs)
            self.ip("link", "set", theirs, "netns", str(self.holder.pid))
            self.ip("address", "add", host + "/24", "dev", ours)
            self.ip("link", "set", ours, "up")
            self.ip("address", "add", robot + "/24", "dev", theirs, inside=True)
            self.ip("link", "set", theirs, "up", inside=True)

    def prefix(self):
        """What starts a command at the robots' side."""
        return ("nsenter", "-t", str(self.holder.pid), "-n")

    def ip(self, *words, inside=False):
        """The tool `ip` at either side."""
        subprocess.run([*(self.prefix() if inside else ()), "ip", *words], check=True)

    def close(self):
        self.holder.kill()
        self.holder.wait()


def vanished(binary):
    """The first cable is cut; the hosts of then say nothing any more."""
    try:
        networks = Namespaces()
    except PermissionError as error:
        print("FAIL a peer that vanishes without FIN needs a network namespace: %s; run it as root, or allow "
              "user namespaces (kernel.unprivileged_userns_clone, CAP_SYS_ADMIN in a container)" % error)
        return 1
    try:
        cases = [Case(binary, state, "vanished without FIN", networks.prefix(), (FIRST[0], SECOND[0]))
                 for state in STATES]
        return run_cases(cases, lambda: networks.ip("link", "set", "host0", "down"), FOUND)
    finally:
        networks.close()


def main():
    arguments = options("The cable is cut.").parse_args()
    if not arguments.serve:
        print("cut_cable needs --serve", file=sys.stderr)
        return 2
    missing = [tool for tool in ("ip", "nsenter", "unshare") if shutil.which(tool) is None]
    if missing:
        print("FAIL cut_cable needs %s: install iproute2 and util-linux" % ", ".join(missing))
        return 1
    if os.geteuid() != 0 and "TS3100_INSIDE" not in os.environ:
        os.environ["TS3100_INSIDE"] = "1"
        os.execvp("unshare", ["unshare", "-Ur", sys.executable, *sys.argv])
    return sum(part(arguments.serve) for part in (resets, closed_terminals, vanished)) > 0


if __name__ == "__main__":
    sys.exit(program(main))
