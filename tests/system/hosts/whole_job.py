#!/usr/bin/env python3
"""A host's whole day: servo on, download, select, run, talk to the program, read status, stop. The host's commands
go over IP0, the HOST terminal or HOST behind RFC 2217; the program talks on IP1, on IP2 which the robot dials itself,
or on COM1.

    python3 tests/system/hosts/whole_job.py --serve target/release/ts3100 [--no-stx]
    python3 tests/system/hosts/whole_job.py --serve target/release/ts3100 --commands terminal --speed 115200 --frame 8E2 --talk com1
    python3 tests/system/hosts/whole_job.py --ip0 127.0.0.1:1000 --ip1 127.0.0.1:1001

It speaks raw bytes and shares no code with the product. Each step prints one line; the exit code is 0 when
all of them held. The program that it downloads stands below and is ours."""

import os
import shutil
import struct
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from transport import Listener, Remote, Settings, Terminal  # noqa: E402
from emulator import Emulator, options, run, split  # noqa: E402
from steps import Failed, equal, ok, program, true  # noqa: E402
from wire import CR, EOF, ETX, STX, Host, Line  # noqa: E402

NAME = b"DAYJOB"
PROGRAM = b"""GLOBAL
COUNT = 10
RATE = 1.5
END
PROGRAM DAYJOB
REMARK One branch for each thing a host wants to see; the host chooses by a number.
K = 0
A = 0
B = 0
C = 0
X = 0.0
Y = 0.0
PRINT IP1, "READY", CR
INPUT IP1, K
GOTO(K) FORMAT, TALK, CLEAN, TRIP, LINGER, LISTEN
PRINT IP1, "UNKNOWN", K, CR
GOTO FINISH
FORMAT:
REMARK Numbers stand in blocks of twelve characters.
PRINT IP1, "THIRD =", -1000.0/3, CR
PRINT IP1, 7, -5, 1234567890, CR
PRINT IP1, "A", 1, "B", X + 1.5, CR
PRINT IP1, COUNT * 2 + 1, 2.0 / 3, CR
PRINT IP1, "OPEN END"
GOTO FINISH
TALK:
INPUT IP1, A, X
PRINT IP1, "ONE", A, X, CR
INPUT IP1, A, B, Y
PRINT IP1, "THREE", A, B, Y, CR
INPUT IP1, A
INPUT IP1, B, C
PRINT IP1, "SURPLUS", A, B, C, CR
INPUT IP1, A, B
PRINT IP1, "SHORT", A, B, CR
GOTO FINISH
CLEAN:
INPUT IP1, A
REMARK On a slow line the rest of the record is still on its way.
DELAY 0.1
PRINT IP1, "BUFFRESET"
PRINT IP1, "CLEANED", CR
INPUT IP1, B
PRINT IP1, "AFTER", A, B, CR
GOTO FINISH
TRIP:
REMARK Out and back; the way out is slow enough to be looked at.
MOVE HOME WITH SPEED=100
PRINT IP1, "AT HOME", CR
MOVE FAR WITH SPEED=6
PRINT IP1, "AT FAR", CR
MOVE HOME WITH SPEED=100
PRINT IP1, "BACK", CR
GOTO FINISH
LINGER:
DELAY 0.4
GOTO FINISH
LISTEN:
COUNT = COUNT + 1
A = 7
B = 7
INPUT IP1, A, B
PRINT IP1, "CANCELLED", A, B, COUNT, CR
FINISH:
END
DATA
POINT HOME=400,0,200,0,0,0,0,0/
POINT FAR=400,200,50,0,0,0,0,0/
END
"""
HOME = (400.0, 0.0, 200.0)
FAR = (400.0, 200.0, 50.0)
RUNNING, RETRY, CONTINUE, RESET = 1, 2, 3, 0
POLLS = 400
# What the manual leaves open is another way each time (docs/explanation/variation.md).
VARIED = "TS3100_VARY" in os.environ


def world(body):
    """X, Y, Z of the tool point in an SF body."""
    return struct.unpack(">3f", body[148:160])


def near(found, expected, within=0.01):
    """Whether two points are the same to so many millimetres."""
    return all(abs(a - b) <= within for a, b in zip(found, expected))


def block(value):
    """A number as PRINT shows it: three decimals if real, right-justified in twelve columns."""
    text = "%.3f" % value if isinstance(value, float) else "%d" % value
    return text.rjust(12).encode()


def settle(host, what):
    """Poll SF until the motion status leaves 1; the last body."""
    for _ in range(POLLS):
        body = host.total()
        if body[2] != RUNNING:
            return body
    raise Failed("%s ends\n     found    still running" % what)


def start(host, robot, choice):
    """RN, and the choice of a branch on IP1."""
    host.command(b"RN")
    equal("the program asks on IP1", b"READY\r", robot.until(CR))
    robot.raw(b"%d\r" % choice)


def cycle_end(host, what):
    """The unsolicited SP at the end of a cycle; a host without STX gets none and asks (hosts.md 8.3)."""
    if not host.stx:
        settle(host, what)
        equal("no SP comes to a host without STX when %s" % what, b"", host.silence(0.25))
        return
    if host.unsolicited:
        host.unsolicited -= 1
    else:
        data = host.receive()
        if data != b"SP\r":
            raise Failed("SP arrives unasked when %s\n     found    %r" % (what, data))
    ok("SP arrives unasked when %s" % what)


def texts(host):
    """Commands that are no commands, and the two sides of a text."""
    equal("a fresh connection hears nothing first", b"", host.silence(0.1))
    equal("an unknown command gets NG", b"NG\r", host.ask(b"QQ"))
    equal("a command without comma gets NG", b"NG\r", host.ask(b"RSPRG"))
    host.text(b"RN")
    equal("a command without CR gets NG", b"NG\r", host.reply())
    equal("surplus operands get NG", b"NG\r", host.ask(b"SL"))
    host.text(b"OK\r")
    equal("an OK that nobody awaits is not answered", b"", host.silence(0.15))


def download(host):
    """DL in several texts, CA, UL."""
    equal("UL of a missing file gets NG", b"NG\r", host.ask(b"UL," + NAME))
    count = host.download(NAME, PROGRAM)
    true("DL of %d bytes in %d texts, each answered OK" % (len(PROGRAM), count), len(PROGRAM) > 1000 and count > 4)
    files = directory(host)
    equal("CA shows the file with its size", len(PROGRAM), files.get(NAME))
    true("CA shows the parameter files", b"USER.PAR" in files and b"ETHERNET.PAR" in files, repr(files))
    blocks = []
    equal("UL returns the file byte for byte", PROGRAM, host.file(b"UL," + NAME, blocks))
    lengths = [len(block) for block in blocks[:-1]]
    if VARIED:
        true("no text of UL has more than 253 data bytes", max(lengths) <= 253, lengths)
    else:
        equal("UL fills its texts to 253 data bytes", [253] * len(lengths), lengths)
    true("the last text of UL ends in EOF", blocks[-1].endswith(EOF), blocks[-1][-4:])
    host.text(b"UL," + NAME + CR)
    host.reply()
    host.text(b"NG\r")
    equal("NG of the host ends an upload in silence", b"", host.silence(0.15))


def directory(host):
    """CA as name and size."""
    records = host.file(b"CA").split(CR)
    if records.pop() != b"":
        raise Failed("the last record of CA ends in CR")
    return {name: int(size) for name, size in (record.split(b" ")[:2] for record in records)}


def servo_and_selection(host):
    """SO, SL, and what RN says before them."""
    equal("SL of a missing file gets NG", b"NG\r", host.ask(b"SL,NOFILE"))
    equal("SL gets OK", b"OK\r", host.ask(b"SL," + NAME))
    equal("RN with servo off gets NG", b"NG\r", host.ask(b"RN"))
    equal("DO with servo off gets NG", b"NG\r", host.ask(b"DO,DOUT(1)"))
    equal("SF shows servo off", 0, host.total()[0])
    equal("SO gets OK", b"OK\r", host.ask(b"SO"))
    body = host.total()
    equal("SF shows servo on", 1, body[0])
    equal("SF shows no alarm", b"\xff" * 20, body[4:24])
    equal("SF shows no emergency stop", 0, body[1])
    equal("SU to the byte", b"MODE:external(" + host.right + b")/cycle FILE:DAYJOB OVRD:100% LSPEED:100% "
          b"MACHINE:free STATUS:stop(reset)", host.file(b"SU"))


def formats(host, robot):
    """PRINT's blocks, exactly, and the end of a cycle."""
    start(host, robot, 1)
    equal("a string and a real, rounded", b"THIRD =" + block(-1000.0 / 3) + CR, robot.until(CR))
    equal("three integers", block(7) + block(-5) + block(1234567890) + CR, robot.until(CR))
    equal("strings and numbers by turns", b"A" + block(1) + b"B" + block(1.5) + CR, robot.until(CR))
    equal("expressions", block(21) + block(2.0 / 3) + CR, robot.until(CR))
    equal("without CR nothing is appended", b"OPEN END", robot.count(8))
    cycle_end(host, "the program ends")
    equal("after the end of the cycle SU says stop(reset)", "stop(reset)", host.status()["STATUS"])
    equal("nothing else came on IP1", b"", robot.silence(0.05))


def dialogue(host, robot):
    """INPUT from one record, from several, with surplus and with shortage."""
    start(host, robot, 2)
    robot.raw(b"3,4.5\r")
    equal("INPUT of two values in one record", b"ONE" + block(3) + block(4.5) + CR, robot.until(CR))
    robot.raw(b"11\r")
    robot.raw(b"-12\r\n")
    robot.raw(b" 0.25 \r")
    equal("INPUT of three values in three records", b"THREE" + block(11) + block(-12) + block(0.25) + CR,
          robot.until(CR))
    robot.raw(b"1,2,3\r")
    equal("surplus serves the next INPUT", b"SURPLUS" + block(1) + block(2) + block(3) + CR, robot.until(CR))
    robot.raw(b"5\r")
    equal("INPUT waits while a value is short", b"", robot.silence(0.2))
    equal("and SU says running meanwhile", "running", host.status()["STATUS"])
    forbidden_while_running(host)
    robot.raw(b"6")
    equal("digits without CR are no value yet", b"", robot.silence(0.1))
    robot.raw(b"6\r")
    equal("the missing value completes it", b"SHORT" + block(5) + block(66) + CR, robot.until(CR))
    cycle_end(host, "the dialogue ends")


def forbidden_while_running(host):
    """What the permission table and the command pages forbid while a program runs."""
    for command in (b"RN", b"DO,DOUT(1)", b"DL,OTHER", b"UL," + NAME, b"ER," + NAME, b"SL," + NAME,
                    b"RS,PRG", b"EC,MODE STEP"):
        equal("%s gets NG while the program runs" % command.decode(), b"NG\r", host.ask(command))
    equal("the program still runs", RUNNING, host.total()[2])


def buffer_reset(host, robot):
    """BUFFRESET discards what is left over."""
    start(host, robot, 3)
    robot.raw(b"1,2,3\r")
    equal("BUFFRESET itself sends nothing", b"CLEANED\r", robot.until(CR))
    equal("after BUFFRESET the INPUT waits", b"", robot.silence(0.15))
    robot.raw(b"9\r")
    equal("and takes only what came later", b"AFTER" + block(1) + block(9) + CR, robot.until(CR))
    cycle_end(host, "that program ends")


def stop_and_go_on(host, robot):
    """Positions change while it moves; SP in mid-motion; RN goes on with the next step."""
    start(host, robot, 4)
    equal("the first MOVE has ended before its PRINT", b"AT HOME\r", robot.until(CR))
    first = host.total()
    second = host.total()
    equal("SF says running while it moves", (RUNNING, RUNNING), (first[2], second[2]))
    true("positions change in SF while it moves", world(first) != world(second), repr(world(second)))
    true("joints change in SF while it moves", first[116:148] != second[116:148])
    asked = time.monotonic()
    equal("SP in mid-motion gets OK", b"OK\r", host.ask(b"SP"))
    true("within 200 ms", time.monotonic() - asked < 0.2)
    body = settle(host, "the step under way")
    equal("the motion status is then stop (continue)", CONTINUE, body[2])
    true("the step under way was completed", near(world(body), FAR), repr(world(body)))
    equal("the next step was not begun", b"", robot.silence(0.15))
    equal("a stop by SP brings no SP back", 0, host.unsolicited)
    host.command(b"RN")
    equal("RN goes on with the next step", b"AT FAR\r", robot.until(CR))
    equal("to the end", b"BACK\r", robot.until(CR))
    cycle_end(host, "the trip ends")
    true("and the arm is back", near(world(host.total()), HOME))


def open_exchange(host, robot):
    """The unsolicited SP waits until an open exchange has ended."""
    start(host, robot, 5)
    host.text(b"SU\r")
    data = host.reply()
    true("SU is answered while the program runs", b"STATUS:running" in data, data)
    equal("no SP inside the open exchange", b"", host.silence(0.8))
    host.text(b"OK\r")
    cycle_end(host, "the exchange has been closed")


def cancelled_input(host, robot):
    """SP cancels a waiting INPUT; RS,PRG starts anew with the data of the file."""
    start(host, robot, 6)
    robot.raw(b"5\r")
    equal("INPUT waits for the second value", b"", robot.silence(0.1))
    host.command(b"SP")
    equal("SP while INPUT waits: stop (continue)", "stop(continue)", host.status()["STATUS"])
    host.command(b"RN")
    equal("the INPUT was cancelled, what it had not got is 0",
          b"CANCELLED" + block(5) + block(0) + block(11) + CR, robot.until(CR))
    cycle_end(host, "it ends")
    host.command(b"RN")
    equal("it runs again", b"READY\r", robot.until(CR))
    host.command(b"SP")
    host.command(b"RS,PRG")
    equal("RS,PRG gives stop (reset)", RESET, host.total()[2])
    equal("and the data of the file", b"10\r", host.file(b"MR,COUNT 0"))
    start(host, robot, 99)
    equal("RN after RS,PRG begins at step 1", b"UNKNOWN" + block(99) + CR, robot.until(CR))
    cycle_end(host, "it ends")


def variables(host):
    """MR and MW of a global, with and without the file."""
    equal("MR of an integer", b"10\r", host.file(b"MR,COUNT 0"))
    equal("MR of a real", b"1.500\r", host.file(b"MR,RATE 1"))
    equal("MR of a position", b"400.000 0.000 200.000 0.000 0.000 0.000 0.000 0.000 0.000\r",
          host.file(b"MR,HOME 4"))
    equal("MR of an unknown name gets NG", b"NG\r", host.ask(b"MR,NOBODY 0"))
    host.command(b"MW,0 COUNT 0 77")
    equal("MW with flag 0 writes the memory", b"77\r", host.file(b"MR,COUNT 0"))
    equal("and not the file", PROGRAM, host.file(b"UL," + NAME))
    host.command(b"RS,STP")
    equal("RS,STP keeps the data", b"77\r", host.file(b"MR,COUNT 0"))
    host.command(b"RS,PRG")
    equal("RS,PRG brings the data of the file", b"10\r", host.file(b"MR,COUNT 0"))
    host.command(b"MW,1 COUNT 0 25")
    equal("MW with flag 1 writes the memory", b"25\r", host.file(b"MR,COUNT 0"))
    equal("and the file, and nothing else in it", PROGRAM.replace(b"COUNT = 10", b"COUNT = 25"),
          host.file(b"UL," + NAME))
    host.command(b"RS,PRG")
    equal("which RS,PRG brings back", b"25\r", host.file(b"MR,COUNT 0"))
    equal("MW with a bad flag gets NG", b"NG\r", host.ask(b"MW,2 COUNT 0 1"))


def direct(host):
    """DO: OK before the motion ends, motion status 1 until it has, override and outputs."""
    host.command(b"EC,OVRD 40")
    equal("EC,OVRD shows in SU", "40%", host.status()["OVRD"])
    asked = time.monotonic()
    equal("DO,MOVE gets OK", b"OK\r", host.ask(b"DO,MOVE POINT(400,200,50) WITH SPEED=20"))
    true("at once", time.monotonic() - asked < 0.2)
    body = host.total()
    equal("before the motion ends: motion status 1", RUNNING, body[2])
    true("and the arm is not there", not near(world(body), FAR), repr(world(body)))
    equal("a second DO meanwhile gets NG", b"NG\r", host.ask(b"DO,MOVE POINT(400,0,200)"))
    body = settle(host, "the DO motion")
    true("when the status leaves 1 the arm is there", near(world(body), FAR), repr(world(body)))
    host.command(b"EC,OVRD 100")
    equal("DO of no statement gets NG", b"NG\r", host.ask(b"DO,XYZZY 1"))
    equal("the end of a DO sends no SP", b"", host.silence(0.1))
    host.command(b"DO,MOVE POINT(400,0,200) WITH SPEED=5")
    host.total()
    host.command(b"EC,BREAK")
    body = settle(host, "EC,BREAK")
    true("EC,BREAK leaves the arm on its way", not near(world(body), HOME, 1.0) and not near(world(body), FAR, 0.01),
         repr(world(body)))
    host.command(b"IW,3 1 5 1")
    equal("IW shows in SF", 0b10100, struct.unpack(">H", host.total()[84:86])[0])
    host.command(b"RS,SIG")
    equal("RS,SIG clears it", 0, struct.unpack(">H", host.total()[84:86])[0])


def hold(host, robot):
    """FD holds a program's motion and lets it go on."""
    start(host, robot, 4)
    equal("on the way", b"AT HOME\r", robot.until(CR))
    host.command(b"FD")
    held = [host.total() for _ in range(8)]
    equal("FD shows in SF", 1, struct.unpack(">H", held[-1][32:34])[0])
    true("and the arm stands", world(held[-1]) == world(held[-2]) and not near(world(held[-1]), FAR))
    equal("while the status stays running", RUNNING, held[-1][2])
    host.command(b"FD")
    equal("a second FD lets it go on", b"AT FAR\r", robot.until(CR))
    equal("to the end", b"BACK\r", robot.until(CR))
    cycle_end(host, "it ends")


def rough_hosts(host, ip0, stx):
    """Hosts that send garbage, half a text, half a file, and vanish."""
    rival = Line(ip0)
    true("a second connection is closed at once", rival.closed_by_peer(2.0))
    rival.close()
    equal("and the first one still works", "stop(reset)", host.status()["STATUS"])
    host.close()
    for what, data in (("garbage", bytes(range(0x80, 0x100)) + b"\x00\x01garbage"),
                       ("half a text", b"SU"), ("half a text with STX", STX + b"SF\r"),
                       ("an over-long text", STX + b"x" * 5000)):
        rough = Host(again(ip0), stx)
        rough.raw(data)
        rough.close()
        host = Host(again(ip0), stx)
        true("%s and a disconnect: the next host is served" % what, "OVRD" in host.status())
        host.close()
    rough = Host(again(ip0), stx)
    half_a_file(rough)
    rough.close()
    host = Host(again(ip0), stx)
    true("and stores nothing", b"HALF" not in directory(host))
    host.right = b"ethernet"
    pieces(host)
    return host


def half_a_file(host):
    """The beginning of a download."""
    host.command(b"DL,HALF")
    host.text(b"FL," + PROGRAM[:250])
    equal("half a download is answered so far", b"OK\r", host.reply())


def rough_line(host):
    """The same on a line that knows no connections: what ends half a text is STX, or ten seconds."""
    for what, data in (("garbage", b"\x00\x01garbage" if host.seven else bytes(range(0x80, 0x100))),
                       ("half a text with STX", STX + b"SF\r"), ("an over-long text", STX + b"x" * 600)):
        host.raw(data)
        if not host.stx:
            time.sleep(10.5)
        true("%s: the next text is served" % what, "OVRD" in host.status())
    half_a_file(host)
    equal("ten seconds without the rest", b"", host.silence(10.5))
    true("end it, and store nothing", b"HALF" not in directory(host))
    pieces(host)
    return host


def pieces(host):
    """Noise, and texts in pieces."""
    if host.stx:
        host.raw(b"XY" + STX + b"S" + STX + b"SU\r" + ETX)
        equal("noise before STX, and a text begun anew: one answer", True, host.reply().startswith(b"FL,MODE:"))
        host.text(b"OK\r")
    for byte in host.stx + b"CA\r" + ETX:
        host.raw(bytes([byte]))
        time.sleep(0.002)
    true("a command in single bytes is answered", host.reply().startswith(b"FL,"))
    host.text(b"OK\r")


def again(address):
    """The address, after a moment in which the controller sees that the last host has gone."""
    time.sleep(0.05)
    return address


def tidy(host):
    """ER, BR, EU, VR."""
    equal("ER of the selected file gets NG", b"NG\r", host.ask(b"ER," + NAME))
    host.command(b"RS,SEL")
    equal("RS,SEL leaves no file selected", "", host.status()["FILE"])
    equal("RN without a file gets NG", b"NG\r", host.ask(b"RN"))
    equal("ER gets OK", b"OK\r", host.ask(b"ER," + NAME))
    true("and the file is gone", NAME not in directory(host))
    equal("ER of a missing file gets NG", b"NG\r", host.ask(b"ER," + NAME))
    equal("EU without errors", b"0\r", host.file(b"EU"))
    version = host.file(b"VR")
    true("VR has its columns", version[10:11] == b" " and version[15:16] == b"-" and version[24:25] == b":"
         or version[11:15].isdigit() and version[15:16] == b"-", version)
    equal("BR gets OK", b"OK\r", host.ask(b"BR"))
    equal("SF shows servo off", 0, host.total()[0])


def other_modes(binary, stx):
    """What the key switch and the control right forbid."""
    for flags, mode in ((("--key-switch", "teaching"), "teaching/cycle"), (("--key-switch", "internal"), "internal/cycle"),
                        (("--control-right", "sig"), "external(sig)/cycle"),
                        (("--control-right", "rs232c"), "external(host)/cycle")):
        with Emulator(binary, *flags) as emulator:
            host = Host(emulator.address("ip0"), stx)
            equal("SU in %s" % mode, mode, host.status()["MODE"])
            for command in (b"RN", b"SO", b"RS,STP", b"SL,DEMO", b"EC,OVRD 50", b"IW,1 1", b"DO,DOUT(1)"):
                if host.ask(command) != b"NG\r":
                    raise Failed("%s gets NG in %s\n     found    OK" % (command.decode(), mode))
            ok("RN SO RS SL EC IW DO get NG in %s" % mode)
            equal("SP gets OK in %s" % mode, b"OK\r", host.ask(b"SP"))
            host.close()


class Cell:
    """The ways between host and robot that the command line asks for, and the flags and files they need."""

    def __init__(self, arguments):
        self.host, self.talk = arguments.commands, arguments.talk
        self.settings = Settings(arguments.speed, arguments.frame)
        self.com1 = Settings(min(arguments.speed, 38400), arguments.frame)
        self.folder = tempfile.mkdtemp(prefix="ts3100-cell-")
        self.listener = Listener() if self.talk == "ip2" else None
        self.channel = self.talk.partition("-")[0].upper().encode()
        self.flags = ["--drive", self.folder, *self.serial_flags()]

    def serial_flags(self):
        """What `serve` is asked for."""
        if self.host != "ip0":
            yield from ("--control-right", "rs232c")
        if "terminal" in (self.host, self.talk.partition("-")[2]):
            yield from ("--serial-dir", self.folder + ".lines")
        if self.host == "rfc2217":
            yield from ("--serial-host-rfc2217", "127.0.0.1:0")
        if self.talk == "com1-rfc2217":
            yield from ("--serial-com1-rfc2217", "127.0.0.1:0")

    def set_parameters(self, binary):
        """[U06], and IP2 as a client, written by a host of before."""
        with Emulator(binary, "--drive", self.folder) as emulator:
            host = Host(emulator.address("ip0"), True)
            user = host.file(b"UL,USER.PAR")
            for name, settings in ((b"{HOST}", self.settings), (b"{COM1}", self.com1)):
                user = user.replace(name + b" = 9600 8 0 1", name + b" = " + settings.parameter())
            host.download(b"USER.PAR", user)
            if self.listener:
                host.download(b"ETHERNET.PAR", self.client(host.file(b"UL,ETHERNET.PAR")))

    def client(self, file):
        """ETHERNET.PAR with IP2 as a client of this process."""
        lines = file.decode("ascii").replace("\r", "\n").split("\n")
        section = ""
        for at, line in enumerate(lines):
            section = line[:5] if line.startswith("[") else section
            if section == "[E00]" and line.startswith("="):
                lines[at] = "= 1 1 2 1"
            if line.startswith("{IP2}"):
                lines[at] = {"[E06]": "{IP2} = %d" % self.listener.port, "[E07]": "{IP2} = 127.0.0.1"}.get(section, line)
        return "\n".join(lines).encode("ascii")

    def host_way(self, emulator):
        """The way of the host's commands."""
        if self.host == "ip0":
            return emulator.address("ip0")
        return self.serial(emulator, "host", self.host, self.settings)

    def program_way(self, emulator):
        """The way of the program's words."""
        if self.listener:
            return self.listener.accept()
        channel, _, kind = self.talk.partition("-")
        return emulator.address(channel) if not kind else self.serial(emulator, channel, kind, self.com1)

    def serial(self, emulator, port, kind, settings):
        """A serial line of either kind."""
        if kind == "terminal":
            return Terminal(os.path.join(self.folder + ".lines", port), settings)
        return Remote(split(emulator.ready["serial"][port].partition("//")[2]), settings)

    def remove(self):
        """The folders it made."""
        for folder in (self.folder, self.folder + ".lines"):
            shutil.rmtree(folder, ignore_errors=True)


def whole_day(host, robot, rough):
    """Everything, in the order of the day. `rough` ends it; the host it leaves behind tidies up."""
    texts(host)
    download(host)
    servo_and_selection(host)
    for part in (formats, dialogue, buffer_reset, stop_and_go_on, open_exchange, cancelled_input, hold):
        part(host, robot)
    host.command(b"RS,PRG")
    variables(host)
    direct(host)
    host.command(b"RS,PRG")
    host = rough(host)
    tidy(host)
    host.close()
    robot.close()


def in_a_cell(arguments):
    """The day over the ways that the command line asks for."""
    global PROGRAM
    cell = Cell(arguments)
    PROGRAM = PROGRAM.replace(b"IP1", cell.channel)
    try:
        cell.set_parameters(arguments.serve)
        with Emulator(arguments.serve, *cell.flags) as emulator:
            robot = Line(cell.program_way(emulator))
            host = Host(cell.host_way(emulator), arguments.stx)
            host.right = b"ethernet" if cell.host == "ip0" else b"host"
            host.seven = cell.settings.bits == 7
            address = emulator.address("ip0")
            whole_day(host, robot, (lambda host: rough_hosts(host, address, arguments.stx)) if cell.host == "ip0"
                      else rough_line)
    finally:
        cell.remove()


def main():
    parser = options("The whole day of a host.")
    parser.add_argument("--commands", choices=("ip0", "terminal", "rfc2217"), default="ip0",
                        help="the way of the commands: IP0 (default), or HOST as a terminal or behind RFC 2217")
    parser.add_argument("--talk", choices=("ip1", "ip2", "com1-terminal", "com1-rfc2217"), default="ip1",
                        help="the way of the program's words; ip2 is dialled by the robot (default ip1)")
    parser.add_argument("--speed", type=int, default=9600, help="of the serial lines, COM1 at most 38400")
    parser.add_argument("--frame", default="8N1", help="data bits, parity, stop bits (default 8N1)")
    arguments = parser.parse_args()
    if (arguments.commands, arguments.talk) != ("ip0", "ip1"):
        return program(in_a_cell, arguments)

    def job(ip0, ip1):
        host, robot = Host(ip0, arguments.stx), Line(ip1)
        host.right = b"ethernet"
        whole_day(host, robot, lambda host: rough_hosts(host, ip0, arguments.stx))
        if arguments.serve:
            other_modes(arguments.serve, arguments.stx)

    return run(job, arguments)


if __name__ == "__main__":
    sys.exit(main())
