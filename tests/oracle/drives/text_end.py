"""Bytes of hosts that end their texts in different ways, with pauses between, on a new connection for each case. What is compared
is which answers come, in which framing, and how often the finding `no-etx` is made."""

import re

import text_end
from link import ARMS, CR, ETX, QUIET, STEPPED, STX, Case, Emulator, Line

OPTIONS = ("detect", "detect", "cr", "etx", "required")
# Commands, and the letters of their answers (of OK and NG none, D2).
ANSWERS = {b"SP": "OK", b"BR": "OK", b"RS,SIG": "OK", b"HI,1 8": "FL", b"ZZ": "NG", b"IW,1": "NG", b"OK": None, b"NG": None}
# The last text of a case: its answer is told from others by its length.
LAST = STX + b"VR" + CR + ETX
LONG = 20
RULE = "T6: where a text without ETX ends; T7, T22, T27.1 to T27.5; FRM-04"


def text(draw):
    """A text of a host, or a piece of one."""
    command = draw.choice(list(ANSWERS))
    if draw.random() < 0.2:
        return STX + command + draw.choice((CR + ETX, CR + ETX, ETX, CR, b""))
    return command + draw.choice((CR, CR, CR, CR + ETX, CR + ETX, CR + b"\n", CR + CR, CR + b"\0 ", ETX, b""))


def traffic(draw):
    """Bytes and pauses in turn; the bytes may be cut anywhere."""
    out = []
    for _ in range(draw.choice((1, 1, 1, 2, 3, 5))):
        data = text(draw)
        cut = draw.randint(1, len(data)) if draw.random() < 0.3 else len(data)
        for piece in (data[:cut], data[cut:]):
            if piece:
                out.append(piece)
            if draw.random() < 0.4:
                out.append(draw.choice((100, 200, 300, 300, 9000, 11000)))
        if data.endswith(CR) and draw.random() < 0.4:
            # An ETX that comes late.
            out += [draw.choice((100, 200, 240, 260, 300)), ETX]
    return out


def expected(option, steps):
    """The answers and the number of findings; None where no source decides."""
    reader = text_end.Reader(option)
    try:
        for step in [*steps, LAST]:
            if isinstance(step, int):
                reader.passes(step)
            else:
                for byte in step:
                    reader.receive(byte)
    except text_end.Undecided:
        return None
    for text in reader.texts:
        # Not said: whether CR, LF, NUL or a blank behind a command is an operand too many, and whether an OK with something
        # behind it is an answer.
        if text.data.rstrip(b"\r\n\0 ") != text.data or text.data[:2] in (b"OK", b"NG") and len(text.data) > 2:
            return None
        if option == "required" and not text.delimited:
            if text.data in (b"OK", b"NG"):
                return None
            # D0, FRM-10: the manual dialect answers NG to a command without CR.
            text.data = b""
    letters = [(text.framed, ANSWERS.get(text.data, "NG")) for text in reader.texts[:-1]]
    return ([("STX " if framed else "") + answer for framed, answer in letters if answer],
            sum(text.no_etx for text in reader.texts))


def answers(line):
    """The answers up to the one to the last text."""
    found = []
    while True:
        data = line.until(ETX)
        framed = data.startswith(STX)
        data = data.lstrip(STX)
        if framed and data.startswith(b"FL,") and len(data) > LONG:
            return found
        found.append(("STX " if framed else "") + data[:2].decode("ascii"))


def findings(robot):
    """How often the finding has been made, which is a line of the metrics."""
    match = re.search(r'^\S*findings\S*rule="no-etx"\S* (\d+)', robot.call("get_metrics"), re.MULTILINE)
    return int(match.group(1)) if match else 0


def cases(binary, draw, count):
    for option in OPTIONS:
        # T5: on a SCARA the manual dialect serves HI too.
        flags = ("--dialect", "manual", *ARMS["scara"]) if option == "required" else ("--set", "text.end=" + option)
        with Emulator(binary, *QUIET, *STEPPED, *flags) as emulator:
            robot, made = emulator.robot, 0
            for _ in range(count // len(OPTIONS)):
                steps = traffic(draw)
                wanted = expected(option, steps)
                if wanted is None:
                    continue
                line = Line(emulator.address("ip0"))
                for step in steps:
                    if isinstance(step, int):
                        # Any call: what was sent before it has arrived when the next one is served.
                        robot.call("get_clock")
                        robot.advance(step / 1000)
                    else:
                        line.raw(step)
                line.raw(LAST)
                found = answers(line)
                total = findings(robot)
                line.close()
                yield Case("%s: %s" % (flags[1], " ".join(repr(step)[1:] if isinstance(step, bytes) else "%d ms" % step
                                                                 for step in steps)), wanted, (found, total - made), RULE)
                made = total


def plant_canary():
    text_end.PATIENCE = 50
    return "a CR waits 50 ms for its ETX"
