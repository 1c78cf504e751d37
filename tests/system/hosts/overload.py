#!/usr/bin/env python3
"""What must not hang the emulator: terminal hosts that flood and leave, a clock faster than the machine, a log
that nobody reads, a storm in it, a terminal that hangs up, a process that is stopped, hosts that never wait for an
answer. After each attack IP0 answers and SIGTERM ends serve.

    python3 tests/system/hosts/overload.py --serve target/release/ts3100 [--rounds 100]"""

import contextlib
import functools
import multiprocessing
import os
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Emulator, split  # noqa: E402
from steps import Failed, equal, ok, program, serving, true, until  # noqa: E402
from wire import Host  # noqa: E402

# The longest a single answer may take on a busy machine; the usual one is held to USUAL.
ANSWER, USUAL = 2.0, 0.05
# More lines than wait to be written and than a pipe holds.
TEXTS = 5000
FACTORS = ("x10", "x1000", "x100000")
# How long the process is stopped.
STOPPED = 3.0
# Programs without an end, by the body of the loop: statements alone, PRINT that nobody hears, pauses, pulses, motions.
LOOPS = {"statements": b"A = A + 1", "PRINT": b"A = A + 1\nPRINT TP, A, CR", "DELAY": b"DELAY 0.001\nDOUT(1)\nDOUT(-1)",
         "PULOUT": b"PULOUT(1, 0.001)\nPULOUT(2, 0.001)", "MOVES": b"MOVES HERE + POINT(0, 0, 9)\nMOVES HERE - POINT(0, 0, 9)"}
# How long SIGTERM may take. A busy machine only adds to a time, so the best of these tries counts.
END, TRIES = 0.1, 3
# How long others may wait beside a host that pipelines: in the best of so many rounds, each this long, for a busy
# machine only adds to a time.
FAIR, ROUNDS, ROUND = 0.020, 3, 1.0
# How long the next host on a flooded port may wait for its first answer, and the bytes that were sent before.
NEXT, FLOODED = 0.050, 1 << 20
# Reads what a flood on IP1 sends, so that every byte has an effect.
READER = b"PROGRAM READER\nAGAIN:\nINPUT IP1, A\nGOTO AGAIN\nEND\n"


def asked(emulator):
    """How long SU takes on a fresh connection."""
    begun = time.monotonic()
    host = Host(emulator.address("ip0"), True)
    host.raw(b"\x02SU\r\x03")
    data = host.receive(ANSWER)
    if not data.startswith(b"FL,MODE:"):
        raise Failed("SU is answered\n     found    %r" % data[:40])
    host.raw(b"\x02OK\r\x03")
    host.close()
    return time.monotonic() - begun


@contextlib.contextmanager
def loaded(source):
    """The path of a program for `--load`."""
    with tempfile.TemporaryDirectory(prefix="ts3100-") as folder:
        path = os.path.join(folder, source.split(None, 2)[1].decode().lower() + ".scol")
        with open(path, "wb") as file:
            file.write(source)
        yield path


def floods(binary, rounds):
    """Random bytes into HOST's terminal, never read, and away."""
    with tempfile.TemporaryDirectory(prefix="ts3100-") as folder, \
            Emulator(binary, "--serial-dir", os.path.join(folder, "s"), "--set", "serial.pacing=false") as emulator:
        for number in range(rounds):
            terminal = os.open(os.path.join(folder, "s", "host"), os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            limit = time.monotonic() + 0.1
            while time.monotonic() < limit:
                try:
                    os.write(terminal, os.urandom(512))
                except BlockingIOError:
                    time.sleep(0.001)
            os.close(terminal)
            try:
                asked(emulator)
            except Failed as error:
                raise Failed("round %d: %s" % (number + 1, error)) from error
        ok("%d terminal hosts that flood and leave" % rounds)


def hurry(binary, factor, name):
    """A program that never ends, at a factor that no machine keeps up with: how long SU takes, and SIGTERM."""
    source = b"PROGRAM LOOP\nA = 0\nSPEED = 100\nAGAIN:\n%s\nGOTO AGAIN\nEND\n" % LOOPS[name]
    with loaded(source) as path, Emulator(binary, "--time", factor, "--servo-on", "--load", path, "--select", "LOOP") as emulator:
        host = Host(emulator.address("ip0"), True)
        host.command(b"RN")
        host.close()
        took = []
        for _ in range(20):
            took.append(asked(emulator))
            time.sleep(0.01)
        begun = time.monotonic()
        emulator.stop(within=ANSWER)
        return statistics.median(took), time.monotonic() - begun


def in_a_hurry(binary, factor):
    """The same of each program, as often as the machine needs for a moment of its own."""
    for name in LOOPS:
        tries = []
        while len(tries) < TRIES and not any(su < USUAL and end < END for su, end in tries):
            tries.append(hurry(binary, factor, name))
        su, end = min(tries)
        true("%s, %s: SU is answered in %.0f ms, SIGTERM ends it in %.0f ms" % (factor, name, 1e3 * su, 1e3 * end),
             su < USUAL and end < END, tries)


def unread_log(binary):
    """A log that nobody reads, and one whose reader has gone: what is not taken is dropped and counted."""
    for closed in (False, True):
        what = "a closed log" if closed else "a log that nobody reads"
        with Emulator(binary, "-vv", stderr=subprocess.PIPE) as emulator:
            log = emulator.process.stderr
            if closed:
                log.close()
            host = Host(emulator.address("ip0"), True)
            for _ in range(TEXTS):
                host.raw(b"\x02XX\r\x03")
                if host.receive(ANSWER) != b"NG\r":
                    raise Failed("%s: every text is answered" % what)
            ok("%s: %d texts are answered" % (what, TEXTS))
            host.close()
            if not closed:
                # Its reader comes back.
                lines = []
                reader = threading.Thread(target=lambda lines=lines, log=log: lines.extend(log))
                reader.start()
                until("%s: it is read again" % what, lambda lines=lines: lines, ANSWER)
                emulator.stop()
                reader.join(5)
                true("%s: it says how many lines are missing" % what, any(b"lines dropped: " in line for line in lines), lines[-2:])


def storm(binary):
    """A host that sends nonsense as fast as it is answered: the log folds what it says of it, as text and as JSON."""
    for form in ("text", "json"):
        with Emulator(binary, "--log-format", form) as emulator:
            host = Host(emulator.address("ip0"), True)
            for _ in range(TEXTS):
                host.raw(b"\x02XX\r\x03")
                host.receive(ANSWER)
            host.close()
            emulator.stop()
            log = emulator.log()
            # What is not folded, and the last of each second.
            true("%s: a storm of %d refusals is %d KB of log" % (form, TEXTS, len(log) >> 10), len(log) < 100_000, log[-500:])
            fold = r"\.\.\. repeated (\d+) times$" if form == "text" else r'"repeated":(\d+)}$'
            told = re.findall(fold, log, re.M)
            lines = sum(map(int, told)) + sum(" refused: " in line and not re.search(fold, line) for line in log.splitlines())
            equal("%s: every refusal is counted" % form, TEXTS, lines)


def stopped(binary):
    """SIGSTOP for a while: SU is answered at once afterwards, and virtual time has passed or was skipped, as asked for."""
    for gap in ("catch-up", "skip"):
        with Emulator(binary, "--time-gap", gap) as emulator:
            host, clock = Host(emulator.address("ip0"), True), functools.partial(emulator.robot.call, "get_clock")
            before, begun = clock(), time.monotonic()
            os.kill(emulator.process.pid, signal.SIGSTOP)
            time.sleep(STOPPED)
            os.kill(emulator.process.pid, signal.SIGCONT)
            runs = time.monotonic()
            host.raw(b"\x02SU\r\x03")
            host.receive(ANSWER)
            took = time.monotonic() - runs
            true("%s: SU is answered %.0f ms after SIGCONT" % (gap, 1e3 * took), took < 2 * USUAL)
            after = clock()
            passed, wall = after["now"] - before["now"], time.monotonic() - begun
            expected = wall if gap == "catch-up" else wall - STOPPED
            true("%s: %.2f s of virtual time have passed in %.2f s" % (gap, passed, wall), abs(passed - expected) < 0.5)
            true("%s: /clock says %.2f s were skipped" % (gap, after["skipped"]),
                 abs(after["skipped"] - (0 if gap == "catch-up" else STOPPED)) < 0.5)
            host.close()


def drips(binary):
    """Servers that say a little again and again: `host` and `ctl` end in their time."""
    text = b"\x02FL," + b"A" * 200 + b"\x03"
    for what, words, answer in (
            ("host, a text byte by byte", ("host", "{}", "su", "--timeout", "1"), [bytes([b]) for b in text * 9]),
            ("host, a file text by text", ("host", "{}", "su", "--timeout", "1", "--total", "2"), [text] * 999),
            ("ctl, the head", ("ctl", "--url", "http://{}", "--timeout", "1", "health"), [b"H"] * 999),
            ("ctl, the body", ("ctl", "--url", "http://{}", "--timeout", "1", "health"),
             [b"HTTP/1.0 200 OK\r\nContent-Length: 999\r\n\r\n"] + [b" "] * 999)):
        listener = socket.create_server(("127.0.0.1", 0))

        def drip(answer=answer, listener=listener):
            peer = listener.accept()[0]
            try:
                peer.recv(1 << 16)
                for part in answer:
                    peer.sendall(part)
                    time.sleep(0.1)
            except OSError:
                pass

        threading.Thread(target=drip, daemon=True).start()
        begun = time.monotonic()
        process = subprocess.run([binary, *(word.format("127.0.0.1:%d" % listener.getsockname()[1]) for word in words)],
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=30)
        took = time.monotonic() - begun
        true("%s: it gives up after %.1f s" % (what, took), process.returncode in (2, 3) and took < 5,
             (process.returncode, process.stderr))
        listener.close()


def made_up(binary):
    """Names and lines of others: nothing of them is obeyed, and a giant line is not echoed."""
    with tempfile.TemporaryDirectory(prefix="ts3100-") as folder, Emulator(binary, "-vv") as emulator:
        host = Host(emulator.address("ip0"), True)
        for text in (b"\x1b[2J", b"\x07\x08", b"\x9b", b"SL,\x1b]0;x\x07", b"\n2026 INFO all is well"):
            host.raw(b"\x02" + text + b"\r\x03")
            host.receive(ANSWER)
        host.close()
        emulator.stop()
        log = emulator.log()
        raw = [letter for letter in log if (ord(letter) < 32 and letter != "\n") or 127 <= ord(letter) < 160]
        true("no control character of a host is in the log", not raw and "<1B>" in log, raw)
        true("no line of the log is a host's", not re.search("^2026 INFO all", log, re.M))
        for flag in ("--config", "--faults", "--scenario", "--model"):
            path = os.path.join(folder, "giant.toml")
            for content in ("x = [" + "A" * 500_000, "A" * 500_000 + " = 1", "[[fault]]\nkind = \"" + "\x1b[2J" * 9 + "\""):
                with open(path, "w") as file:
                    file.write(content)
                found = subprocess.run([binary, "serve", "--ports", "auto", flag, path], stdout=subprocess.PIPE,
                                       stderr=subprocess.PIPE, timeout=30)
                said = found.stderr
                if found.returncode != 2 or len(said) > 4096 or b"\x1b" in said:
                    raise Failed("%s of nonsense is refused in a few words\n     found    %d, %d bytes: %r"
                                 % (flag, found.returncode, len(said), said[:200]))
        ok("files that are no TOML are refused in a few words")


def pipeline(address, block, sent):
    """A host that sends as fast as it can, and reads what comes in a thread."""
    peer = socket.create_connection(address)

    def read():
        with contextlib.suppress(OSError):
            while peer.recv(1 << 16):
                pass

    threading.Thread(target=read, daemon=True).start()
    while True:
        peer.sendall(block)
        sent.value += len(block)


def waits(address, robot):
    """How long one in twenty waits at least for SU on a port, and for /health, over a round."""
    host, took = Host(address, True), {"SU": [], "/health": []}

    def su():
        host.raw(b"\x02SU\r\x03")
        host.receive(ANSWER)
        host.raw(b"\x02OK\r\x03")

    limit = time.monotonic() + ROUND
    while time.monotonic() < limit:
        for name, ask in (("SU", su), ("/health", lambda: robot.request("GET", "/health", timeout=ANSWER))):
            begun = time.monotonic()
            try:
                ask()
            except (Failed, OSError) as error:
                raise Failed("%s is answered: %s" % (name, error)) from error
            took[name].append(time.monotonic() - begun)
        time.sleep(0.005)
    host.close()
    return {name: sorted(times)[len(times) * 19 // 20] for name, times in took.items()}


def fairness(binary):
    """A host that pipelines on one port: the others and /health wait no longer for it."""
    lines = ("--serial-host-tcp", "127.0.0.1:0", "--serial-com1-tcp", "127.0.0.1:0", "--set", "serial.pacing=false")
    for port, block in (("ip0", b"\x02SU\r\x03" * 1000), ("host", b"\x02SU\r\x03" * 1000), ("com1", b"1\r" * 2000),
                        ("ip1", b"1\r" * 2000)):
        with loaded(READER) as path, Emulator(binary, *lines, "--servo-on", "--load", path, "--select", "READER") as emulator:
            addresses = {name: split(emulator.ready["serial"][name].split("//")[-1]) for name in ("host", "com1")}
            addresses.update({name: emulator.address(name) for name in ("ip0", "ip1")})
            sent = multiprocessing.Value("Q")
            flood = multiprocessing.Process(target=pipeline, args=(addresses[port], block, sent), daemon=True)
            host = Host(emulator.address("ip0"), True)
            host.command(b"RN")
            host.close()
            flood.start()
            try:
                until("%s is flooded" % port, lambda: sent.value, ANSWER)
                probe = addresses["host" if port == "ip0" else "ip0"]
                rounds = [waits(probe, emulator.robot) for _ in range(ROUNDS)]
                true("%s: the host that pipelines is still there, %d KB" % (port, sent.value >> 10), flood.is_alive())
                for name in rounds[0]:
                    best = min(found[name] for found in rounds)
                    true("%s pipelines: %s waits %.1f ms" % (port, name, 1e3 * best), best < FAIR, rounds)
            finally:
                flood.kill()


def until_closed(address, block, sent):
    """The same, until the emulator closes the connection."""
    with contextlib.suppress(OSError):
        pipeline(address, block, sent)


def etx_storm(binary):
    """A host that sends ETX or empty texts as fast as it can: others are answered meanwhile, and the next one on its port is
    served, whether it is gone or still there."""
    for what, block in (("ETX", b"\x03" * 4096), ("STX ETX", b"\x02\x03" * 2048), ("SU", b"\x02SU\r\x03" * 1000)):
        for gone in (True, False):
            took = []
            while len(took) < TRIES and not any(seconds < NEXT for seconds in took):
                with Emulator(binary) as emulator:
                    sent = multiprocessing.Value("Q")
                    flood = multiprocessing.Process(target=until_closed, args=(emulator.address("ip0"), block, sent), daemon=True)
                    flood.start()
                    try:
                        until("IP0 is flooded", lambda sent=sent: sent.value > FLOODED, 10 * ANSWER)
                        if gone:
                            flood.kill()
                            flood.join()
                        took.append(asked(emulator))
                    finally:
                        flood.kill()
            true("%s storm, %s: the next host has its status after %.0f ms" % (what, "gone" if gone else "there", 1e3 * min(took)),
                 min(took) < NEXT, took)


def hang_up(binary):
    """SIGHUP is an end like any other."""
    with Emulator(binary) as emulator:
        emulator.stop(by=signal.SIGHUP)


def main():
    parser = serving(__doc__)
    parser.add_argument("--rounds", type=int, default=100, help="terminal hosts (default 100)")
    attacks = (floods, in_a_hurry, unread_log, storm, etx_storm, hang_up, stopped, drips, made_up, fairness)
    names = [attack.__name__ for attack in attacks]
    parser.add_argument("--only", choices=names, metavar="ATTACK", help="one of " + ", ".join(names))
    arguments = parser.parse_args()
    further = {"floods": [(arguments.rounds,)], "in_a_hurry": [(factor,) for factor in FACTORS]}
    for attack in attacks:
        if arguments.only in (None, attack.__name__):
            for words in further.get(attack.__name__, [()]):
                attack(arguments.serve, *words)


if __name__ == "__main__":
    sys.exit(program(main))
