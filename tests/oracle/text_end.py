"""Where a text ends that begins without STX: `decisions.md` T6, T7 (bytes between texts), T22 (the rest of a text that timed out),
T27.1 to T27.5; our manual 5.2.1 (a text ends with ETX), `clauses.tsv` FRM-04, SER-06.

Times are in milliseconds."""

STX, ETX, CR = 0x02, 0x03, 0x0D
# T7: skipped between texts.
SKIPPED = (0x0D, 0x0A, 0x00, 0x20)
# T6.3: how long a CR waits for its ETX.
PATIENCE = 250
# SER-06: the longest gap between two characters of a text.
LIMIT = 10_000


class Undecided(Exception):
    """No source says what becomes of this byte."""


class Text:
    """A text that has ended: its data without the CR at the end and whether there was one, whether STX began it, whether the
    finding `no-etx` is made."""

    def __init__(self, data, framed, by_cr):
        self.delimited = data[-1:] == b"\r"
        self.data = bytes(data[:-1] if data[-1:] == b"\r" else data)
        self.framed = framed
        # T27.2: not for OK and NG.
        self.no_etx = by_cr and self.data not in (b"OK", b"NG")


class Reader:
    """One connection with the option `text.end`: `etx`, `cr` or `detect`; `required`: as `etx`, and a text begins with STX."""

    def __init__(self, option):
        self.option = option
        self.mark = {"etx": "etx", "cr": "cr", "detect": None, "required": "etx"}[option]
        self.state, self.data = "between", bytearray()
        self.waits = self.swallow = False
        self.silent = 0
        self.texts = []

    def receive(self, byte):
        """One byte."""
        self.silent = 0
        getattr(self, self.state)(byte)

    def passes(self, milliseconds):
        """Silence."""
        self.silent += milliseconds
        if self.waits and self.silent >= PATIENCE:
            # T6.3
            self.end_by_cr()
        elif self.state in ("bare", "framed") and self.silent >= LIMIT:
            # T22
            self.state = "dropping"

    def begin(self, state):
        self.state, self.data, self.waits, self.swallow = state, bytearray(), False, False

    def end(self, framed=False, by_cr=False):
        self.texts.append(Text(self.data, framed, by_cr))
        self.begin("between")

    def end_by_cr(self):
        """T6.2, T6.3, T6.4: the connection is marked, and an ETX right behind is swallowed."""
        self.mark = "cr"
        self.end(by_cr=True)
        self.swallow = True

    def end_by_etx(self, framed):
        """T6.1, T27.4: an unmarked connection is marked; a mark stays."""
        self.mark = self.mark or "etx"
        self.end(framed)

    def between(self, byte):
        swallow, self.swallow = self.swallow, False
        if byte == STX:
            self.begin("framed")
        elif self.option == "required":
            # D0: bytes outside STX to ETX are ignored.
            return
        elif byte == ETX:
            if not swallow:
                raise Undecided
        elif byte not in SKIPPED:
            self.begin("bare")
            self.bare(byte)

    def bare(self, byte):
        if byte == ETX:
            self.end_by_etx(framed=False)
        elif self.waits:
            # T6.2: the byte begins the next text.
            self.end_by_cr()
            self.swallow = False
            self.between(byte)
        elif byte == STX:
            # FRM-04: STX restarts reception.
            self.begin("framed")
        else:
            self.data.append(byte)
            if byte == CR and self.mark == "cr":
                self.end_by_cr()
            elif byte == CR and self.mark is None:
                self.waits = True

    def framed(self, byte):
        if byte == ETX:
            self.end_by_etx(framed=True)
        elif byte == STX:
            self.begin("framed")
        else:
            self.data.append(byte)

    def dropping(self, byte):
        """T22, T27.3: up to the next ETX or STX, on a connection marked cr up to CR too."""
        if byte == STX:
            self.begin("framed")
        elif byte == ETX or byte == CR and self.mark == "cr":
            self.begin("between")
            # An ETX behind that CR: T6.4 speaks of a text that CR has ended.
            self.swallow = False
