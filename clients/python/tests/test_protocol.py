"""The protocol and the records without a robot: bytes in, bytes out."""

from datetime import datetime
from typing import Any, List, Tuple

import pytest

from ts3100 import AlarmRecord, ExecutionStatus, FileEntry, Protocol, ProtocolError, Refused, RunMode, Status, TotalStatus, Version
from ts3100.protocol import LONGEST_RECEIVED, Exchange, number
from ts3100.records import Position, QuickStatus, alarm_number


def answered(protocol: Protocol, exchange: Exchange[Any], *answers: bytes) -> Tuple[List[bytes], Any]:
    """What was sent, and the result, when these bytes come one after the other."""
    sent: List[bytes] = []
    coming = list(answers)
    while True:
        try:
            data = next(exchange)
        except StopIteration as end:
            return sent, end.value
        if data is None:
            protocol.feed(coming.pop(0))
        else:
            sent.append(data)


def test_an_sp_may_come_before_any_answer() -> None:
    protocol = Protocol()
    assert answered(protocol, protocol.servo_on(), b"\x02SP\r\x03\x02O", b"K\r", b"\x03") == ([b"\x02SO\r\x03"], None)
    lines = b"\x02SP\r\x03\x02FL," + bytes(79) + b"\x03\x03"
    sent, found = answered(protocol, protocol.lines(), *(lines[at:at + 1] for at in range(len(lines))))
    assert sent == [b"\x02IO,1\r\x03", b"\x02OK\r\x03"] and found.outputs == {449, 450}
    assert protocol.stops == 2
    assert answered(protocol, protocol.wait_for_stop()) == ([], None)
    assert protocol.stops == 1


def test_half_an_sp_is_kept_when_late_answers_are_dropped() -> None:
    protocol = Protocol()
    protocol.feed(b"\x02OK\r\x03\x02SP\r\x03\x02S")
    protocol.discard()
    assert protocol.stops == 1
    assert answered(protocol, protocol.stop(), b"P\r\x03\x02OK\r\x03") == ([b"\x02SP\r\x03"], None)
    assert protocol.stops == 2


def test_a_file_in_several_texts_both_ways() -> None:
    protocol = Protocol(stx=False)
    sent, content = answered(protocol, protocol.upload("A"), b"FL,ab\x03", b"cd\x03\x1a\x03"[:3], b"e\x1a\x03")
    assert sent == [b"UL,A\r\x03", b"OK\r\x03", b"OK\r\x03", b"OK\r\x03"] and content == b"abcde"
    sent, _ = answered(protocol, protocol.download("A", b"x" * 249), b"OK\r\x03", b"OK\r\x03", b"OK\r\x03")
    assert [len(text) for text in sent] == [6, 254] and sent[1].endswith(b"x\x1a\x03")
    sent, _ = answered(protocol, protocol.download("A", b"x" * 250), b"OK\r\x03", b"OK\r\x03", b"OK\r\x03")
    assert sent[1:] == [b"FL," + b"x" * 250 + b"\x03", b"\x1a\x03"]
    with pytest.raises(ValueError, match="contains EOF"):
        answered(protocol, protocol.download("A", b"\x1a"))
    with pytest.raises(Refused, match="text 1 of 1 of DL,A was refused"):
        answered(protocol, protocol.download("A", b"x"), b"OK\r\x03", b"NG\r\x03")


@pytest.mark.parametrize("answer, message", [
    (b"OK\r\x03", "expected STX at the beginning of a text, found b'O'"),
    (b"\x02FL,1\x1a\x03", "expected OK or NG after SO, found b'FL,1"),
    (b"\x02" + b"x" * LONGEST_RECEIVED, "65537 bytes were received"),
])
def test_what_is_not_an_answer(answer: bytes, message: str) -> None:
    protocol = Protocol()
    with pytest.raises(ProtocolError, match=message):
        answered(protocol, protocol.servo_on(), answer)


def test_binary_answers_that_are_wrong() -> None:
    protocol = Protocol()
    with pytest.raises(ProtocolError, match="at the end of the answer to IO,1"):
        answered(protocol, protocol.lines(), b"\x02FL," + bytes(81) + b"\x03")
    protocol = Protocol()
    with pytest.raises(Refused, match="SF was refused"):
        answered(protocol, protocol.total_status(), b"\x02NG\r\x03")
    with pytest.raises(ProtocolError, match="expected FL or NG after SF"):
        answered(protocol, protocol.total_status(), b"\x02OK\r\x03")
    protocol = Protocol(checksum=True)
    with pytest.raises(ProtocolError, match="expected checksum AA, found 00"):
        answered(protocol, protocol.servo_on(), b"\x02OK\r\x03\x00")


@pytest.mark.parametrize("word, alarm", [
    (0, "8-001"), (367, "8-368"), (960, "8-369"), (1471, "8-880"), (368, "4-001"), (1472, "4-145"), (557, "2-046"),
    (1728, "2-225"), (935, "1-200"), (2239, "1-480")])
def test_alarm_words(word: int, alarm: str) -> None:
    assert alarm_number(word) == alarm


def test_numbers_have_a_point_if_they_are_reals() -> None:
    assert [number(value) for value in (3, -3, 1.5, -2.25, 300.0, 1e-7, 1e6)] == [
        "3", "-3", "1.5", "-2.25", "300.0", "0.0", "1000000.0"]


def test_status_of_both_dialects() -> None:
    expected = Status("external(sig)", RunMode.STEP, "", 5, None, True, ExecutionStatus.STOP_CONTINUE)
    assert Status.parse(b"MODE:external(sig)/step FILE: OVRD:5% LSPEED: MACHINE:lock STATUS:stop(continue)") == expected
    assert Status.parse(b"MODE:external (sig)/step\rFILE:\rOVRD:5%\r\rMACHINE:lock\rSTATUS:stop (continue)\r") == expected


@pytest.mark.parametrize("parse, data", [
    (Status.parse, b"MODE:ext/sleep FILE: OVRD:5% LSPEED: MACHINE:lock STATUS:running"), (Status.parse, b""),
    (TotalStatus.parse, bytes(100)), (TotalStatus.parse, b"\0\0\x09" + bytes(273)), (QuickStatus.parse, b"EE0"),
    (QuickStatus.parse, b"EE0 SE0 SC0 BC0 ES0 SS0 SV0 MM5 RM9 RS0 OV100 AL0 DC0 DS0"), (FileEntry.parse, b"A B\r"),
    (Version.parse, b"TS3100\r"), (AlarmRecord.parse_history, b"1\r002-046 yesterday\r"), (Position.parse, b"x.1,11111")])
def test_a_malformed_answer_is_said(parse: Any, data: bytes) -> None:
    with pytest.raises(ProtocolError, match="cannot read the answer to"):
        parse(data)


def test_records_of_several_rows() -> None:
    for year in (b"2026", b"26"):
        rows = AlarmRecord.parse_list("AC", b"2,002-046,A,%s-03-01 13:05:59\r008-027,B,%s-03-01 12:00:00\r" % (year, year))
        assert [row.number for row in rows] == ["2-046", "8-027"]
        assert rows[0].at == datetime(2026, 3, 1, 13, 5, 59)
    assert AlarmRecord.parse_list("AC", b"0") == AlarmRecord.parse_history(b"0\r") == []
    assert [row.name for row in Version.parse(b"TS3100    2014/02/0610:303BF3\rTV800     2014/02/0610:3067BE\r")] == ["TS3100", "TV800"]
    assert Version.parse(b"TS3100     2014-02-06 10:30 3BF3\r")[0].built == datetime(2014, 2, 6, 10, 30)
