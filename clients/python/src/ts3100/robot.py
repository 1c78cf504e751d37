"""`Robot`: a running emulator, by its control interface; started here, or connected to.

Every method is one operation of the interface; `Robot.call` reaches the others. The interface is described in
docs/reference/control-interface.md of the project, and by the emulator itself at /docs.
"""

from __future__ import annotations

import atexit
import contextlib
import difflib
import http.client
import json
import os
import re
import signal
import socket
import subprocess
import tempfile
import threading
import time
from collections import deque
from dataclasses import dataclass, fields
from typing import (TYPE_CHECKING, Any, Deque, Dict, Generic, Iterator, List, Mapping, MutableMapping, Optional, Sequence, Set, Tuple,
                    Type, TypeVar, Union, cast, overload)
from urllib.parse import quote, unquote, urlencode, urlsplit

from .binary import find_binary
from .channel import Channel
from .closing import Closing, Strict
from .errors import Disconnected, Error, NoFile, NoReply, NotReached, ProtocolError, Refused, StartError
from .host import Host
from .operations import OPERATIONS, Alarm, Clock, Fault, Pose, Program, Reached, State
from .operations import Channel as ChannelDocument
from .operations import Finding as FindingFields

if TYPE_CHECKING:
    from typing_extensions import Self

T = TypeVar("T")
# Seconds, or a text with its unit: `500 ms`.
Duration = Union[float, str]
Condition = Union[str, Mapping[str, object]]

# A cold start on a busy machine; the usual one takes 10 ms.
START_TIMEOUT = 30.0
STOP_TIMEOUT = 10.0
CALL_TIMEOUT = 10.0
# The emulator closes an idle connection after 30 s.
IDLE_LIMIT = 20.0
# Defaults of `advance_until` and `wait_until`: virtual and wall-clock seconds.
WITHIN, WALL = 60.0, 30.0
# HTTP statuses: of a name that there is none of, and of a wait that took longer than `wall`.
NOT_FOUND, TOO_LONG = 404, 408
UNITS = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0}
# The end of the emulator's log in a message.
LOG_SHOWN = 4096
# Ends an emulator whose test was killed: `read` ends with the pipe from there.
GUARD = ("/bin/sh", "-c", 'read -r _; kill "$0"')
LOCAL_ADDRESSES = ("0.0.0.0", "::")


class Finding(FindingFields):
    """A mistake of a host, or what a fault has caused; `ts3100 docs findings` lists the rules.

    No test fails on what a fault has caused: `caused_by` names it."""

    def __str__(self) -> str:
        text = f" Text: {self.text!r}." if self.text else ""
        advice = f"caused-by: {self.caused_by}" if self.caused_by else self.remedy
        return f"{self.port} {self.rule} ({self.severity}): {self.message}.{text} {advice}"


@dataclass(frozen=True)
class Event:
    """Something that came in, went out or happened. `fields` has all of the document."""

    seq: int
    t: float
    event: str
    fields: Mapping[str, Any]


def _record(kind: Type[T], document: Mapping[str, Any]) -> T:
    """A record from the keys of a document that it has; lists become tuples."""
    names = {field.name for field in fields(cast(Any, kind))}
    keys = {name.replace("-", "_"): value for name, value in document.items()}
    values = {name: tuple(value) if isinstance(value, list) else value for name, value in keys.items() if name in names}
    try:
        return kind(**values)
    except TypeError as error:
        raise ProtocolError(f"cannot read the answer of the emulator as {kind.__name__}: {error}") from None


class _Setting(Generic[T]):
    """A value that `get_NAME` reads and `put_NAME` sets."""

    def __init__(self, name: str, key: str) -> None:
        self._name, self._key = name, key

    @overload
    def __get__(self, robot: None, owner: object) -> Self: ...

    @overload
    def __get__(self, robot: Robot, owner: object) -> T: ...

    def __get__(self, robot: Optional[Robot], owner: object) -> Union[Self, T]:
        return self if robot is None else cast(T, robot.call(f"get_{self._name}")[self._key])

    def __set__(self, robot: Robot, value: T) -> None:
        robot.call(f"put_{self._name}", {self._key: value})


class Lines(Strict):
    """Input or output lines: `robot.inputs[5] = True`."""

    __slots__ = ("_robot", "_kind")

    def __init__(self, robot: Robot, kind: str) -> None:
        self._robot, self._kind = robot, kind

    def __getitem__(self, line: int) -> bool:
        return bool(self._robot.call(f"get_{self._kind}", {"line": line})["on"])

    def __setitem__(self, line: int, on: bool) -> None:
        self._robot.call(f"put_{self._kind}", {"line": line, "on": on})

    @property
    def on(self) -> List[int]:
        """The numbers of the lines that are on."""
        return list(self._robot.call(f"get_{self._kind}s")["on"])

    def pulse(self, line: int, seconds: Duration, on: bool = True) -> None:
        """Sets a line and sets it back after this much virtual time."""
        self._robot.call(f"pulse_{self._kind}", {"line": line, "seconds": _seconds(seconds), "on": on})

    def force(self, line: int, on: bool) -> None:
        """The line shows this state, whatever drives it, until `release`."""
        self._robot.call(f"force_{self._kind}", {"line": line, "on": on})

    def release(self, line: int) -> None:
        """Ends forcing."""
        self._robot.call(f"release_{self._kind}", {"line": line})


class Variables(Strict):
    """Variables or positions of the selected file: `robot.variables["COUNT"] = 3`.

    A value is a number, a list of numbers for a load, a coordinate or a position, and None if nothing was assigned yet. An
    array is the list of its elements from subscript 0; `robot.variables["TBL(2)"]` is a single one.
    """

    __slots__ = ("_robot", "_kind")

    def __init__(self, robot: Robot, kind: str) -> None:
        self._robot, self._kind = robot, kind

    def __getitem__(self, name: str) -> Any:
        return self._value(self._robot.call(f"get_{self._kind}", {"name": name}))

    def __setitem__(self, name: str, value: Any) -> None:
        self.set(name, value)

    def set(self, name: str, value: Any, restore: bool = False) -> None:
        """Sets a variable; with `restore` also in its file."""
        self._robot.call(f"put_{self._kind}", {"name": name, "value": value, "restore": restore})

    def teach(self, name: str, restore: bool = False) -> None:
        """A position becomes the present one."""
        self._robot.call("teach_position", {"name": name, "restore": restore})

    def all(self) -> Dict[str, Any]:
        """All of them by their names."""
        return {row["name"]: self._value(row) for row in self._robot.call(f"get_{self._kind}s")}

    @staticmethod
    def _value(row: Mapping[str, Any]) -> Any:
        def scalar(value: Any) -> Any:
            return value[0] if isinstance(value, list) and len(value) == 1 else value

        return [scalar(element) for element in row["elements"]] if "elements" in row else scalar(row.get("value"))


class Files(Strict, MutableMapping[str, str]):
    """The files of the RAM drive as texts: `robot.files["PICK"] = source`. Without such a file, `NoFile` is raised, a KeyError."""

    __slots__ = ("_robot",)

    def __init__(self, robot: Robot) -> None:
        self._robot = robot

    def __getitem__(self, name: str) -> str:
        return self.read(name).decode("latin-1")

    def __setitem__(self, name: str, content: Union[str, bytes]) -> None:
        data = content.encode("latin-1") if isinstance(content, str) else content
        self._robot.call("put_file", {"name": name, "hex": data.hex()})

    def __delitem__(self, name: str) -> None:
        self._call("delete_file", name)

    def __iter__(self) -> Iterator[str]:
        return iter([row["name"] for row in self._robot.call("get_files")["files"]])

    def __len__(self) -> int:
        return len(self._robot.call("get_files")["files"])

    def read(self, name: str) -> bytes:
        """The bytes of a file."""
        document = self._call("get_file", name)
        return bytes.fromhex(document["hex"]) if "hex" in document else str(document["text"]).encode()

    def _call(self, operation: str, name: str) -> Any:
        try:
            return self._robot.call(operation, {"name": name})
        except Refused as error:
            if error.status != NOT_FOUND:
                raise
            raise NoFile(str(error), error.status, error.where) from None

    def load(self, path: Union[str, os.PathLike[str]]) -> str:
        """Puts a file of this machine on the RAM drive as `--load` does: pick.scol becomes PICK. Returns the name."""
        stem, ending = os.path.splitext(os.path.basename(os.fspath(path)))
        name = (stem + ending if ending.lower() == ".par" else stem).upper()
        with open(path, "rb") as file:
            content = file.read()
        self[name] = content.rstrip(b"\x1a").replace(b"\r\n", b"\n").decode("latin-1")
        return name


class Robot(Closing):
    """A robot of a running emulator.

        with Robot.start(time="stepped", load=["pick.scol"], select="PICK", servo_on=True) as robot:
            robot.start_program()
            robot.advance_until("output 5 on")

    Settings are attributes: `robot.emergency_stop = True`. A refused call raises `Refused` with the reason.
    """

    __slots__ = ("url", "taken", "name", "ports", "inputs", "outputs", "variables", "positions", "files", "_authority", "_headers", "_process",
                 "_idle", "_prefix", "_addresses", "__weakref__")

    key_switch = _Setting[str]("key_switch", "position")
    control_right = _Setting[str]("control_right", "holder")
    emergency_stop = _Setting[bool]("emergency_stop", "pressed")
    safety_switch = _Setting[bool]("safety_switch", "open")
    servo = _Setting[bool]("servo", "on")
    feed_hold = _Setting[bool]("feed_hold", "on")
    machine_lock = _Setting[bool]("machine_lock", "on")
    battery = _Setting[bool]("battery", "low")
    override = _Setting[int]("override", "percent")
    run_mode = _Setting[str]("run_mode", "mode")
    time_mode = _Setting[str]("clock", "mode")
    breakpoints = _Setting[List[int]]("breakpoints", "lines")

    def __init__(self, url: str, *, token: Optional[str] = None, robot: Optional[str] = None,
                 process: Optional[_Process] = None) -> None:
        parts = urlsplit(url)
        path = re.fullmatch(r"(?:/robots/([^/]+))?/?", parts.path)
        if parts.scheme != "http" or not parts.hostname or not path:
            raise ValueError(f"cannot connect to {url!r}: expected the URL of a control interface, for example http://127.0.0.1:3100")
        self.url = url.rstrip("/")
        self._authority = (parts.hostname, parts.port or 80)
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._process = process
        # Idle connections, each with the time of its last use. Calls of several threads each take their own.
        self._idle: Deque[Tuple[http.client.HTTPConnection, float]] = deque()
        self._prefix = ""
        # Names of the snapshots that were taken here and not deleted.
        self.taken: Set[str] = set()
        try:
            row = self._row(robot or (unquote(path[1]) if path[1] else None))
        except BaseException:
            self._hang_up()
            raise
        self.name: str = row["name"]
        # A serial line has an address if it is served as bare TCP.
        lines = {name: text.split("://")[-1] for name, text in row.get("serial", {}).items() if text.startswith("socket:")}
        self._addresses = {name: self._address(text) for name, text in {**lines, **row["ports"]}.items()}
        self.ports = {name: self._addresses[name][1] for name in row["ports"]}
        self.inputs, self.outputs = Lines(self, "input"), Lines(self, "output")
        self.variables, self.positions = Variables(self, "variable"), Variables(self, "position")
        self.files = Files(self)

    # Starting, connecting, ending

    @classmethod
    def start(cls, *, time: Optional[str] = None, load: Sequence[Union[str, os.PathLike[str]]] = (), select: Optional[str] = None,
              servo_on: bool = False, model: Optional[str] = None, scenario: Union[str, os.PathLike[str], None] = None,
              faults: Sequence[str] = (), options: Optional[Mapping[str, object]] = None, flags: Sequence[str] = (),
              binary: Optional[str] = None, cwd: Union[str, os.PathLike[str], None] = None) -> Self:
        """Starts an emulator on free ports; it ends with `close`, or with this process. On Windows it continues if this process is killed.

        `faults` are as for `--fault`, `options` are named options (`--set`), `flags` any other flags of `ts3100 serve`. Paths
        are relative to `cwd`, default the present directory.
        Variables of the environment that set flags (TS3100_...) have no effect on it.
        """
        command: List[str] = [f"--time={time}"] if time else []
        command += [f"--load={os.fspath(path)}" for path in load]
        command += [f"--select={select}"] if select else []
        command += ["--servo-on"] if servo_on else []
        command += [f"--model={model}"] if model else []
        command += [f"--scenario={os.fspath(scenario)}"] if scenario else []
        command += [f"--fault={fault}" for fault in faults]
        command += set_flags(options)
        process = _Process(binary or find_binary(), [*command, *flags], cwd)
        try:
            if "control" not in process.ready:
                raise StartError("cannot control the emulator: its flags turn the control interface off")
            return cls(process.ready["control"], process=process)
        except BaseException:
            process.end()
            raise

    @classmethod
    def connect(cls, url: str, *, token: Optional[str] = None, robot: Optional[str] = None) -> Self:
        """Connects to a running emulator by the URL of its control interface. `robot`, or /robots/NAME at the end of the URL, names one
        of several; default the first."""
        return cls(url, token=token, robot=robot)

    @classmethod
    def from_environment(cls) -> Self:
        """Connects to the robot that `ts3100 exec` has started around this process."""
        url = os.environ.get("TS3100_CONTROL_URL")
        if not url:
            raise StartError("TS3100_CONTROL_URL is not set: run the tests by `ts3100 exec -- pytest`")
        return cls(url, token=os.environ.get("TS3100_CONTROL_TOKEN"))

    def close(self) -> int:
        """Closes the connections and ends an emulator that was started here. Returns its exit code; 0 otherwise."""
        self._hang_up()
        return self._process.end() if self._process else 0

    def _hang_up(self) -> None:
        while self._idle:
            self._idle.pop()[0].close()

    @property
    def ready(self) -> Dict[str, Any]:
        """The ready line of an emulator that was started here: ports, and addresses of serial lines at `serial`."""
        return self._process.ready if self._process else {}

    @property
    def has_ended(self) -> bool:
        """Whether an emulator that was started here has ended by itself."""
        return self._process is not None and self._process.has_ended()

    @property
    def log(self) -> str:
        """The log of an emulator that was started here."""
        return self._process.log() if self._process else ""

    def _row(self, robot: Optional[str]) -> Mapping[str, Any]:
        rows = self.call("get_robots")["robots"]
        for row in rows:
            if robot in (None, row["name"]):
                # Of several robots, paths name one.
                self._prefix = f"/robots/{quote(row['name'], safe='')}" if len(rows) > 1 else ""
                return cast(Mapping[str, Any], row)
        raise Refused(f"no robot {robot!r}; there are {', '.join(row['name'] for row in rows)}", 404, "robot")

    def _address(self, text: str) -> Tuple[str, int]:
        host, _, port = text.rpartition(":")
        host = host.strip("[]")
        return self._authority[0] if host in LOCAL_ADDRESSES else host, int(port)

    def address(self, port: str = "ip0") -> Tuple[str, int]:
        """Host and port number of ip0 to ip3, and of a serial line that is served as bare TCP."""
        return self._addresses[port.lower()]

    def host(self, *, timeout: float = 5.0, pause: float = 0.05, stx: bool = True) -> Host:
        """A host that is connected to IP0."""
        return Host.connect(self.address(), timeout=timeout, pause=pause, stx=stx, describe=self.describe)

    def channel(self, port: str = "ip1", *, timeout: float = 5.0) -> Channel:
        """A peer that is connected to IP1 or IP2, or to COM1 where it is served as bare TCP."""
        return Channel.connect(self.address(port), timeout=timeout, name=port.upper(), describe=self.describe)

    # Calls

    def call(self, operation: str, arguments: Optional[Mapping[str, object]] = None, *, timeout: float = CALL_TIMEOUT) -> Any:
        """Makes a call of the control interface, by its operation in the OpenAPI document: `call("put_input", {"line": 5, "on": True})`.

        The arguments are the parameters of the path and the query, and the fields of the body. Returns the JSON document of the
        answer, or its text or bytes.
        """
        return self._answer(*_request(operation, arguments or {}), timeout)

    def request(self, method: str, path: str, body: object = None, *, timeout: float = CALL_TIMEOUT) -> Any:
        """Makes a call by its method and path, for what has no operation: `request("GET", "/openapi.json")`."""
        return self._answer(method, path, None if body is None else json.dumps(body).encode(), timeout)

    def _answer(self, method: str, path: str, body: Optional[bytes], timeout: float) -> Any:
        status, kind, answer = self._exchange(method, self._prefix + path, body, timeout)
        if status >= 400:
            raise self._refused(method, path, status, kind, answer)
        if kind.startswith("application/json"):
            return json.loads(answer)
        return answer.decode() if kind.startswith(("text/", "application/x-ndjson")) else answer

    def _exchange(self, method: str, path: str, body: Optional[bytes], timeout: float) -> Tuple[int, str, bytes]:
        headers = self._headers if body is None else {**self._headers, "Content-Type": "application/json"}
        connection = self._connection(timeout)
        with self._closing_on_failure(connection, f"{method} {path}", timeout):
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            data = answer.read()
        self._idle.append((connection, time.monotonic()))
        return answer.status, answer.getheader("Content-Type") or "", data

    @contextlib.contextmanager
    def _closing_on_failure(self, connection: http.client.HTTPConnection, call: str, timeout: float) -> Iterator[None]:
        try:
            yield
        except BaseException as error:
            connection.close()
            if isinstance(error, socket.timeout):
                raise NoReply(f"{call}: no answer within {timeout:g} s") from None
            if isinstance(error, (OSError, http.client.HTTPException)):
                raise Disconnected(f"{call}: {self._ended() or error}") from error
            raise

    def _connection(self, timeout: float) -> http.client.HTTPConnection:
        try:
            connection, used = self._idle.pop()
        except IndexError:
            return http.client.HTTPConnection(*self._authority, timeout=timeout)
        if time.monotonic() - used > IDLE_LIMIT or _has_ended(connection.sock):
            connection.close()
        connection.timeout = timeout
        if connection.sock:
            connection.sock.settimeout(timeout)
        return connection

    def _ended(self) -> Optional[str]:
        return self._process.ended() if self._process else None

    @staticmethod
    def _refused(method: str, path: str, status: int, kind: str, answer: bytes) -> Error:
        text = answer.decode("utf-8", "replace")
        problem = json.loads(text) if kind.startswith("application/json") else {}
        message = problem.get("error") or text or f"{method} {path}: status {status}"
        return Refused(message, status, problem.get("where"))

    # Panel

    @property
    def state(self) -> State:
        """Everything at one moment."""
        return cast(State, self.call("get_state"))

    def describe(self) -> str:
        """Clock, program, alarms, outputs and the last printed lines in a sentence, for the message of a test that fails."""
        state = self.state
        clock = "is stepped and stopped at" if state["time_mode"] == "stepped" else f"runs ({state['time_mode']}) and is at"
        task = next((task for task in state["tasks"] if task.get("reads")), None)
        reads = f", an INPUT waits for {task['reads']}" if task else ""
        program = f"{state['file']} is {state['status']}, line {state['line']}{reads}" if state["file"] else "no file is selected"
        alarms = " ".join(alarm["number"] for alarm in state["alarms"]) or "none"
        outputs = " ".join(str(line) for line in state["outputs"]["on"]) or "none"
        last = {match[1]: match[2] for match in re.finditer(r"^<:? (COM1|IP1|IP2) (.*)", self.transcript(), re.MULTILINE)}
        printed = "".join(f"{port} printed {text}, " for port, text in last.items())
        pendant = (state["pendant"].split() and state["pendant"].splitlines()[-1].strip()) or "nothing"
        return (f"the clock {clock} {state['t']:g} s; {program}; alarms: {alarms}; outputs on: {outputs}; "
                f"{printed}the pendant {'printed ' * (not printed)}{pendant}")

    @property
    def status(self) -> str:
        """The execution status: running, stop (reset), stop (retry) or stop (continue)."""
        return self.program.status

    def press_feed_hold(self) -> None:
        """Presses the button, which turns feed hold on or off."""
        self.call("press_feed_hold")

    def power_off(self) -> None:
        """Turns the power off: every port is closed."""
        self.call("power_off")

    def power_on(self) -> None:
        """Turns the power on."""
        self.call("power_on")

    def power_cycle(self) -> None:
        """Turns the power off and on."""
        self.call("power_cycle")

    def reset(self, *, time: Optional[str] = None) -> None:
        """Everything is as when the emulator was started; connections are closed. Ports stay, and the mode of the clock unless
        `time` is another one."""
        self.call("reset_emulator", {"mode": time} if time else None)

    def jog(self, axis: int, direction: str, *, coordinates: str = "joint", speed: str = "slow", inching: bool = False) -> None:
        """Presses a key of the teach pendant that moves the arm, `plus` or `minus`, until `stop_jog` or for one step."""
        self.call("jog_arm", {"axis": axis, "direction": direction, "coordinates": coordinates, "speed": speed, "inching": inching})

    def stop_jog(self) -> None:
        """Lets the key go."""
        self.call("stop_jog")

    @property
    def pose(self) -> Pose:
        """Where the arm is."""
        return _record(Pose, self.call("get_pose"))

    # Program

    @property
    def program(self) -> Program:
        """The selected program."""
        return _record(Program, self.call("get_program"))

    def select_file(self, name: str) -> None:
        """Selects a file of the RAM drive."""
        self.call("select_file", {"name": name})

    def start_program(self) -> None:
        """Presses START."""
        self.call("start_program")

    def stop_program(self) -> None:
        """Presses STOP."""
        self.call("stop_program")

    def reset_program(self) -> None:
        """Goes back to the first step, with the initial values of the file."""
        self.call("reset_program")

    def step_program(self) -> None:
        """Runs one step."""
        self.call("step_program")

    def run_program_to(self, line: int) -> None:
        """Runs the program and stops before this line."""
        self.call("run_program_to", {"line": line})

    @property
    def pendant(self) -> str:
        """What programs have printed on the teach pendant."""
        return str(self.call("get_pendant")["text"])

    def press_keys(self, keys: str) -> None:
        """Types at the teach pendant, for INPUT without a channel; `\\r` is the key that ends a value."""
        self.call("press_keys", {"keys": keys})

    # Alarms and faults

    @property
    def alarms(self) -> List[Alarm]:
        """The active alarms, oldest first."""
        return [_record(Alarm, row) for row in self.call("get_alarms")["active"]]

    @property
    def alarm_history(self) -> List[Alarm]:
        """The error history, newest first."""
        return [_record(Alarm, row) for row in self.call("get_alarms")["history"]]

    def raise_alarm(self, number: str, detail: str = "") -> None:
        """Raises an alarm, such as `2-046`."""
        self.call("raise_alarm", {"number": number, **({"detail": detail} if detail else {})})

    def reset_alarms(self) -> None:
        """Presses ALARM RESET."""
        self.call("reset_alarms")

    @property
    def faults(self) -> List[Fault]:
        """The faults since the start, and their outcome."""
        return [_record(Fault, row) for row in self.call("get_faults")["faults"]]

    def arm_fault(self, spec: str) -> Fault:
        """Arms a fault, such as `no-reply:command=SU`."""
        rows = self.call("arm_fault", {"spec": spec})["faults"]
        return _record(Fault, max(rows, key=lambda row: row["armed"] and row["id"]))

    def disarm_fault(self, fault: int) -> None:
        """Disarms a fault by its number; it stays in the list."""
        self.call("disarm_fault", {"number": fault})

    def clear_faults(self) -> None:
        """Removes all faults."""
        self.call("clear_faults")

    # Ports

    def channel_state(self, port: str) -> ChannelDocument:
        """A communication port (HOST, COM1, IP0 to IP3): its peer, its exchange, its buffer."""
        return cast(ChannelDocument, self.call("get_channel", {"port": port.upper()}))

    def inject(self, port: str, data: Union[str, bytes]) -> None:
        """Bytes as if the peer of a SCOL channel had sent them."""
        body = {"hex": data.hex()} if isinstance(data, bytes) else {"text": data}
        self.call("inject_bytes", {"port": port.upper(), **body})

    def drop_peer(self, port: str) -> None:
        """Closes the connection of the peer."""
        self.call("drop_peer", {"port": port.upper()})

    # Time

    @property
    def clock(self) -> Clock:
        """The virtual time, and how it passes."""
        return _record(Clock, self.call("get_clock"))

    def advance(self, seconds: Duration, *, wall: Duration = WALL) -> None:
        """Advances a stopped clock (`time_mode` stepped) by so many seconds, or `500 ms`; `wall` bounds the real time it takes."""
        wall = _seconds(wall)
        self.call("advance_time", {"seconds": _seconds(seconds), "wall": wall}, timeout=wall + CALL_TIMEOUT)

    def advance_until(self, condition: Condition, within: Duration = WITHIN, *, wall: Duration = WALL) -> Reached:
        """Advances a stopped clock until a condition is met, such as `output 5 on`. Raises NotReached after `within` s."""
        return self._await("advance_time_until", condition, _seconds(within), _seconds(wall))

    def wait_until(self, condition: Condition, within: Duration = WITHIN, *, wall: Duration = WALL) -> Reached:
        """Waits for a condition while time passes by itself. Raises NotReached after `within` s of virtual time."""
        return self._await("wait_until", condition, _seconds(within), _seconds(wall))

    def _await(self, operation: str, condition: Condition, within: float, wall: float) -> Reached:
        limit = f"{within:g} s of virtual time"
        try:
            answer = self.call(operation, {"condition": condition, "within": within, "wall": wall}, timeout=wall + CALL_TIMEOUT)
            if answer["reached"]:
                return _record(Reached, answer)
        except Refused as error:
            if error.status != TOO_LONG:
                raise
            limit = f"{wall:g} s of wall-clock time"
        raise NotReached(f"`{condition}` was not met within {limit}: {self.describe()}")

    # Snapshots

    @property
    def snapshots(self) -> List[str]:
        """The names of the snapshots."""
        return [row["name"] for row in self.call("get_snapshots")["snapshots"]]

    def take_snapshot(self, name: str) -> None:
        """Keeps the present state under a name."""
        self.call("put_snapshot", {"name": name})
        self.taken.add(name)

    def restore_snapshot(self, name: str) -> None:
        """Returns to a snapshot; hosts stay connected, findings and transcript continue."""
        self.call("restore_snapshot", {"name": name})

    def delete_snapshot(self, name: str) -> None:
        """Deletes a snapshot."""
        self.call("delete_snapshot", {"name": name})
        self.taken.discard(name)

    # Records

    @property
    def findings(self) -> List[Finding]:
        """The mistakes of hosts since the start or the last reset, oldest first."""
        return [_record(Finding, row) for row in self.call("get_findings")]

    def transcript(self, format: str = "text") -> str:
        """What went over the ports, as `text` or `jsonl`."""
        return str(self.call("get_transcript", {"format": format}))

    def events(self, since: Optional[int] = None, *, count: Optional[int] = None, timeout: float = CALL_TIMEOUT) -> Iterator[Event]:
        """The events as they happen; `since` 1 begins with the oldest kept. Raises NoReply after `timeout` s of silence."""
        given = {name: value for name, value in (("since", since), ("count", count)) if value is not None}
        path = self._prefix + _request("get_events", given)[1]
        connection = http.client.HTTPConnection(*self._authority, timeout=timeout)
        with self._closing_on_failure(connection, "GET /events", timeout):
            connection.request("GET", path, headers=self._headers)
            answer = connection.getresponse()
            if answer.status >= 400:
                raise self._refused("GET", path, answer.status, answer.getheader("Content-Type") or "", answer.read())
        return self._events(connection, answer, timeout)

    def _events(self, connection: http.client.HTTPConnection, answer: http.client.HTTPResponse, timeout: float) -> Iterator[Event]:
        quiet = time.monotonic() + timeout
        try:
            for line in answer:
                if line.startswith(b"data:"):
                    document = json.loads(line[5:])
                    yield Event(document.get("seq", 0), document.get("t", 0.0), document.get("event", ""), document)
                    quiet = time.monotonic() + timeout
                elif time.monotonic() > quiet:
                    raise socket.timeout
        except socket.timeout:
            raise NoReply(f"no event within {timeout:g} s") from None
        finally:
            answer.close()
            connection.close()


def _has_ended(idle: Optional[socket.socket]) -> bool:
    """Whether the emulator has closed a connection on which nothing is due: of many, the longest idle give way."""
    if idle is None:
        return False
    idle.setblocking(False)
    try:
        idle.recv(1, socket.MSG_PEEK)
    except BlockingIOError:
        return False
    except OSError:
        pass
    return True


def _request(operation: str, arguments: Mapping[str, object]) -> Tuple[str, str, Optional[bytes]]:
    """Method, path and body of an operation: the path and the query take their arguments, the body has the others."""
    if operation not in OPERATIONS:
        near = difflib.get_close_matches(operation, OPERATIONS, 1)
        raise ValueError(f"unknown operation {operation!r}" + (f"; did you mean {near[0]!r}?" if near else ""))
    method, _, template = OPERATIONS[operation].partition(" ")
    place, _, query = template.partition("{?")
    rest = dict(arguments)
    try:
        path = re.sub(r"\{(\w+)\}", lambda name: quote(str(rest.pop(name[1])), safe=""), place)
    except KeyError as missing:
        raise ValueError(f"{operation} needs the argument {missing}") from None
    given = {name: rest.pop(name) for name in query[:-1].split(",") if name in rest}
    path += "?" + urlencode(given) if given else ""
    if method in ("PUT", "POST"):
        return method, path, json.dumps(rest).encode()
    if rest:
        raise ValueError(f"{operation} has no argument {next(iter(rest))!r}")
    return method, path, None


def _seconds(duration: Duration) -> float:
    """The seconds of a number, or of a text as the command line reads it."""
    if not isinstance(duration, str):
        return duration
    found = re.fullmatch(r"(\d+\.?\d*|\.\d+) *(us|ms|s|min)?", duration.strip())
    if not found:
        raise ValueError(f"cannot read {duration!r} as a duration: expected seconds, or e.g. `5s`, `500 ms`, `1.5 s`")
    return float(found[1]) * UNITS[found[2] or "s"]


def set_flags(options: Optional[Mapping[str, object]]) -> List[str]:
    """The flags of named options, in the words of the command line."""
    return [f"--set={name}={str(value).lower() if isinstance(value, bool) else value}" for name, value in (options or {}).items()]


class _Process:
    """A `ts3100 serve` on free ports, in a process group of its own: Ctrl-C ends the tests first and then this."""

    def __init__(self, binary: str, flags: Sequence[str], cwd: Union[str, os.PathLike[str], None]) -> None:
        environment = {name: value for name, value in os.environ.items() if not name.startswith("TS3100_")}
        command = [binary, "serve", "--ports=auto", "--ready-json", *flags]
        group: Dict[str, Any] = ({"creationflags": getattr(subprocess, "CREATE_NEW_PROCESS_GROUP")} if os.name == "nt"
                                 else {"start_new_session": True})
        # The emulator writes and this process reads: each needs an offset of its own.
        log, self._log = tempfile.mkstemp("-ts3100.log")
        self._said = ""
        try:
            self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log,
                                             env=environment, cwd=cwd, **group)
        except OSError as error:
            os.unlink(self._log)
            raise StartError(f"cannot start {binary}: {error}") from error
        finally:
            os.close(log)
        atexit.register(self.end)
        self._guard: Optional[subprocess.Popen[bytes]] = None
        # Windows has no shell of this kind, and some containers have none either.
        with contextlib.suppress(OSError):
            self._guard = subprocess.Popen([*GUARD, str(self._process.pid)], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                                           stderr=subprocess.DEVNULL, start_new_session=os.name != "nt")
        watch = threading.Timer(START_TIMEOUT, self._process.kill)
        watch.start()
        assert self._process.stdout
        line = self._process.stdout.readline()
        watch.cancel()
        if not line:
            code = self._process.wait()
            said = self.log().strip() or "it said nothing"
            self.end()
            raise StartError(f"cannot start the emulator, exit code {code}: {said}")
        self.ready: Dict[str, Any] = json.loads(line)

    def log(self) -> str:
        """The log so far."""
        if os.path.exists(self._log):
            with open(self._log, encoding="utf-8", errors="replace") as file:
                self._said = file.read()
        return self._said

    def has_ended(self) -> bool:
        """Whether it has ended."""
        return self._process.poll() is not None

    def ended(self) -> Optional[str]:
        """How it ended by itself."""
        try:
            code = self._process.wait(0.2)
        except subprocess.TimeoutExpired:
            return None
        return f"the emulator has ended with exit code {code}: {self.log()[-LOG_SHOWN:].strip()}"

    def end(self) -> int:
        """Ends it as Ctrl-C does, so that it writes its reports. Returns the exit code."""
        atexit.unregister(self.end)
        if self._guard:
            self._guard.kill()
            self._guard.communicate()
        if self._process.poll() is None:
            self._process.send_signal(getattr(signal, "CTRL_BREAK_EVENT") if os.name == "nt" else signal.SIGTERM)
            try:
                self._process.wait(STOP_TIMEOUT)
            except subprocess.TimeoutExpired:
                self._process.kill()
        code = self._process.wait()
        if self._process.stdout:
            self._process.stdout.close()
        self.log()
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self._log)
        return code
