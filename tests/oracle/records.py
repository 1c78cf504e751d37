"""What INPUT reads: our manual, section 4 and 4.1.2, 4.1.3; `clauses.tsv` NPC-01, INP-01 to INP-17, BUF-01, BUF-02; `decisions.md`
D10 (`CR LF` and `, CR` end a record), T13 (a string that is not a number); `scol.md` 13.9 (`5.` is a real)."""

import re

from printing import Real, truncated

# What an empty field counts as (INP-17).
EMPTY = "0"
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


def number(token, leading):
    """The value of a token. `leading`: its leading numeric part counts, 0 if it has none (INP-14), instead of an alarm."""
    match = NUMBER.match(token)
    if not match or match.end() < len(token):
        if not leading:
            raise Malformed(token)
        token = match.group() if match else "0"
    return Real(float(token)) if "." in token else int(token)


def received(old, token, leading):
    """The variable after INPUT: its type stays, a real sent to an integer loses its decimals (INP-15)."""
    value = number(token, leading)
    return Real(value) if isinstance(old, Real) else truncated(value)


def cancelled(tokens, count):
    """INP-09, INP-10: a stop ends the INPUT; variables whose data had not come count as 0, the program goes on behind it."""
    return tokens + ["0"] * (count - len(tokens))


def malformed_is_number(arm, dialect):
    """T13.1: in the manual dialect on six axes the leading number counts; else the alarm is raised."""
    return arm == "six-axis" and dialect == "manual"
