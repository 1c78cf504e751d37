"""The simple protocol without input and output: texts, exchanges, and every command of the manual.

A command is a generator. It yields bytes to send, or None when it needs more bytes; its return value is the answer. `host`
drives the generators over sockets and serial ports, blocking or with asyncio. A newcomer reads `Protocol.query` first.
"""

from __future__ import annotations

from typing import Generator, List, Mapping, Optional, Sequence, Tuple, TypeVar, Union

from . import records
from .errors import ProtocolError, Refused
from .records import (AlarmRecord, Coordinates, FileEntry, Frame, GuideMode, GuideRate, Lines, MaintenanceItem, Number, Position,
                      QuickStatus, RunMode, Status, TotalStatus, VariableType, Version)

T = TypeVar("T")
Exchange = Generator[Optional[bytes], None, T]

STX, ETX, CR, EOF = b"\x02", b"\x03", b"\r", b"\x1a"
OK, NG, SP, FL = b"OK\r", b"NG\r", b"SP\r", b"FL,"
# Data bytes of a text, between STX and ETX.
LONGEST_TEXT = 253
# Most bytes that wait to be read: hundreds of texts, where one is usual.
LONGEST_RECEIVED = 64 * 1024
# The directory of a full drive is longer than any file: 1,000 files of at most 20 characters a record.
LONGEST_ANSWER = 128 * 1024
MOST_LINES_WRITTEN = 32


def number(value: Number) -> str:
    """A number as the robot reads it: an integer without a point, a real with one and without an exponent."""
    if isinstance(value, int):
        return str(int(value))
    text = f"{value:.6f}".rstrip("0")
    return text + "0" if text.endswith(".") else text


class Protocol:
    """One connection of a host: what was received and not yet read, and the commands.

    With `total_split`, SF of a six-axis arm comes in two texts (option `sf.split = several`, dialect `manual`).
    """

    def __init__(self, stx: bool = True, checksum: bool = False, total_split: bool = False) -> None:
        self.stx = stx
        self.checksum = checksum
        self.total_split = total_split
        self.stops = 0
        self._received = bytearray()

    # Texts

    def feed(self, data: bytes) -> None:
        """Takes bytes that were received."""
        self._received += data
        if len(self._received) > LONGEST_RECEIVED:
            raise ProtocolError(f"{len(self._received)} bytes were received without an expected text, or the text has no end")

    def frame(self, data: bytes) -> bytes:
        """The text around this data."""
        if len(data) > LONGEST_TEXT:
            raise ValueError(f"cannot send {data[:20]!r}...: a text has at most {LONGEST_TEXT} bytes, this one {len(data)}")
        text = (STX if self.stx else b"") + data + ETX
        return text + bytes([self._sum(data)]) if self.checksum else text

    def discard(self) -> None:
        """Drops what was received before a command: late answers. An unsolicited SP among them counts."""
        stop = (STX if self.stx else b"") + SP + ETX
        self.stops += self._received.count(stop)
        rest = bytes(self._received[self._received.rfind(ETX) + 1:])
        self._received[:] = rest if stop.startswith(rest) else b""

    @staticmethod
    def _sum(data: bytes) -> int:
        return (sum(data) + ETX[0]) & 0xFF

    def _exactly(self, count: int) -> Exchange[bytes]:
        while len(self._received) < count:
            yield None
        data = bytes(self._received[:count])
        del self._received[:count]
        return data

    def _begin(self) -> Exchange[None]:
        if self.stx:
            first = yield from self._exactly(1)
            if first != STX:
                raise ProtocolError(f"expected STX at the beginning of a text, found {first!r}")

    def _end(self, data: bytes) -> Exchange[None]:
        """The checksum after the ETX of a text with this data."""
        if self.checksum:
            found = yield from self._exactly(1)
            if found[0] != self._sum(data):
                raise ProtocolError(f"expected checksum {self._sum(data):02X}, found {found[0]:02X}")

    def _any_text(self) -> Exchange[bytes]:
        while (end := self._received.find(ETX)) < 0:
            yield None
        yield from self._begin()
        data = yield from self._exactly(end - int(self.stx))
        yield from self._exactly(1)
        yield from self._end(data)
        return data

    def _text(self) -> Exchange[bytes]:
        """The next text that is an answer. An unsolicited SP may come before it."""
        while (data := (yield from self._any_text())) == SP:
            self.stops += 1
        return data

    def _answer(self, command: str) -> Exchange[bytes]:
        data = yield from self._text()
        if data == NG:
            raise Refused(f"{command} was refused: NG")
        return data

    def _ask(self, command: str) -> Exchange[None]:
        yield self.frame(command.encode("latin-1") + CR)

    def _expect_ok(self, what: str) -> Exchange[None]:
        data = yield from self._answer(what)
        if data != OK:
            raise ProtocolError(f"expected OK or NG after {what}, found {data!r}")

    # Kinds of commands

    def raw(self, data: bytes) -> Exchange[bytes]:
        """Sends a text with this data, right or wrong, and returns the data of the answer. FL is not acknowledged."""
        yield self.frame(data)
        return (yield from self._text())

    def command(self, command: str) -> Exchange[None]:
        """Sends a command that is answered by OK."""
        yield from self._ask(command)
        yield from self._expect_ok(command)

    def query(self, command: str) -> Exchange[bytes]:
        """Sends a command that is answered by a file, in one or several texts; without EOF."""
        yield from self._ask(command)
        data = yield from self._answer(command)
        if not data.startswith(FL):
            raise ProtocolError(f"expected FL or NG after {command}, found {data!r}")
        content, data = b"", data[len(FL):]
        while True:
            yield self.frame(OK)
            content += data
            if EOF in data:
                return content[:content.index(EOF)]
            if len(content) > LONGEST_ANSWER:
                raise ProtocolError(f"no EOF in {len(content)} bytes of the answer to {command}")
            data = yield from self._text()

    def _binary_head(self, command: str) -> Exchange[None]:
        """The FL at the beginning of a binary answer, which may hold any byte and is read by its length."""
        yield from self._ask(command)
        while True:
            yield from self._begin()
            head = yield from self._exactly(len(FL))
            if head == FL:
                return
            end = yield from self._exactly(1)
            yield from self._end(head)
            if head + end == NG + ETX:
                raise Refused(f"{command} was refused: NG")
            if head + end != SP + ETX:
                raise ProtocolError(f"expected FL or NG after {command}, found {head + end!r}")
            self.stops += 1

    def _binary_end(self, command: str, data: bytes, end: bytes) -> Exchange[None]:
        found = yield from self._exactly(len(end))
        if found != end:
            raise ProtocolError(f"expected {end!r} at the end of the answer to {command}, found {found!r}")
        yield from self._end(data + end[:-1])
        yield self.frame(OK)

    def wait_for_stop(self) -> Exchange[None]:
        """Waits for the SP of a stop without a command, for example at the end of a cycle."""
        while not self.stops:
            data = yield from self._any_text()
            if data != SP:
                raise ProtocolError(f"expected SP, found {data!r}")
            self.stops += 1
        self.stops -= 1

    # Operation

    def start(self) -> Exchange[None]:
        """RN: starts the selected program, or continues it."""
        return self.command("RN")

    def stop(self) -> Exchange[None]:
        """SP: stops the program after its statement."""
        return self.command("SP")

    def servo_on(self) -> Exchange[None]:
        """SO: turns servo power on."""
        return self.command("SO")

    def servo_off(self) -> Exchange[None]:
        """BR: turns servo power off; the arm slows down at full deceleration."""
        return self.command("BR")

    def feed_hold(self) -> Exchange[None]:
        """FD: turns feed hold on; the next FD turns it off."""
        return self.command("FD")

    def break_motion(self) -> Exchange[None]:
        """EC,BREAK: stops at once; a DO is given up."""
        return self.command("EC,BREAK")

    def set_override(self, percent: int) -> Exchange[None]:
        """EC,OVRD: sets the speed override, 1 to 100."""
        return self.command(f"EC,OVRD {percent}")

    def set_run_mode(self, mode: RunMode) -> Exchange[None]:
        """EC,MODE: sets the operation mode."""
        return self.command(f"EC,MODE {RunMode(mode).name}")

    def execute(self, statement: str) -> Exchange[None]:
        """DO: executes one statement of the language. OK comes when it is accepted, not when it has ended."""
        return self.command(f"DO,{statement}")

    # Program

    def select(self, name: str) -> Exchange[None]:
        """SL: selects a file."""
        return self.command(f"SL,{name}")

    def deselect(self) -> Exchange[None]:
        """RS,SEL: deselects the file."""
        return self.command("RS,SEL")

    def reset_program(self) -> Exchange[None]:
        """RS,PRG: goes to step 1, with the data of the file."""
        return self.command("RS,PRG")

    def reset_step(self) -> Exchange[None]:
        """RS,STP: goes to step 1 and keeps the data."""
        return self.command("RS,STP")

    def reset_cycle(self) -> Exchange[None]:
        """RS,CYC: goes to the label RCYCLE, or to step 1 without one, and keeps the data."""
        return self.command("RS,CYC")

    def reset_signals(self) -> Exchange[None]:
        """RS,SIG: turns outputs 1 to 24 off."""
        return self.command("RS,SIG")

    def reset_alarms(self) -> Exchange[None]:
        """RS,ERR: resets alarms whose cause is gone (extension)."""
        return self.command("RS,ERR")

    # Files

    def upload(self, name: str) -> Exchange[bytes]:
        """UL: reads a file from the robot."""
        return self.query(f"UL,{name}")

    def download(self, name: str, content: Union[str, bytes]) -> Exchange[None]:
        """DL: writes a file to the robot, in as many texts as it takes. The manual ends lines with CR; LF is accepted."""
        data = content.encode("ascii") if isinstance(content, str) else content
        if EOF in data:
            raise ValueError(f"cannot download {name}: it contains EOF (1A), which ends a file")
        yield from self.command(f"DL,{name}")
        whole = FL + data + EOF
        texts = [whole[at:at + LONGEST_TEXT] for at in range(0, len(whole), LONGEST_TEXT)]
        for count, text in enumerate(texts, 1):
            yield self.frame(text)
            yield from self._expect_ok(f"text {count} of {len(texts)} of DL,{name}")

    def erase(self, name: str) -> Exchange[None]:
        """ER: erases a file."""
        return self.command(f"ER,{name}")

    def directory(self) -> Exchange[List[FileEntry]]:
        """CA: lists the files."""
        return FileEntry.parse((yield from self.query("CA")))

    # Status

    def status(self) -> Exchange[Status]:
        """SU: modes, selected file, override and execution status."""
        return Status.parse((yield from self.query("SU")))

    def total_status(self) -> Exchange[TotalStatus]:
        """SF: the system total status, of a six-axis arm or a SCARA."""
        yield from self._binary_head("SF")
        if self.total_split:
            data = yield from self._exactly(records.SCARA_BYTES)
            yield from self._binary_end("SF", FL + data, ETX)
            yield from self._begin()
            rest = yield from self._exactly(records.SIX_AXIS_BYTES - records.SCARA_BYTES)
            yield from self._binary_end("SF", rest, EOF + ETX)
            return TotalStatus.parse(data + rest)
        # Of a six-axis arm the byte after those of a SCARA belongs to a name, where an ETX cannot be.
        data = yield from self._exactly(records.SCARA_BYTES)
        while not self._received:
            yield None
        if self._received.startswith(ETX):
            yield from self._binary_end("SF", FL + data, ETX)
        else:
            data += yield from self._exactly(records.SIX_AXIS_BYTES - records.SCARA_BYTES)
            yield from self._binary_end("SF", FL + data, EOF + ETX)
        return TotalStatus.parse(data)

    def quick_status(self) -> Exchange[QuickStatus]:
        """SM: status in short (extension). After it the robot sends no unsolicited SP on this connection."""
        return QuickStatus.parse((yield from self.query("SM,1")))

    def error_history(self) -> Exchange[List[AlarmRecord]]:
        """EU: the error history, newest first, without messages."""
        return AlarmRecord.parse_history((yield from self.query("EU")))

    def alarms(self) -> Exchange[List[AlarmRecord]]:
        """AC: the active alarms, newest first (extension)."""
        return AlarmRecord.parse_list("AC", (yield from self.query("AC")))

    def alarm_history(self) -> Exchange[List[AlarmRecord]]:
        """AH: the alarm history, newest first (extension)."""
        return AlarmRecord.parse_list("AH", (yield from self.query("AH")))

    def version(self) -> Exchange[List[Version]]:
        """VR: versions of the system and, in dialect `manual`, of the arm."""
        return Version.parse((yield from self.query("VR")))

    def position(self, frame: Frame, measured: bool = False) -> Exchange[Position]:
        """PR: the position as commanded, or as measured (extension)."""
        return Position.parse((yield from self.query(f"PR,{Frame(frame) + (3 if measured else 0)}")))

    def speed(self, frame: Frame) -> Exchange[Tuple[Number, ...]]:
        """VL: the speed per second, of the joints or in world coordinates (extension)."""
        return records.numbers("VL", (yield from self.query(f"VL,{int(frame)}")))

    def maintenance(self, item: int) -> Exchange[MaintenanceItem]:
        """MN: an item of the maintenance information, 1 to 17 (extension). Item 5 is cleared when it has been shown."""
        return MaintenanceItem.parse((yield from self.query(f"MN,{item}")))

    # Variables and lines

    def read_variable(self, name: str, kind: VariableType = VariableType.ANY) -> Exchange[Tuple[Number, ...]]:
        """MR: the values of a variable, or of an element such as `TBL(1,3)`."""
        return records.numbers("MR", (yield from self.query(f"MR,{name} {self._kind(name, kind)}")))

    def write_variable(self, name: str, values: Sequence[Number], kind: VariableType = VariableType.ANY,
                       restore: bool = False) -> Exchange[None]:
        """MW: writes a variable; with `restore` also into its file."""
        words = " ".join(number(value) for value in values)
        return self.command(f"MW,{int(restore)} {name} {self._kind(name, kind)} {words}")

    @staticmethod
    def _kind(name: str, kind: VariableType) -> int:
        """Types 5 to 9 are types 0 to 4 as elements of an array."""
        return int(kind) + 5 if "(" in name and kind is not VariableType.ANY else int(kind)

    def set_outputs(self, lines: Mapping[int, bool]) -> Exchange[None]:
        """IW: switches up to 32 outputs, all of them or none."""
        if not 1 <= len(lines) <= MOST_LINES_WRITTEN:
            raise ValueError(f"cannot switch {len(lines)} outputs: IW takes 1 to {MOST_LINES_WRITTEN}")
        return self.command("IW," + " ".join(f"{line} {int(on)}" for line, on in lines.items()))

    def lines(self) -> Exchange[Lines]:
        """IO: the input and output lines that are on (extension)."""
        yield from self._binary_head("IO,1")
        data = yield from self._exactly(records.IO_BYTES)
        yield from self._binary_end("IO,1", FL + data, ETX)
        return Lines.parse(data)

    def read_inputs(self, first: int, count: int) -> Exchange[int]:
        """HI: up to 32 successive inputs as a number; `first` is bit 0 (extension)."""
        return int(records.numbers("HI", (yield from self.query(f"HI,{first} {count}")))[0])

    def write_outputs(self, first: int, count: int, value: int) -> Exchange[None]:
        """HO: sets up to 16 successive outputs from a number; `first` is bit 0 (extension)."""
        return self.command(f"HO,{first} {count} {value}")

    # Guiding, coordinate systems, watchdog: extensions

    def set_work(self, name: str, values: Sequence[Number]) -> Exchange[None]:
        """ZS,1: sets the work coordinate system (extension)."""
        return self.command(" ".join(["ZS,1", name, *(number(float(value)) for value in values)]))

    def set_tool(self, name: str, values: Sequence[Number]) -> Exchange[None]:
        """ZS,2: sets the tool coordinate system (extension)."""
        return self.command(" ".join(["ZS,2", name, *(number(float(value)) for value in values)]))

    def set_guide(self, mode: GuideMode, rate: GuideRate, coordinates: Coordinates) -> Exchange[None]:
        """MD, RT and SC: how `jog` moves the arm (extension)."""
        yield from self.command(f"MD,{int(mode)}")
        yield from self.command(f"RT,{int(rate)}")
        yield from self.command(f"SC,{int(coordinates)}")

    def jog(self, axis: int, direction: str) -> Exchange[None]:
        """JG: guides an axis; the direction is `+`, `-` or `!` to stop (extension)."""
        return self.command(f"JG,{axis} {direction}")

    def watchdog(self, milliseconds: int, level: int) -> Exchange[None]:
        """WD: from now on the host must send a text this often; 0 ends it. The level of the alarm is 0, 1, 2 or 8 (extension)."""
        return self.command(f"WD,{milliseconds} {level}")
