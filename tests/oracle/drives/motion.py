"""MOVE, MOVES and MOVEC of a SCARA by DO, in stepped time: where the arm is at five moments, the last when it has to have arrived and
one right before. Lines and arcs are slow, so that no axis comes to its own speed, of which no source speaks."""

import os
import tomllib

import motion
from link import ARMS, QUIET, STEPPED, Asking, Case, Emulator, Failed
from emulator import ROOT

RULE = "D11: trapezoid, closed form of time; T21: each axis its own trapezoid, stretched to the slowest; T27.15: override scales time"
# The control interface rounds, and so do the statements.
NEAR = 0.02
SHARES = (0.1, 0.35, 0.7, 0.97, 1.0)
SLOW = 4


class Cell:
    """A robot, its host, and the data of its arm."""

    def __init__(self, emulator, draw):
        self.robot, self.draw = emulator.robot, draw
        self.host = Asking(emulator.address("ip0"))
        with open(os.path.join(ROOT, "fixtures", "models", "tsl3000-thl400.toml"), "rb") as file:
            model = tomllib.load(file)
        self.links = model["geometry"]["first_arm"], model["geometry"]["second_arm"]
        self.axes = [(axis["max_speed"], axis["max_accel"]) for axis in model["axis"]]
        self.tool = model["tool"]["max_speed"] * SLOW / 100, model["tool"]["max_accel"]

    def point(self, x, y, z, c):
        """A position LEFTY, which all motions keep."""
        return "POINT(%.3f,%.3f,%.3f,%.3f,0,1)" % (x, y, z, c)

    def sampled(self, what, statement, whole, place, name):
        """The cases of one motion."""
        if self.host.ask("DO," + statement) != "OK":
            raise Failed("DO,%s is answered OK" % statement)
        passed = 0.0
        for share in SHARES:
            self.robot.advance(whole * share - passed)
            passed = whole * share
            expected, found = place(passed), self.robot.state["arm"][name]
            expected, found = [round(value, 3) for value in expected], [round(value, 3) for value in found[:len(expected)]]
            if all(abs(a - b) < NEAR for a, b in zip(expected, found)):
                expected = found
            yield Case("%s after %.4f of %.4f s" % (what, passed, whole), expected, found, RULE)
        self.robot.advance(1)

    def joints(self):
        return list(self.robot.state["arm"]["joints"])[:5]

    def world(self):
        return list(self.robot.state["arm"]["world"])[:4]

    def move(self):
        """MOVE under a drawn override."""
        begin, draw = self.joints(), self.draw
        # Which of the whole turns of axis 4 a C means is not said, so the nearest one is far nearer than the others.
        end = [draw.uniform(-90, 90), draw.uniform(20, 120), draw.uniform(-100, 100), begin[3] + draw.uniform(-100, 100), 0.0]
        override = draw.choice((100, 100, 50, 20, draw.randint(1, 100)))
        if self.host.ask("EC,OVRD %d" % override) != "OK":
            raise Failed("EC,OVRD is answered OK")
        scale = override / 100
        statement = "MOVE " + self.point(*motion.tip(end, *self.links)[:4])
        yield from self.sampled("%s, override %d" % (statement, override), statement, motion.joint_time(begin, end, self.axes) / scale,
                                lambda time: motion.joint_place(begin, end, self.axes, time * scale), "joints")

    def straight(self):
        """MOVES near the present place."""
        self.host.ask("EC,OVRD 100")
        begin, draw = self.world(), self.draw
        end = [value + draw.uniform(-20, 20) for value in begin[:3]]
        statement = "MOVES %s WITH SPEED=%d" % (self.point(*end, begin[3]), SLOW)
        yield from self.sampled(statement, statement, motion.ramp_time(motion.math.dist(begin[:3], end), *self.tool),
                                lambda time: motion.line_place(begin[:3], end, *self.tool, time), "world")

    def arc(self):
        """MOVEC near the present place."""
        self.host.ask("EC,OVRD 100")
        (x, y, z, c), draw = self.world(), self.draw
        via, end = ([round(value + draw.choice((-1, 1)) * draw.uniform(8, 20), 3) for value in (x, y)] for _ in range(2))
        if motion.math.dist(via, end) < 12:
            # Rounding turns such an arc.
            return
        (centre_x, centre_y), radius, angle = motion.circle((x, y), via, end)
        away = motion.math.hypot(centre_x, centre_y)
        # All of the circle is in reach, and slow for every axis.
        if radius > 40 or away + radius > sum(self.links) - 20 or away - radius < 120:
            return
        statement = "MOVEC %s %s WITH SPEED=%d" % (self.point(*via, z, c), self.point(*end, z, c), SLOW)
        yield from self.sampled(statement, statement, motion.ramp_time(radius * abs(angle), *self.tool),
                                lambda time: motion.arc_place((x, y), via, end, *self.tool, time), "world")


def cases(binary, draw, count):
    with Emulator(binary, *QUIET, *STEPPED, *ARMS["scara"], "--servo-on") as emulator:
        cell, left = Cell(emulator, draw), count
        yield from cell.move()
        while left > 0:
            # Lines and arcs begin in the middle of the reach.
            joints = [draw.uniform(-60, 60), draw.uniform(50, 100), draw.uniform(-50, 50), draw.uniform(-100, 100), 0.0]
            for statement in ("MOVE " + cell.point(*motion.tip(joints, *cell.links)[:4]), "MOVEA 4,%.3f" % joints[3]):
                cell.host.ask("DO," + statement)
                cell.robot.advance(200)
            for case in draw.choice((cell.move, cell.straight, cell.arc))():
                left -= 1
                yield case


def plant_canary():
    place = motion.ramp_time
    motion.ramp_time = lambda way, speed, acceleration: place(way, speed * 0.98, acceleration)
    return "axes and tool are 2 % slower"
