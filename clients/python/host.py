#!/usr/bin/env python3
"""A host program on sockets, for the TS3100 or the emulator: servo on, a program downloaded, selected and started, its
questions answered, status read by SU and by SF, the file read back. Standard library only; Robot is the part to take
over into a program of one's own.

    python3 clients/python/host.py 127.0.0.1:11000 127.0.0.1:11001          commands on IP0, the program talks on IP1
    python3 clients/python/host.py 127.0.0.1:22217 127.0.0.1:22218 COM1     the same on HOST and COM1 as bare TCP

Exit code: 0 all of it happened, 1 it did not (the reason is on stderr), 2 wrong arguments."""

import socket
import struct
import sys
import time

STX, ETX, CR, EOF = b"\x02", b"\x03", b"\r", b"\x1a"
TIMEOUT = 5.0
ADVISED_PAUSE = 0.050       # between a text of the robot and the next one of the host
DATA_BYTES = 253            # between STX and ETX
TOTAL_BYTES = 276           # SF of a six-axis arm; a SCARA sends 250 and no EOF
NO_ALARM = 0xFFFF


class RobotError(Exception):
    """What the robot refused, sent in a form that is not the protocol's, or did not send in time."""


class Link:
    """Bytes to and from one port of the robot. TCP cuts where it likes: what came too early is kept."""

    def __init__(self, address):
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)), timeout=TIMEOUT)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.kept = b""

    def send(self, data):
        self.socket.sendall(data)

    def _more(self):
        try:
            data = self.socket.recv(4096)
        except socket.timeout:
            raise RobotError("nothing more within %.0f s than %r" % (TIMEOUT, self.kept)) from None
        if not data:
            raise RobotError("the robot closed the connection (has it another host already?)")
        self.kept += data

    def bytes(self, count):
        """Exactly so many bytes."""
        while len(self.kept) < count:
            self._more()
        data, self.kept = self.kept[:count], self.kept[count:]
        return data

    def until(self, end):
        """The bytes in front of `end`, which is taken and not returned."""
        while end not in self.kept:
            self._more()
        data, self.kept = self.kept.split(end, 1)
        return data

    def close(self):
        self.socket.close()


class Total:
    """The system total status: the part of SF's binary record that most hosts look at. Big-endian throughout."""

    def __init__(self, body):
        self.servo_on, self.emergency_stop = body[0] == 1, body[1] == 1
        self.motion = body[2]                                   # 0 reset, 1 running, 2 retry, 3 continue
        self.alarms = [word for word in struct.unpack_from(">10H", body, 4) if word != NO_ALARM]
        self.joints = struct.unpack_from(">8f", body, 116)
        self.world = struct.unpack_from(">8f", body, 148)       # X Y Z A B C U V in mm and degrees


class Robot:
    """The simple protocol on IP0 or HOST: one text out, one text or one file back."""

    def __init__(self, address):
        self.link = Link(address)
        self.last = 0.0
        self.stops = 0      # how often the robot said SP by itself: a program has ended or was stopped

    def _send(self, data):
        time.sleep(max(self.last + ADVISED_PAUSE - time.monotonic(), 0.0))
        self.link.send(STX + data + ETX)

    def _begin(self):
        first = self.link.bytes(1)
        if first != STX:
            raise RobotError("a text begins with %r, not with STX" % first)

    def _next(self):
        self._begin()
        data = self.link.until(ETX)
        self.last = time.monotonic()
        return data

    def _answer(self):
        """The next text that is an answer; an SP may lie in front of it."""
        while (data := self._next()) == b"SP\r":
            self.stops += 1
        return data

    def _expect(self, what):
        answer = self._answer()
        if answer != b"OK\r":
            raise RobotError("%s is answered by %s" % (what, answer.decode("ascii", "replace").strip()))

    def command(self, command):
        """A command that is answered by OK or NG."""
        self._send(command.encode() + CR)
        self._expect(command)

    def read(self, command):
        """A command that is answered by a file of one or several texts, each acknowledged; without EOF."""
        self._send(command.encode() + CR)
        data = self._answer()
        if data[:3] != b"FL,":
            raise RobotError("%s is answered by %r" % (command, data))
        content, data = b"", data[3:]
        while True:
            self._send(b"OK\r")
            content += data
            if EOF in data:
                return content[:content.index(EOF)]
            data = self._answer()

    def download(self, name, content):
        """DL; FL, and the EOF count among the data bytes, and only the first and the last text have them. The texts."""
        self.command("DL," + name)
        whole = b"FL," + content + EOF
        texts = [whole[at:at + DATA_BYTES] for at in range(0, len(whole), DATA_BYTES)]
        for number, text in enumerate(texts, 1):
            self._send(text)
            self._expect("text %d of DL,%s" % (number, name))
        return len(texts)

    def status(self):
        """SU: the items of the status by their labels."""
        return dict(item.split(":", 1) for item in self.read("SU").decode("ascii").split(" "))

    def total(self):
        """SF is binary: an ETX may stand anywhere in it, so it is read by its length."""
        self._send(b"SF\r")
        self._begin()
        while (head := self.link.bytes(3)) == b"SP\r":
            self.link.bytes(1)
            self.stops += 1
            self._begin()
        if head != b"FL,":
            raise RobotError("SF is answered by %s" % head.decode("ascii", "replace").strip())
        body, end = self.link.bytes(TOTAL_BYTES), self.link.bytes(2)
        self.last = time.monotonic()
        if end != EOF + ETX:
            raise RobotError("SF is not %d bytes long; is this a SCARA?" % TOTAL_BYTES)
        self._send(b"OK\r")
        return Total(body)

    def await_stop(self):
        """Wait for the SP that tells of the end of a cycle."""
        if self.stops:
            self.stops -= 1
        elif (data := self._next()) != b"SP\r":
            raise RobotError("SP was expected, not %r" % data)

    def close(self):
        self.link.close()


NAME = "PYHOST"
FAR = 62.5
# The lines of a file on the RAM drive end in LF alone.
PROGRAM = """PROGRAM %(name)s
REMARK Asks the host how far to go, goes there, and says so.
X = 0.0
PRINT %(channel)s, "HOW FAR?", CR
INPUT %(channel)s, X
MOVE START WITH SPEED=100
MOVE START + POINT(0, X, 0) WITH SPEED=100
WAIT MOTION >= 100
PRINT %(channel)s, "THERE", X, CR
END
DATA
POINT START=400,0,200,0,0,0,0,0/11111
END
"""


def job(robot, talk, channel):
    """The whole of it."""
    program = (PROGRAM % {"name": NAME, "channel": channel}).encode()
    robot.command("SO")
    print("SO: servo on")
    print("DL: %d bytes in %d texts" % (len(program), robot.download(NAME, program)))
    same = robot.read("UL," + NAME) == program
    print("UL: %s bytes" % ("the same" if same else "other"))
    robot.command("SL," + NAME)
    print("SL: " + robot.status()["FILE"])
    robot.command("RN")
    print("the robot asks: " + talk.until(CR).decode())
    print("SU: " + robot.status()["STATUS"])
    talk.send(b"%.1f\r" % FAR)
    print("the robot says: " + talk.until(CR).decode())
    robot.await_stop()
    total = robot.total()
    print("SF: servo %s, motion %d, %d alarms, X %.1f Y %.1f Z %.1f"
          % ("on" if total.servo_on else "off", total.motion, len(total.alarms), *total.world[:3]))
    robot.command("BR")
    print("BR: servo off")
    if not same or total.motion or total.alarms or abs(total.world[1] - FAR) > 0.01:
        raise RobotError("the robot is not where it was sent, or the file is not what was sent")


def main(arguments):
    if not 2 <= len(arguments) <= 3:
        print("host.py COMMANDS DIALOGUE [CHANNEL]: two addresses, and IP1 (the default), IP2 or COM1", file=sys.stderr)
        return 2
    links = []
    try:
        links += [Robot(arguments[0]), Link(arguments[1])]
        job(*links, arguments[2] if len(arguments) == 3 else "IP1")
        return 0
    except (RobotError, OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    finally:
        for link in links:
            link.close()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
