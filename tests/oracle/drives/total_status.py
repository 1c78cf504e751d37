"""A walk through the states of a robot: the panel, the lines, host commands and time change it; after every few changes SF, IO
and SU are compared with the facts that the walk has kept."""

import re
import struct

import alarms
import permissions
import total_status
from link import ETX, Asking, Case, Failed, robots, turn

LAYOUT = "our manual, 5.3.3 FL (5), sf-layout.tsv; SCARA: S23; alarms D6; system outputs SF-38, SF-39"
INPUTS = [*range(1, 65), *range(101, 165), *range(201, 217), *range(233, 249), 262, 263]
OUTPUTS = [*range(1, 65), *range(101, 165), *range(201, 209)]
# Files, and the line on which each waits for input.
FILES = {"L2": 2, "L9": 9, "L300": 300}
NEAR = 0.002
# T8: the emergency stop. A low battery has an alarm that is the emulator's own (no source has its number).
STOP, BATTERY = alarms.word("8-014"), alarms.word("1-102")


def source(line):
    """A program that waits for input on this line."""
    return "PROGRAM P\n" + "REMARK X\n" * (line - 2) + "INPUT COM1, N\nEND\n"


class Walk:
    """The robot, its host, and what is true of it."""

    def __init__(self, emulator, arm, dialect, draw):
        self.robot, self.arm, self.dialect, self.draw = emulator.robot, arm, dialect, draw
        self.host = Asking(emulator.address("ip0"))
        for name, line in FILES.items():
            self.robot.files[name] = source(line)
        self.seconds = self.run_seconds = 0.0
        self.facts = {"servo": 0, "emergency": 0, "status": "reset", "request": None, "alarms": [], "line": 0, "task": 0, "hold": 0,
                      "coordinate": 0, "rate": 0, "guide": 0, "mode": "ETHER", "power_minutes": 0, "run_minutes": 0,
                      "inputs": set(), "outputs": set(), "run_mode": "cycle", "battery": False, "selected": "", "override": 100,
                      "lock": False, "work_name": "", "tool_name": "", "joints": (), "world": (), "work": ()}
        self.shown = None
        self.changed = False

    # What changes it

    def panel(self, name, **body):
        self.robot.call(name, body)

    def command(self, text):
        """Sends a command; whether the tables accept it, which the answer has to agree with."""
        facts = self.facts
        state = "running" if facts["status"] == "running" else "stopped"
        expected = permissions.accepted(text, "IP0", facts["mode"], state, self.arm, self.dialect)
        answer = self.host.ask(text)
        if (answer == "OK") != bool(expected):
            raise Failed("%s is answered %s\n     found    %s" % (text, "OK" if expected else "NG", answer))
        return expected

    def alarm(self, word):
        """An alarm that is not active yet goes behind the others (SF-23)."""
        self.facts["alarms"] = self.facts["alarms"] + [word] * (word not in self.facts["alarms"])

    def change_key(self):
        if self.facts["status"] != "running":
            mode = self.draw.choice(permissions.MODES)
            turn(self.robot, mode)
            self.facts["mode"] = mode

    def change_inputs(self):
        line, on = self.draw.choice(INPUTS), self.draw.random() < 0.6
        self.robot.inputs[line] = on
        (self.facts["inputs"].add if on else self.facts["inputs"].discard)(line)

    def change_outputs(self):
        lines = {self.draw.choice(OUTPUTS): self.draw.random() < 0.6 for _ in range(self.draw.randint(1, 32))}
        text = "IW," + " ".join("%d %d" % (line, on) for line, on in lines.items())
        if self.command(text):
            self.facts["outputs"] |= {line for line, on in lines.items() if on}
            self.facts["outputs"] -= {line for line, on in lines.items() if not on}

    def change_servo(self):
        facts = self.facts
        if facts["status"] == "running" or self.draw.random() < 0.5:
            if facts["mode"] == "ETHER" and not facts["emergency"] and STOP not in facts["alarms"]:
                self.command("SO")
                facts["servo"] = 1
        else:
            self.command("BR")
            facts["servo"] = 0

    def change_emergency(self):
        facts, pressed = self.facts, not self.facts["emergency"]
        self.panel("put_emergency_stop", pressed=pressed)
        facts["emergency"] = int(pressed)
        if pressed:
            self.alarm(STOP)
            # The program waits in INPUT, which any stop ends (INP-09): a restart goes on with the step after it.
            waits = facts["status"] == "running"
            facts["status"], servo = alarms.effect(8, facts["status"], facts["servo"])
            facts["servo"] = int(servo)
            if waits:
                facts["status"] = "continue"

    def change_hold(self):
        self.command("FD")
        self.facts["hold"] ^= 1

    def change_guide(self):
        name, letters, values = self.draw.choice((("guide", "MD", 3), ("rate", "RT", 3), ("coordinate", "SC", 4)))
        value = self.draw.randrange(values)
        if self.command("%s,%d" % (letters, value)):
            self.facts[name] = value

    def change_frame(self):
        which = self.draw.choice((1, 2))
        name = "".join(self.draw.choice("ABCDEFGHIJ") for _ in range(self.draw.randint(1, 10)))
        values = ["%.3f" % self.draw.uniform(-50, 50) for _ in range(6 if self.arm == "six-axis" else 4)]
        if self.command("ZS,%d %s %s" % (which, name, " ".join(values))):
            self.facts["work_name" if which == 1 else "tool_name"] = name

    def forget_frames(self):
        """Whether a frame outlives a selection, RS,SEL or RS,PRG is not said."""
        self.facts.update(work_name=None, tool_name=None)

    def change_override(self):
        percent = self.draw.randint(1, 100)
        if self.command("EC,OVRD %d" % percent):
            self.facts["override"] = percent

    def change_run_mode(self):
        word, mode = self.draw.choice((("CYCLE", "cycle"), ("CONT", "continuous"), ("STEP", "step"), ("SEGMENT", "segment")))
        if self.command("EC,MODE " + word):
            self.facts["run_mode"] = mode

    def change_battery(self):
        self.facts["battery"] = not self.facts["battery"]
        self.panel("put_battery", low=self.facts["battery"])
        if self.facts["battery"]:
            self.alarm(BATTERY)

    def change_lock(self):
        self.facts["lock"] = not self.facts["lock"]
        self.panel("put_machine_lock", on=self.facts["lock"])

    def change_selection(self):
        facts = self.facts
        if facts["status"] == "running":
            return
        name = self.draw.choice(list(FILES))
        if self.command("SL," + name):
            facts.update(selected=name, status="reset", line=None)
            self.forget_frames()

    def change_program(self):
        facts = self.facts
        if facts["status"] == "running":
            self.command("SP")
            # CMD-SP-02 and INP-09: the INPUT has ended, in a feed hold too, which SP ends (CMD-FD-03).
            facts["status"], facts["hold"] = "continue", 0
        elif facts["selected"] and facts["status"] == "reset" and facts["servo"] and not facts["hold"] and STOP not in facts["alarms"]:
            if facts["run_mode"] in ("cycle", "continuous", "segment") and self.command("RN"):
                facts.update(status="running", line=FILES[facts["selected"]], task=1)

    def change_reset(self):
        facts = self.facts
        word = self.draw.choice(("PRG", "STP", "SIG", "SEL", "ERR"))
        if facts["battery"]:
            self.change_battery()
        if not self.command("RS," + word):
            return
        if word == "SIG":
            facts["outputs"] -= set(range(1, 25))
        if word in ("PRG", "ERR"):
            # D6: not while the cause persists. Whether that holds for a battery too is not said.
            facts["alarms"] = [STOP] if facts["emergency"] else []
        if word == "PRG":
            facts["hold"] = 0
            self.forget_frames()
        if word in ("PRG", "STP", "SEL"):
            facts["status"] = "reset"
        if word == "SEL":
            facts.update(selected="", line=0, task=0)
            self.forget_frames()

    def change_time(self):
        seconds = self.draw.choice((1, 59, 61, 600, 3600))
        self.robot.advance(seconds)
        self.seconds += seconds
        self.run_seconds += seconds if self.facts["status"] == "running" else 0
        self.facts.update(power_minutes=int(self.seconds // 60), run_minutes=int(self.run_seconds // 60))

    # What is compared

    def step(self):
        """One change; the SU request follows what SU shows (SF-21)."""
        before = total_status.status_items(self.facts, self.dialect)
        change = self.draw.choice([name for name in dir(self) if name.startswith("change_")])
        getattr(self, change)()
        after = total_status.status_items(self.facts, self.dialect)
        if after != before:
            self.changed = True
        if self.shown is not None:
            # A change that was undone: no source says whether the request is taken back.
            self.facts["request"] = None if self.changed and after == self.shown else int(self.changed)
        return change[len("change_"):]

    def total(self):
        """Expected and found body of SF, each with 0 where nothing is decided."""
        found = self.host.total_status(self.arm, self.dialect)
        arm = self.robot.state["arm"]
        group, facts = 4 * total_status.AXES[self.arm], dict(self.facts)
        for number, name in enumerate(("joints", "world", "work")):
            at = 116 + number * group
            there = struct.unpack(">%df" % (group // 4), found[at:at + group])
            values = (list(arm[name]) + [0.0] * 8)[:group // 4]
            # The control interface rounds.
            facts[name] = there if all(abs(a - b) < NEAR for a, b in zip(there, values)) else values
        for name, at in (("work_name", 116 + 3 * group), ("tool_name", 136 + 3 * group)):
            if facts[name] is None:
                facts[name] = found[at:at + 20].rstrip(b"\0").decode("ascii")
        for name in ("request", "line"):
            facts[name] = facts[name] or 0
        expected = total_status.total_status(facts, self.arm)
        return (total_status.undecided(self.facts, self.arm, expected), total_status.undecided(self.facts, self.arm, found))

    def status(self):
        """Expected and found items of SU; the speed limit has no stated value."""
        expected = total_status.status_items(self.facts, self.dialect)
        expected[3] = "LSPEED:" if self.dialect == "field" else ""
        answer = self.host.ask("SU")
        found = answer.split(" ") if self.dialect == "field" else answer[:-1].split("\r")
        found = [re.sub("^LSPEED:.*", "LSPEED:", item) for item in found]
        self.shown, self.changed, self.facts["request"] = total_status.status_items(self.facts, self.dialect), False, 0
        return expected, found


def cases(binary, draw, count):
    for emulator, arm, dialect in robots(binary):
        walk = Walk(emulator, arm, dialect, draw)
        for _ in range(count // 4):
            done = "%s, %s dialect, after %s" % (arm, dialect, ", ".join(walk.step() for _ in range(draw.randint(1, 5))))
            expected, found = walk.total()
            difference = total_status.difference(arm, expected, found)
            yield Case("SF, " + done, {name: pair[0] for name, pair in difference.items()},
                       {name: pair[1] for name, pair in difference.items()}, LAYOUT)
            if draw.random() < 0.4:
                expected, found = walk.status()
                yield Case("SU, " + done, expected, found, "our manual, 5.3.3 FL (3); decisions.md D5")
            if draw.random() < 0.3 and permissions.served("IO,1", arm, dialect):
                body = walk.host.binary("IO,1", 80, ETX)
                mask = bytearray(80)
                mask[62:64] = struct.pack(">H", total_status.hidden_outputs(walk.facts))
                found = bytes(byte & ~hidden for byte, hidden in zip(body, mask)).hex(" ", 2)
                yield Case("IO, " + done, total_status.io_body(walk.facts).hex(" ", 2), found,
                           "STE 80722 pages 132 to 151 (S27, S97): 20 input words, then 20 output words")


def plant_canary():
    total_status.BLOCKS = total_status.BLOCKS[:4] + (102,) + total_status.BLOCKS[5:]
    return "extension lines begin at 102"
