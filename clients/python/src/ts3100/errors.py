"""What can go wrong between a test and a robot. Every exception of this package is an `Error`."""

from __future__ import annotations

from typing import Optional


class Error(Exception):
    """Base of the exceptions of this package."""


class Refused(Error):
    """The robot answered NG, or the control interface refused a call. Nothing was changed.

    `status` is the HTTP status of a call and None for NG; `where` names the field, header, line or variable.
    """

    def __init__(self, message: str, status: Optional[int] = None, where: Optional[str] = None) -> None:
        super().__init__(message)
        self.status = status
        self.where = where


class NoFile(Refused, KeyError):
    """The RAM drive has no file of this name."""

    # A KeyError would show its message in quotes.
    __str__ = Exception.__str__


class ProtocolError(Error):
    """The robot sent something that the protocol does not allow here."""


class NoReply(Error, TimeoutError):
    """The robot did not answer in time."""


class Disconnected(Error, ConnectionError):
    """The connection has ended."""


class NotReached(Error, TimeoutError):
    """A condition was not met within its time."""


class StartError(Error):
    """The emulator could not be found or started, or ended by itself."""
