"""Alarms of every number that the emulator can raise, by hand: their words in SF, AL of SM, the files of EU, AC and AH, what a
level does to a program that runs, and what is refused while it is active."""

import collections
import datetime
import re
import struct

import alarms
from link import Asking, Case, robots

PROGRAM = "PROGRAM P\nAGAIN:\nDELAY 5\nGOTO AGAIN\nEND\n"
STATUS = ("reset", "running", "retry", "continue")
WORDS = "D6: word = base + code - 1 with base 0, 368, 512, 736; S25: codes beyond a range go on in the second; no alarm is FFFF"
LEVELS = "D6: 8 stops at once, servo off, stop (retry); 4 stops at once, stop (retry); 2 ends the step, stop (continue); 1 warns"
FILES = "D5: AC and AH, count before the first record; EU: EU-01 to EU-06, newest first; T9: dates"
# EU-06: at most 99 are kept.
KEPT = 99


class Cell:
    """A robot and the alarms that it has had."""

    def __init__(self, emulator, arm, dialect, draw):
        self.robot, self.arm, self.dialect, self.draw = emulator.robot, arm, dialect, draw
        self.host = Asking(emulator.address("ip0"))
        self.numbers = [row["number"] for row in self.robot.call("get_alarm_table")]
        self.robot.files["P"] = PROGRAM
        self.ask("SL,P")
        self.active, self.history = [], []

    def ask(self, command):
        return self.host.ask(command)

    def total(self):
        """Alarm words, status and servo as SF shows them."""
        body = self.host.total_status(self.arm, self.dialect)
        return list(struct.unpack(">10H", body[4:24])), STATUS[body[2]], bool(body[0])

    def reset(self):
        """No alarm, servo power on, at step 1."""
        self.ask("RS,PRG")
        self.ask("SO")
        self.active = []

    def raise_one(self, levels=(8, 4, 2, 1)):
        """Raises an alarm that is not active yet."""
        number = self.draw.choice([number for number in self.numbers
                                   if number not in self.active and alarms.parse(number)[0] in levels])
        self.robot.raise_alarm(number)
        moment = datetime.datetime.fromisoformat(self.robot.clock.calendar.replace("Z", "+00:00"))
        self.active.append(number)
        self.history.append((number, moment))
        return number

    def words(self):
        return ([alarms.word(number) for number in self.active] + [alarms.NONE] * 10)[:10]

    def message(self, number, found):
        """The text of an alarm: the list's where it has one, else what the emulator shows."""
        if number in alarms.TEXTS:
            return alarms.TEXTS[number]
        match = re.search(r"(?:^|[,\r])%s,([^,\r]*)," % alarms.printed(number), found)
        return match.group(1) if match else "?"

    def several(self):
        """A set of alarms, and all that shows them."""
        self.reset()
        for _ in range(self.draw.choice((0, 1, 1, 2, 3, 5, 12))):
            self.raise_one()
            self.robot.advance(self.draw.choice((0.25, 1, 61, 3600, 86400)))
        done = "%s, %s dialect, alarms %s" % (self.arm, self.dialect, " ".join(self.active) or "none")
        words, _, servo = self.total()
        yield Case("SF, " + done, self.words(), words, WORDS)
        highest = alarms.highest(self.active)
        yield Case("servo power, " + done, highest != 8, servo, LEVELS)
        if self.active:
            refused = "OK" if highest < 8 else "NG"
            yield Case("SO, " + done, refused, self.ask("SO"), "CMD-SO-02: NG while a level 8 alarm is active")
        history = alarms.history_file([alarms.history_record(*row) for row in reversed(self.history[-KEPT:])])
        yield Case("EU, " + done, history, self.ask("EU"), FILES)
        if self.arm == "scara" or self.dialect == "field":
            yield Case("SM, " + done, "AL%d" % highest, self.ask("SM,1").split(" ")[11], "L15: AL, the level of the alarm that occurs now")
            moments = dict(self.history)
            for command, rows in (("AC", [(number, moments[number]) for number in self.active]), ("AH", self.history)):
                found = self.ask(command)
                if command == "AH" and len(rows) > KEPT:
                    continue
                four_digits = command == "AC" and self.dialect == "field"
                records = [alarms.message_record(number, self.message(number, found), moment, four_digits) for number, moment in rows]
                # In which order is not said.
                yield Case(command + ", " + done, *self.differing(alarms.message_file(records), found), FILES)

    @staticmethod
    def differing(*files):
        """Count, records and what is behind the last CR, of both files; of the records those that only one of them has."""
        parts = [(count, *(rest.rsplit("\r", 1) if "\r" in rest else ("", rest)))
                 for count, _, rest in (content.partition(",") for content in files)]
        records = [collections.Counter(part[1].split("\r")) for part in parts]
        return [(part[0], sorted((mine - other).elements()), part[2])
                for part, mine, other in zip(parts, records, reversed(records))]

    def effect(self):
        """One alarm while a program runs."""
        self.reset()
        started = self.ask("RN")
        number = self.raise_one()
        level = alarms.parse(number)[0]
        done = "%s, %s dialect, %s while a program runs" % (self.arm, self.dialect, number)
        status, servo = alarms.effect(level, "running", True)
        _, *found = self.total()
        yield Case("status and servo, " + done, ["OK", status, servo], [started, *found], LEVELS)
        self.robot.advance(11)
        _, *found = self.total()
        yield Case("status and servo after the step, " + done, ["continue" if level == 2 else status, servo], found, LEVELS)
        if level in (8, 4):
            yield Case("RN, " + done, "NG", self.ask("RN"), "CMD-RN-05: NG while a level 4 or 8 alarm is active")
        self.ask("SP")
        self.robot.advance(11)
        if level in (8, 4, 2, 1):
            yield Case("RS,PRG, " + done, ("OK", self.words()[1:] + [alarms.NONE]), (self.ask("RS,PRG"), self.total()[0]),
                       "D6: reset by RS,PRG")


def cases(binary, draw, count):
    for emulator, arm, dialect in robots(binary):
        cell, left = Cell(emulator, arm, dialect, draw), count // 4
        while left > 0:
            for case in draw.choice((cell.several, cell.effect))():
                left -= 1
                yield case


def plant_canary():
    alarms.BASES[2] = 513
    return "words of level 2 begin at 513"
