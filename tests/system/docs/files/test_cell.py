"""What pages call `pytest`, `pytest tests` or `the_failing_one`: a host that finds the robot of `ts3100 exec`."""

import ts3100


def test_the_failing_one():
    with ts3100.Robot.from_environment() as robot, robot.host() as host:
        host.servo_on()
        assert robot.servo
