"""Stops of every kind, by the panel, the lines and both ports; in between SM on both ports, and new connections on IP0."""

import events
from link import ARMS, QUIET, STEPPED, Asking, Case, Emulator, Failed, serial

# Din257 and Din260 (SF-31).
LINES = {"STOP": 257, "BREAK": 260}
PROGRAM = "PROGRAM P\nINPUT COM1, N\nEND\n"
RULE = "T1: EE, SE, SC, BC are events of a connection, ES and SS are states; T27.6"
ACTIONS = ("SM", "SM", "SM", "SM,2", "press", "open", "SP", "STOP", "BREAK", "EC,BREAK", "BR", "FD", "SO", "RN", "RS,ERR", "RS,PRG",
           "alarm", "SVOFF", "connect")


class Cell:
    """A robot, its ports, and what the oracle keeps of them."""

    def __init__(self, emulator, arm, draw):
        self.emulator, self.robot, self.arm, self.draw = emulator, emulator.robot, arm, draw
        self.hosts = {"HOST": Asking(serial(emulator, "host")), "IP0": Asking(emulator.address("ip0"))}
        self.monitor = events.Monitor(self.hosts)
        self.robot.files["P"] = PROGRAM
        self.hosts["IP0"].ask("SL,P")
        self.done = []

    def act(self):
        """One action; a case if it was an SM that is answered."""
        action, port = self.draw.choice(ACTIONS), self.draw.choice(list(self.hosts))
        self.done.append(action + " on " + port if action in ("SM", "SP", "EC,BREAK") else action)
        if action == "SM":
            done, self.done = ", ".join(self.done), self.done[-8:]
            return Case("%s: %s" % (self.arm, done), self.monitor.answer(port), self.hosts[port].ask("SM,1").split(" ")[:6], RULE)
        if action == "press":
            self.monitor.press(not self.monitor.pressed)
            self.robot.call("put_emergency_stop", {"pressed": self.monitor.pressed})
        elif action == "open":
            self.monitor.open(not self.monitor.opened)
            self.robot.call("put_safety_switch", {"open": self.monitor.opened})
        elif action in LINES:
            self.robot.inputs[LINES[action]] = True
            self.robot.inputs[LINES[action]] = False
            self.monitor.happens(action)
        elif action == "SVOFF":
            self.robot.inputs[261] = True
            self.robot.inputs[261] = False
        elif action == "alarm":
            self.robot.raise_alarm(self.draw.choice(("8-035", "2-046", "1-200")))
        elif action == "connect":
            self.hosts["IP0"].close()
            self.hosts["IP0"] = Asking(self.emulator.address("ip0"))
            self.monitor.connect("IP0")
            # The connection has begun when it is answered.
            self.hosts["IP0"].ask("SU")
        elif self.hosts[port].ask(action) == "OK":
            self.monitor.happens(action)
        elif action == "SP":
            raise Failed("SP is answered OK in every mode")
        return None


def cases(binary, draw, count):
    for arm, flags in ARMS.items():
        with Emulator(binary, *QUIET, *STEPPED, *flags, "--serial-host-tcp", "127.0.0.1:0") as emulator:
            cell, left = Cell(emulator, arm, draw), count // len(ARMS)
            while left > 0:
                case = cell.act()
                if case:
                    left -= 1
                    yield case


def plant_canary():
    events.EVENTS["BR"] = "SC"
    return "BR counts as a stop request"
