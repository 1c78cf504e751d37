"""Test software that talks to a TS3100 robot controller.

`Host` and `AsyncHost` speak the robot's simple protocol, with a real robot or with the emulator. `Channel` is the peer of PRINT and
INPUT. `Robot` starts an emulator or connects to one, and controls it from a test. The pytest plugin in `ts3100.pytest_plugin` has the fixtures `robot` and `host`.
"""

from importlib.metadata import PackageNotFoundError as _PackageNotFoundError
from importlib.metadata import version as _version

from .binary import find_binary
from .channel import Channel
from .errors import Disconnected, Error, NoFile, NoReply, NotReached, ProtocolError, Refused, StartError
from .host import AsyncHost, Host
from .operations import Alarm, Clock, Fault, Pose, Program, Reached
from .protocol import Protocol
from .records import (AlarmRecord, Coordinates, ExecutionStatus, FileEntry, Frame, GuideMode, GuideRate, Lines, MaintenanceItem,
                      Position, QuickStatus, RunMode, Status, TotalStatus, VariableType, Version)
from .robot import Event, Finding, Robot

try:
    __version__ = _version("ts3100")
except _PackageNotFoundError:  # used from a clone, without being installed
    __version__ = "0"

__all__ = [
    "Alarm", "AlarmRecord", "AsyncHost", "Channel", "Clock", "Coordinates", "Disconnected", "Error", "Event", "ExecutionStatus", "Fault",
    "FileEntry", "Finding", "Frame", "GuideMode", "GuideRate", "Host", "Lines", "MaintenanceItem", "NoFile", "NoReply", "NotReached",
    "Pose", "Position", "Program", "Protocol", "ProtocolError", "QuickStatus", "Reached", "Refused", "Robot", "RunMode", "StartError",
    "Status", "TotalStatus", "VariableType", "Version", "find_binary",
]
