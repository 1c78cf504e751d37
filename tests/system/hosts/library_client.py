#!/usr/bin/env python3
"""A host in the way of the vendor's .NET client library (hosts.md 1, 2, 7, 8): texts without STX both ways, or with it,
SM and VR on connecting, the watchdog fed by SM every 300 ms, replies taken and files cut as the library does, SF and IO
read by their fixed length, moves ended by a change of DC in SM. What the library would throw at is a failure here.

    python3 tests/system/hosts/library_client.py --serve target/release/ts3100 [--model six-axis|scara]"""

import datetime
import os
import struct
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import options, run  # noqa: E402
from steps import Failed, equal, ok, show, true  # noqa: E402
from wire import CR, EOF, ETX, STX, Line  # noqa: E402

STATUS_TIMEOUT, OK_TIMEOUT = 0.5, 5.0
FEED = 0.3
FIRST_BLOCK, NEXT_BLOCK = 226, 225
MOTION_LIMIT = 20.0
# DS has to be seen so soon, or the library throws MoveTimeout (hosts.md 8.1).
UNDER_WAY = 0.2
# Moves in a row at each interval of the watchdog: DC passes from 9 to 0.
INTERVALS = (0.1, 0.5, 1.0)
MOVES_IN_A_ROW, CYCLES, LINES = 12, 40, 200
# With --short, where each answer takes its time.
SHORT = (2, 4, 10)

PROGRAM = b"""GLOBAL
N1 = 12
R1 = 1.5
DIM K1(2) AS INTEGER
END
PROGRAM TEST
  ' A remark that makes the file long enough to travel in three texts, cut in the middle of lines.
  ' A remark that makes the file long enough to travel in three texts, cut in the middle of lines.
  ' A remark that makes the file long enough to travel in three texts, cut in the middle of lines.
  ' A remark that makes the file long enough to travel in three texts, cut in the middle of lines.
  WAIT DIN(1)
  N1 = N1 + 1
  DELAY 0.5
  DOUT(2)
END
DATA
%s
END
"""
DATA = {
    "six-axis": b"""  POINT A1=300,100,250,0,0,0,0,0/11211
  TRANS T1=10,20,30,0,0,90
  TRANS WK1=100,0,0,0,0,0
  PAYLOAD P1=1.5,0,0,50,0,0,0""",
    "scara": b"""  POINT A1=250,100,-20,45,0/LEFTY
  TRANS T1=10,20,30,90
  TRANS WK1=100,0,0,0
  PAYLOAD P1=1.5,20""",
}


class Library:
    """The library's object: one socket, one request at a time, SM whenever its interval has gone."""

    def __init__(self, address, stx, counts):
        self.line = Line(address)
        self.moves_in_a_row, self.cycles, self.turns = counts
        self.stx = STX if stx else b""
        self.feeding = False
        self.interval = FEED
        self.fed = time.monotonic()

    def send(self, request):
        """One text in one send; the reply to it is what comes next."""
        if self.feeding and time.monotonic() - self.fed > self.interval:
            self.feed()
        if self.line.more(0.0) or self.line.kept:
            raise Failed("nothing comes unasked, not even SP\n     found    %s" % show(self.line.kept))
        self.line.raw(self.stx + request + CR + ETX)

    def text(self, timeout):
        """A reply up to ETX."""
        data = self.line.until(ETX, timeout)
        if data[:1] == STX != self.stx or not data.startswith(self.stx):
            raise Failed("a reply in the framing of the request\n     found    %s" % show(data))
        return data[len(self.stx):]

    def acknowledge(self):
        self.line.raw(self.stx + b"OK\r" + ETX)

    def order(self, request):
        """A request that is answered OK: only the first two letters count."""
        self.send(request)
        reply = self.text(OK_TIMEOUT)
        if reply[:2] != b"OK":
            raise Failed("%s is answered OK\n     found    %s" % (request.decode(), show(reply)))

    def refused(self, request):
        """A request that makes the library throw ControllerNG."""
        self.send(request)
        equal("%s: ControllerNG" % request.decode(), b"NG", self.text(OK_TIMEOUT)[:2])

    def raw_file(self, request, timeout=STATUS_TIMEOUT):
        """An FL: every text acknowledged until one holds EOF; what the library keeps, EOF and all."""
        self.send(request)
        content = b""
        while EOF not in content:
            text = self.text(timeout)
            if not content and text[:3] != b"FL,":
                raise Failed("%s is answered FL\n     found    %s" % (request.decode(), show(text)))
            content += text[3 if not content else 0:-1]
            self.acknowledge()
        return content

    def file(self, request):
        """Text of an FL; a CR in front of the EOF is no part of it."""
        content = self.raw_file(request)
        return content[:content.index(EOF)].decode("ascii")

    def fixed(self, request, length):
        """An FL read by its length, binary."""
        self.send(request)
        data = self.line.count(len(self.stx) + length, STATUS_TIMEOUT)[len(self.stx):]
        if data[:3] != b"FL," or data[-1:] != ETX:
            raise Failed("%s is %d bytes from FL to ETX\n     found    %s" % (request.decode(), length, show(data)))
        self.acknowledge()
        return data

    def feed(self):
        """SM,1 by position, labels cut off."""
        self.fed = time.monotonic()
        items = self.file(b"SM,1").split(" ")
        names = ["EE", "SE", "SC", "BC", "ES", "SS", "SV", "MM", "RM", "RS", "OV", "AL", "DC", "DS"]
        return dict(zip(names, (int(item[2:]) for item in items)))

    def pause(self, seconds):
        """Time passes for the caller; the watchdog is fed all the same."""
        limit = time.monotonic() + seconds
        while time.monotonic() < limit:
            if self.feeding and time.monotonic() - self.fed > self.interval:
                self.feed()
            time.sleep(0.01)

    def connect(self):
        state = self.feed()
        record = self.file(b"VR").split("\r")[0]
        date = datetime.datetime.strptime(record[11:27], "%Y-%m-%d %H:%M")
        true("VR: a name in nine columns, a date, a checksum",
             record[:9].strip() == "TS3100" and date.year > 2000 and len(record[-4:].strip()) == 4, record)
        return state

    def motion(self, statement, quiet=False):
        """Move: the DO, then SM until DC is another one, as the library waits; DS has to show early."""
        before = self.feed()["DC"]
        self.order(b"DO," + statement)
        begun = time.monotonic()
        seen = []
        while time.monotonic() < begun + MOTION_LIMIT:
            # A status says what was when it was asked for, however long it takes beside other work.
            asked = time.monotonic()
            state = self.feed()
            seen.append((state["DC"], state["DS"]))
            if (before, 1) not in seen and asked - begun > UNDER_WAY:
                raise Failed("%s: DS1 within %.1f s\n     found    %s" % (statement.decode(), UNDER_WAY, seen))
            if state["DC"] != before:
                if state["DC"] != (before + 1) % 10:
                    raise Failed("DC counts on from %d\n     found    %d" % (before, state["DC"]))
                if not quiet:
                    ok("%s: DS, then another DC" % statement.decode()[:60])
                return
            time.sleep(0.03)
        raise Failed("%s: DC changes within %d s\n     found    %s" % (statement.decode(), MOTION_LIMIT, seen[-3:]))

    def lines(self):
        """GetDIO: eighty bytes and nothing behind them."""
        return struct.unpack(">40H", self.fixed(b"IO,1", 3 + 80 + 1)[3:83])

    def floats(self, request):
        return [float(item) for item in self.file(request).split(",")]

    def values(self, name, kind):
        return [float(item) for item in self.file(b"MR,%s %d" % (name, kind)).split()]


def word(value, known):
    """The library's look-up: case does not count, what it does not know is 0."""
    return known.get(value.lower(), 0)


def get_status(text):
    """SU exactly as the library takes it (hosts.md 7.1), its quirks included."""
    fields = []
    for item, label in zip(text.split(" "), ("MODE:", "FILE:", "OVRD:", "LSPEED:", "MACHINE:", "STATUS:")):
        fields.append(item[item.index(label):])
    mode, _, run_mode = fields[0][len("MODE:"):].partition("/")
    override = fields[2][len("OVRD:"):]
    return {
        "master": word(mode, {"internal": 1, "external(sig)": 2, "external(host)": 4, "external(ethernet)": 5}),
        "run_mode": word(run_mode, {"continuous": 0, "cycle": 1, "step": 2, "segment": 3}),
        "file": fields[1],
        "override": int(override[:-1]) if override.endswith("%") else 0,
        "lock": word(fields[4][len("MACHINE:"):], {"free": 0, "lock": 1}),
        "status": word(fields[5][len("STATUS:"):], {"running": 1, "stop(retry)": 2, "stop(continue)": 3}),
    }


def alarms(text):
    """AC and AH (hosts.md 7.2): the count and a comma before the first record, records behind CR."""
    count, _, rest = text.partition(",")
    if not rest:
        return []
    found = []
    for record in rest.split("\r"):
        if record:
            number, message, at = record.split(",")
            # The library reads years of two and of four digits.
            year = "%y" if at[2:3] == "-" else "%Y"
            datetime.datetime.strptime(at, year + "-%m-%d %H:%M:%S")
            found.append((number, message))
    equal("the count is that of the records", int(count), len(found))
    return found


def directory(text):
    """GetDir: one blank between name and size; with more the size would read 0."""
    found = {}
    for record in text.split("\r"):
        if record:
            words = record.split(" ")
            found[words[0]] = int(words[1]) if len(words) > 1 and words[1] else 0
    return found


def files(robot, program):
    """SendFile, ReceiveFile, GetDir, DeleteFile."""
    robot.order(b"DL,TEST")
    whole = program.replace(b"\r\n", b"\n")
    robot.line.raw(robot.stx + b"FL," + whole[:FIRST_BLOCK] + ETX)
    at, texts = FIRST_BLOCK, 1
    while True:
        equal("text %d of DL is answered OK" % texts, b"OK", robot.text(OK_TIMEOUT)[:2])
        if at >= len(whole):
            break
        block = whole[at:at + NEXT_BLOCK]
        at, texts = at + NEXT_BLOCK, texts + 1
        robot.line.raw(robot.stx + block + (EOF if at >= len(whole) else b"") + ETX)
    true("the file went in three texts or more", texts >= 3, texts)
    equal("UL gives the file back, and the EOF", whole + EOF, robot.raw_file(b"UL,TEST"))
    found = directory(robot.file(b"CA"))
    equal("GetDir has the file and its size", len(whole), found.get("TEST"))
    true("GetDir has no file of size 0", 0 not in found.values(), found)
    robot.order(b"DL,GONE")
    robot.line.raw(robot.stx + b"FL,PROGRAM GONE\nEND\n" + EOF + ETX)
    equal("a short file goes in one text", b"OK", robot.text(OK_TIMEOUT)[:2])
    robot.order(b"ER,GONE")
    true("DeleteFile: gone", "GONE" not in directory(robot.file(b"CA")))
    robot.refused(b"UL,GONE")


def status(robot, model):
    """GetStatus, GetStatusAll, the alarms, the lines."""
    equal("GetStatus", {"master": 5, "run_mode": 1, "file": "FILE:TEST", "override": 100, "lock": 0, "status": 0},
          get_status(robot.file(b"SU")))
    robot.order(b"EC,OVRD 55")
    for name, number in ((b"CONT", 0), (b"SEGMENT", 3), (b"STEP", 2), (b"CYCLE", 1)):
        robot.order(b"EC,MODE " + name)
        found = get_status(robot.file(b"SU"))
        equal("SetRunMode %s: GetStatus" % name.decode(), (number, 55), (found["run_mode"], found["override"]))
    length, joints, world = (281, 8, 148) if model == "six-axis" else (254, 6, 140)
    data = robot.fixed(b"SF", length)
    body = data[3:]
    equal("GetStatusAll: servo, emergency, no alarm", (1, 0, [-1] * 10),
          (body[0], body[1], list(struct.unpack(">10h", body[4:24]))))
    group = [round(value, 3) for value in struct.unpack(">%df" % joints, body[116:116 + 4 * joints])]
    axes = robot.floats(b"PR,0")
    true("GetStatusAll: the joints are those of PR,0", all(abs(a - b) < 0.002 for a, b in zip(group, axes)), group)
    place = struct.unpack(">3f", body[world:world + 12])
    there = robot.floats(b"PR,1")
    true("and the world is that of PR,1", all(abs(a - b) < 0.002 for a, b in zip(place, there)), place)
    equal("GetCurrentAlarm: none", [], alarms(robot.file(b"AC")))
    alarms(robot.file(b"AH"))
    robot.order(b"IW,3 1")
    robot.order(b"HO,9 8 165")
    equal("GetDout: output 3 and byte 9", 4 | 165 << 8, robot.lines()[20])
    for turn in range(robot.turns):
        if robot.lines()[20] != 4 | 165 << 8:
            raise Failed("GetDIO is right each time\n     found    another word in turn %d" % turn)
        if turn % 20 == 0:
            get_status(robot.file(b"SU"))
            robot.fixed(b"SF", length)
    ok("%d GetDIO in a row, mixed with GetStatus and GetStatusAll" % robot.turns)
    for count in (8, 20, 32):
        equal("GetHexIn of %d lines" % count, 0, int(robot.file(b"HI,1 %d" % count)))
    for request in (b"MD,1", b"RT,0", b"SC,0", b"JG,1 +", b"JG,1 !", b"MD,0"):
        robot.order(request)


def positions(robot, model):
    """PR, VL."""
    for number in range(6):
        found = robot.floats(b"PR,%d" % number)
        least = 5 if number in (0, 3) else 9 if model == "six-axis" else 7
        true("PR,%d has %d items" % (number, least), len(found) >= least, found)
    # JG has moved the arm just now, the longer the busier this machine is: it may be slowing down.
    moving, limit = True, time.monotonic() + 5
    while moving and time.monotonic() < limit:
        moving = any(robot.floats(b"VL,0")) or any(robot.floats(b"VL,1"))
    true("VL,0 and VL,1 rest", not moving)


def globals_of(robot, model):
    """The five types, read, set, and read again; the numbers the library writes."""
    six = model == "six-axis"
    point = "300.000 100.000 250.000 0.000 0.000 10.000 0.000 0.000 11211" if six else \
        "260.000 -90.250 -13.000 4.123 5.000 2"
    for name, kind, value in (
            ("N1", 0, "42"), ("R1", 1, "3.142"),
            ("P1", 2, "1.500 0.000 0.000 20.000 1.000 2.000 3.000" if six else "1.500 20.000"),
            ("T1", 3, "1.000 2.000 3.000 4.000 5.000 6.000" if six else "1.000 2.000 3.000 4.000"),
            ("A1", 4, point)):
        before = robot.values(name.encode(), kind)
        equal("MR,%s %d: as many items as MW writes" % (name, kind), len(value.split()), len(before))
        robot.order(b"MW,0 %s %d %s" % (name.encode(), kind, value.encode()))
        equal("MW and MR of %s" % name, [float(item) for item in value.split()], robot.values(name.encode(), kind))
    true("an integer has no decimal point", "." not in robot.file(b"MR,N1 0"))
    robot.refused(b"MR,NOTHERE 0")


def moves(robot, model):
    """Move, Moves, Movea, SetPayload, SetTransWork, SetTransTool: ended by SM."""
    six = model == "six-axis"
    with_ = b" with SPEED=50.000,ACCEL=100.000,DECEL=100.000"
    first = b"300.000,100.500,250.000,0.000,0.000,0.000,0.000,0.000,LANSS" if six else \
        b"300.000,100.500,-20.123,45.000,0.000,2"
    other = b"320.000,80.000,240.000,0.000,0.000,0.000,0.000,0.000,LANSS" if six else \
        b"320.000,80.000,-20.000,45.000,0.000,2"
    robot.motion(b"MOVE POINT(" + first + b")" + with_)
    expected = [float(item) for item in first.split(b",")[:3]]
    equal("Move: there", expected, robot.floats(b"PR,4")[:3])
    robot.motion(b"MOVES POINT(" + other + b")" + with_)
    equal("Moves: there", [float(item) for item in other.split(b",")[:3]], robot.floats(b"PR,4")[:3])
    robot.motion(b"MOVES POINT(" + other + b")" + with_)
    ok("a move of no length ends as well")
    robot.motion(b"MOVE POINT(" + first + b")" + with_ + b",Config=" +
                 (b"{Lefty,Above,Nflip,Single4,Single6}" if six else b"1"))
    robot.motion(b"MOVEA %d,12.500" % (6 if six else 3) + with_)
    equal("Movea: the axis is there", 12.5, robot.floats(b"PR,3")[5 if six else 2])
    robot.order(b"DO,PAYLOAD={1.500,0.000,0.000,20.000,0.000,0.000,0.000}" if six else b"DO,PAYLOAD={1.500,20.000}")
    robot.order(b"ZS,1 WK1 1.000 2.000 3.000 4.000" + (b" 5.000 6.000" if six else b""))
    true("the name is a coordinate", len(robot.values(b"WK1", 3)) == (6 if six else 4))
    robot.order(b"ZS,2 TL1 0.000 0.000 5.000 0.000" + (b" 0.000 0.000" if six else b""))
    robot.order(b"RS,PRG")


def many_moves(robot, model):
    """Moves in a row at each interval of the watchdog: each ends where it should, none is refused."""
    six = model == "six-axis"
    for interval in INTERVALS:
        robot.interval = interval
        for turn in range(robot.moves_in_a_row):
            x = 300 + turn % 2 * 12
            rest = b"100.500,250.000,0.000,0.000,0.000,0.000,0.000,xxxxx" if six else b"100.500,-20.123,45.000,0.000,2"
            robot.motion(b"%s POINT(%d.000,%s) with SPEED=100.000,ACCEL=100.000,DECEL=100.000"
                         % (b"MOVES" if turn % 3 else b"MOVE", x, rest), quiet=True)
            place = robot.floats(b"PR,4")
            if place[:2] != [x, 100.5]:
                raise Failed("Move %d ends where it should\n     found    %s" % (turn, place))
        ok("%d Moves in a row at an interval of %.1f s" % (robot.moves_in_a_row, interval))
    robot.interval = FEED
    # Out of reach: accepted, never under way, not counted; the next one is served after a reset.
    before = robot.feed()["DC"]
    robot.order(b"DO,MOVE POINT(1900.000,0.000,0.000,0.000) with SPEED=50.000,ACCEL=100.000,DECEL=100.000")
    limit = time.monotonic() + 0.5
    while time.monotonic() < limit:
        state = robot.feed()
        if (state["DC"], state["DS"]) != (before, 0):
            raise Failed("a Move out of reach leaves DC and DS alone\n     found    %s" % state)
    equal("out of reach: an alarm of level 8", 8, state["AL"])
    robot.order(b"RS,ERR")
    robot.order(b"SO")
    # Cut short: the library waits for DC, whatever else SM says.
    robot.order(b"DO,MOVEA 1,0.000 with SPEED=1.000,ACCEL=100.000,DECEL=100.000")
    robot.pause(0.3)
    equal("a slow move is under way", (before, 1), (robot.feed()["DC"], robot.feed()["DS"]))
    robot.order(b"EC,BREAK")
    robot.pause(0.5)
    equal("EC,BREAK ends it, and it counts", ((before + 1) % 10, 0), (robot.feed()["DC"], robot.feed()["DS"]))


def cycles(robot):
    """Hard polling over ends of cycles: the robot's own SP never falls between two texts."""
    robot.order(b"DL,SHORT")
    robot.line.raw(robot.stx + b"FL,PROGRAM SHORT\nDELAY 0.05\nEND\n" + EOF + ETX)
    equal("the short program is stored", b"OK", robot.text(OK_TIMEOUT)[:2])
    robot.order(b"SL,SHORT")
    for turn in range(robot.cycles):
        robot.order(b"RN")
        polls = 0
        while robot.feed()["RS"] == 1:
            robot.file((b"SU", b"PR,1", b"AC")[polls % 3])
            polls += 1
        robot.pause(0.02 * (turn % 4))
    ok("%d ends of cycles without an SP" % robot.cycles)
    robot.order(b"SL,TEST")


def programs(robot):
    """ProgramSelect, ProgramRun, ProgramStop, ProgramBreak, the resets."""
    for request in (b"RS,PRG", b"RS,STP", b"RS,SIG", b"RS,ERR", b"RN"):
        robot.order(request)
    robot.pause(0.1)
    equal("ProgramRun: running", 1, get_status(robot.file(b"SU"))["status"])
    robot.refused(b"DO,MOVEA 1,0.000 with SPEED=50.000,ACCEL=100.000,DECEL=100.000")
    robot.order(b"SP")
    robot.pause(0.1)
    equal("ProgramStop: stop (continue)", 3, get_status(robot.file(b"SU"))["status"])
    robot.order(b"RN")
    robot.order(b"EC,BREAK")
    robot.pause(0.1)
    equal("ProgramBreak: stop (retry)", 2, get_status(robot.file(b"SU"))["status"])
    robot.order(b"RN")
    robot.pause(1.0)
    equal("at END: stop (reset)", 0, get_status(robot.file(b"SU"))["status"])
    true("and SM says the same", robot.feed()["RS"] == 0)
    robot.refused(b"SL,NOTHERE")


def job_of(model, stx, counts):
    """The whole job of a host for one arm in one framing."""
    program = PROGRAM % DATA[model]

    def job(ip0, _ip1):
        robot = Library(ip0, stx, counts)
        state = robot.connect()
        equal("SM: EXT (ETHER), cycle, stop, 100 %", (5, 1, 0, 100),
              (state["MM"], state["RM"], state["RS"], state["OV"]))
        robot.order(b"SO")
        files(robot, program.replace(b"\n", b"\r\n"))
        robot.order(b"SL,TEST")
        robot.order(b"WD,700 2")
        robot.feeding = True
        status(robot, model)
        robot.order(b"EC,OVRD 100")
        positions(robot, model)
        globals_of(robot, model)
        moves(robot, model)
        many_moves(robot, model)
        programs(robot)
        cycles(robot)
        robot.pause(1.5)
        equal("fed all the time, the watchdog is silent", [], alarms(robot.file(b"AC")))
        robot.feeding = False
        time.sleep(1.0)
        found = [number for number, _ in alarms(robot.file(b"AC"))]
        equal("left alone, it raises its alarm of level 2", ["002-137"], found)
        robot.order(b"RS,ERR")
        equal("ResetALARM: none is left", [], alarms(robot.file(b"AC")))
        true("the history keeps it", len(alarms(robot.file(b"AH"))) >= 1)
        robot.order(b"WD,0 0")
        robot.order(b"BR")
        equal("ServoOff", 0, robot.feed()["SV"])
        robot.line.close()
    return job


def main():
    parser = options("A host in the way of the vendor's client library on IP0.")
    parser.add_argument("--model", choices=sorted(DATA), help="the arm; both, one after the other, if not said")
    parser.add_argument("--short", action="store_true", help="fewer turns of the same")
    arguments = parser.parse_args()
    counts = SHORT if arguments.short else (MOVES_IN_A_ROW, CYCLES, LINES)
    flags = {"six-axis": (), "scara": ("--model", "tsl3000-thl400")}
    for model in [arguments.model] if arguments.model else ["six-axis", "scara"]:
        for stx in (False, True):
            print("-- %s, %s STX" % (model, "with" if stx else "without"), flush=True)
            code = run(job_of(model, stx, counts), arguments, *flags[model])
            if code:
                return code
    return 0


if __name__ == "__main__":
    sys.exit(main())
