"""What the Python hosts of this folder share: an emulator process, raw links, and steps that print what
they saw. Standard library only, nothing of the product: every byte of the protocol is spelled out here a
second time, so that an error in the product cannot hide behind itself."""

import argparse
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time

from transport import Tcp

STX, ETX, CR, LF, EOF = b"\x02", b"\x03", b"\r", b"\n", b"\x1a"
ADVISED_PAUSE = 0.050
REPLY_TIMEOUT = 5.0
READY_TIMEOUT = 10.0
SF_BYTES = 276


class Failed(Exception):
    """A step did not see what it had to see."""


def ok(what):
    """Report a step that held."""
    print("ok   " + what, flush=True)


def show(data):
    """Bytes as a person reads them: hexadecimal and text."""
    if not isinstance(data, (bytes, bytearray)):
        return repr(data)
    text = "".join(chr(b) if 0x20 <= b < 0x7F else "<%02X>" % b for b in data)
    return "%s   (%s)" % (data.hex(" "), text) if len(data) <= 64 else "%d bytes: %s" % (len(data), text)


def equal(what, expected, found):
    """The step holds when both are the same."""
    if expected != found:
        raise Failed("%s\n     expected %s\n     found    %s" % (what, show(expected), show(found)))
    ok(what)


def true(what, condition, found=""):
    """The step holds when the condition does."""
    if not condition:
        raise Failed("%s\n     found    %s" % (what, show(found)))
    ok(what)


class Emulator:
    """A `ts3100 serve` process on free ports, of the loopback interface unless `--listen` and `at` say otherwise.
    `prefix` is a command that starts it, for example in a network namespace."""

    def __init__(self, binary, *flags, prefix=(), at="127.0.0.1"):
        self.at = at
        self.stderr = tempfile.TemporaryFile()
        self.process = subprocess.Popen(
            [*prefix, os.path.abspath(binary), "serve", "--ports", "auto", "--ready-json", *flags],
            stdout=subprocess.PIPE, stderr=self.stderr)
        ready, _, _ = select.select([self.process.stdout], [], [], READY_TIMEOUT)
        line = self.process.stdout.readline() if ready else b""
        try:
            event = json.loads(line)
            self.ready, self.ports = event, event["ports"]
            if event["event"] != "ready":
                raise ValueError(line)
        except (ValueError, KeyError):
            self.process.kill()
            raise Failed("the ready line of serve %s\n     found    %s\n%s"
                         % (" ".join(flags), show(line), self.log()))

    def address(self, channel):
        """Host and port of a channel, as `ip0`."""
        return (self.at, self.ports[channel])

    def log(self):
        """What the process wrote on stderr."""
        self.stderr.seek(0)
        return self.stderr.read().decode("utf-8", "replace")

    def stop(self):
        """End it as an operator does, and look at its exit code."""
        self.process.send_signal(signal.SIGTERM)
        try:
            code = self.process.wait(5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise Failed("SIGTERM ends serve within 5 s\n     found    still running")
        equal("SIGTERM ends serve with exit code 0", 0, code)

    def kill(self):
        """End it whatever its state."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()


class Line:
    """A line to the robot as a host sees it: bytes, and a clock. `way` is an address, or a transport."""

    def __init__(self, way):
        self.way = Tcp(way) if isinstance(way, (tuple, socket.socket)) else way
        self.kept = b""
        self.last = 0.0

    @property
    def socket(self):
        """The socket of a TCP connection."""
        return self.way.socket

    def raw(self, data):
        """Send bytes as they are."""
        self.way.send(data)

    def more(self, timeout):
        """Wait for more bytes; False when none came in time. A closed connection is an error here."""
        data = self.way.receive(timeout)
        if data is None:
            raise Failed("the connection stays open\n     found    closed after " + show(self.kept))
        if not data:
            return False
        self.kept += data
        self.last = time.monotonic()
        return True

    def until(self, end, timeout=REPLY_TIMEOUT):
        """Bytes up to and including `end`."""
        limit = time.monotonic() + timeout
        while end not in self.kept:
            if not self.more(limit - time.monotonic()):
                raise Failed("bytes up to %s within %.1f s\n     found    %s" % (show(end), timeout, show(self.kept)))
        at = self.kept.index(end) + len(end)
        data, self.kept = self.kept[:at], self.kept[at:]
        return data

    def count(self, number, timeout=REPLY_TIMEOUT):
        """Exactly so many bytes."""
        limit = time.monotonic() + timeout
        while len(self.kept) < number:
            if not self.more(limit - time.monotonic()):
                raise Failed("%d bytes within %.1f s\n     found    %s" % (number, timeout, show(self.kept)))
        data, self.kept = self.kept[:number], self.kept[number:]
        return data

    def silence(self, seconds):
        """All bytes that come in this time; b"" is silence."""
        limit = time.monotonic() + seconds
        while time.monotonic() < limit:
            self.more(limit - time.monotonic())
        data, self.kept = self.kept, b""
        return data

    def closed_by_peer(self, timeout):
        """Whether the peer closes within this time without sending anything."""
        self.socket.settimeout(timeout)
        try:
            return self.socket.recv(1) == b""
        except ConnectionError:
            return True
        except socket.timeout:
            return False

    def close(self):
        """Hang up."""
        self.way.close()


class Host(Line):
    """A host on IP0, in the framing with or without STX, that waits the advised 50 ms."""

    def __init__(self, way, stx):
        super().__init__(way)
        self.stx = STX if stx else b""
        self.unsolicited = 0

    def text(self, data):
        """Send one text: the data section without STX and ETX."""
        pause = self.last + ADVISED_PAUSE - time.monotonic()
        if pause > 0:
            time.sleep(pause)
        self.raw(self.stx + data + ETX)

    def receive(self, timeout=REPLY_TIMEOUT):
        """The data section of the next text."""
        text = self.until(ETX, timeout)
        if not text.startswith(self.stx) or text[:1] == STX != self.stx:
            raise Failed("a text in the framing of the host\n     found    %s" % show(text))
        return text[len(self.stx):-1]

    def reply(self, timeout=REPLY_TIMEOUT):
        """The next text that is not an unsolicited SP; those are counted."""
        while True:
            data = self.receive(timeout)
            if data != b"SP\r":
                return data
            self.unsolicited += 1

    def ask(self, command):
        """A command that is answered by OK or NG: the answer's data section."""
        self.text(command + CR)
        return self.reply()

    def command(self, command):
        """A command that has to be answered OK."""
        answer = self.ask(command)
        if answer != b"OK\r":
            raise Failed("%s is answered OK\n     expected %s\n     found    %s"
                         % (command.decode(), show(b"OK\r"), show(answer)))

    def file(self, command, blocks=None):
        """A command that is answered by FL: the content without EOF. `blocks` collects the data sections."""
        self.text(command + CR)
        content = b""
        first = True
        while True:
            data = self.reply()
            if blocks is not None:
                blocks.append(data)
            if first and not data.startswith(b"FL,"):
                raise Failed("%s is answered by FL\n     found    %s" % (command.decode(), show(data)))
            content += data[3:] if first else data
            first = False
            self.text(b"OK\r")
            if EOF in data:
                return content[:content.index(EOF)]

    def download(self, name, content):
        """DL in texts of 253 data bytes; every text has to be answered OK."""
        self.command(b"DL," + name)
        whole = b"FL," + content + EOF
        blocks = [whole[at:at + 253] for at in range(0, len(whole), 253)]
        for number, block in enumerate(blocks, 1):
            self.text(block)
            answer = self.reply()
            if answer != b"OK\r":
                raise Failed("text %d of %d of DL,%s is answered OK\n     found    %s"
                             % (number, len(blocks), name.decode(), show(answer)))
        return len(blocks)

    def status(self):
        """SU as a dictionary of its six items."""
        items = self.file(b"SU").decode("ascii").split(" ")
        return dict(item.split(":", 1) for item in items)

    def total(self, length=SF_BYTES, tail=EOF + ETX):
        """SF, read by length: its binary body."""
        self.text(b"SF\r")
        while True:
            head = self.count(len(self.stx) + 3)
            if head[len(self.stx):] != b"SP\r":
                break
            self.count(1)
            self.unsolicited += 1
        if head != self.stx + b"FL,":
            raise Failed("SF is answered by FL\n     found    %s" % show(head))
        body = self.count(length)
        end = self.count(len(tail))
        if end != tail:
            raise Failed("SF ends as it must\n     expected %s\n     found    %s" % (show(tail), show(end)))
        self.text(b"OK\r")
        return body


def options(description):
    """The command line every host of this folder understands."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--serve", metavar="TS3100", help="start this binary on free ports")
    parser.add_argument("--ip0", metavar="HOST:PORT", help="IP0 of a running emulator")
    parser.add_argument("--ip1", metavar="HOST:PORT", help="IP1 of a running emulator")
    parser.add_argument("--stx", action=argparse.BooleanOptionalAction, default=True,
                        help="texts with STX (default) or without")
    return parser


def split(address):
    """HOST:PORT as a pair."""
    host, port = address.rsplit(":", 1)
    return (host, int(port))


def run(job, arguments, *flags):
    """Do a job against the emulator that the command line names; the exit code."""
    emulator = None
    started = time.monotonic()
    try:
        if arguments.serve:
            emulator = Emulator(arguments.serve, *flags)
            job(emulator.address("ip0"), emulator.address("ip1"))
            emulator.stop()
        elif arguments.ip0 and arguments.ip1:
            job(split(arguments.ip0), split(arguments.ip1))
        else:
            print("either --serve or both of --ip0 and --ip1 are needed", file=sys.stderr)
            return 2
    except (Failed, OSError) as error:
        print("FAIL %s" % error, flush=True)
        if emulator:
            print(emulator.log(), file=sys.stderr)
        return 1
    finally:
        if emulator:
            emulator.kill()
    print("all of it held, in %.1f s" % (time.monotonic() - started))
    return 0
