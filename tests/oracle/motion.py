"""Time and place along a motion of a SCARA arm: `decisions.md` D11 (trapezoid; closed form of time), T21 (each axis has its own
trapezoid, the slowest sets the time, the others are stretched to it), T27.15 (the override scales the time).

Lengths in mm, angles in degrees, times in seconds. The values of an arm are data: `fixtures/models`."""

import math


def ramp_time(way, speed, acceleration):
    """Time of one trapezoid; a triangle where the way is too short for the speed."""
    if way * acceleration >= speed * speed:
        return way / speed + speed / acceleration
    return 2 * math.sqrt(way / acceleration)


def ramp_place(way, speed, acceleration, time):
    """The way covered after a time."""
    whole = ramp_time(way, speed, acceleration)
    time = min(max(time, 0.0), whole)
    top = min(speed, math.sqrt(way * acceleration))
    ramp = top / acceleration
    if time < ramp:
        return acceleration * time * time / 2
    if time > whole - ramp:
        return way - acceleration * (whole - time) ** 2 / 2
    return top * ramp / 2 + top * (time - ramp)


def joint_time(begin, end, axes):
    """Time of a MOVE at override 100: that of the axis that takes longest (T21). `axes`: speed and acceleration of each."""
    return max(ramp_time(abs(b - a), *axis) for a, b, axis in zip(begin, end, axes))


def joint_place(begin, end, axes, time):
    """The joints after a time."""
    whole, out = joint_time(begin, end, axes), []
    for a, b, axis in zip(begin, end, axes):
        own = ramp_time(abs(b - a), *axis)
        # Stretched: it runs its own trapezoid in the time of the slowest.
        covered = ramp_place(abs(b - a), *axis, time * own / whole) if own else 0.0
        out.append(a + math.copysign(covered, b - a))
    return out


def tip(joints, first, second):
    """X, Y, Z, C, T of a SCARA posture."""
    shoulder, elbow = math.radians(joints[0]), math.radians(joints[0] + joints[1])
    return [first * math.cos(shoulder) + second * math.cos(elbow), first * math.sin(shoulder) + second * math.sin(elbow), joints[2],
            joints[0] + joints[1] + joints[3], joints[4]]


def line_place(begin, end, speed, acceleration, time):
    """X, Y, Z after a time on the straight line of MOVES."""
    way = math.dist(begin, end)
    share = ramp_place(way, speed, acceleration, time) / way
    return [a + (b - a) * share for a, b in zip(begin, end)]


def circle(begin, via, end):
    """Centre, radius and signed angle of the arc of MOVEC in a plane of constant Z, from three points X, Y."""
    (ax, ay), (bx, by), (cx, cy) = begin, via, end
    twice = 2 * (ax * (by - cy) + bx * (cy - ay) + cx * (ay - by))
    squares = [x * x + y * y for x, y in (begin, via, end)]
    x = (squares[0] * (by - cy) + squares[1] * (cy - ay) + squares[2] * (ay - by)) / twice
    y = (squares[0] * (cx - bx) + squares[1] * (ax - cx) + squares[2] * (bx - ax)) / twice
    turn = [math.atan2(py - y, px - x) for px, py in (begin, via, end)]
    left = (turn[2] - turn[0]) % math.tau
    # Anticlockwise if the middle point comes first that way round.
    angle = left if (turn[1] - turn[0]) % math.tau < left else left - math.tau
    return (x, y), math.hypot(ax - x, ay - y), angle


def arc_place(begin, via, end, speed, acceleration, time):
    """X, Y after a time on the arc of MOVEC."""
    (x, y), radius, angle = circle(begin, via, end)
    way = radius * abs(angle)
    turned = math.atan2(begin[1] - y, begin[0] - x) + angle * ramp_place(way, speed, acceleration, time) / way
    return [x + radius * math.cos(turned), y + radius * math.sin(turned)]
