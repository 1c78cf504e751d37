"""Every command, over TCP, by Host and by AsyncHost, with the emulator."""

import asyncio
import signal
import sys
import threading
import time
from datetime import datetime
from pathlib import Path
from typing import Any, Callable

import pytest

from ts3100 import (AlarmRecord, AsyncHost, Coordinates, Disconnected, Error, ExecutionStatus, FileEntry, Frame, GuideMode, GuideRate,
                    Host, NoReply, Position, Protocol, ProtocolError, Refused, Robot, RunMode, VariableType)
from ts3100.host import Operation, Operations

Connect = Callable[..., Any]
PROGRAM = b"""GLOBAL
  N = 3
  X = 1.5
  DIM TBL(3) AS INTEGER
END
PROGRAM PICK
  DOUT(5)
  DELAY 1
END
DATA
  POINT P1 = 400,0,200,0,0,0,0,0/11111
END
"""
NO_DENY = pytest.mark.ts3100(time="stepped", deny="none")
pytestmark = pytest.mark.ts3100(time="stepped")


def test_every_command_of_the_protocol_is_a_method_of_both_hosts() -> None:
    helpers = {"feed", "frame", "discard", "wait_for_stop"}
    commands = {name for name in vars(Protocol) if not name.startswith("_")} - helpers
    assert {name for name, value in vars(Operations).items() if isinstance(value, Operation)} == commands
    assert Host.status.__doc__ == Protocol.status.__doc__


def test_a_program_is_downloaded_started_and_reports_its_end(robot: Robot, connect: Connect) -> None:
    host = connect()
    content = PROGRAM + b"REMARK " + b"X" * 200 + b"\n" + b"REMARK Y\n" * 40
    host.servo_on()
    host.download("PICK", content)
    assert host.upload("PICK") == content
    assert FileEntry("PICK", len(content)) in host.directory()
    host.select("PICK")
    status = host.status()
    assert (status.mode, status.run_mode, status.file) == ("external(ethernet)", RunMode.CYCLE, "PICK")
    assert (status.override, status.speed_limit, status.machine_lock) == (100, 100, False)
    host.start()
    assert host.status().status is ExecutionStatus.RUNNING
    robot.advance_until("idle")
    host.wait_for_stop(2)
    assert host.status().status is ExecutionStatus.STOP_RESET
    assert {finding.rule for finding in robot.findings} == {"file-line-ends"}


def test_an_sp_before_an_answer_is_counted(robot: Robot, connect: Connect) -> None:
    robot.files["PICK"] = PROGRAM.decode()
    robot.servo = True
    host = connect()
    host.select("PICK")
    host.start()
    robot.advance_until("idle")
    # SP comes 50 ms after the answer; the next answers come after it.
    robot.advance(0.3)
    assert host.total_status().status is ExecutionStatus.STOP_RESET
    host.wait_for_stop(0.5)
    with pytest.raises(NoReply, match="within 0.05 s"):
        host.wait_for_stop(0.05)


@NO_DENY
def test_commands_that_move_stop_and_reset(robot: Robot, connect: Connect) -> None:
    robot.files["PICK"] = PROGRAM.decode()
    host = connect()
    with pytest.raises(Refused, match="RN was refused: NG"):
        host.start()
    host.servo_on()
    host.select("PICK")
    host.set_override(30)
    host.set_run_mode(RunMode.SEGMENT)
    assert (host.status().override, host.status().run_mode) == (30, RunMode.SEGMENT)
    host.set_run_mode(RunMode.CYCLE)
    host.start()
    host.feed_hold()
    assert host.total_status().feed_hold
    host.feed_hold()
    host.stop()
    robot.advance(2)
    assert host.total_status().status is ExecutionStatus.STOP_CONTINUE
    host.reset_step()
    host.start()
    host.break_motion()
    assert host.total_status().status is ExecutionStatus.STOP_RETRY
    host.reset_program()
    host.reset_alarms()
    host.reset_signals()
    # Without the label RCYCLE it acts as RS,STP.
    host.reset_cycle()
    assert host.total_status().status is ExecutionStatus.STOP_RESET
    host.deselect()
    assert host.status().file == ""
    host.erase("PICK")
    with pytest.raises(Refused, match="UL,PICK was refused"):
        host.upload("PICK")
    host.execute("MOVE POINT(400,0,200,0,0,0,0,0)")
    assert host.quick_status().do_running
    robot.advance_until("idle")
    assert host.quick_status().done == 1
    host.servo_off()
    assert not host.quick_status().servo_on


@NO_DENY
def test_variables_and_lines(robot: Robot, connect: Connect) -> None:
    robot.files["PICK"] = PROGRAM.decode()
    host = connect()
    host.select("PICK")
    assert host.read_variable("N") == (3,)
    assert host.read_variable("X", VariableType.REAL) == (1.5,)
    host.write_variable("N", [7], VariableType.INTEGER)
    host.write_variable("X", [-2.25], VariableType.REAL, restore=True)
    assert (host.read_variable("N"), host.read_variable("X")) == ((7,), (-2.25,))
    assert "X = -2.25" in robot.files["PICK"]
    host.write_variable("P1", [300.0, 1.5, 200, 0, 0, 0, 0, 0, 11111], VariableType.POSITION)
    assert host.read_variable("P1", VariableType.POSITION)[:3] == (300.0, 1.5, 200.0)
    host.write_variable("TBL(2)", [5], VariableType.INTEGER)
    assert host.read_variable("TBL(2)", VariableType.INTEGER) == host.read_variable("TBL(2)") == (5,)
    with pytest.raises(Refused):
        host.read_variable("N", VariableType.REAL)
    host.set_outputs({3: True, 201: True, 4: False})
    host.write_outputs(9, 4, 0b1010)
    robot.inputs[2] = True
    lines = host.lines()
    assert lines.inputs == {2} and {3, 10, 12, 201} <= lines.outputs
    total = host.total_status()
    assert (total.inputs, total.outputs) == (lines.inputs, lines.outputs)
    assert host.read_inputs(1, 8) == 2
    with pytest.raises(ValueError, match="IW takes 1 to 32"):
        host.set_outputs({})


def test_status_of_a_six_axis_arm(robot: Robot, connect: Connect) -> None:
    robot.raise_alarm("2-046", "line 12")
    host = connect()
    total = host.total_status()
    assert (total.servo_on, total.emergency_stop, total.alarms, total.master_mode) == (False, False, ("2-046",), 3)
    assert total.joints == pytest.approx((0, 10, 130, 0, 40, 0, 0, 0))
    assert total.world[:3] == pytest.approx((408.509, 0, 293.282), abs=0.001)
    assert host.alarms() == [AlarmRecord("2-046", "Invalid Channel: line 12", datetime(2014, 2, 6))]
    assert host.alarm_history() == host.alarms()
    assert host.error_history() == [AlarmRecord("2-046", "", datetime(2014, 2, 6))]
    assert host.position(Frame.WORLD) == Position((408.509, 0, 293.282, 0, 0, 0, 0, 0), "11111")
    assert host.position(Frame.JOINT, measured=True) == Position((0, 10, 130, 0, 40, 0, 0, 0), None)
    assert host.speed(Frame.WORLD) == (0,) * 8
    quick = host.quick_status()
    assert (quick.master_mode, quick.run_mode, quick.override, quick.alarm_level) == (5, RunMode.CYCLE, 100, 2)
    (version,) = host.version()
    assert (version.name, version.built) == ("TS3100", datetime(2014, 2, 6, 10, 30))
    items = [host.maintenance(number) for number in range(1, 18)]
    assert [item.number for item in items] == list(range(1, 18))
    assert [len(item.values) for item in items] == [6] * 9 + [1] * 7 + [6]


@pytest.mark.ts3100(model="tsl3000-thl400", servo_on=True)
def test_status_of_a_scara(robot: Robot, connect: Connect) -> None:
    host = connect()
    assert len(host.total_status().joints) == 6
    assert len(host.position(Frame.WORK).values) == 6
    assert host.total_status().servo_on
    host.set_work("WK1", [1, 2, 3, 4])
    assert host.total_status().work_name == "WK1"


@pytest.mark.ts3100(dialect="manual", deny="none")
def test_the_forms_of_dialect_manual(robot: Robot, connect: Connect) -> None:
    host = connect(total_split=True)
    assert host.status().mode == "external(ethernet)" and host.status().speed_limit is None
    assert [version.name for version in host.version()] == ["TS3100", "TV800"]
    total = host.total_status()
    assert len(total.joints) == 8 and total.work_name == ""
    with pytest.raises(Refused):
        host.quick_status()


@pytest.mark.ts3100(servo_on=True, deny="none")
def test_guiding_and_coordinate_systems(robot: Robot, connect: Connect) -> None:
    host = connect()
    host.set_guide(GuideMode.INCHING, GuideRate.FAST, Coordinates.WORLD)
    total = host.total_status()
    assert (total.guide_mode, total.guide_rate, total.coordinates) == (GuideMode.INCHING, GuideRate.FAST, Coordinates.WORLD)
    host.jog(3, "+")
    robot.advance(5)
    assert host.position(Frame.WORLD).values[2] == pytest.approx(303.282)
    host.jog(3, "!")
    host.set_work("WK1", [1, 2, 3, 0, 0, 0])
    host.set_tool("TL1", [0, 0, 10, 0, 0, 0])
    assert (host.total_status().work_name, host.total_status().tool_name) == ("WK1", "TL1")
    host.watchdog(700, 2)
    robot.advance(1)
    assert [alarm.number for alarm in host.alarms()] == ["2-137"]


@NO_DENY
def test_framing_without_stx(robot: Robot, connect: Connect) -> None:
    host = connect(stx=False)
    host.servo_on()
    assert host.total_status().servo_on
    assert host.upload("DEMO").startswith(b"' origin")
    assert {finding.rule for finding in robot.findings} == {"no-stx"}


@pytest.mark.ts3100(options={"text.checksum": "sum"})
def test_framing_with_a_checksum(robot: Robot, connect: Connect) -> None:
    host = connect(checksum=True)
    host.servo_on()
    assert host.total_status().servo_on and host.lines().inputs == set()
    assert host.upload("DEMO") == robot.files.read("DEMO")
    assert {finding.rule for finding in robot.findings} == {"extension-command"}


@NO_DENY
def test_raw_texts_are_sent_as_they_are(robot: Robot, connect: Connect) -> None:
    host = connect()
    assert host.raw(b"so\r") == b"OK\r"
    assert host.raw(b"XX\r") == b"NG\r"
    assert [finding.rule for finding in robot.findings] == ["lower-case", "unknown-command"]


@pytest.mark.ts3100(time="real", faults=["late-reply:command=SO,delay=600", "no-reply:command=RS"], deny="none")
def test_an_answer_after_its_time_limit_is_not_taken_for_the_next(robot: Robot, connect: Connect) -> None:
    host = connect(timeout=0.3)
    with pytest.raises(NoReply, match="did not send an answer to SO within 0.3 s"):
        host.servo_on()
    time.sleep(0.8)
    assert host.status().status is ExecutionStatus.STOP_RESET
    with pytest.raises(NoReply):
        host.reset_program()
    host.reset_program()


@pytest.mark.ts3100(time="real", faults=["late-reply:command=SO,delay=320"], deny="none")
def test_an_answer_during_the_pause_is_not_taken_for_the_next(robot: Robot, connect: Connect) -> None:
    host = connect(timeout=0.3, pause=0.4)
    with pytest.raises(NoReply):
        host.servo_on()
    assert host.status().status is ExecutionStatus.STOP_RESET


@pytest.mark.ts3100(time="real", faults=["wrong-reply:command=BR", "lost-etx:command=SP", "reset-mid-text:command=SU"], deny="none")
def test_what_is_not_the_protocol_is_said(robot: Robot, connect: Connect) -> None:
    host = connect(timeout=0.2)
    with pytest.raises(ProtocolError, match="expected OK or NG after BR, found"):
        host.servo_off()
    with pytest.raises(NoReply):
        host.stop()
    with pytest.raises(Disconnected):
        host.status()


def test_a_closed_connection(robot: Robot, connect: Connect) -> None:
    host = connect()
    robot.drop_peer("IP0")
    with pytest.raises(Disconnected, match="closed the connection"):
        host.servo_on()


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGSTOP")
def test_a_connection_that_is_reset() -> None:
    robot = Robot.start()
    assert robot._process
    process = robot._process._process
    with robot.host(timeout=0.05) as host:
        process.send_signal(signal.SIGSTOP)
        with pytest.raises(NoReply):
            host.servo_on()
        # What the emulator has not read when it dies makes the end of the connection a reset.
        process.kill()
        process.wait()
        with pytest.raises(Disconnected):
            host.servo_on()
    robot.close()


def test_one_exchange_at_a_time(robot: Robot) -> None:
    robot.arm_fault("late-reply:command=SU,delay=200")
    robot.time_mode = "real"

    async def both() -> None:
        async with await AsyncHost.connect(robot.address(), pause=0) as host:
            first = asyncio.ensure_future(host.status())
            await asyncio.sleep(0.05)
            with pytest.raises(Error, match="a connection has one exchange at a time"):
                await host.version()
            assert (await first).file == ""
            assert (await host.version())[0].name == "TS3100"

    asyncio.run(both())


@pytest.mark.ts3100(time="real")
def test_the_pause_of_the_manual_is_kept(robot: Robot, connect: Connect) -> None:
    host = connect(pause=0.05)
    for _ in range(3):
        host.status()
        host.upload("DEMO")
    assert robot.findings == []


def test_addresses() -> None:
    with pytest.raises(ValueError, match="expected HOST:PORT"):
        Host.connect("192.168.0.124")
    with pytest.raises(ValueError, match="a text has at most 253 bytes"):
        Protocol().frame(b"X" * 254)


def test_several_async_hosts_at_a_time(robot: Robot) -> None:
    async def both() -> None:
        async with await AsyncHost.connect(robot.address(), pause=0) as host:
            waiting = asyncio.ensure_future(host.wait_for_stop(5))
            await asyncio.sleep(0)
            robot.servo = True
            robot.select_file("DEMO")
            robot.start_program()
            robot.advance_until("idle")
            robot.advance(0.3)
            await waiting

    asyncio.run(both())


@pytest.mark.parametrize("line", ["socket", "terminal"])
def test_a_serial_line(line: str, tmp_path: Path) -> None:
    pytest.importorskip("serial")
    flag = "--serial-host-tcp=127.0.0.1:0" if line == "socket" else f"--serial-dir={tmp_path}"
    with Robot.start(flags=["--control-right=rs232c", flag]) as robot:
        port = robot.ready["serial"]["host"].replace("tcp://", "socket://") if line == "socket" else str(tmp_path / "host")
        with Host.open_serial(port) as host:
            host.servo_on()
            assert host.total_status().servo_on
            assert host.upload("DEMO") == robot.files.read("DEMO")

        async def job() -> None:
            async with await AsyncHost.open_serial(port) as host:
                assert (await host.total_status()).servo_on
                robot.arm_fault("no-reply:command=SU")
                with pytest.raises(asyncio.TimeoutError):
                    await asyncio.wait_for(host.status(), 0.3)
                # The thread of the call that was given up still waits: what it receives is the answer to this one.
                assert (await host.version())[0].name == "TS3100"

        asyncio.run(job())


def test_a_serial_line_whose_other_end_is_gone(tmp_path: Path) -> None:
    pytest.importorskip("serial")
    robot = Robot.start(flags=[f"--serial-dir={tmp_path}"])
    with Host.open_serial(str(tmp_path / "host")) as host:
        robot.close()
        with pytest.raises(Disconnected):
            host.status()


def test_a_host_in_a_thread(robot: Robot, connect: Connect) -> None:
    """What a test does meanwhile does not wait for the host, and the other way round."""
    robot.time_mode = "real"
    host = connect()
    pressed = threading.Timer(0.1, lambda: setattr(robot, "emergency_stop", True))
    pressed.start()
    robot.wait_until("alarm 8-014", within=5)
    pressed.join()
    assert host.total_status().emergency_stop
