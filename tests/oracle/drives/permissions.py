"""Every command on both ports in every mode and state, for both arms in both dialects. A snapshot brings each state back."""

import permissions
from link import ETX, Asking, Case, Failed, robots, serial, turn

PROGRAM = """GLOBAL
A = 10
END
PROGRAM WAITS
RCYCLE:
INPUT COM1, A
GOTO RCYCLE
END
DATA
POINT P1=%s/
END
"""
START = {"six-axis": "400,0,300,0,0,0,0,0", "scara": "300,100,50,0,0"}
STATES = ("stopped", "running", "direct", "hold", "unpowered", "emergency")
FRAME = {"six-axis": "1 2 3 4 5 6", "scara": "1 2 3 4"}


def commands(arm):
    """Every command with operands that are right in form."""
    yield from ("RN", "SP", "BR", "SO", "SU", "CA", "EU", "FD", "SF", "VR", "UL,OLD", "ER,OLD", "DL,NEW", "SL,OLD", "IW,1 1",
                "MW,0 A 0 5", "MR,A 0", "DO,DOUT(1)", "EC,OVRD 50", "EC,BREAK", "EC,MODE CYCLE", "AC", "AH", "IO,1", "SM,1", "PS",
                "HI,1 8", "HO,1 8 5", "WD,0 0", "ZC", "JG,1 +", "MP,0 P1", "ZS,1 W %s" % FRAME[arm], "ZS,2 T %s" % FRAME[arm],
                "ZZ", "XY,1")
    for command, operands in (("RS", ("PRG", "STP", "CYC", "SIG", "SEL", "ERR")), ("PR", range(6)), ("VL", range(2)),
                              ("MN", range(1, 18)), ("RM", range(1, 17)), ("MD", range(3)), ("RT", range(3)), ("SC", range(4)),
                              ("EM", range(3))):
        for operand in operands:
            yield "%s,%s" % (command, operand)


class Cell:
    """An emulator, a host on each port, and a snapshot of each mode and state."""

    def __init__(self, emulator, arm, dialect):
        self.robot, self.arm, self.dialect = emulator.robot, arm, dialect
        self.hosts = {"HOST": Asking(serial(emulator, "host")), "IP0": Asking(emulator.address("ip0"))}
        for name in ("WAITS", "OLD"):
            self.robot.files[name] = PROGRAM % START[arm]
        self.robot.select_file("WAITS")
        self.states = [(mode, state) for mode in permissions.MODES for state in STATES]
        for mode, state in self.states:
            self.prepare(mode, state)

    def prepare(self, mode, state):
        """Brings the robot to a mode and state, and keeps the snapshot."""
        robot = self.robot
        robot.call("put_servo", {"on": True})
        if state == "direct":
            self.expect("DO,DELAY 1000", "OK")
        turn(robot, mode)
        if state in ("hold", "unpowered", "emergency"):
            name, body = {"hold": ("put_feed_hold", {"on": True}), "unpowered": ("put_servo", {"on": False}),
                          "emergency": ("put_emergency_stop", {"pressed": True})}[state]
            robot.call(name, body)
        elif not robot.state["servo"]:
            robot.call("put_servo", {"on": True})
        if state == "running":
            # From the panel, so in every mode.
            robot.start_program()
        if (robot.state["status"] == "running") != (state in ("running", "direct")):
            raise Failed("%s in %s cannot be reached: the robot is %s" % (state, mode, robot.state["status"]))
        robot.take_snapshot("%s-%s" % (mode, state))
        self.back()

    def back(self):
        """Stopped in EXT, with the control right at ETHER."""
        robot = self.robot
        robot.call("put_emergency_stop", {"pressed": False})
        robot.call("put_feed_hold", {"on": False})
        turn(robot, "ETHER")
        self.expect("BR", "OK")
        robot.call("reset_alarms")
        self.expect("RS,PRG", "OK")

    def expect(self, command, answer):
        found = self.hosts["IP0"].ask(command)
        if found != answer:
            raise Failed("%s is answered %s\n     found    %s" % (command, answer, found))

    def accepts(self, port, command):
        """Whether the answer is not NG; whatever the command opened is closed."""
        host = self.hosts[port]
        if command == "SF":
            return host.total_status(self.arm, self.dialect) is not None
        if command == "IO,1":
            return host.binary(command, 80, ETX) is not None
        answer = host.ask(command)
        if command.startswith("DL") and answer == "OK":
            # The host discontinues the download in silence (CMD-DL-05).
            host.raw(b"\x02NG\r\x03")
        return answer != "NG"


def cases(binary, draw, count):
    for emulator, arm, dialect in robots(binary, "--serial-host-tcp", "127.0.0.1:0", "--serial-com1-tcp", "127.0.0.1:0"):
        cell = Cell(emulator, arm, dialect)
        texts = list(commands(arm))
        for _ in range(count // 4):
            (mode, state), text, port = draw.choice(cell.states), draw.choice(texts), draw.choice(permissions.PORTS)
            expected = permissions.accepted(text, port, mode, state, arm, dialect)
            if expected is None:
                continue
            cell.robot.restore_snapshot("%s-%s" % (mode, state))
            yield Case("%s on %s, %s, %s, %s dialect, %s" % (text, port, arm, mode, dialect, state), expected,
                       cell.accepts(port, text),
                       permissions.sentence(text, port, mode, state, arm, dialect))


def plant_canary():
    permissions.SCARA["WD"] = permissions.RIGHT
    return "WD is valid for the port with the control right only"
