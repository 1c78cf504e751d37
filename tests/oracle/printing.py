"""What PRINT sends: our manual, 4.1.1 and 4.1.3; `clauses.tsv` PRT-01 to PRT-15, BUF-01 to BUF-04; expressions: `scol.md` 1
(precedence, integer division, mixed arithmetic, 32-bit reals), 13.5 (the first number assigned fixes the type).

A value is a Python int or a `Real`. An expression is a tuple: ("int", text), ("real", text), ("variable", name),
("(", inner), ("-", inner), ("NOT", inner), ("call", name, inner) or (operator, left, right)."""

import decimal
import math
import struct

# PRT-04: a block of twelve characters.
WIDTH = 12
# PRT-05, PRT-06: decimals of a real.
DECIMALS = 3
RELATIONS = ("==", "<>", "<", ">", "<=", ">=")


class Undecided(Exception):
    """No source says what this gives: overflow, division by zero, the root of a negative number."""


class Real(float):
    """A real of the controller: 32 bits (scol.md 1, EXAMPLE-10)."""

    def __new__(cls, value):
        try:
            return super().__new__(cls, struct.unpack(">f", struct.pack(">f", value))[0])
        except OverflowError:
            raise Undecided from None


def integer(value):
    """A 32-bit integer (13.5)."""
    if not -2 ** 31 <= value < 2 ** 31:
        raise Undecided
    return value


def truncated(value):
    """INT, and what an integer variable keeps of a real: no decimals (13.5)."""
    return integer(math.trunc(value))


def quotient(left, right):
    """scol.md 1: an integer divided by an integer is an integer, truncated toward zero."""
    if right == 0:
        raise Undecided
    if isinstance(left, Real):
        return Real(left / right)
    magnitude = abs(left) // abs(right)
    return integer(magnitude if (left < 0) == (right < 0) else -magnitude)


def remainder(left, right):
    """MOD: of negative numbers and reals nothing is said."""
    if right <= 0 or left < 0 or isinstance(left, Real):
        raise Undecided
    return left % right


def binary(operator, left, right):
    """Mixed arithmetic is real; a relation gives 1 or 0."""
    if isinstance(left, Real) != isinstance(right, Real):
        left, right = Real(left), Real(right)
    if operator in RELATIONS:
        return int({"==": left == right, "<>": left != right, "<": left < right, ">": left > right, "<=": left <= right,
                    ">=": left >= right}[operator])
    if operator in ("AND", "OR"):
        return int(bool(left) and bool(right)) if operator == "AND" else int(bool(left) or bool(right))
    if operator == "/":
        return quotient(left, right)
    if operator == "MOD":
        return remainder(left, right)
    value = {"+": left + right, "-": left - right, "*": left * right}[operator]
    return Real(value) if isinstance(left, Real) else integer(value)


def function(name, value):
    """INT, ABS and SQRT (scol.md 3.11)."""
    if name == "INT":
        return truncated(value)
    if name == "ABS":
        return Real(abs(value)) if isinstance(value, Real) else integer(abs(value))
    if value < 0:
        raise Undecided
    return Real(math.sqrt(value))


def evaluate(expression, variables):
    """The value of an expression."""
    kind, *rest = expression
    if kind == "int":
        return integer(int(rest[0]))
    if kind == "real":
        return Real(float(rest[0]))
    if kind == "variable":
        return variables[rest[0]]
    if kind == "call":
        return function(rest[0], evaluate(rest[1], variables))
    values = [evaluate(part, variables) for part in rest]
    if kind == "(":
        return values[0]
    if kind == "NOT":
        return int(not values[0])
    if len(values) == 1:
        return Real(-values[0]) if isinstance(values[0], Real) else integer(-values[0])
    return binary(kind, *values)


def assigned(old, value):
    """The value of a variable after an assignment: its type stays (13.5)."""
    if isinstance(old, Real):
        return Real(value)
    return truncated(value)


def number(value):
    """An integer in decimal; a real with three decimals, rounded half away from zero (PRT-05, PRT-06, PRT-11)."""
    if not isinstance(value, Real):
        return str(value)
    with decimal.localcontext() as context:
        context.prec = 100
        step = decimal.Decimal(1).scaleb(-DECIMALS)
        return "{:f}".format(decimal.Decimal(float(value)).quantize(step, rounding=decimal.ROUND_HALF_UP))


def block(value):
    """PRT-04: right-justified in twelve characters; PRT-12: asterisks if it does not fit (scol.md 3.8 would widen the field; the
    clause is newer)."""
    text = number(value)
    return text.rjust(WIDTH) if len(text) <= WIDTH else "*" * WIDTH


def sent(items, variables):
    """The bytes of one PRINT. An item is ("text", characters), ("CR",) or an expression."""
    if items == [("text", "BUFFRESET")]:
        # BUF-03: it clears the receive buffer and sends nothing.
        return b""
    out = ""
    for item in items:
        out += item[1] if item[0] == "text" else "\r" if item[0] == "CR" else block(evaluate(item, variables))
    return out.encode("ascii")


def source(item):
    """An item or an expression as it is written in a program."""
    kind, *rest = item
    if kind == "text":
        return '"%s"' % rest[0]
    if kind == "CR":
        return "CR"
    if kind in ("int", "real", "variable"):
        return rest[0]
    if kind == "call":
        return "%s(%s)" % (rest[0], source(rest[1]))
    if kind == "(":
        return "(%s)" % source(rest[0])
    if len(rest) == 1:
        return "%s%s" % ("NOT " if kind == "NOT" else "-", source(rest[0]))
    return "%s %s %s" % (source(rest[0]), kind, source(rest[1]))
