#!/usr/bin/env python3
"""A gateway between a six-axis robot and a web page (hosts.md 9.1, client I): texts without STX and without ETX, which
CR alone ends; one connection for good; a step every 500 ms: a pause, SF, AC if the last SF showed an alarm, SU; `OK` and
CR 50 ms after whatever has come. It reads SF by its bytes, SU by its blanks and colons, AC by its commas.

The original only looks. This one also makes an alarm, to have one to read, and resets it.

    python3 tests/system/hosts/gateway.py --serve target/release/ts3100"""

import os
import re
import struct
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import options, run  # noqa: E402
from steps import Failed, equal, ok, true  # noqa: E402
from wire import CR, EOF, ETX, Line  # noqa: E402

STEP, ACKNOWLEDGE = 0.5, 0.05
# Bytes of an answer to SF: FL and a comma before the body, EOF and ETX after it.
SF_ANSWER = 3 + 276 + 2
ROUNDS = 3
COORDINATES = ("JOINT", "TOOL", "WORK", "WORLD")
RATES = ("LOW", "MEDIUM", "HIGH")
GUIDES = ("JOG", "INCHING", "FREE")
MODES = ("TEACHING", "INTERNAL", "EXT(SIG)", "EXT(HOST)")
ITEMS = ["MODE", "FILE", "OVRD", "LSPEED", "MACHINE", "STATUS"]
DATE = re.compile(r"20\d\d-\d\d-\d\d \d\d:\d\d:\d\d")


class Total:
    """What the gateway takes from an answer to SF; the numbers are bytes of the answer."""

    def __init__(self, answer):
        def word(at):
            return struct.unpack(">H", answer[at:at + 2])[0]

        self.servo, self.emergency = answer[3], answer[4]
        self.lines, self.tasks = (word(27), word(29)), (word(31), word(33))
        self.feed_hold = word(35)
        self.coordinates, self.rate = COORDINATES[answer[38]], RATES[answer[40]]
        self.guide, self.mode = GUIDES[answer[42]], MODES[answer[44]]
        self.inputs = struct.unpack(">12H", answer[55:79])
        self.outputs = struct.unpack(">12H", answer[87:111])
        self.alarm = answer[109] >> 5 & 1
        places = struct.unpack(">24f", answer[119:215])
        self.joints, self.world, self.work = places[:8], places[8:16], places[16:]


class Gateway:
    """The one connection and its steps."""

    def __init__(self, address):
        self.line = Line(address)
        self.alarm = False

    def acknowledge(self):
        """OK, 50 ms after an answer; it gets none itself."""
        time.sleep(ACKNOWLEDGE)
        self.line.raw(b"OK" + CR)
        extra = self.line.silence(STEP - ACKNOWLEDGE)
        if extra:
            raise Failed("OK gets no answer\n     found    %r" % extra)

    def text(self, command):
        """A command that CR alone ends, and its answer of characters: the content between `FL,` and EOF."""
        self.line.raw(command + CR)
        answer = self.line.until(ETX)
        self.acknowledge()
        if not answer.startswith(b"FL,") or not answer.endswith(EOF + ETX):
            raise Failed("%s: FL, first and EOF, ETX last\n     found    %r" % (command.decode(), answer))
        return answer[3:-2].decode("ascii")

    def order(self, command):
        """A command that is answered by OK."""
        self.line.raw(command + CR)
        equal("%s: OK" % command.decode(), b"OK" + CR + ETX, self.line.until(ETX))
        self.acknowledge()

    def total(self):
        """SF."""
        self.line.raw(b"SF" + CR)
        answer = self.line.count(SF_ANSWER)
        self.acknowledge()
        if not answer.startswith(b"FL,") or not answer.endswith(EOF + ETX):
            raise Failed("SF: FL, first and EOF, ETX last\n     found    %s" % answer.hex(" "))
        total = Total(answer)
        self.alarm = total.alarm == 1
        return total

    def status(self):
        """SU: names and values, cut at each blank and each colon."""
        words = re.split("[ :]", self.text(b"SU"))
        return dict(zip(words[::2], words[1::2]))

    def alarms(self):
        """AC: code, message and date of each record; a CR counts as a comma."""
        words = self.text(b"AC").replace("\r", ",").split(",")
        count = int(words.pop(0))
        records = [tuple(words[at:at + 3]) for at in range(0, 3 * count, 3)]
        if [word for word in words[3 * count:] if word]:
            raise Failed("AC has as many records as it says\n     found    %r" % words)
        return records

    def round(self):
        """The steps; SF, SU and the alarms."""
        time.sleep(STEP)
        total = self.total()
        alarms = self.alarms() if self.alarm else []
        return total, self.status(), alarms


def job(ip0, _ip1):
    gateway = Gateway(ip0)
    for number in range(1, ROUNDS + 1):
        total, status, _ = gateway.round()
        equal("round %d: the items of SU" % number, ITEMS, list(status))
    equal("SU: one word for each mode", "external(ethernet)/cycle", status["MODE"])
    equal("SU: the status", "stop(reset)", status["STATUS"])
    equal("SF: servo, emergency stop, alarm", (0, 0, 0), (total.servo, total.emergency, total.alarm))
    equal("SF: the guide", ("JOINT", "LOW", "JOG"), (total.coordinates, total.rate, total.guide))
    equal("SF: the master mode", "EXT(HOST)", total.mode)
    equal("SF: no feed hold", 0, total.feed_hold)
    true("SF: the tool point is somewhere", any(total.world) and total.world == total.work, total.world)

    gateway.order(b"SO")
    total, _, _ = gateway.round()
    equal("SF: servo", 1, total.servo)
    gateway.order(b"DO,MOVE POINT(9000,0,0,0,0,0)")
    gateway.total()
    total, status, alarms = gateway.round()
    equal("SF: a point out of reach is an alarm", 1, total.alarm)
    equal("AC: one record", 1, len(alarms))
    code, message, date = alarms[0]
    true("AC: a code of seven characters", re.fullmatch(r"\d{3}-\d{3}", code), code)
    true("AC: a message", message != "", message)
    true("AC: date and time", DATE.fullmatch(date), date)
    gateway.order(b"RS,ERR")
    total, _, alarms = gateway.round()
    equal("RS,ERR: no alarm, so AC is not asked", (0, []), (total.alarm, alarms))
    equal("AC: no record", [], gateway.alarms())
    ok("one connection from first to last")
    gateway.line.close()


def main():
    arguments = options("A gateway that ends its texts by CR alone.").parse_args()
    return run(job, arguments)


if __name__ == "__main__":
    sys.exit(main())
