"""The control interface by Robot: every setting and method, and how a call fails."""

import contextlib
import http.client
import io
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

import ts3100
from ts3100 import Disconnected, Host, NoFile, NoReply, NotReached, Refused, Robot, StartError
from ts3100 import robot as module

PROGRAM = """GLOBAL
  COUNT = 3
  DIM TBL(3)
END
PROGRAM PICK
  TBL(2) = 4
  DOUT(5)
  INPUT COUNT
  PRINT "GOT", COUNT, CR
  DELAY 60
  INPUT IP1, COUNT
END
DATA
  POINT P1 = 300,0,400,0,0,0,0,0
END
"""
pytestmark = pytest.mark.ts3100(time="stepped", deny="none")


@pytest.fixture
def pick(robot: Robot) -> Robot:
    robot.files["PICK"] = PROGRAM
    robot.select_file("PICK")
    robot.servo = True
    return robot


SETTINGS = [("key_switch", "ext", "teaching"), ("control_right", "ether", "sig"), ("emergency_stop", False, True),
            ("safety_switch", False, True), ("servo", False, True), ("feed_hold", False, True), ("machine_lock", False, True),
            ("battery", False, True), ("override", 100, 35), ("run_mode", "cycle", "step"), ("time_mode", "stepped", "auto")]


@pytest.mark.parametrize("name, before, after", SETTINGS)
def test_settings_are_attributes(robot: Robot, name: str, before: Any, after: Any) -> None:
    assert getattr(robot, name) == before
    setattr(robot, name, after)
    assert getattr(robot, name) == after


def test_what_is_not_an_attribute_cannot_be_set(robot: Robot) -> None:
    anything: Any = robot
    with pytest.raises(AttributeError, match="^Robot has no attribute 'srvo'; did you mean 'servo'?"):
        anything.srvo = True
    for name in ("start_program", "status"):
        with pytest.raises(AttributeError):
            setattr(robot, name, True)
    with pytest.raises(AttributeError, match="^Lines has no attribute 'one'; did you mean 'on'?"):
        anything.inputs.one = [5]
    with robot.host() as host, pytest.raises(AttributeError, match="^Host has no attribute 'timeouts'; did you mean 'timeout'?"):
        setattr(host, "timeouts", 1.0)
    with robot.channel() as channel, pytest.raises(AttributeError, match="^Channel has no attribute 'tmeout'; did you mean 'timeout'?"):
        setattr(channel, "tmeout", 1.0)
    assert not any(hasattr(one, "__dict__") for one in (robot, robot.inputs, robot.variables, robot.files, host, channel))


@pytest.mark.parametrize("duration, seconds", [(0.5, 0.5), ("0.5", 0.5), ("0.5 s", 0.5), ("500ms", 0.5), ("500000 us", 0.5), (" .01min ", 0.6)])
def test_a_duration_has_the_form_of_the_command_line(robot: Robot, duration: Any, seconds: float) -> None:
    robot.advance(duration, wall="10s")
    assert robot.clock.now == pytest.approx(seconds)
    robot.inputs.pulse(5, duration)
    assert robot.advance_until("input 5 off", within="1 min").passed == pytest.approx(seconds)
    with pytest.raises(NotReached, match="`output 9 on` was not met within 0.[56] s of virtual time"):
        robot.advance_until("output 9 on", within=duration)


@pytest.mark.parametrize("duration", ["soon", "", "5 h", "-1s", "1e3", "1s2"])
def test_another_duration_is_refused_with_its_form(robot: Robot, duration: str) -> None:
    with pytest.raises(ValueError, match=r"^cannot read '.*' as a duration: expected seconds, or e\.g\. `5s`, `500 ms`, `1\.5 s`$"):
        robot.wait_until("idle", within=duration)


def test_any_operation_is_called_by_its_name(robot: Robot) -> None:
    assert robot.call("put_input", {"line": 5, "on": True})["on"] and 5 in robot.inputs.on
    assert robot.call("get_events", {"since": 1, "count": 1}).startswith("event:")
    robot.files["PICK"] = PROGRAM
    robot.select_file("PICK")
    assert robot.call("get_variable", {"name": "TBL(2)"})["name"] == "TBL"
    for operation, arguments, message in (("get_inputt", {}, "unknown operation 'get_inputt'; did you mean 'get_input'?"),
                                          ("get_input", {}, "get_input needs the argument 'line'"),
                                          ("get_input", {"line": 5, "on": True}, "get_input has no argument 'on'")):
        with pytest.raises(ValueError) as error:
            robot.call(operation, arguments)
        assert str(error.value) == message


def test_a_wait_that_times_out_says_what_is_there_instead(pick: Robot) -> None:
    pick.files["ASK"] = 'PROGRAM ASK\nPRINT IP1, "WHERE", CR\nDELAY 1\nPRINT IP1, "THERE", CR\nINPUT IP1, X\nEND\n'
    pick.select_file("ASK")
    stopped = "the clock is stepped and stopped at 0 s; ASK is running, line 3; alarms: none; outputs on: "
    with pick.channel("ip1") as channel:
        pick.start_program()
        with pytest.raises(NotReached) as error:
            pick.wait_until("printed WHERE", wall=0.1)
        assert str(error.value).startswith(f"`printed WHERE` was not met within 0.1 s of wall-clock time: {stopped}")
        assert str(error.value).endswith("; IP1 printed WHERE<CR>, the pendant nothing")
        assert channel.wait_for_line("WHERE") == "WHERE"
        with pytest.raises(NoReply) as late:
            channel.wait_for_line("THERE", timeout=0.1)
        assert str(late.value).startswith(f"IP1: expected a line with `THERE` within 0.1 s, found nothing: {stopped}")
        pick.advance(1)
        with pytest.raises(NoReply, match="IP1: expected a line with `EVER` within 0.1 s, found `THERE`: .* at 1 s;.* an INPUT waits for IP1"):
            channel.wait_for_line("EVER", timeout=0.1)
        channel.send_line("1")
        pick.files["ASK"] = 'PROGRAM ASK\nPRINT IP1, "HALF"\nDELAY 1\nPRINT IP1, "DONE", CR\nEND\n'
        pick.select_file("ASK")
        pick.start_program()
        with pytest.raises(NoReply, match="IP1: expected a line within 0.1 s, found `HALF`: "):
            channel.read_line(timeout=0.1)
        pick.advance(1)
        assert channel.read_line() == "HALFDONE"
        with pick.host(timeout=0.1, pause=0) as host, pytest.raises(NoReply, match="did not send the SP of a stop within 0.1 s: the clock is"):
            host.wait_for_stop()
        pick.time_mode = "auto"
        with pytest.raises(NotReached, match="`output 9 on` was not met within 2 s of virtual time: the clock runs .auto. and is at"):
            pick.wait_until("output 9 on", within=2)


def test_a_channel_reads_and_sends_lines(pick: Robot) -> None:
    pick.time_mode = "auto"
    pick.files["ASK"] = 'PROGRAM ASK\nPRINT IP2, "ONE", CR\nPRINT IP2, "TWO", CR\nINPUT IP2, X, Y\nPRINT IP2, X + Y, CR\nEND\n'
    pick.select_file("ASK")
    with pick.channel("ip2") as channel:
        pick.start_program()
        assert [channel.read_line(), channel.read_line()] == ["ONE", "TWO"]
        channel.send_line("2.5,1")
        assert channel.wait_for_line("3.5").strip() == "3.500"
        pick.drop_peer("ip2")
        with pytest.raises(Disconnected, match="the robot closed the connection to IP2"):
            channel.read_line()
    with Robot.start(flags=["--serial-com1-tcp=127.0.0.1:0", "--time=auto"], servo_on=True) as robot:
        robot.files["ASK"] = 'PROGRAM ASK\nPRINT COM1, "ONE", CR\nEND\n'
        robot.select_file("ASK")
        with robot.channel("com1") as line:
            robot.start_program()
            assert line.read_line() == "ONE"


def test_the_robot_of_exec(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("TS3100_CONTROL_URL", raising=False)
    with pytest.raises(StartError, match="TS3100_CONTROL_URL is not set: run the tests by `ts3100 exec -- pytest`"):
        Robot.from_environment()
    code = "import ts3100; print(ts3100.Robot.from_environment().override)"
    said = subprocess.run([ts3100.find_binary(), "exec", "--", sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True).stdout
    assert said == "100\n"


def test_a_refused_call_says_why(robot: Robot) -> None:
    robot.emergency_stop = True
    with pytest.raises(Refused, match="cannot turn the servo on: the emergency stop is pressed") as refused:
        robot.servo = True
    assert refused.value.status == 409
    with pytest.raises(Refused, match="1 to 100") as refused:
        robot.override = 130
    assert refused.value.status in (409, 422) and "percent" in str(refused.value.where or refused.value)
    with pytest.raises(Refused) as refused:
        robot.select_file("NOSUCH")
    assert refused.value.status == 404


def test_a_program_is_driven(pick: Robot) -> None:
    assert pick.program == ts3100.Program("PICK", "stop (reset)", pick.program.line)
    pick.start_program()
    assert pick.status == "running"
    assert pick.advance_until("output 5 on").passed == 0
    assert pick.outputs[5] and 5 in pick.outputs.on
    pick.press_keys("12\r")
    pick.advance(0.1)
    assert pick.pendant.split() == ["GOT", "12"]
    assert (pick.variables["COUNT"], pick.variables["TBL(2)"]) == (12, 4)
    assert pick.variables["TBL"] == [None, None, 4, None]
    reached = pick.advance_until({"line": 11}, within=100)
    assert 59 < reached.passed <= 60
    pick.stop_program()
    pick.advance(1)
    assert pick.status == "stop (continue)"
    with pytest.raises(NotReached, match="`output 9 on` was not met within 3 s"):
        pick.advance_until("output 9 on", within=3)


def test_time_passes_by_itself(pick: Robot) -> None:
    pick.time_mode = "auto"
    started = time.monotonic()
    pick.start_program()
    pick.press_keys("1\r")
    # A state: unlike the line, it still holds if it began before the wait.
    pick.wait_until("alarm 2-046", within=100)
    assert pick.clock.now >= 60 and time.monotonic() - started < 20


def test_variables_and_positions(pick: Robot) -> None:
    assert pick.variables["COUNT"] == 3
    pick.variables["COUNT"] = 8
    pick.variables.set("COUNT", 9, restore=True)
    assert pick.variables.all()["COUNT"] == 9 and "COUNT = 9" in pick.files["PICK"]
    assert pick.positions["P1"][:3] == [300, 0, 400]
    pick.positions["P1"] = [310, 0, 400, 0, 0, 0, 0, 0, 0]
    assert pick.positions["P1"][0] == 310
    pick.positions.teach("P1")
    assert pick.positions["P1"][0] == pytest.approx(pick.pose.world[0])
    with pytest.raises(Refused):
        pick.variables["NOSUCH"]


def test_files_are_a_mapping(robot: Robot, tmp_path: Path) -> None:
    assert {"DEMO", "USER.PAR"} <= set(robot.files)
    robot.files["NOTE"] = "REMARK A\n"
    assert (robot.files["NOTE"], robot.files.read("NOTE"), len(robot.files)) == ("REMARK A\n", b"REMARK A\n", 5)
    del robot.files["NOTE"]
    assert "NOTE" not in robot.files
    for missing in (lambda: robot.files["NOTE"], lambda: robot.files.read("NOTE"), lambda: robot.files.__delitem__("NOTE")):
        with pytest.raises(NoFile, match="^cannot (read|erase) NOTE: it is not on the RAM drive") as error:
            missing()
        assert isinstance(error.value, KeyError) and error.value.status == 404
    with pytest.raises(NoFile, match="^cannot read NOTE: .*; the drive has DEMO, DIALOG, ETHERNET.PAR, USER.PAR$"):
        robot.files.read("NOTE")
    with pytest.raises(NoFile, match="; did you mean `DEMO`[?]$"):
        robot.files.read("dem0")
    assert robot.files.get("NOTE") is None
    path = tmp_path / "place.scol"
    path.write_bytes(b"PROGRAM PLACE\r\nEND\r\n\x1a")
    assert robot.files.load(path) == "PLACE" and robot.files["PLACE"] == "PROGRAM PLACE\nEND\n"


def test_lines(robot: Robot) -> None:
    robot.inputs[7] = True
    assert robot.inputs[7] and robot.inputs.on == [7]
    robot.inputs.pulse(8, 0.2)
    assert robot.inputs[8]
    robot.advance(0.3)
    assert not robot.inputs[8]
    robot.outputs.force(9, True)
    assert robot.outputs[9]
    robot.outputs.release(9)
    assert not robot.outputs[9]


def test_alarms_faults_and_findings(robot: Robot) -> None:
    robot.raise_alarm("2-046", "line 12")
    (alarm,) = robot.alarms
    assert (alarm.number, alarm.level, alarm.text) == ("2-046", 2, "Invalid Channel: line 12") and alarm.remedy
    robot.reset_alarms()
    assert robot.alarms == [] and [alarm.number for alarm in robot.alarm_history] == ["2-046"]
    fault = robot.arm_fault("ng:command=SU")
    assert (fault.kind, fault.armed, fault.fired) == ("ng", True, 0)
    with robot.host(pause=0) as host, pytest.raises(Refused):
        host.status()
    (fault,) = robot.faults
    assert (fault.fired, fault.at) == (1, (0.0,))
    second = robot.arm_fault("no-reply:command=SO")
    robot.disarm_fault(second.id)
    assert [fault.armed for fault in robot.faults] == [False, False]
    robot.clear_faults()
    assert robot.faults == []
    with robot.host(pause=0) as host:
        host.raw(b"so\r")
    assert "lower-case (note): \"so\" is read as SO" in str(robot.findings[-1])
    assert "> IP0 so<CR>" in robot.transcript() and '"event":"start"' in robot.transcript("jsonl")


def test_channels_power_and_snapshots(robot: Robot) -> None:
    with Host.connect(robot.address(), pause=0) as host:
        host.servo_on()
        assert robot.channel_state("ip0")["peer"]
        robot.take_snapshot("ready")
        robot.servo = False
        robot.restore_snapshot("ready")
        assert robot.servo and robot.snapshots == ["ready"]
        robot.delete_snapshot("ready")
        robot.power_cycle()
        with pytest.raises(Disconnected):
            host.servo_on()
    robot.power_off()
    robot.power_on()
    robot.press_feed_hold()
    assert robot.feed_hold
    robot.reset()
    assert not robot.feed_hold and robot.clock.now == 0
    robot.reset(time="x10")
    assert robot.time_mode == "x10"


def test_events_come_as_they_happen(robot: Robot) -> None:
    events = robot.events(timeout=5)
    robot.servo = True
    robot.select_file("DEMO")
    first, second = next(events), next(events)
    assert (first.event, first.fields["on"], second.event) == ("servo", True, "selected")
    assert list(robot.events(since=first.seq, count=2)) == [first, second]
    quiet = robot.events(timeout=0.2)
    with pytest.raises(NoReply, match="no event within 0.2 s"):
        next(quiet)
    # The signs of life of the stream are not events.
    life = http.client.HTTPConnection("127.0.0.1"), io.BytesIO(b":\n\n" * 3)
    with pytest.raises(NoReply, match="no event within 0 s"):
        next(robot._events(*life, 0))  # type: ignore[arg-type]


def test_jogging_and_breakpoints(pick: Robot) -> None:
    pick.breakpoints = [9]
    pick.start_program()
    pick.press_keys("1\r")
    pick.advance(1)
    assert (pick.status, pick.breakpoints) == ("stop (continue)", [9])
    pick.step_program()
    pick.run_program_to(11)
    pick.advance(70)
    assert pick.status == "stop (continue)"
    pick.key_switch = "teaching"
    before = pick.pose.joints[0]
    pick.jog(1, "plus", speed="fast")
    pick.advance(0.5)
    pick.stop_jog()
    pick.advance(1)
    assert pick.pose.joints[0] > before + 1


def test_several_threads_call_at_a_time(robot: Robot) -> None:
    robot.time_mode = "real"
    waiting = threading.Thread(target=lambda: robot.wait_until("input 5 on", within=10))
    waiting.start()
    time.sleep(0.05)
    robot.inputs[5] = True
    waiting.join(5)
    assert not waiting.is_alive()


def test_a_connection_that_gave_way_to_others_is_made_anew(robot: Robot) -> None:
    # The emulator serves 64 at a time.
    with contextlib.ExitStack() as stack:
        others = [stack.enter_context(Robot.connect(robot.url)) for _ in range(70)]
        assert {other.status for other in others} == {robot.status}
        assert {other.status for other in others} == {robot.status}



def test_an_idle_connection_is_opened_again(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    def local_port() -> int:
        assert robot.status == "stop (reset)"
        return int(robot._idle[-1][0].sock.getsockname()[1])

    kept = local_port()
    assert local_port() == kept
    monkeypatch.setattr(module, "IDLE_LIMIT", -1.0)
    assert local_port() != kept


def test_one_of_several_robots() -> None:
    with Robot.start(flags=["--robots=2", "--listen=127.0.0.1"]) as first:
        second = Robot.connect(first.url, robot="robot-2")
        second.servo = True
        assert (first.name, second.name, first.servo, second.servo) == ("robot-1", "robot-2", False, True)
        assert first.address() != second.address()
        second.close()
        with Robot.connect(f"{first.url}/robots/robot-2/") as second:
            assert second.servo
        with pytest.raises(ValueError, match="expected the URL of a control interface"):
            Robot.connect(f"{first.url}/page")
        with pytest.raises(Refused, match="no robot 'x'; there are robot-1, robot-2"):
            Robot.connect(first.url, robot="x")


def test_starting_and_ending(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TS3100_TIME", "nonsense")
    load = tmp_path / "pick.scol"
    load.write_text(PROGRAM)
    robot = Robot.start(time="stepped", load=[load], select="PICK", servo_on=True, faults=["ng:command=SU"],
                        options={"text.checksum": "sum", "extensions": False}, flags=["--deny", "unknown-command"])
    assert (robot.program.file, robot.servo, robot.faults[0].kind) == ("PICK", True, "ng")
    with Host.connect(robot.address(), pause=0, checksum=True) as host, pytest.raises(Refused):
        host.command("XX")
    assert robot.close() == 3
    assert "unknown command" in robot.log
    with pytest.raises(Disconnected):
        robot.state
    with pytest.raises(StartError, match="(?s)exit code 2: error: .*NOSUCH"):
        Robot.start(select="NOSUCH")
    with pytest.raises(StartError, match="its flags turn the control interface off"):
        Robot.start(flags=["--control=off"])
    with pytest.raises(StartError, match="cannot start /no/such"):
        Robot.start(binary="/no/such")
    with pytest.raises(ValueError, match="expected the URL of a control interface"):
        Robot.connect("127.0.0.1:3100")


def test_the_program_that_is_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TS3100_BINARY", "/no/such")
    with pytest.raises(StartError, match="TS3100_BINARY is /no/such, which is not a file"):
        Robot.start()
    monkeypatch.delenv("TS3100_BINARY")
    assert Path(ts3100.find_binary()).parent == Path(sys.executable).parent


def test_an_emulator_that_died_says_so() -> None:
    robot = Robot.start()
    assert robot._process
    robot._process._process.kill()
    with pytest.raises(Disconnected, match="the emulator has ended with exit code -9"):
        robot.state
    with pytest.raises(Disconnected, match="GET /events: the emulator has ended with exit code -9"):
        robot.events()
    robot.close()


@pytest.mark.skipif(sys.platform == "win32", reason="needs /bin/sh")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_an_emulator_ends_with_a_test_that_is_killed(number: signal.Signals) -> None:
    code = "import time; from ts3100 import Robot; robot = Robot.start(); print(robot.url, flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as test:
        assert test.stdout
        url = test.stdout.readline().strip()
        Robot.connect(url).close()
        test.send_signal(number)
    limit = time.monotonic() + 10
    with pytest.raises(Disconnected):
        while time.monotonic() < limit:
            Robot.connect(url).close()


def test_a_system_without_a_shell(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "GUARD", ("/no/such",))
    with Robot.start() as robot:
        assert robot.status == "stop (reset)"


def test_the_token_is_presented() -> None:
    token = "a-token-of-the-test-0123456789"
    with pytest.raises(Refused) as refused:
        Robot.start(flags=[f"--control-token={token}"])
    assert refused.value.status == 401
