"""MR and MW: our manual, 5.3.3 (MR, MW) and FL (7); `clauses.tsv` MR-01 to MR-05, CMD-MR-01 to CMD-MR-06, CMD-MW-01 to CMD-MW-06;
on a SCARA the counts of `hosts.md` 2 and `ste80722.md` S30; S47: RS,PRG initialises the data."""

from printing import Real, number

# Type code, and how many values it has.
INTEGER, REAL, LOAD, COORDINATE, POSITION = range(5)
COUNTS = {"six-axis": {INTEGER: 1, REAL: 1, LOAD: 7, COORDINATE: 6, POSITION: 9},
          "scara": {INTEGER: 1, REAL: 1, LOAD: 2, COORDINATE: 4, POSITION: 6}}
UNCLARIFIED = -1
LONGEST_NAME = 10
OK, NG = "OK", "NG"


class Memory:
    """The global variables of the selected file: type and values, in memory and as the file has them."""

    def __init__(self, arm, variables):
        self.arm, self.file = arm, dict(variables)
        self.reset()

    def reset(self):
        """RS,PRG initialises all program data (CMD-RS-03)."""
        self.now = dict(self.file)

    def find(self, name, code):
        """The values of a variable, None if the request gets NG (CMD-MR-06): unknown, a name of more than ten characters, a code
        that does not fit. Upper and lower case are not distinguished (RAM-07)."""
        name = name.upper()
        if len(name) > LONGEST_NAME or name not in self.now:
            return None
        kind, values = self.now[name]
        return values if code in (kind, UNCLARIFIED) else None

    def read(self, name, code):
        """MR: the values with blanks between them and CR; integers plain, reals with three decimals (MR-01 to MR-05)."""
        values = self.find(name, code)
        return NG if values is None else " ".join(number(value) for value in values) + "\r"

    def write(self, flag, name, code, data):
        """MW: flag 1 writes into the file too (CMD-MW-02); a wrong flag, name, type or count gets NG (CMD-MW-06)."""
        if flag not in (0, 1) or self.find(name, code) is None or len(data) != COUNTS[self.arm].get(code):
            return NG
        values = [int(word) if code == INTEGER else Real(float(word)) for word in data]
        self.now[name.upper()] = (code, values)
        if flag == 1:
            self.file[name.upper()] = (code, values)
        return OK
