#!/usr/bin/env python3
"""HOST on a serial port of the computer, with a pair of virtual ports: the robot at one end, a host at the other. The one program of
this folder that runs on Windows, with com0com (docs/how-to/windows.md); elsewhere the ends are a pair of terminals (socat).

    python tests/system/hosts/com_port.py --serve target/release/ts3100.exe --robot COM10 --other-end COM11

The host is the one of the Python package; it needs pyserial."""

import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Robot  # noqa: E402
from steps import equal, program, serving, true  # noqa: E402
from ts3100 import Host  # noqa: E402

SOURCE = b"PROGRAM ASK\r" + b"REMARK several texts\r" * 20 + b"END\r"


def main():
    parser = serving(__doc__)
    parser.add_argument("--robot", metavar="PORT", required=True, help="the end for the robot")
    parser.add_argument("--other-end", metavar="PORT", required=True, help="the end for the host")
    options = parser.parse_args()
    flags = ["--control-right", "rs232c", "--serial-host", options.robot]
    with Robot.start(binary=options.serve, flags=flags) as robot:
        with Host.open_serial(options.other_end) as host:
            equal("SU over the serial port", "external(host)", host.status().mode)
            host.download("ASK", SOURCE)
            equal("a file of several texts comes back", SOURCE, host.upload("ASK"))
            host.servo_on()
            true("the servo is on", robot.servo)
        equal("the host made no mistake", [], [str(finding) for finding in robot.findings])
        equal("it ends with exit code 0", 0, robot.close())


if __name__ == "__main__":
    sys.exit(program(main))
