"""The plugin, as its user runs it: pytest in a process of its own, with the installed package."""

import json
import os
import re
import shlex
import subprocess
import sys
import xml.etree.ElementTree
from pathlib import Path
from typing import Any, Iterator

import pytest

from ts3100 import Robot
from ts3100.binary import find_binary
from ts3100.pytest_plugin import RULES, last_exchange

PICK = "GLOBAL\n  COUNT = 0\nEND\nPROGRAM PICK\n  DOUT(5)\n  DELAY 60\nEND\n"
# A host with a mistake: its command is in lower case. The robot forgives it and a test that looks at the robot passes.
WRONG_HOST = """
import socket

def turn_servo_on(address):
    with socket.create_connection(address) as host:
        host.sendall(b"\\x02so\\r\\x03")
        assert host.recv(100) == b"\\x02OK\\r\\x03"
"""


@pytest.fixture
def user(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.Pytester]:
    """A folder of a user, with a program and a host."""
    monkeypatch.delenv("PYTEST_XDIST_WORKER", raising=False)
    pytester.makefile(".scol", pick=PICK)
    pytester.makepyfile(wrong_host=WRONG_HOST)
    yield pytester


def run(user: pytest.Pytester, test: str, *arguments: str) -> pytest.RunResult:
    user.makepyfile(test)
    return user.runpytest_subprocess("-p", "no:cacheprovider", *arguments, timeout=120)


def test_a_wrong_host_fails_with_the_finding_that_explains_it(user: pytest.Pytester) -> None:
    result = run(user, """
        import pytest
        from wrong_host import turn_servo_on

        @pytest.mark.ts3100(deny="note")
        def test_servo(robot):
            turn_servo_on(robot.address())
            assert robot.servo

        def test_forgiven(robot):
            turn_servo_on(robot.address())

        @pytest.mark.ts3100(deny=["no-cr", "lower-case"])
        def test_by_rule(robot):
            turn_servo_on(robot.address())

        def test_unknown_command(robot, host):
            host.raw(b"XX\\r")
    """, "--ts3100-artifacts=found", "--junitxml=results.xml")
    result.assert_outcomes(failed=3, passed=1)
    result.stdout.fnmatch_lines([
        "the robot found mistakes of the host:",
        "  IP0 lower-case (note): \"so\" is read as SO. Text: 'so'. Send command letters in upper case*",
        "*- ts3100 findings -*",
        "IP0 lower-case*",
        "*- ts3100 last exchange -*",
        "> IP0 so<CR>",
        "< IP0 OK<CR>",
        "*- ts3100 trace -*",
        "ts3100 view found/*test_servo-call.txt --first lower-case",
        "page: found/*test_servo-call.html",
        "*_ test_by_rule _*",
        "*_ test_unknown_command _*",
        "  IP0 unknown-command (error): unknown command \"XX\"*",
    ])
    transcripts = sorted(path.name for path in (user.path / "found").glob("*.txt"))
    assert [name.rpartition(".py-")[2] for name in transcripts] == [
        "test_by_rule-call.txt", "test_servo-call.txt", "test_unknown_command-call.txt"]
    assert "> IP0 so<CR>" in (user.path / "found" / transcripts[1]).read_text()
    properties = xml.etree.ElementTree.parse(user.path / "results.xml").iter("property")
    assert [entry.get("name") for entry in properties] == ["ts3100_transcript"] * 3


TRACED = """
    import os
    import pytest

    @pytest.mark.ts3100(time="stepped")
    def test_refused(robot, host):
        robot.advance(2.5)
        host.select("NOFILE")

    def test_wrong_answer(robot, host):
        assert host.status().file == "PICK"

    def test_right(robot, host):
        host.status()

    def test_without_a_robot():
        assert os.name == "?"
"""


def viewed(user: pytest.Pytester, command: str) -> Any:
    """The state at the moment of a command that a report shows."""
    program, view, *words = shlex.split(command)
    assert (program, view) == ("ts3100", "view")
    shown = subprocess.run([find_binary(), view, *words, "--json"], cwd=user.path, stdout=subprocess.PIPE, check=True)
    return json.loads(shown.stdout)


def test_the_command_under_a_failure_shows_its_moment(user: pytest.Pytester) -> None:
    result = run(user, TRACED, "--ts3100-artifacts=the traces")
    result.assert_outcomes(failed=3, passed=1)
    commands = [line for line in result.outlines if line.startswith("ts3100 view ")]
    assert [re.sub(r".*-call.txt'", "", command) for command in commands] == [" --first ng", " --last received"]
    refused, answered = (viewed(user, command) for command in commands)
    assert refused["t"] == 2.5 and refused["file"] == ""
    assert answered["t"] > 0
    pages = [line[len("page: "):] for line in result.outlines if line.startswith("page: ")]
    assert "NG" in (user.path / pages[0]).read_text(encoding="utf-8")
    assert sorted(path.suffix for path in (user.path / "the traces").iterdir()) == [".html", ".html", ".txt", ".txt"]


def test_traces_are_kept_as_the_user_says(user: pytest.Pytester) -> None:
    run(user, TRACED, "--ts3100-artifacts=off", "--ts3100-trace=off").assert_outcomes(failed=3, passed=1)
    assert not (user.path / "off").exists()
    user.makeini("[pytest]\nts3100_trace = on\n")
    result = run(user, TRACED, "--ts3100-artifacts=on")
    result.assert_outcomes(failed=3, passed=1)
    names = sorted(path.name.rpartition(".py-")[2] for path in (user.path / "on").glob("*.txt"))
    assert names == ["test_refused-call.txt", "test_right.txt", "test_wrong_answer-call.txt"]
    assert "> IP0 SU<CR>" in next((user.path / "on").glob("*test_right.txt")).read_text()
    assert len(list((user.path / "on").glob("*.html"))) == 3
    result.stdout.no_fnmatch_line("*test_right.txt*")
    user.makeini("[pytest]\nts3100_trace = always\n")
    run(user, TRACED).stderr.fnmatch_lines(["*ts3100_trace: cannot keep the run of 'always'; there are off, on, retain-on-failure"])


@pytest.mark.skipif(os.name == "nt", reason="the program is a script here")
def test_a_page_that_cannot_be_written_hides_no_failure(user: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    program = user.path / "ts3100"
    program.write_text(f"#!/bin/sh\ntest $1 != view || {{ echo no disk >&2; exit 2; }}\nexec {shlex.quote(find_binary())} \"$@\"\n")
    program.chmod(0o755)
    monkeypatch.setenv("TS3100_BINARY", str(program))
    result = run(user, TRACED)
    result.assert_outcomes(failed=3, passed=1)
    result.stdout.fnmatch_lines(["E *Refused: *", "*- ts3100 trace -*", "ts3100 view *.txt --first ng", "no page: no disk"])


def test_without_the_program_the_report_says_how_to_make_the_page(user: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    with Robot.start(time="auto") as robot:
        monkeypatch.setenv("TS3100_BINARY", str(user.path / "none"))
        result = run(user, TRACED, f"--ts3100-url={robot.url}", "--ts3100-artifacts=kept")
    result.assert_outcomes(failed=3, passed=1)
    result.stdout.fnmatch_lines(["no page, because the program is not here; make it with ts3100 view kept/*test_refused-call.txt "
                                 "--html kept/*test_refused-call.html"])


def test_a_failed_test_shows_the_last_exchange_once(user: pytest.Pytester) -> None:
    result = run(user, """
        def test_status(robot, host):
            host.raw(b"XX\\r")
            assert host.status().file == "PICK"
    """)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["E *AssertionError*", "*- ts3100 last exchange -*", "> IP0 SU<CR>", "< IP0 FL,MODE:*", "*> IP0 OK<CR>"])


def test_findings_of_the_end_of_a_host(user: pytest.Pytester) -> None:
    result = run(user, """
        import pytest, socket

        @pytest.fixture
        def own_host(robot):
            with socket.create_connection(robot.address()) as host:
                yield host
            robot.wait_until("disconnected IP0", within=5)

        @pytest.mark.ts3100(deny="left-in-exchange")
        def test_leaves(own_host):
            own_host.sendall(b"\\x02SU\\r\\x03")
            own_host.recv(200)
    """)
    result.assert_outcomes(passed=1, errors=1)
    # Also of the last test of a session: the robot ends after the report.
    result.stdout.fnmatch_lines(["*ERROR at teardown*", "the robot found mistakes*", "  IP0 left-in-exchange*",
                                 "*- ts3100 last exchange -*", "> IP0 SU<CR>", "*- ts3100 trace -*"])
    result.stdout.no_fnmatch_line("*cannot read more from the robot*")


def test_every_test_has_a_fresh_robot(user: pytest.Pytester) -> None:
    result = run(user, """
        import pytest, socket

        @pytest.mark.parametrize("number", range(4))
        @pytest.mark.ts3100(time="stepped", deny="none")
        def test_fresh(robot, host, number):
            state = robot.state
            assert (state["t"], state["time_mode"], state["calendar"]) == (0, "stepped", "2014-02-06 00:00:00")
            assert "PICK" not in robot.files and robot.faults == [] and robot.findings == []
            assert robot.alarm_history == [] and robot.override == 100 and robot.inputs.on == []
            assert robot.transcript().count("> IP0") == 0 and robot.program.file == ""
            assert robot.key_switch == "ext" and not robot.servo
            assert robot.snapshots == []
            robot.files.load("pick.scol")
            robot.select_file("PICK")
            robot.arm_fault("ng:command=SU")
            robot.inputs.force(7, True)
            robot.override = 30
            robot.raise_alarm("8-014")
            robot.key_switch = "teaching"
            robot.take_snapshot("mine")
            host.raw(b"so\\r")
            robot.advance(1000)
    """)
    result.assert_outcomes(passed=4)


def test_markers_say_what_the_robot_is_like(user: pytest.Pytester) -> None:
    user.mkdir("sub")
    (user.path / "sub" / "test_sub.py").write_text("""
import pytest

pytestmark = pytest.mark.ts3100(load=["../pick.scol"], select="PICK", time="x10")

def test_paths_are_relative_to_the_file_of_the_test(robot):
    assert robot.program.file == "PICK" and robot.time_mode == "x10"

@pytest.mark.ts3100(time="stepped", servo_on=True, key_switch="teaching", control_right="rs232c")
class TestNearest:
    @pytest.mark.ts3100(key_switch="ext", faults=["ng:command=SU", "no-reply:command=SO"])
    def test_the_nearest_marker_wins(self, robot):
        assert (robot.time_mode, robot.program.file, robot.servo) == ("stepped", "PICK", True)
        assert (robot.key_switch, robot.control_right) == ("ext", "rs232c")
        assert [fault.kind for fault in robot.faults] == ["ng", "no-reply"]
""")
    result = run(user, """
        import pytest

        urls = {}

        @pytest.mark.parametrize("again", [1, 2])
        @pytest.mark.ts3100(model="tsl3000-thl400", options={"do.min_run": "1s"}, flags="--controller tsl3100")
        def test_own_process(robot, ts3100_server, again):
            version = robot.call("get_version")
            assert (version["model"], version["controller"]) == ("tsl3000-thl400", "TSL3100")
            assert robot.url != ts3100_server.url
            assert urls.setdefault("own", robot.url) == robot.url

        def test_session(robot, ts3100_server):
            assert robot is ts3100_server and robot.time_mode == "auto"
    """)
    result.assert_outcomes(passed=5)


def test_mistakes_in_a_marker(user: pytest.Pytester) -> None:
    result = run(user, """
        import pytest

        @pytest.mark.ts3100(selected="PICK")
        def test_typo(robot): pass

        @pytest.mark.ts3100("PICK")
        def test_positional(robot): pass

        @pytest.mark.ts3100(select="NOSUCH")
        def test_no_such_file(robot): pass

        @pytest.mark.ts3100(deny="lowercase")
        def test_no_such_rule(robot): pass

        @pytest.mark.ts3100(model="tv-801")
        def test_no_such_model(robot): pass
    """, "--strict-markers")
    result.assert_outcomes(errors=5)
    result.stdout.fnmatch_lines_random([
        "*the marker ts3100 has no 'selected'; did you mean 'select'?*", "*the marker ts3100 takes keywords only*",
        "*NOSUCH*", "*cannot deny 'lowercase': no such rule; did you mean 'lower-case'?*", "*exit code 2: error:*tv-801*"])


def test_configuration(user: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    user.makeini("[pytest]\nts3100_time = stepped\nts3100_deny = note\nts3100_flags = --load pick.scol --select PICK --servo-on\n"
                 "ts3100_artifacts = kept\n")
    # Paths of the configuration are relative to its folder, wherever pytest is called.
    user.mkdir("sub")
    monkeypatch.chdir(user.path / "sub")
    result = run(user, """
        def test_a(robot):
            assert (robot.time_mode, robot.program.file, robot.servo) == ("stepped", "PICK", True)
            robot.servo = False
            robot.select_file("PICK")

        def test_b(robot, host):
            assert robot.servo
            host.raw(b"so\\r")
    """, "..")
    result.assert_outcomes(passed=1, failed=1)
    assert sorted(path.suffix for path in (user.path / "kept").iterdir()) == [".html", ".txt"]


SCENARIO = """
[start]
load = ["pick.scol"]
select = "PICK"
servo-on = true

[[do]]
when = "command RN"
actions = ["emergency-stop press"]

[[expect]]
name = "asks for the status after the stop"
what = "command SU"
after = "alarm 8-014"
"""


def test_a_scenario_plays_for_each_test(user: pytest.Pytester) -> None:
    user.makefile(".toml", stop=SCENARIO)
    result = run(user, """
        import pytest

        pytestmark = pytest.mark.ts3100(scenario="stop.toml", time="stepped", deny="none")

        @pytest.mark.parametrize("again", [1, 2])
        def test_asks(host, again):
            host.start()
            assert host.status().status.name == "STOP_RETRY"

        def test_does_not_ask(host):
            host.start()
    """)
    result.assert_outcomes(passed=3, errors=1)
    result.stdout.fnmatch_lines(["*ERROR at teardown of test_does_not_ask*", "the scenario failed:",
                                 "  asks for the status after the stop: *", "*- ts3100 last exchange -*", "> IP0 RN<CR>"])


def test_a_running_emulator(user: pytest.Pytester) -> None:
    test = """
        import os, pytest

        def test_url(robot, host):
            host.servo_on()
            assert robot.url == os.environ["THE_URL"]
            print("ran on", robot.name)

        @pytest.mark.parametrize("number", range(4))
        def test_fresh(robot, number):
            assert not robot.servo

        @pytest.mark.parametrize("flags", [
            pytest.param(1, marks=pytest.mark.ts3100(model="tsl3000-thl400")),
            pytest.param(2, marks=pytest.mark.ts3100(scenario="stop.toml"))])
        def test_own(robot, flags): pass
    """
    with Robot.start(flags=["--robots=2"]) as running, pytest.MonkeyPatch.context() as patch:
        patch.setenv("THE_URL", running.url)
        result = run(user, test, f"--ts3100-url={running.url}", "-rP")
        result.assert_outcomes(passed=5, errors=2)
        result.stdout.fnmatch_lines(["*cannot set --model=tsl3000-thl400 on the running emulator at http*: run without --ts3100-url*",
                                     "*cannot set --scenario=* on the running emulator*"])
        pytest.importorskip("xdist")
        run(user, test, f"--ts3100-url={running.url}", "-n2").assert_outcomes(passed=5, errors=2)
        result = run(user, test, f"--ts3100-url={running.url}", "-n3")
        result.stdout.fnmatch_lines(["*has 2 robots, too few for worker gw2*"])
        assert running.status == "stop (reset)"


def test_xdist_has_a_server_for_each_worker(user: pytest.Pytester) -> None:
    pytest.importorskip("xdist")
    result = run(user, """
        import json, os, pytest, time

        @pytest.mark.parametrize("number", range(8))
        def test_it(robot, host, number):
            host.servo_on()
            time.sleep(0.05)
            open(f"{os.environ['PYTEST_XDIST_WORKER']}-{number}.json", "w").write(json.dumps(robot.url))
            assert robot.servo
    """, "-n2")
    result.assert_outcomes(passed=8)
    urls = {(path.name[:3], json.loads(path.read_text())) for path in user.path.glob("gw*.json")}
    assert len(urls) == 2 and len({url for _, url in urls}) == 2


def test_the_report_of_a_worker_is_complete(user: pytest.Pytester) -> None:
    pytest.importorskip("xdist")
    result = run(user, """
        import pytest
        from wrong_host import turn_servo_on

        @pytest.mark.ts3100(deny="lower-case")
        def test_servo(robot):
            turn_servo_on(robot.address())
    """, "-n1")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*- ts3100 findings -*", "*- ts3100 last exchange -*", "> IP0 so<CR>", "*- ts3100 trace -*"])


def test_only_some_emulators_are_kept(user: pytest.Pytester) -> None:
    result = run(user, """
        import pytest

        started = []

        @pytest.mark.parametrize("number", [
            pytest.param(number, marks=pytest.mark.ts3100(options={"do.min_run": f"{number}ms"})) for number in range(1, 13)])
        def test_own(robot, ts3100_server, number):
            started.append(robot)
            assert sum(not robot.has_ended for robot in started) <= 8

        def test_the_session_server_is_there(ts3100_server):
            assert ts3100_server.status == "stop (reset)" and sum(robot.has_ended for robot in started) == 5
    """)
    result.assert_outcomes(passed=13)


def test_a_robot_that_died_is_said_and_the_next_test_has_another(user: pytest.Pytester) -> None:
    result = run(user, """
        def test_dies(robot):
            robot._process._process.kill()
            robot._process._process.wait()

        def test_next(robot):
            assert robot.status == "stop (reset)"
    """)
    result.stdout.fnmatch_lines(["*the emulator has ended with exit code -9*"])
    result.assert_outcomes(passed=2, errors=1)


def test_without_the_fixtures_nothing_is_started(user: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TS3100_BINARY", "/no/such")
    run(user, "def test_it(): pass").assert_outcomes(passed=1)


def test_the_rules_are_those_of_the_documentation() -> None:
    page = Path(__file__).parents[3] / "docs" / "reference" / "findings.md"
    assert set(re.findall(r"^\| \[`([a-z0-9-]+)`\]\(#", page.read_text(encoding="utf-8"), re.MULTILINE)) == RULES


def test_the_last_exchange() -> None:
    assert last_exchange("> IP0 SO<CR>\n< IP0 OK<CR>\n> IP0 SU<CR>\n< IP0 FL,X<EOF>\n@+50ms\n> IP0 OK<CR>\n") == (
        "> IP0 SU<CR>\n< IP0 FL,X<EOF>\n@+50ms\n> IP0 OK<CR>")
    assert last_exchange("file DEMO\n| END\n") == ""
    snapshot = json.dumps({"state": ["x"] * 1000})
    assert last_exchange(f"! begin 5us IP0 {snapshot}\n> IP0 SU<CR>\n! restore 40us {snapshot}\n< IP0 SP<CR>\n") == (
        "> IP0 SU<CR>\n! restore 40us ...\n< IP0 SP<CR>")


def test_python_m() -> None:
    said = subprocess.run([sys.executable, "-m", "ts3100", "--version"], stdout=subprocess.PIPE, text=True, timeout=30, check=True)
    assert said.stdout.startswith("ts3100 ")
