"""A host of the robot as the programs of `tests/system` use it: raw links and texts. Standard library only, nothing of the
product: every byte of the protocol is spelled out here a second time, so that an error in the product cannot hide behind
itself."""

import socket
import time

from steps import Failed, show
from transport import Tcp

STX, ETX, CR, LF, EOF = b"\x02", b"\x03", b"\r", b"\n", b"\x1a"
ADVISED_PAUSE = 0.050
REPLY_TIMEOUT = 5.0
SF_BYTES = 276


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


class Fast(Host):
    """A host that does not wait the advised 50 ms."""

    def text(self, data):
        self.raw(self.stx + data + ETX)

    def load(self, name, content):
        """DL: the answer to its last text."""
        self.command(b"DL," + name)
        whole = b"FL," + content + EOF
        answer = b""
        for at in range(0, len(whole), 253):
            self.text(whole[at:at + 253])
            answer = self.reply()
            if answer != b"OK\r":
                break
        return answer.rstrip(b"\r")

    def answer(self, command):
        return self.ask(command).rstrip(b"\r")
