"""Programs of random INPUT statements on IP1, IP2 and COM1, fed with records that are cut anywhere, have too many values or too
few, blanks, empty values, LF, and now and then something that is no number. PRINT shows what was read."""

import printing
import records
from link import ARMS, QUIET, RUNNING, Asking, Case, Emulator, Failed, Line, NotReached, serial

STATEMENTS = 40
# D10: 256 bytes a channel.
CAPACITY = 200
CHANNELS = ("IP1", "IP2", "COM1")
STRINGS = ("ABC", "abc", "Abc", "12X", "X12", "-", "1.2.3", "--3", "7 8", "1;2", "5)", "OK")
RULE = ("our manual 4.1.2: values separated by commas, the record ends with CR; too many stay for the next INPUT, too few are waited "
        "for; NPC-01, INP-01 to INP-17, D10, T13")


def token(draw, integer):
    """One value as a host sends it."""
    if draw.random() < 0.08:
        return ""
    whole = draw.choice((0, draw.randint(0, 9), draw.randint(0, 999), draw.randint(0, 99999999)))
    text = draw.choice(("", "", "-")) + draw.choice(("", "", "", "00")) + str(whole)
    if draw.random() < (0.2 if integer else 0.6):
        text += "." + "".join(draw.choice("0123456789") for _ in range(draw.choice((0, 1, 3, 5))))
    return draw.choice(("", "", "", " ")) + text + draw.choice(("", "", "", " "))


def program(draw):
    """The lines of a program and its INPUT statements: channel, variables, whether the buffer is cleared afterwards."""
    variables = {"N%d" % number: 0 for number in range(3)}
    variables.update({"X%d" % number: printing.Real(0) for number in range(3)})
    lines = ["PROGRAM P"] + ["%s = %s" % (name, "0.0" if isinstance(value, printing.Real) else "0") for name, value in variables.items()]
    statements = []
    for _ in range(STATEMENTS):
        channel, names = draw.choice(CHANNELS), draw.sample(list(variables), draw.choice((1, 1, 2, 3, 6)))
        cleared = draw.random() < 0.2
        lines.append("INPUT %s, %s" % (channel, ", ".join(names)))
        if cleared:
            lines.append('PRINT %s, "BUFFRESET"' % channel)
        lines.append("PRINT IP1, %s, CR" % ", ".join(names))
        statements.append((channel, names, cleared))
    return "\n".join(lines + ["END", ""]), variables, statements


def strings(draw):
    """Rows of STRING.PAR: number and text, some twice, some beyond the last row that counts."""
    known = [(draw.randint(0, 32767), draw.choice(STRINGS)) for _ in range(4)]
    rows = known + [(draw.randint(0, 32767), "FILL%d" % row) for row in range(draw.choice((0, 40, 122, 124, 126)))]
    return rows + [(draw.randint(0, 32767), draw.choice(STRINGS)) for _ in range(4)]


class Feeding:
    """What is sent for one INPUT: records until it has enough, cut into pieces."""

    def __init__(self, draw, buffer, names):
        self.draw, self.buffer, self.names = draw, buffer, names
        self.sent = ""
        self.tokens = []

    def read(self):
        """Draws values from the buffer, as the emulator will."""
        while len(self.tokens) < len(self.names):
            value = self.buffer.value()
            if value is None:
                return False
            self.tokens.append(value)
        return True

    def feed(self):
        while not self.read():
            left = [name[0] == "N" for name in self.names[len(self.tokens):]]
            count = self.draw.choice((1, len(left), len(left), len(left) + self.draw.randint(1, 3)))
            values = [token(self.draw, (left + [True] * 9)[at]) for at in range(count)]
            if self.draw.random() < 0.05:
                values[self.draw.randrange(count)] = self.draw.choice(STRINGS)
            record = ",".join(values) + self.draw.choice(("\r", "\r", "\r\n", ",\r", ",\r\n"))
            if record.strip("\r\n") in ("", ","):
                # Whether an empty record holds one empty value or none is not said.
                continue
            self.sent += record
            self.buffer.receive(record)

    def starve(self):
        """Sends too few values, each complete; False if the buffer has enough, or what raises an alarm."""
        if self.read() or any(value in STRINGS for value in self.tokens):
            return False
        for _ in range(self.draw.randrange(len(self.names) - len(self.tokens))):
            value = token(self.draw, self.names[len(self.tokens)][0] == "N") or "0"
            self.sent += value + self.draw.choice((",", "\r"))
            self.buffer.receive(value + self.sent[-1])
            self.read()
        return True

    def pieces(self):
        """What is sent, cut anywhere before the separator that completes the INPUT: so what is left over has come when it ends."""
        last = len(self.sent) - len(self.buffer.data) - 1
        cuts = sorted(self.draw.randint(0, last) for _ in range(self.draw.choice((0, 0, 1, 3)))) if last > 0 else []
        return [self.sent[begin:end] for begin, end in zip([0, *cuts], [*cuts, len(self.sent)]) if begin < end]


class Cell:
    """An emulator, its host, and a peer on each channel."""

    def __init__(self, emulator, arm, dialect, switch, draw):
        self.robot, self.draw, self.done = emulator.robot, draw, "%s, %s dialect, [U25] %s" % (arm, dialect, switch)
        rows = strings(draw)
        self.malformed = records.policy(arm, dialect, switch, rows)
        self.parameters(switch, rows)
        self.host = Asking(emulator.address("ip0"))
        self.peers = {"IP1": Line(emulator.address("ip1")), "IP2": Line(emulator.address("ip2")), "COM1": Line(serial(emulator, "com1"))}

    def parameters(self, switch, rows):
        """[U25] of USER.PAR and STRING.PAR; they act after a power cycle."""
        if switch is None:
            return
        kept = self.robot.files["USER.PAR"].partition("[U25]")[0].replace("[END]\n", "")
        section = "[U25] FUNCTION SELECT SWITCH\n= %d 0 0 0 0 0\n" % switch + "= 0 0 0 0 0 0\n" * 3
        self.robot.files["USER.PAR"] = kept + section + "[END]\n"
        self.robot.files["STRING.PAR"] = "".join('= %d "%s"\n' % row for row in rows)
        self.robot.power_cycle()
        self.robot.call("put_servo", {"on": True})

    def command(self, text):
        if self.host.ask(text) != "OK":
            raise Failed("%s is answered OK" % text)

    def cancel(self, channel, data):
        """Sends too little, and stops and starts the program while it waits."""
        self.peers[channel].raw(data.encode("ascii"))
        for _ in range(2):
            # Any call: what was sent before it has arrived when the next one is served.
            self.robot.call("get_clock")
        self.command("SP")
        self.command("RN")

    def run(self):
        """The cases of one program; an alarm ends it."""
        text, variables, statements = program(self.draw)
        buffers = {channel: records.Buffer() for channel in CHANNELS}
        self.robot.files["P"] = text
        self.command("SL,P")
        self.command("RN")
        for channel, names, cleared in statements:
            feeding = Feeding(self.draw, buffers[channel], names)
            before = buffers[channel].data
            cancelled = self.draw.random() < 0.05 and feeding.starve()
            if cancelled:
                self.cancel(channel, feeding.sent)
            else:
                feeding.feed()
                for piece in feeding.pieces():
                    self.peers[channel].raw(piece.encode("ascii"))
            what = "INPUT %s, %s: %r kept, %r sent%s, %s" % (channel, ", ".join(names), before, feeding.sent,
                                                            ", SP and RN" if cancelled else "", self.done)
            try:
                for name, value in zip(names, records.cancelled(feeding.tokens, len(names)) if cancelled else feeding.tokens):
                    variables[name] = records.received(variables[name], value, self.malformed)
            except records.Malformed as error:
                try:
                    self.robot.wait_until("status stop (continue)", 3600)
                except NotReached:
                    pass
                yield Case(what, ["2-046"], [alarm.number for alarm in self.robot.alarms], "T13.1, S89: %r is no number" % str(error))
                break
            if cleared:
                buffers[channel].clear()
            expected = printing.sent([("variable", name) for name in names] + [("CR",)], variables)
            try:
                found = self.peers["IP1"].until(b"\r")
            except Failed:
                found = "no answer; alarms %s" % [alarm.number for alarm in self.robot.alarms]
            yield Case(what, expected, found, RULE)
            if found != expected or any(len(buffer.data) > CAPACITY for buffer in buffers.values()):
                break
        self.command("SP")
        self.command("RS,PRG")


def cases(binary, draw, count):
    cells = [(arm, dialect, switch) for arm in ARMS for dialect in ("field", "manual") for switch in (None, 1, 2)]
    for arm, dialect, switch in cells:
        with Emulator(binary, *QUIET, *RUNNING, *ARMS[arm], "--dialect", dialect, "--servo-on", "--set", "drive.open_mode=1 1 1 0",
                      "--serial-com1-tcp", "127.0.0.1:0") as emulator:
            cell, left = Cell(emulator, arm, dialect, switch, draw), count // len(cells)
            while left > 0:
                for case in cell.run():
                    left -= 1
                    yield case


def plant_canary():
    records.EMPTY = "1"
    return "an empty value counts as 1"
