"""Written by clients/generate.py from the OpenAPI document. Do not edit."""

from dataclasses import dataclass
from typing import Any, Dict, List, Literal, Optional, Tuple, TypedDict, Union

OPERATIONS = {
    "get_alarms": "GET /alarms",
    "raise_alarm": "POST /alarms",
    "reset_alarms": "POST /alarms/reset",
    "get_alarm_table": "GET /alarms/table",
    "get_alarm_row": "GET /alarms/table/{number}",
    "get_arm": "GET /arm",
    "get_pose": "GET /arm/pose",
    "get_battery": "GET /battery",
    "put_battery": "PUT /battery",
    "get_breakpoints": "GET /breakpoints",
    "put_breakpoints": "PUT /breakpoints",
    "get_channels": "GET /channels",
    "get_channel": "GET /channels/{port}",
    "drop_peer": "POST /channels/{port}/drop",
    "inject_bytes": "POST /channels/{port}/inject",
    "check_program": "POST /check",
    "get_clock": "GET /clock",
    "put_clock": "PUT /clock",
    "advance_time": "POST /clock/advance",
    "advance_time_until": "POST /clock/advance-until",
    "get_control_right": "GET /control-right",
    "put_control_right": "PUT /control-right",
    "get_coverage": "GET /coverage",
    "decode_text": "POST /decode",
    "get_emergency_stop": "GET /emergency-stop",
    "put_emergency_stop": "PUT /emergency-stop",
    "get_events": "GET /events{?since,count,state}",
    "get_faults": "GET /faults",
    "arm_fault": "POST /faults",
    "clear_faults": "DELETE /faults",
    "get_fault_kinds": "GET /faults/kinds",
    "get_fault": "GET /faults/{number}",
    "disarm_fault": "DELETE /faults/{number}",
    "get_feed_hold": "GET /feed-hold",
    "put_feed_hold": "PUT /feed-hold",
    "press_feed_hold": "POST /feed-hold/press",
    "get_files": "GET /files",
    "get_file": "GET /files/{name}",
    "put_file": "PUT /files/{name}",
    "delete_file": "DELETE /files/{name}",
    "select_file": "POST /files/{name}/select",
    "get_findings": "GET /findings",
    "get_health": "GET /health",
    "get_inputs": "GET /inputs",
    "get_input": "GET /inputs/{line}",
    "put_input": "PUT /inputs/{line}",
    "force_input": "PUT /inputs/{line}/force",
    "release_input": "DELETE /inputs/{line}/force",
    "pulse_input": "POST /inputs/{line}/pulse",
    "jog_arm": "POST /jog",
    "stop_jog": "POST /jog/stop",
    "get_key_switch": "GET /key-switch",
    "put_key_switch": "PUT /key-switch",
    "get_lines": "GET /lines",
    "get_machine_lock": "GET /machine-lock",
    "put_machine_lock": "PUT /machine-lock",
    "get_metrics": "GET /metrics",
    "get_outputs": "GET /outputs",
    "get_output": "GET /outputs/{line}",
    "put_output": "PUT /outputs/{line}",
    "force_output": "PUT /outputs/{line}/force",
    "release_output": "DELETE /outputs/{line}/force",
    "pulse_output": "POST /outputs/{line}/pulse",
    "get_override": "GET /override",
    "put_override": "PUT /override",
    "get_parameters": "GET /parameters",
    "get_pendant": "GET /pendant",
    "press_keys": "POST /pendant/keys",
    "get_positions": "GET /positions",
    "get_position": "GET /positions/{name}",
    "put_position": "PUT /positions/{name}",
    "teach_position": "POST /positions/{name}/teach",
    "get_power": "GET /power",
    "power_cycle": "POST /power/cycle",
    "power_off": "POST /power/off",
    "power_on": "POST /power/on",
    "get_program": "GET /program",
    "assign_variable": "POST /program/assign",
    "evaluate_expression": "POST /program/evaluate",
    "reset_program": "POST /program/reset",
    "run_program_to": "POST /program/run-to",
    "get_program_stack": "GET /program/stack",
    "start_program": "POST /program/start",
    "step_program": "POST /program/step",
    "step_task": "POST /program/step-task",
    "stop_program": "POST /program/stop",
    "reset_emulator": "POST /reset",
    "get_robots": "GET /robots",
    "get_robot": "GET /robots/{name}",
    "get_run_mode": "GET /run-mode",
    "put_run_mode": "PUT /run-mode",
    "get_safety_switch": "GET /safety-switch",
    "put_safety_switch": "PUT /safety-switch",
    "get_scenario": "GET /scenario",
    "get_servo": "GET /servo",
    "put_servo": "PUT /servo",
    "get_snapshot": "GET /snapshot",
    "load_snapshot": "PUT /snapshot",
    "get_snapshots": "GET /snapshots",
    "get_named_snapshot": "GET /snapshots/{name}",
    "put_snapshot": "PUT /snapshots/{name}",
    "delete_snapshot": "DELETE /snapshots/{name}",
    "restore_snapshot": "POST /snapshots/{name}/restore",
    "get_state": "GET /state",
    "get_status_frame": "GET /status-frame",
    "get_transcript": "GET /transcript{?format}",
    "get_variables": "GET /variables",
    "get_variable": "GET /variables/{name}",
    "put_variable": "PUT /variables/{name}",
    "get_version": "GET /version",
    "wait_until": "POST /wait",
    "get_wires": "GET /wires",
    "put_outside": "PUT /wires/outside/{name}",
}


@dataclass(frozen=True)
class Program:
    """The selected program."""

    file: str
    """The selected file; empty when none is."""
    status: str
    """Execution status."""
    line: int
    """Current line of the file; 0 when no file is selected."""


@dataclass(frozen=True)
class Alarm:
    """An alarm, with its cause and its remedy."""

    number: str
    """Number, as `level-code`."""
    level: int
    """Level: 8 the most severe, 1 a warning."""
    text: str
    """Text that the operator reads."""
    cause: str
    """Cause of the alarm."""
    remedy: str
    """Remedy."""
    at: str
    """Date and time, `YYYY-MM-DD HH:MM:SS`."""


@dataclass(frozen=True)
class Finding:
    """A mistake of a host, or what a fault has caused; `ts3100 docs findings` lists the rules."""

    rule: str
    """Name of the rule of a finding."""
    severity: str
    """Severity of a finding; `note` if a fault caused it."""
    message: str
    """Message."""
    remedy: str
    """Remedy of a finding."""
    t: float
    """Virtual time in seconds."""
    port: str = ""
    """Port of the event."""
    text: str = ""
    """Bytes as text, control codes by name: `<STX>SO<CR><ETX>`. Of an alarm and the pendant the words themselves."""
    caused_by: str = ""
    """Number and kind of the fault that caused a finding; absent if the host caused it."""


@dataclass(frozen=True)
class Fault:
    """A fault and its outcome."""

    id: int
    """Number of the fault."""
    kind: str
    """Kind of the fault."""
    spec: str
    """As text, like `--fault`."""
    armed: bool
    """Whether it can still trigger."""
    seen: int
    """Matches while it was armed."""
    fired: int
    """Number of times it triggered."""
    at: Tuple[float, ...]
    """Times at which it triggered, in seconds of virtual time; the first hundred."""


@dataclass(frozen=True)
class Clock:
    """The virtual time and how it passes."""

    mode: str
    """How time passes: `real`, `xN`, `stepped`, `auto`."""
    now: float
    """Virtual time in seconds since the emulator was started or reset."""
    calendar: str
    """Date and time as the error history writes them."""


@dataclass(frozen=True)
class Reached:
    """The end of a wait."""

    now: float
    """Virtual time at the end of the wait, in seconds."""
    passed: float
    """Virtual time that passed during the wait, in seconds."""


@dataclass(frozen=True)
class Pose:
    """Joints in degrees (the third of a SCARA in mm), and the tool point in the world in mm and degrees."""

    joints: Tuple[float, ...]
    """Joint values: degrees, of the SCARA's third axis mm."""
    world: Tuple[float, ...]
    """The tool point in world: X Y Z A B C U V, of a SCARA X Y Z C T; mm and degrees."""
    moving: bool
    """Whether a motion is under way or held."""
    percent: float
    """Completed percentage of the motion; 100 without a motion."""


ActiveAlarm = TypedDict("ActiveAlarm", {"at": str, "cause": str, "docs": str, "level": int, "number": str, "remedy": str,
    "text": str})
Alarms = TypedDict("Alarms", {"active": List["ActiveAlarm"], "history": List["ActiveAlarm"]})
AlarmRow = TypedDict("AlarmRow", {"cause": str, "docs": str, "level": int, "number": str, "ours": bool, "remedy": str,
    "text": str})
ArmPosture = TypedDict("ArmPosture", {"analysed_line": int, "executed_line": int, "joints": List[float], "moving": bool,
    "percent": float, "t": float, "work": List[float], "world": List[float]})
Axis = TypedDict("Axis", {"max": float, "max_speed": float, "min": float})
Geometry = Dict[str, Any]
ArmModel = TypedDict("ArmModel", {"axes": List["Axis"], "geometry": "Geometry", "kind": str, "max_tool_speed": float, "name": str,
    "ready": List[float]})
ArmPicture = TypedDict("ArmPicture", {"analysed_line": int, "executed_line": int, "joints": List[float], "moving": bool,
    "percent": float, "t": float, "work": List[float], "world": List[float], "base": List[float], "model": "ArmModel",
    "path": List[List[float]], "tool": List[float], "tool_point": List[float], "work_frame": List[float]})
Battery = TypedDict("Battery", {"low": bool})
BreakpointRule = TypedDict("BreakpointRule", {"condition": Optional[str], "hits": Optional[str], "line": int,
    "message": Optional[str]}, total=False)
Breakpoints = TypedDict("Breakpoints", {"lines": List[int], "rules": List["BreakpointRule"]}, total=False)
PortName = Literal["HOST", "COM1", "IP0", "IP1", "IP2", "IP3"]
Channel = TypedDict("Channel", {"accepts": Optional[int], "buffer": str, "buffer_hex": str, "exchange": Optional[str],
    "partial": bool, "peer": Optional[str], "port": "PortName", "serial": Optional[str]}, total=False)
Diagnostic = TypedDict("Diagnostic", {"code": str, "column": int, "docs": Optional[str], "help": Optional[str], "length": int,
    "line": int, "message": str, "severity": str}, total=False)
ClockDocument = TypedDict("ClockDocument", {"behind": float, "calendar": str, "mode": str, "next": Optional[float], "now": float,
    "skipped": float}, total=False)
WaitResult = TypedDict("WaitResult", {"now": float, "passed": float, "reached": bool})
RightHolder = Literal["sig", "rs232c", "ether"]
ControlRight = TypedDict("ControlRight", {"holder": "RightHolder"})
CoverageCell = TypedDict("CoverageCell", {"command": str, "count": int, "mode": str, "outcome": str, "port": str,
    "reachable": bool})
Coverage = TypedDict("Coverage", {"cells": List["CoverageCell"], "percent": float, "reachable": int, "reached": int,
    "version": int})
TextField = TypedDict("TextField", {"end": int, "key": str, "name": str, "start": int, "value": str})
DecodedText = TypedDict("DecodedText", {"fields": List["TextField"]})
Button = TypedDict("Button", {"pressed": bool})
Event = TypedDict("Event", {"bytes": Optional[int], "caused-by": Optional[str], "command": Optional[str], "event": str,
    "file": Optional[str], "hex": Optional[str], "kind": Optional[str], "line": Optional[int], "message": Optional[str],
    "mode": Optional[str], "number": Optional[str], "on": Optional[bool], "outcome": Optional[str], "peer": Optional[str],
    "port": Optional[str], "reason": Optional[str], "remedy": Optional[str], "rule": Optional[str], "seq": int,
    "severity": Optional[str], "source": Optional[str], "status": Optional[str], "t": float, "task": Optional[int],
    "text": Optional[str], "until": Optional[float]}, total=False)
FaultTrigger = TypedDict("FaultTrigger", {"block": Optional[int], "channel": Optional[str], "command": Optional[str]},
    total=False)
FaultDocument = TypedDict("FaultDocument", {"after": int, "armed": bool, "at": List[float], "fired": int, "id": int, "kind": str,
    "on": "FaultTrigger", "parameters": Dict[str, Any], "probability": float, "seen": int, "spec": str, "times": int})
Faults = TypedDict("Faults", {"faults": List["FaultDocument"], "never_fired": List[int]})
FaultParameter = TypedDict("FaultParameter", {"default": Optional[str], "name": str, "takes": str, "what": str}, total=False)
FaultKind = TypedDict("FaultKind", {"applies_to": List[str], "block": Optional[int], "command": Optional[str], "kind": str,
    "parameters": List["FaultParameter"], "remedy": str, "what": str}, total=False)
Switch = TypedDict("Switch", {"on": bool})
FileEntry = TypedDict("FileEntry", {"name": str, "size": int})
Drive = TypedDict("Drive", {"capacity": int, "files": List["FileEntry"], "selected": str})
File = TypedDict("File", {"hex": Optional[str], "name": str, "size": int, "text": Optional[str]}, total=False)
Status = Literal["running", "stop (reset)", "stop (retry)", "stop (continue)"]
ProgramStatus = TypedDict("ProgramStatus", {"file": str, "line": int, "status": "Status"})
DriveHealth = TypedDict("DriveHealth", {"error": Optional[str], "failures": int, "status": str, "unkept": List[str]}, total=False)
Health = TypedDict("Health", {"drive": Optional["DriveHealth"], "power": Optional[bool], "robots": Optional[int], "status": str,
    "t": Optional[float]}, total=False)
ForcedLine = TypedDict("ForcedLine", {"line": int, "on": bool})
Lines = TypedDict("Lines", {"forced": List["ForcedLine"], "on": List[int]})
Line = TypedDict("Line", {"forced": bool, "line": int, "name": Optional[str], "on": bool}, total=False)
KeyPosition = Literal["teaching", "internal", "ext"]
KeySwitch = TypedDict("KeySwitch", {"position": "KeyPosition"})
AllLines = TypedDict("AllLines", {"inputs": List["Line"], "outputs": List["Line"]})
Override = TypedDict("Override", {"percent": int})
Serial = TypedDict("Serial", {"length": int, "parity": int, "speed": int, "stop": int})
EthernetChannel = TypedDict("EthernetChannel", {"alarm_level": Optional[int], "open_mode": int, "own_port": int,
    "peer_address": str, "peer_port": int, "port": str}, total=False)
Ethernet = TypedDict("Ethernet", {"address": str, "channels": List["EthernetChannel"], "community": str, "dhcp": int,
    "gateway": str, "mask": str, "name": str})
Parameters = TypedDict("Parameters", {"com1": "Serial", "ethernet": "Ethernet", "host": "Serial"})
PendantPage = TypedDict("PendantPage", {"heading": str, "lines": List[str]})
Pendant = TypedDict("Pendant", {"ether_pages": List["PendantPage"], "text": str})
VariableKind = Literal["integer", "real", "load", "coordinate", "position"]
Variable = TypedDict("Variable", {"bounds": List[int], "elements": Optional[List[Optional[List[float]]]],
    "kind": Optional["VariableKind"], "name": str, "value": Optional[List[float]]}, total=False)
OpenPort = TypedDict("OpenPort", {"accepts": int, "port": str})
Power = TypedDict("Power", {"on": bool, "ports": List["OpenPort"]})
ProgramStop = TypedDict("ProgramStop", {"fault": Optional[str], "line": int, "reason": str, "task": int}, total=False)
StackCall = TypedDict("StackCall", {"line": int, "locals": List["Variable"], "program": str})
StackTask = TypedDict("StackTask", {"calls": List["StackCall"], "doing": str, "id": int, "interrupted": Optional[int]},
    total=False)
ProgramStack = TypedDict("ProgramStack", {"file": str, "statement_lines": List[int], "status": "Status",
    "stopped": Optional["ProgramStop"], "tasks": List["StackTask"]}, total=False)
Robot = TypedDict("Robot", {"name": str, "ports": Dict[str, Any], "serial": Dict[str, Any], "started": bool}, total=False)
Robots = TypedDict("Robots", {"robots": List["Robot"]})
RunMode = Literal["continuous", "cycle", "step", "segment"]
OperationMode = TypedDict("OperationMode", {"mode": "RunMode"})
SafetySwitch = TypedDict("SafetySwitch", {"open": bool})
ScenarioStep = TypedDict("ScenarioStep", {"line": int, "message": Optional[str], "name": str, "state": str, "t": Optional[float]},
    total=False)
Scenario = TypedDict("Scenario", {"file": str, "state": str, "steps": List["ScenarioStep"]})
Snapshot = TypedDict("Snapshot", {"name": str, "t": float})
Snapshots = TypedDict("Snapshots", {"snapshots": List["Snapshot"]})
Arm = TypedDict("Arm", {"configuration": int, "joints": List[float], "model": str, "moving": bool, "percent": float,
    "position_file": str, "work": List[float], "work_name": str, "world": List[float]})
Guidance = TypedDict("Guidance", {"coordinate": int, "mode": int, "rate": int})
OpenCall = TypedDict("OpenCall", {"line": int, "program": str})
Task = TypedDict("Task", {"calls": List["OpenCall"], "doing": str, "id": int, "line": int, "reads": Optional["PortName"]},
    total=False)
Watchdog = TypedDict("Watchdog", {"due": float, "level": int, "timeout": float})
State = TypedDict("State", {"alarms": List["ActiveAlarm"], "analysed_line": int, "arm": "Arm", "battery_low": bool,
    "breakpoints": List[int], "calendar": str, "channels": List["Channel"], "control_right": "RightHolder",
    "emergency_stop": bool, "ether_pages": List["PendantPage"], "executed_line": int, "faults": "Faults", "feed_hold": bool,
    "file": str, "files": "Drive", "findings": Dict[str, Any], "guide": "Guidance", "hands": List[str], "inputs": "Lines",
    "key_switch": "KeyPosition", "line": int, "machine_lock": bool, "master_mode": str, "outputs": "Lines",
    "override_percent": int, "parameters": "Parameters", "pendant": str, "power": bool, "power_on_minutes": int,
    "run_minutes": int, "run_mode": str, "safety_open": bool, "scenario": bool, "servo": bool, "servo_due": Optional[float],
    "status": "Status", "t": float, "tasks": List["Task"], "time_mode": str, "variables": List["Variable"],
    "watchdog": Optional["Watchdog"]}, total=False)
StatusField = TypedDict("StatusField", {"key": str, "meaning": Optional[str], "name": str, "value": str}, total=False)
Version = TypedDict("Version", {"controller": Optional[str], "model": Optional[str], "name": str, "version": str}, total=False)
Wire = TypedDict("Wire", {"from": str, "on": bool, "to": str})
Wires = TypedDict("Wires", {"wires": List["Wire"]})
