"""Programs of random PRINT statements, fifty at a time, on IP1: numbers, strings and expressions over typed variables."""

import string

import printing
from link import QUIET, RUNNING, Asking, Case, Emulator, Failed, Line

STATEMENTS = 50
# No source has a longer line (RAM-01), and COM1 transfers 256 bytes (SER-03).
LONGEST_LINE, LONGEST_TEXT = 240, 250
MARK = b"|\r"
CHARACTERS = string.ascii_letters + string.digits + " '()+-*/,.<>=![]{}%^&?;:"
# Binding of the operators, the weakest first (scol.md 1).
LEVELS = (("OR",), ("AND",), printing.RELATIONS, ("+", "-"), ("*", "/", "MOD"))
RULE = ("our manual 4.1.1: a 12-character block of fixed length, pushed over to the right; integer up to ten digits; real with three "
        "decimals; PRT-03 to PRT-13; expressions: scol.md 1")


def literal(draw):
    """A number as a program writes it."""
    if draw.random() < 0.5:
        return ("int", str(draw.choice((draw.randint(0, 9), draw.randint(0, 9999), draw.randint(0, 2 ** 31 - 1)))))
    whole = draw.choice((0, draw.randint(0, 9), draw.randint(0, 9999), draw.randint(0, 99999999)))
    digits = draw.choice((0, 1, 2, 3, 4, 5))
    # 13.9: `1234567.` is a real.
    return ("real", "%d.%s" % (whole, "".join(draw.choice(string.digits) for _ in range(digits))))


def atom(draw, depth, names):
    """A number, a variable, a call or something in parentheses."""
    what = draw.random()
    if depth == 0 or what < 0.4:
        return literal(draw)
    if what < 0.6:
        return ("variable", draw.choice(names))
    if what < 0.8:
        return ("call", draw.choice(("INT", "ABS", "SQRT")), expression(draw, depth - 1, names))
    return ("(", expression(draw, depth - 1, names))


def chain(draw, depth, names, level):
    """Operators of one level, from left to right, over chains that bind tighter."""
    if level == len(LEVELS):
        inner = atom(draw, depth, names)
        return ("-", inner) if draw.random() < 0.1 and inner[0] in ("variable", "(", "call") else inner
    out = chain(draw, depth, names, level + 1)
    # Relations of relations: nobody has seen one.
    for _ in range(draw.choice((0, 0, 0, 0, 1)) if level < 3 else draw.choice((0, 0, 1, 2))):
        out = (draw.choice(LEVELS[level]), out, chain(draw, depth, names, level + 1))
    return out


def expression(draw, depth, names):
    """A whole expression; a minus in front binds to its first number."""
    out = chain(draw, depth, names, draw.choice((0, 2, 3, 3, 3, 3)))
    if draw.random() < 0.05:
        out = ("NOT", ("(", out))
    elif draw.random() < 0.2 and out[0] in ("int", "real", "variable"):
        out = ("-", out)
    return out


def statement(draw, names):
    """The items of a PRINT."""
    if draw.random() < 0.02:
        return [("text", "BUFFRESET")] + [("CR",)] * draw.choice((0, 1))
    items = [("text", "".join(draw.choice(CHARACTERS) for _ in range(draw.randint(0, 20)))) if draw.random() < 0.2
             else expression(draw, draw.choice((0, 0, 1, 2)), names) for _ in range(draw.choice((1, 1, 2, 3, 5)))]
    return items + [("CR",)] * draw.choice((0, 1))


def program(draw):
    """The lines of a program, and what each PRINT sends."""
    variables = {"N%d" % number: 0 for number in range(4)}
    variables.update({"X%d" % number: printing.Real(0) for number in range(4)})
    names, lines, expected = list(variables), ["PROGRAM P"], []
    lines += ["%s = %s" % (name, "0.0" if isinstance(value, printing.Real) else "0") for name, value in variables.items()]
    while len(expected) < STATEMENTS:
        try:
            if draw.random() < 0.3:
                name, value = draw.choice(names), expression(draw, 1, names)
                line = "%s = %s" % (name, printing.source(value))
                new = printing.assigned(variables[name], printing.evaluate(value, variables))
                if len(line) <= LONGEST_LINE:
                    variables[name] = new
                    lines.append(line)
                continue
            items = statement(draw, names)
            line = "PRINT IP1, " + ", ".join(printing.source(item) for item in items)
            out = printing.sent(items, variables)
        except printing.Undecided:
            continue
        if len(line) <= LONGEST_LINE and len(out) <= LONGEST_TEXT:
            lines += [line, 'PRINT IP1, "|", CR']
            values = " ".join("%s=%s" % (name, printing.number(value)) for name, value in variables.items() if name in line)
            expected.append((line + ("   with " + values if values else ""), out))
    return "\n".join(lines + ["END", ""]), expected


def cases(binary, draw, count):
    with Emulator(binary, *QUIET, *RUNNING, "--servo-on") as emulator:
        host, channel = Asking(emulator.address("ip0")), Line(emulator.address("ip1"))
        for _ in range(max(1, count // STATEMENTS)):
            text, expected = program(draw)
            emulator.robot.files["P"] = text
            for command in ("SL,P", "RN"):
                if host.ask(command) != "OK":
                    raise Failed("%s is answered OK\n%s" % (command, text))
            for line, out in expected:
                try:
                    found = channel.until(MARK)
                except Failed as error:
                    raise Failed("%s: no answer: %s\n%s" % (line, host.ask("AC"), error)) from None
                yield Case(line, out, found[:-len(MARK)], RULE)


def plant_canary():
    printing.DECIMALS = 2
    return "reals have two decimals"
