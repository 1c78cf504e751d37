"""MW and MR on global variables and data of every type, with wrong names, types, counts and flags between; RS,PRG brings the values
of the file back."""

import variables
from link import Asking, Case, Failed, robots
from printing import Real

RULE = "our manual 5.3.3: MR, MW, FL (7); MR-01 to MR-05, CMD-MR-*, CMD-MW-*"
DATA = {"six-axis": ("POINT P1=1,2,3,4,5,6,0,0/12111", "TRANS T1=400,200,50,90", "PAYLOAD H1=3,100"),
        "scara": ("POINT P1=1,2,3,4,5/RIGHTY", "TRANS T1=400,200,50,90", "PAYLOAD H1=3,100")}
FIRST = {"six-axis": {"P1": (1, 2, 3, 4, 5, 6, 0, 0, 12111), "T1": (400, 200, 50, 90, 0, 0), "H1": (3, 100, 0, 0, 0, 0, 0)},
         "scara": {"P1": (1, 2, 3, 4, 5, 2), "T1": (400, 200, 50, 90), "H1": (3, 100)}}
KINDS = {"P1": variables.POSITION, "T1": variables.COORDINATE, "H1": variables.LOAD}
NAMES = ("A", "ABCDEFGHIJ", "R", "P1", "T1", "H1")
WRONG = ("B", "ABCDEFGHIJK", "P2", "LOCAL")


def program(arm):
    head = ["GLOBAL", "A = 10", "ABCDEFGHIJ = -7", "R = 1.5", "END", "PROGRAM P", "LOCAL = 1", "END", "DATA"]
    return "\n".join([*head, *DATA[arm], "END", ""])


def memory(arm):
    """What the file gives."""
    rows = {"A": (variables.INTEGER, [10]), "ABCDEFGHIJ": (variables.INTEGER, [-7]), "R": (variables.REAL, [Real(1.5)])}
    rows.update({name: (KINDS[name], [Real(value) for value in values]) for name, values in FIRST[arm].items()})
    return variables.Memory(arm, rows)


def values(draw, arm, code, count):
    """So many values as a host sends them; the last of a position is its configuration."""
    if code == variables.INTEGER:
        return [str(draw.choice((draw.randint(-9, 9), draw.randint(-2 ** 31, 2 ** 31 - 1)))) for _ in range(count)]
    # Whether an integer -0 keeps its sign in a real is not said.
    out = [("%.*f" % (draw.choice((0, 1, 3)), draw.uniform(-999, 999))).replace("-0", "0") for _ in range(count)]
    if code == variables.POSITION:
        out[-1] = "".join(draw.choice("012") for _ in range(5)) if arm == "six-axis" else draw.choice("012")
    return out


def cases(binary, draw, count):
    for emulator, arm, dialect in robots(binary):
        host, facts = Asking(emulator.address("ip0")), memory(arm)
        emulator.robot.files["P"] = program(arm)
        if host.ask("SL,P") != "OK":
            raise Failed("SL,P is answered OK\n%s" % program(arm))
        for _ in range(count // 4):
            if draw.random() < 0.03:
                facts.reset()
                if host.ask("RS,PRG") != "OK":
                    raise Failed("RS,PRG is answered OK")
            name = draw.choice(NAMES if draw.random() < 0.92 else WRONG)
            kind = facts.now[name][0] if name in facts.now else variables.INTEGER
            code = kind if draw.random() < 0.9 else draw.choice(range(5))
            spelled = name.lower() if draw.random() < 0.1 else name
            if draw.random() < 0.6:
                code = variables.UNCLARIFIED if draw.random() < 0.1 else code
                text, expected = "MR,%s %d" % (spelled, code), facts.read(spelled, code)
            else:
                flag = draw.choice((0, 0, 0, 0, 1, 1, 2))
                wanted = variables.COUNTS[arm][code]
                data = values(draw, arm, code, wanted if draw.random() < 0.9 else draw.choice((wanted - 1, wanted + 1)) or 2)
                text = "MW,%d %s %d %s" % (flag, spelled, code, " ".join(data))
                expected = facts.write(flag, spelled, code, data)
            yield Case("%s, %s, %s dialect" % (text, arm, dialect), expected, host.ask(text), RULE)


def plant_canary():
    variables.LONGEST_NAME = 9
    return "names have nine characters"
