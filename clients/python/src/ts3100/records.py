"""What the robot answers, as typed records. Each `parse` reads the bytes between `FL,` and EOF.

The forms are in docs/reference/protocol/status.md and extensions.md of the project.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from datetime import datetime
from enum import IntEnum
from typing import FrozenSet, List, Optional, Sequence, Tuple, Union

from .errors import ProtocolError

Number = Union[int, float]

NO_ALARM = 0xFFFF
# Level, first word, number of codes, first word of the further codes.
ALARM_WORDS = ((8, 0, 368, 960), (4, 368, 144, 1472), (2, 512, 224, 1728), (1, 736, 224, 1984))
FURTHER_CODES = {8: 512, 4: 256, 2: 256, 1: 256}
# First line of each group of IO and SF; a group has four words of 16 lines.
LINE_GROUPS = (1, 101, 201, 301, 401)
LINES_A_GROUP = 64
SIX_AXIS_BYTES, SCARA_BYTES = 276, 250
IO_BYTES = 80


class ExecutionStatus(IntEnum):
    """Whether a program runs, and how the next start continues."""

    STOP_RESET = 0
    RUNNING = 1
    STOP_RETRY = 2
    STOP_CONTINUE = 3


class RunMode(IntEnum):
    """Operation mode."""

    CONTINUOUS = 0
    CYCLE = 1
    STEP = 2
    SEGMENT = 3


class VariableType(IntEnum):
    """Type of a variable in MR and MW. ANY is the type that the variable has."""

    ANY = -1
    INTEGER = 0
    REAL = 1
    LOAD = 2
    COORDINATE = 3
    POSITION = 4


class Frame(IntEnum):
    """What the values of a position belong to, in the numbers of PR as commanded."""

    JOINT = 0
    WORLD = 1
    WORK = 2


class GuideMode(IntEnum):
    """How JG moves the arm."""

    JOG = 0
    INCHING = 1
    FREE = 2


class GuideRate(IntEnum):
    """How fast JG moves the arm."""

    SLOW = 0
    MID = 1
    FAST = 2


class Coordinates(IntEnum):
    """Coordinate system of JG."""

    JOINT = 0
    TOOL = 1
    WORK = 2
    WORLD = 3


def _malformed(command: str, expected: str, found: object) -> ProtocolError:
    return ProtocolError(f"cannot read the answer to {command}: expected {expected}, found {found!r}")


def _number(command: str, word: str) -> Number:
    try:
        return float(word) if "." in word else int(word)
    except ValueError:
        raise _malformed(command, "a number", word) from None


def _records(data: bytes) -> List[str]:
    """The records of an answer, each ended by CR."""
    return [record for record in data.decode("latin-1").split("\r") if record]


@dataclass(frozen=True)
class Status:
    """SU. `mode` is without blanks, such as `external(ethernet)`; `speed_limit` is None in dialect `manual`."""

    mode: str
    run_mode: RunMode
    file: str
    override: int
    speed_limit: Optional[int]
    machine_lock: bool
    status: ExecutionStatus

    @classmethod
    def parse(cls, data: bytes) -> Status:
        text = data.decode("latin-1").replace(" (", "(").replace("\r", " ")
        form = (r"MODE:(\S+)/(\w+) FILE:(\S*) OVRD:(\d+)% (?:LSPEED:(\d*)%?)? ?MACHINE:(\w+) "
                r"STATUS:(running|stop\((?:reset|retry|continue)\)) *")
        found = re.fullmatch(form, text)
        if not found or found[2].upper() not in RunMode.__members__:
            raise _malformed("SU", "MODE, FILE, OVRD, LSPEED, MACHINE and STATUS", data)
        status = found[7].upper().replace("(", "_").rstrip(")")
        return cls(found[1], RunMode[found[2].upper()], found[3], int(found[4]), int(found[5]) if found[5] else None,
                   found[6] == "lock", ExecutionStatus[status])


@dataclass(frozen=True)
class TotalStatus:
    """SF. Alarms are written `8-014`, oldest first; positions are in mm and degrees."""

    servo_on: bool
    emergency_stop: bool
    status: ExecutionStatus
    changed: bool
    alarms: Tuple[str, ...]
    execution_line: int
    analysis_line: int
    execution_task: int
    analysis_task: int
    feed_hold: bool
    coordinates: Coordinates
    guide_rate: GuideRate
    guide_mode: GuideMode
    master_mode: int
    power_on_minutes: int
    run_minutes: int
    inputs: FrozenSet[int]
    outputs: FrozenSet[int]
    joints: Tuple[float, ...]
    world: Tuple[float, ...]
    work: Tuple[float, ...]
    work_name: str
    tool_name: str
    base_name: str

    @classmethod
    def parse(cls, data: bytes) -> TotalStatus:
        if len(data) not in (SIX_AXIS_BYTES, SCARA_BYTES):
            raise _malformed("SF", f"{SIX_AXIS_BYTES} or {SCARA_BYTES} bytes", len(data))
        axes = 8 if len(data) == SIX_AXIS_BYTES else 6
        head = struct.unpack_from(">4B10H10H2I16H16H", data)
        floats = struct.unpack_from(f">{3 * axes}f", data, 116)
        names = struct.unpack_from("20s20s20s", data, 116 + 12 * axes)
        words = head[4:14]
        rest = head[14:]
        try:
            status = ExecutionStatus(head[2])
            guide = Coordinates(rest[5]), GuideRate(rest[6]), GuideMode(rest[7])
        except ValueError as error:
            raise _malformed("SF", "a status and a guide mode of the manual", str(error)) from None
        work, tool, base = (name.rstrip(b"\0 ").decode("latin-1") for name in names)
        return cls(head[0] != 0, head[1] != 0, status, head[3] != 0,
                   tuple(alarm_number(word) for word in words if word != NO_ALARM),
                   rest[0], rest[1], rest[2], rest[3], rest[4] != 0, *guide, rest[8], rest[10], rest[11],
                   _lines(rest[12:28]), _lines(rest[28:44]),
                   floats[:axes], floats[axes:2 * axes], floats[2 * axes:], work, tool, base)


def alarm_number(word: int) -> str:
    """The alarm of an alarm word: 557 is `2-046`."""
    for level, base, codes, further in ALARM_WORDS:
        if base <= word < base + codes:
            return f"{level}-{word - base + 1:03}"
        if further <= word < further + FURTHER_CODES[level]:
            return f"{level}-{word - further + codes + 1:03}"
    raise _malformed("SF", "an alarm word", word)


def _lines(words: Sequence[int]) -> FrozenSet[int]:
    """The numbers of the lines that are on in these words of 16 lines, bit 0 first."""
    return frozenset(LINE_GROUPS[word * 16 // LINES_A_GROUP] + word * 16 % LINES_A_GROUP + bit
                     for word, value in enumerate(words) for bit in range(16) if value >> bit & 1)


@dataclass(frozen=True)
class QuickStatus:
    """SM. `alarm_level` is that of the worst active alarm; `done` counts ended DOs, one digit."""

    emergency_stop: bool
    safety_open: bool
    stop_input: bool
    break_input: bool
    servo_on: bool
    master_mode: int
    run_mode: RunMode
    status: ExecutionStatus
    override: int
    alarm_level: int
    done: int
    do_running: bool

    @classmethod
    def parse(cls, data: bytes) -> QuickStatus:
        labels = ("EE", "SE", "SC", "BC", "ES", "SS", "SV", "MM", "RM", "RS", "OV", "AL", "DC", "DS")
        items = data.decode("latin-1").split(" ")
        if len(items) != len(labels) or any(not re.fullmatch(label + r"\d+", item) for label, item in zip(labels, items)):
            raise _malformed("SM", " ".join(labels), data)
        value = {item[:2]: int(item[2:]) for item in items}
        try:
            modes = RunMode(value["RM"]), ExecutionStatus(value["RS"])
        except ValueError as error:
            raise _malformed("SM", "an operation mode and an execution status", str(error)) from None
        return cls(value["EE"] != 0, value["SE"] != 0, value["SC"] != 0, value["BC"] != 0, value["SV"] != 0, value["MM"],
                   *modes, value["OV"], value["AL"], value["DC"], value["DS"] != 0)


@dataclass(frozen=True)
class AlarmRecord:
    """An alarm of EU, AC or AH. EU has no message."""

    number: str
    message: str
    at: datetime

    @classmethod
    def parse_history(cls, data: bytes) -> List[AlarmRecord]:
        """EU: the count, then records with blanks between number, date and time."""
        return [cls._of("EU", *record.partition(" ")[::2], "") for record in _records(data)[1:]]

    @classmethod
    def parse_list(cls, command: str, data: bytes) -> List[AlarmRecord]:
        """AC and AH: the count and a comma before the first record, commas between the fields."""
        _, _, rest = data.partition(b",")
        alarms = []
        for record in _records(rest):
            fields = record.split(",")
            if len(fields) != 3:
                raise _malformed(command, "number, message and date", record)
            alarms.append(cls._of(command, fields[0], fields[2], fields[1]))
        return alarms

    @classmethod
    def _of(cls, command: str, number: str, date: str, message: str) -> AlarmRecord:
        level, _, code = number.partition("-")
        try:
            year = "%y" if date[2:3] == "-" else "%Y"
            return cls(f"{int(level)}-{code}", message, datetime.strptime(date, year + "-%m-%d %H:%M:%S"))
        except ValueError:
            raise _malformed(command, "LLL-CCC and a date YYYY-MM-DD HH:MM:SS or YY-MM-DD HH:MM:SS", (number, date)) from None


@dataclass(frozen=True)
class FileEntry:
    """A file of CA; the size is in bytes without EOF."""

    name: str
    size: int

    @classmethod
    def parse(cls, data: bytes) -> List[FileEntry]:
        entries = []
        for record in _records(data):
            name, _, size = record.partition(" ")
            if not size.isdigit():
                raise _malformed("CA", "NAME SIZE", record)
            entries.append(cls(name, int(size)))
        return entries


@dataclass(frozen=True)
class Version:
    """A record of VR: of the system, and in dialect `manual` of the arm."""

    name: str
    built: datetime
    checksum: str

    @classmethod
    def parse(cls, data: bytes) -> List[Version]:
        versions = []
        for record in _records(data):
            found = re.fullmatch(r"(.{1,11}?) *(\d{4})[-/](\d\d)[-/](\d\d) ?(\d\d):(\d\d) ?(\S{4})", record)
            if not found:
                raise _malformed("VR", "name, date, time and four digits", record)
            year, month, day, hour, minute = (int(found[part]) for part in range(2, 7))
            versions.append(cls(found[1], datetime(year, month, day, hour, minute), found[7]))
        return versions


@dataclass(frozen=True)
class Lines:
    """IO: the numbers of the lines that are on."""

    inputs: FrozenSet[int]
    outputs: FrozenSet[int]

    @classmethod
    def parse(cls, data: bytes) -> Lines:
        words = struct.unpack(">40H", data)
        return cls(_lines(words[:20]), _lines(words[20:]))


@dataclass(frozen=True)
class Position:
    """PR. `configuration` is None for joints, five digits for a six-axis arm and 0 to 2 for a SCARA."""

    values: Tuple[float, ...]
    configuration: Optional[str]

    @classmethod
    def parse(cls, data: bytes) -> Position:
        words = data.decode("latin-1").split(",")
        configuration = None if "." in words[-1] else words.pop()
        return cls(tuple(float(_number("PR", word)) for word in words), configuration)


@dataclass(frozen=True)
class MaintenanceItem:
    """An item of MN: 6 values for items 1 to 9 and 17, otherwise 1."""

    number: int
    values: Tuple[float, ...]

    @classmethod
    def parse(cls, data: bytes) -> MaintenanceItem:
        (record,) = _records(data)
        number, *values = record.split(",")
        return cls(int(_number("MN", number)), tuple(float(_number("MN", value)) for value in values))


def numbers(command: str, data: bytes) -> Tuple[Number, ...]:
    """The numbers of MR, VL and HI, with blanks or commas between them."""
    return tuple(_number(command, word) for word in data.decode("latin-1").replace(",", " ").split())
