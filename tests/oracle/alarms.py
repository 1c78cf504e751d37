"""Alarm numbers on the wire: the words of SF, the numbers of EU, AC and AH, the level of SM, and what a level does.

- Our manual, 5.3.3 FL (4) error history and (5) item 5; the SCARA edition, page 106 (S25: second ranges), page 152 (S92: AH).
- `decisions.md` D5 (AC, AH), D6 (words and levels), T8 (numbers and texts), T9 (dates); `hosts.md` 9.1.1 (the public list)."""

BASES = {8: 0, 4: 368, 2: 512, 1: 736}
# How many codes the first range has, and where the second goes on (S25). Level 1 ends at 959 in the SCARA edition.
FIRST = {8: 368, 4: 144, 2: 224, 1: 224}
SECOND = {8: 960, 4: 1472, 2: 1728, 1: 1984}
NONE = 0xFFFF

# T8 and hosts.md 9.1.1; the texts as the list shows them. 8-031 is left out: the print has a slip in its name. The row "Axis n Exceed
# Speed" folds six names; the only name with an axis that the list prints whole is that of 8-561, `Axis1`.
TEXTS = {
    "8-002": "Memory Check error", "8-004": "Watchdog error", "8-007": "Servo soft Watchdog error", "8-013": "AC Alarm",
    "8-014": "Emergency Stop SW ON", "8-015": "Parameter error", "8-016": "Servo Type error", "8-017": "Safety SW ON",
    "8-018": "Servo CPU error", "8-024": "MMI timeout", "8-026": "Servo Gate OFF error", "8-029": "DC24 Regulator error",
    "8-032": "Servo Power Over Volt", "8-033": "Distribution error", "8-034": "Unable to Trans",
    "8-035": "Point Invalid of Range", "8-041": "Axis1 Exceed Speed", "8-042": "Axis2 Exceed Speed",
    "8-043": "Axis3 Exceed Speed", "8-044": "Axis4 Exceed Speed", "8-045": "Axis5 Exceed Speed",
    "8-046": "Axis6 Exceed Speed", "8-353": "Fieldbus Parameter error", "8-354": "Fieldbus Offline",
    "8-355": "Fieldbus Board error", "8-561": "Axis1 communication error", "4-077": "PLC user alarm",
    # S11: the watchdog of the host; S89: INPUT.
    "1-200": "Host Port Time Out", "2-137": "Host Port Time Out", "8-352": "Host Port Time Out", "2-046": "Invalid Channel",
}


def parse(number):
    """`2-046` as level and code."""
    level, code = number.split("-")
    return int(level), int(code)


def word(number):
    """D6: base + code - 1; codes beyond the first range go on in the second."""
    level, code = parse(number)
    if code <= FIRST[level]:
        return BASES[level] + code - 1
    return SECOND[level] + code - 1 - FIRST[level]


def printed(number):
    """The seven characters of EU, AC and AH: `002-046` (EU-02, S22)."""
    level, code = parse(number)
    return "%03d-%03d" % (level, code)


def highest(numbers):
    """AL of SM: the level of the alarm that occurs now, 0 for none (L15)."""
    return max([parse(number)[0] for number in numbers], default=0)


def effect(level, status, servo):
    """D6: what an alarm does at once to a program's status and to servo power: 8 stops and turns power off, 4 stops, 2 lets
    the step end, 1 warns."""
    if level == 8:
        return ("retry" if status == "running" else status), False
    if level == 4:
        return ("retry" if status == "running" else status), servo
    return status, servo


def history_record(number, moment):
    """EU: code, `YY-MM-DD`, `HH:MM:SS`, with one blank between (EU-06)."""
    return "%s %s" % (printed(number), moment.strftime("%y-%m-%d %H:%M:%S"))


def message_record(number, text, moment, four_digits):
    """AC and AH: number, message, date and time with commas; T9: AC has four digits of the year in the field dialect."""
    return "%s,%s,%s" % (printed(number), text, moment.strftime("%Y-%m-%d %H:%M:%S" if four_digits else "%y-%m-%d %H:%M:%S"))


def message_file(records):
    """D5: the count and a comma before the first record, CR after each; none: `0`."""
    return "0" if not records else "%d,%s" % (len(records), "".join(record + "\r" for record in records))


def history_file(records):
    """EU: the count and CR, then the records with CR, the newest first (EU-06)."""
    return "%d\r%s" % (len(records), "".join(record + "\r" for record in records))
