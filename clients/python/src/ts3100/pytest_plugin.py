"""The pytest plugin: a fresh robot for each test, and what its host did wrong in the report of a failed test.

Fixtures: `robot` and `host`, of a test; `ts3100_server`, of a session. The marker `ts3100` says what a test needs:

    @pytest.mark.ts3100(load=["pick.scol"], select="PICK", servo_on=True, time="stepped", deny="warning")
    def test_cell(robot, host): ...
"""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import shlex
import subprocess
import tempfile
import xml.etree.ElementTree
from collections import OrderedDict
from pathlib import Path
from typing import Any, Dict, Generator, Iterator, List, Optional, Sequence, Tuple, Union

import pytest

from .binary import find_binary
from .errors import Error, StartError
from .host import ADVISED_PAUSE, Host
from .robot import Finding, Robot, set_flags

# Keys of the marker: what is set on a running robot, what needs a process of its own, and what the plugin does.
LIVE = ("load", "select", "servo_on", "faults", "time", "key_switch", "control_right")
OWN = ("model", "controller", "dialect", "options", "flags", "scenario")
PLUGIN = ("deny",)
SEVERITIES = ("note", "warning", "error")
# The rules of docs/reference/findings.md; a test compares them.
RULES = frozenset("""
    answer-early command-early command-before-answer poll-fast no-stx no-etx bytes-outside text-over-long
    text-unfinished bad-checksum no-cr message-too-long lower-case blank-after-comma blank-at-end comma-for-blank odd-character
    abbreviated unknown-command malformed-command extension-command mode-forbids start-servo-off program-errors
    refused-by-state repeated-refusal servo-off-running write-while-running command-in-exchange unexpected-answer
    answer-missing download-abandoned left-in-exchange file-without-download file-bad-line file-malformed
    file-too-large file-line-ends cr-after-eof selected-overwritten long-file-name parameter-pending
    parameter-broken watchdog-late left-jogging second-connection answers-unread half-duplex line-settings
    line-garbled line-overflow data-before-input data-cleared input-overflow print-cut input-not-a-number
    input-empty input-line-feed half-value peer-left print-without-peer input-without-peer protocol-on-channel
    data-to-ip3 accel-over-full panel-refused signal-refused no-such-line wire-loop selection-lost
""".split())
# Processes kept for tests with other flags than those of the session.
KEPT_SERVERS = 8
# Findings and characters shown in a report; the transcript has all of it.
FINDINGS_SHOWN = 10
TEXT_SHOWN = 2000
LONGEST_NAME = 100
# When the run of a test is kept, as for the traces of Playwright.
TRACES = ("off", "on", "retain-on-failure")
# A page is written in less than a second; a machine under load takes longer.
PAGE_TIMEOUT = 60


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("ts3100", "TS3100 emulator")
    group.addoption("--ts3100-url", metavar="URL", help="use a running emulator instead of starting one: the URL of its control "
                    "interface")
    group.addoption("--ts3100-artifacts", metavar="DIR", help="write the traces of tests to this directory "
                    "[default: a temporary one]")
    group.addoption("--ts3100-trace", choices=TRACES, help="keep the run of the robot, for `ts3100 view` and as a page: "
                    "of no test, of each, or of those that fail [default: retain-on-failure]")
    parser.addini("ts3100_flags", "flags of `ts3100 serve` for every robot", "args", [])
    parser.addini("ts3100_time", "how time passes unless a test says otherwise: real, x10, stepped or auto", default="auto")
    parser.addini("ts3100_deny", "fail a test on these findings: none, note, warning, error or names of rules", "args", ["error"])
    parser.addini("ts3100_artifacts", "directory for the traces of tests", default="")
    parser.addini("ts3100_trace", f"of which tests the run is kept: {', '.join(TRACES)}", default="retain-on-failure")


def pytest_configure(config: pytest.Config) -> None:
    _check_word(f"ts3100_trace: cannot keep the run of {_tracing(config)!r}", _tracing(config), TRACES)
    config.addinivalue_line("markers", f"ts3100({', '.join(f'{key}=...' for key in LIVE + OWN + PLUGIN)}): what the robot of a "
                            "test is like; `ts3100 docs pytest` explains them")


class _Test:
    """What a test said with its markers, and the robot it got."""

    def __init__(self, item: pytest.Item, servers: Servers) -> None:
        self.item = item
        self.servers = servers
        self.wanted: Dict[str, Any] = {}
        self.robot: Optional[Robot] = None
        # Findings and transcript of a robot that ends before the report is made.
        self.record: Optional[Tuple[List[Finding], str]] = None
        # The rule of the first finding that fails the test.
        self.broken: Optional[str] = None
        self.is_kept = False
        self._blamed = 0
        for marker in item.iter_markers("ts3100"):
            if marker.args:
                raise pytest.UsageError("the marker ts3100 takes keywords only, for example select=\"PICK\"")
            # The marker nearest to the test comes first and wins.
            self.wanted = {**marker.kwargs, **self.wanted}
        known = LIVE + OWN + PLUGIN
        for key in self.wanted:
            _check_word(f"the marker ts3100 has no {key!r}", key, known)
        deny = self.wanted.get("deny", item.config.getini("ts3100_deny"))
        self._deny = {word for entry in _listed(deny) for word in entry.split(",")}
        for word in self._deny:
            _check_word(f"cannot deny {word!r}: no such rule", word, ("none", *SEVERITIES, *sorted(RULES)))

    def path(self, name: Union[str, os.PathLike[str]]) -> str:
        """A path of the marker, which is relative to the file of the test."""
        return str(self.item.path.parent / name)

    def denied(self, robot: Robot) -> List[Finding]:
        """The findings that fail the test and have not failed it yet."""
        lowest = min((SEVERITIES.index(word) for word in self._deny & set(SEVERITIES)), default=len(SEVERITIES))
        found = [finding for finding in robot.findings if not finding.caused_by
                 and (finding.rule in self._deny or SEVERITIES.index(finding.severity) >= lowest)]
        new, self._blamed = found[self._blamed:], len(found)
        if new and not self.broken:
            self.broken = new[0].rule
        return new


def _check_word(message: str, word: str, known: Sequence[str]) -> None:
    if word not in known:
        near = difflib.get_close_matches(word, known, 1)
        raise pytest.UsageError(f"{message}; " + (f"did you mean {near[0]!r}?" if near else f"there are {', '.join(known)}"))


def _tracing(config: pytest.Config) -> str:
    """Of which tests the run is kept."""
    return str(config.getoption("--ts3100-trace") or config.getini("ts3100_trace"))


def _listed(value: Any) -> List[Any]:
    return [value] if isinstance(value, (str, os.PathLike)) else list(value)


_TEST = pytest.StashKey[_Test]()


def denial(findings: Sequence[Finding]) -> str:
    """What a test fails with whose host did what the test, or the configuration, denies."""
    shown = [f"  {finding}" for finding in findings[:FINDINGS_SHOWN]]
    if len(findings) > len(shown):
        shown.append(f"  and {len(findings) - len(shown)} more")
    return "the robot found mistakes of the host:\n" + "\n".join(shown)


class Servers:
    """The processes of a session: one with the flags of the configuration, and others for tests that need other flags."""

    def __init__(self, config: pytest.Config, temporary: pytest.TempPathFactory) -> None:
        self.temporary = temporary
        self._config = config
        self._flags: List[str] = config.getini("ts3100_flags")
        self._url: Optional[str] = config.getoption("--ts3100-url")
        self._kept: OrderedDict[Tuple[str, ...], Robot] = OrderedDict()

    def get(self, flags: Sequence[str] = ()) -> Robot:
        """The robot that was started with these flags; the longest unused of the others may end for it."""
        key = tuple(flags)
        robot = self._kept.pop(key, None)
        if robot and robot.has_ended:
            robot.close()
            robot = None
        if robot is None:
            robot = self._connect() if self._url and not key else self.start(key)
        self._kept[key] = robot
        if len(self._kept) > KEPT_SERVERS:
            # That of the session stays: `ts3100_server` has it.
            self._kept.pop(next(key for key in self._kept if key)).close()
        return robot

    def start(self, flags: Sequence[str], time: Optional[str] = None) -> Robot:
        """A process with the flags of the configuration and these; their paths are relative to the root of the tests."""
        if self._url:
            raise pytest.UsageError(f"cannot set {' '.join(flags)} on the running emulator at {self._url}: run without --ts3100-url")
        return Robot.start(time=time or self._config.getini("ts3100_time"), flags=[*self._flags, *flags],
                           cwd=self._config.rootpath)

    def _connect(self) -> Robot:
        """The running emulator; with xdist each worker has one of its robots."""
        assert self._url
        token = os.environ.get("TS3100_CONTROL_TOKEN")
        robot = Robot.connect(self._url, token=token)
        worker = os.environ.get("PYTEST_XDIST_WORKER")
        if worker is None:
            return robot
        names = [row["name"] for row in robot.call("get_robots")["robots"]]
        robot.close()
        number = int(worker[2:])
        if number >= len(names):
            raise pytest.UsageError(f"the emulator at {self._url} has {len(names)} robots, too few for worker {worker}: start it "
                                    "with --robots, or run without --ts3100-url")
        return Robot.connect(self._url, token=token, robot=names[number])

    def close(self) -> None:
        """Ends all of them."""
        while self._kept:
            self._kept.popitem()[1].close()


@pytest.fixture(scope="session")
def _ts3100_servers(pytestconfig: pytest.Config, tmp_path_factory: pytest.TempPathFactory) -> Servers:
    """The processes of the session."""
    servers = Servers(pytestconfig, tmp_path_factory)
    # Later than the end of the fixture, which comes before the report of the last test's teardown: that report reads the robot.
    pytestconfig.add_cleanup(servers.close)
    return servers


@pytest.fixture(scope="session")
def ts3100_server(_ts3100_servers: Servers) -> Robot:
    """The robot of the session, with the flags of the configuration, as the last test left it. `robot` resets it."""
    return _ts3100_servers.get()


@pytest.fixture
def robot(request: pytest.FixtureRequest, _ts3100_servers: Servers) -> Iterator[Robot]:
    """A fresh robot: files, variables, alarms, faults, clock, findings and transcript are as after a start."""
    test = _Test(request.node, _ts3100_servers)
    request.node.stash[_TEST] = test
    flags = _own_flags(test)
    if test.wanted.get("scenario"):
        yield from _with_scenario(test, _ts3100_servers, flags)
        return
    robot = _ts3100_servers.get(flags)
    robot.reset(time=test.wanted.get("time") or request.config.getini("ts3100_time"))
    for name in sorted(robot.taken):
        robot.delete_snapshot(name)
    _prepare(test, robot)
    yield robot
    _check_findings(test, robot)


@pytest.fixture
def host(robot: Robot) -> Iterator[Host]:
    """A host that is connected to IP0 of `robot`. It keeps the manual's pause of 50 ms unless the clock is stopped."""
    with robot.host(pause=0.0 if robot.time_mode == "stepped" else ADVISED_PAUSE) as host:
        yield host


def _own_flags(test: _Test) -> List[str]:
    """Flags for what cannot be set on a running robot."""
    wanted = test.wanted
    flags = [f"--{key}={wanted[key]}" for key in ("controller", "dialect") if wanted.get(key)]
    if wanted.get("model"):
        model = str(wanted["model"])
        flags.append(f"--model={test.path(model) if model.endswith('.toml') else model}")
    flags += set_flags(wanted.get("options"))
    extra = wanted.get("flags") or []
    return flags + (shlex.split(extra) if isinstance(extra, str) else list(extra))


def _prepare(test: _Test, robot: Robot) -> None:
    """What the marker says and a running robot can be told."""
    test.robot = robot
    wanted = test.wanted
    for path in _listed(wanted.get("load") or []):
        robot.files.load(test.path(path))
    if wanted.get("select"):
        robot.select_file(wanted["select"])
    if "servo_on" in wanted:
        robot.servo = wanted["servo_on"]
    for fault in _listed(wanted.get("faults") or []):
        robot.arm_fault(fault)
    for key in ("control_right", "key_switch"):
        if wanted.get(key):
            setattr(robot, key, wanted[key])


def _with_scenario(test: _Test, servers: Servers, flags: List[str]) -> Iterator[Robot]:
    """A process of the test's own: a scenario begins with its emulator, and its results come at the end."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder, "scenario.xml")
        flags = [*flags, f"--scenario={test.path(test.wanted['scenario'])}", f"--junit={results}"]
        robot = servers.start(flags, test.wanted.get("time"))
        try:
            _prepare(test, robot)
            yield robot
            # The robot ends before the report is made.
            test.record = (robot.findings, robot.transcript())
            _check_findings(test, robot)
        finally:
            robot.close()
        failed = [f"  {case.get('name')}: {failure.get('message') or failure.text}"
                  for case in xml.etree.ElementTree.parse(results).iter("testcase") for failure in case.findall("failure")]
        if failed:
            pytest.fail("the scenario failed:\n" + "\n".join(failed), pytrace=False)


def _check_findings(test: _Test, robot: Robot) -> None:
    """Findings after the test, such as of a connection that was closed in the middle of an exchange."""
    denied = test.denied(robot)
    if denied:
        pytest.fail(denial(denied), pytrace=False)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Fails a test that has passed if its host made denied mistakes. Those of a failed test are in its report."""
    test = item.stash.get(_TEST, None)
    denied: List[Finding] = []
    try:
        result = yield
    finally:
        if test and test.robot:
            with contextlib.suppress(Error):
                denied = test.denied(test.robot)
    if denied:
        pytest.fail(denial(denied), pytrace=False)
    return result


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Adds findings, the last exchange and the trace to the report of a failed test. Keeps the trace of others if told so."""
    report = yield
    test = item.stash.get(_TEST, None)
    if not test or not test.robot:
        return report
    # The end of a test is the last moment at which its robot is as it left it.
    kept_anyway = _tracing(item.config) == "on" and report.when == "teardown" and not test.is_kept
    if report.failed or kept_anyway:
        try:
            findings, transcript = test.record or (test.robot.findings, test.robot.transcript())
            if report.failed:
                report.sections += _sections(findings, transcript)
            if _tracing(item.config) != "off":
                shown = _keep(test, transcript, f"-{report.when}" if report.failed else "")
                if report.failed:
                    report.sections.append(("ts3100 trace", shown))
        except (Error, OSError) as error:
            report.sections.append(("ts3100", f"cannot read more from the robot: {error}"))
    return report


def _sections(findings: List[Finding], transcript: str) -> List[Tuple[str, str]]:
    """Findings and the last exchange, as sections of a report."""
    sections = []
    if findings:
        lines = [str(finding) for finding in findings[-FINDINGS_SHOWN:]]
        if len(findings) > len(lines):
            lines.insert(0, f"the last {len(lines)} of {len(findings)}:")
        sections.append(("ts3100 findings", "\n".join(lines)))
    exchange = last_exchange(transcript)
    if exchange:
        sections.append(("ts3100 last exchange", exchange[-TEXT_SHOWN:]))
    return sections


def _keep(test: _Test, transcript: str, ending: str) -> str:
    """Writes the transcript and its page. Returns the command that shows the moment of the failure, and the page."""
    folder = _artifacts(test)
    name = re.sub(r"[^\w.-]+", "-", test.item.nodeid)[-LONGEST_NAME:].strip("-")
    path = folder / f"{name}{ending}.txt"
    folder.mkdir(parents=True, exist_ok=True)
    path.write_bytes(transcript.encode())
    test.is_kept = True
    test.item.user_properties.append(("ts3100_transcript", str(path)))
    here = test.item.config.invocation_params.dir
    view = f"ts3100 view {_quoted(path, here)}"
    return f"{view}{_moment(test, transcript)}\n" + _page(test, path, here, view)


def _moment(test: _Test, transcript: str) -> str:
    """The finding that failed the test, otherwise the first NG, otherwise the last that a host sent."""
    if test.broken:
        return f" --first {test.broken}"
    if re.search(r"^<:? \S+ NG<CR>", transcript, re.MULTILINE):
        return " --first ng"
    return " --last received" if last_exchange(transcript) else ""


def _page(test: _Test, path: Path, here: Path, view: str) -> str:
    """Writes the page of a transcript beside it. Returns its path, or why there is none: the failure of the test is reported
    all the same."""
    page = path.with_suffix(".html")
    try:
        # The flags of a recording are relative to where its emulator was started.
        made = subprocess.run([find_binary(), "view", str(path), "--html", str(page)], cwd=test.item.config.rootpath,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=PAGE_TIMEOUT)
    except StartError:
        return f"no page, because the program is not here; make it with {view} --html {_quoted(page, here)}"
    except (OSError, subprocess.SubprocessError) as error:
        return f"no page: {error}"
    if made.returncode:
        return f"no page: {made.stderr.decode(errors='replace').strip() or f'exit code {made.returncode}'}"
    return f"page: {_shown(page, here)}"


def _shown(path: Path, here: Path) -> str:
    """A path, relative to the working directory if it is below."""
    return str(path.relative_to(here) if here in path.parents else path)


def _quoted(path: Path, here: Path) -> str:
    """The same for a shell."""
    shown = _shown(path, here)
    return subprocess.list2cmdline([shown]) if os.name == "nt" else shlex.quote(shown)


def _artifacts(test: _Test) -> Path:
    config = test.item.config
    chosen = config.getoption("--ts3100-artifacts") or config.getini("ts3100_artifacts")
    return config.rootpath / str(chosen) if chosen else test.servers.temporary.getbasetemp() / "ts3100"


def last_exchange(transcript: str) -> str:
    """The last text of a host in a transcript, and everything after it."""
    lines = transcript.splitlines()
    texts = [at for at, line in enumerate(lines) if line.startswith((">", ">:"))]
    # The OK of the host to an FL text belongs to the command before it.
    while len(texts) > 1 and re.fullmatch(r">:? \S+ OK<CR>(<ETX>)?", lines[texts[-1]]):
        texts.pop()
    # A whole snapshot would leave no room for anything else.
    return "\n".join(re.sub(r"^(! restore \S+ ).*", r"\1...", line) for line in lines[texts[-1]:]) if texts else ""
