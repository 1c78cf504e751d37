"""What INPUT reads: our manual, section 4 and 4.1.2, 4.1.3; `clauses.tsv` NPC-01, INP-01 to INP-17, BUF-01, BUF-02; `decisions.md`
D10 (`CR LF` and `, CR` end a record), T13 (a string that is not a number); `scol.md` 13.9 (`5.` is a real)."""

import re

from printing import Real, truncated

# What an empty field counts as (INP-17).
EMPTY = "0"
# T13.4: what exceeds them is ignored.
ROWS = 128
NUMBER = re.compile(r"[+-]?\d+\.?\d*")


class Malformed(Exception):
    """A value that is no number: alarm 2-046 (S89, T13.1)."""


class Buffer:
    """The ring buffer of one channel, as INPUT draws from it."""

    def __init__(self):
        self.clear()

    def clear(self):
        """PRINT "BUFFRESET", or a start from step 1 (D10)."""
        self.data, self.after_comma = "", False

    def receive(self, data):
        self.data += data

    def value(self):
        """The next value; None while it is not complete: that takes a comma or CR behind it (INP-16)."""
        # LF and blanks around a number are ignored (INP-17).
        self.data = self.data.lstrip("\n ")
        if self.after_comma and self.data.startswith("\r"):
            # `, CR` ends a record without an empty value (D10).
            self.data, self.after_comma = self.data[1:].lstrip("\n "), False
        match = re.match("([^,\r]*)([,\r])", self.data)
        if not match:
            return None
        self.data, self.after_comma = self.data[match.end():], match.group(2) == ","
        return match.group(1).strip("\n ") or EMPTY


def alarm(token):
    """A string that is no number raises 2-046 (S89, T13.1)."""
    raise Malformed(token)


def leading_number(token):
    """The leading numeric part, 0 if there is none (INP-14)."""
    match = NUMBER.match(token)
    return match.group() if match else "0"


def zero(_token):
    """[U25] 1: the string is 0 (T13.2)."""
    return "0"


def looked_up(rows):
    """[U25] 2: the number of the first row of STRING.PAR that fits, in exact letter case; at most 128 rows (T13.4, T13.5)."""
    def find(token):
        for number, text in rows[:ROWS]:
            if text == token:
                return str(number)
        raise Malformed(token)
    return find


def policy(arm, dialect, switch, rows):
    """What becomes of a string that is no number. In the manual dialect on six axes its leading number counts, and [U25] has no
    effect (T13.1, T13.3, T27.12). `switch`: the first number of [U25]; None: the file has no such section, which means 0."""
    if arm == "six-axis" and dialect == "manual":
        return leading_number
    return {0: alarm, 1: zero, 2: looked_up(rows)}[switch or 0]


def number(token, malformed):
    """The value of a token."""
    if not NUMBER.fullmatch(token):
        token = malformed(token)
    return Real(float(token)) if "." in token else int(token)


def received(old, token, malformed):
    """The variable after INPUT: its type stays, a real sent to an integer loses its decimals (INP-15)."""
    value = number(token, malformed)
    return Real(value) if isinstance(old, Real) else truncated(value)


def cancelled(tokens, count):
    """INP-09, INP-10: a stop ends the INPUT; variables whose data had not come count as 0, the program goes on behind it."""
    return tokens + ["0"] * (count - len(tokens))
