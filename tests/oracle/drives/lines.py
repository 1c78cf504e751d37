"""Outputs forced by IW and HO, right and wrong, inputs driven from outside and read by HI; the outputs are seen in SF."""

import struct

import lines
import permissions
import total_status
from link import Asking, Case, robots

RULE = "our manual 5.3.3: IW, RS; CMD-IW-01 to CMD-IW-05, CMD-RS-07; S14, S79; T12, T14"
DRIVEN = [*range(1, 65), *range(101, 165), *range(201, 209)]


def block(draw):
    """A first line and a length that stay within a block of lines; now and then beyond what exists."""
    begin, end = draw.choice(((1, 64), (1, 64), (101, 164), (201, 208), (301, 364)))
    length = draw.randint(1, min(32, end - begin + 1))
    first = draw.randint(begin, end - length + 1)
    if draw.random() < 0.1:
        return draw.choice(((0, 1), (65, 1), (100, 1), (165, 2), (465, 1), (first, 0), (begin, 33)))
    return first, length


def pairs(draw):
    """Lines and states of an IW."""
    count = draw.choice((1, 1, 2, 5, 32, 33))
    out = {draw.choice(DRIVEN): draw.randint(0, 1) for _ in range(count * 2)}
    out = list(out.items())[:count]
    if draw.random() < 0.15:
        out[draw.randrange(len(out))] = draw.choice(((0, 1), (65, 1), (165, 0), (209, 1), (217, 1), (249, 0), (301, 1), (5, 2), (3, 9)))
    return out


class Cell:
    """The robot and its lines."""

    def __init__(self, emulator, arm, dialect, draw):
        self.robot, self.arm, self.dialect, self.draw = emulator.robot, arm, dialect, draw
        self.host = Asking(emulator.address("ip0"))
        self.inputs, self.outputs = set(), set()

    def command(self, text, expected):
        return Case("%s, %s, %s dialect" % (text, self.arm, self.dialect), expected, self.host.ask(text).rstrip("\r"), RULE)

    def step(self):
        """The cases of one command."""
        what = self.draw.choice(("IW", "IW", "HO", "HI", "HI", "RS,SIG", "drive"))
        if what == "drive":
            for _ in range(4):
                line, on = self.draw.choice(DRIVEN), self.draw.random() < 0.6
                self.robot.inputs[line] = on
                (self.inputs.add if on else self.inputs.discard)(line)
            return
        if not permissions.served(what, self.arm, self.dialect):
            return
        if what == "HI":
            first, length = block(self.draw)
            yield self.command("HI,%d %d" % (first, length), lines.read(self.inputs, first, length))
            return
        if what == "IW":
            wanted = pairs(self.draw)
            text, (answer, after) = "IW," + " ".join("%d %d" % pair for pair in wanted), lines.force(self.outputs, wanted)
        elif what == "HO":
            first, length = block(self.draw)
            value = self.draw.randrange(2 ** length if self.draw.random() < 0.9 else 2 ** 33)
            text, (answer, after) = "HO,%d %d %d" % (first, length, value), lines.force_value(self.outputs, first, length, value)
        else:
            text, answer, after = "RS,SIG", "OK", lines.reset(self.outputs)
        self.outputs = after
        yield self.command(text, answer)
        body = self.host.total_status(self.arm, self.dialect)
        words = struct.unpack(">9H", body[84:102])
        found = {first + bit for first, word in zip(total_status.BLOCKS, words) for bit in range(16) if word >> bit & 1}
        yield Case("outputs after %s, %s, %s dialect" % (text, self.arm, self.dialect), sorted(self.outputs), sorted(found), RULE)


def cases(binary, draw, count):
    for emulator, arm, dialect in robots(binary):
        cell, left = Cell(emulator, arm, dialect, draw), count // 4
        while left > 0:
            for case in cell.step():
                left -= 1
                yield case


def plant_canary():
    lines.USER_OUTPUTS = range(1, 26)
    return "RS,SIG turns DO25 off too"
