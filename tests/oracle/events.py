"""EE, SE, SC, BC, ES and SS of SM: `decisions.md` T1, T27.6; the library's manual L16 to L18, L24, L25, L27.

EE, SE, SC and BC are events: 1 if the request came since the last answered SM of the same connection. ES and SS are states."""

LABELS = ("EE", "SE", "SC", "BC")
# T1.3, T1.4: which event an action is. Rising edges of Din257 (STOP) and Din260 (BREAK); all else is none.
EVENTS = {"press": "EE", "open": "SE", "SP": "SC", "STOP": "SC", "panel stop": "SC", "EC,BREAK": "BC", "BREAK": "BC"}


class Monitor:
    """The latches of each connection, the button and the safety switch."""

    def __init__(self, ports):
        self.latches = {port: set() for port in ports}
        self.pressed = self.opened = False

    def connect(self, port):
        """T1.1: what came before a connection concerns nobody."""
        self.latches[port] = set()

    def happens(self, action):
        """T1.2: a request sets the latch on every connection, the one it came from included."""
        if action in EVENTS:
            for latches in self.latches.values():
                latches.add(EVENTS[action])

    def press(self, pressed):
        if pressed and not self.pressed:
            self.happens("press")
        self.pressed = pressed

    def open(self, opened):
        if opened and not self.opened:
            self.happens("open")
        self.opened = opened

    def answer(self, port):
        """The first six items of an answered SM, which clears the latches of its connection."""
        items = ["%s%d" % (label, label in self.latches[port]) for label in LABELS]
        self.latches[port] = set()
        return items + ["ES%d" % self.pressed, "SS%d" % self.opened]
