"""`Channel`: the peer of a SCOL channel, which reads what PRINT writes and writes what INPUT reads, line by line."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, List, Optional

from .closing import Closing
from .errors import Disconnected, NoReply
from .host import DEFAULT_TIMEOUT, Address, Describe, Link, SerialLink, TcpLink, late, nothing

if TYPE_CHECKING:
    from typing_extensions import Self

CR = b"\r"
# Lines in the message of a wait that was not met.
LINES_SHOWN = 5


class Channel(Closing):
    """A peer on IP1, IP2 or COM1. A line ends in CR.

        with robot.channel("ip1") as channel:
            channel.wait_for_line("HOW FAR?")
            channel.send_line("2.5")
    """

    __slots__ = ("timeout", "_link", "_name", "_describe", "_received", "__weakref__")

    def __init__(self, link: Link, *, timeout: float = DEFAULT_TIMEOUT, name: str = "the robot",
                 describe: Describe = nothing) -> None:
        self.timeout = timeout
        self._link, self._name, self._describe = link, name, describe
        self._received = b""

    @classmethod
    def connect(cls, address: Address, *, timeout: float = DEFAULT_TIMEOUT, name: str = "the robot",
                describe: Describe = nothing) -> Self:
        """Connects over TCP: IP1 or IP2 of the robot, or COM1 served as bare TCP. `describe` adds to the message of a late line."""
        return cls(TcpLink(address, timeout), timeout=timeout, name=name, describe=describe)

    @classmethod
    def open_serial(cls, port: str, *, baudrate: int = 9600, timeout: float = DEFAULT_TIMEOUT, **settings: Any) -> Self:
        """Opens a serial port that leads to COM1; `settings` are those of pyserial."""
        return cls(SerialLink(port, baudrate=baudrate, **settings), timeout=timeout, name="COM1")

    def send_line(self, text: str) -> None:
        """Sends a line; INPUT expects commas between values."""
        self._link.send(text.encode("ascii") + CR)

    def read_line(self, timeout: Optional[float] = None) -> str:
        """The next line that the program prints, without its CR."""
        return self.wait_for_line("", timeout)

    def wait_for_line(self, text: str, timeout: Optional[float] = None) -> str:
        """The next line with this text. Lines before it are dropped; if none comes in time, the message of NoReply has them."""
        timeout = self.timeout if timeout is None else timeout
        until, others = time.monotonic() + timeout, []
        while True:
            line, end, rest = self._received.partition(CR)
            if end:
                self._received = rest
                found = line.decode("latin-1")
                if text in found:
                    return found
                others.append(found)
                continue
            try:
                data = self._link.receive(max(until - time.monotonic(), 0.0))
            except TimeoutError:
                raise self._late(text, timeout, others) from None
            except OSError as error:
                raise Disconnected(f"the connection to {self._name} has ended: {error}") from error
            if not data:
                raise Disconnected(f"the robot closed the connection to {self._name}")
            self._received += data

    def _late(self, text: str, timeout: float, others: List[str]) -> NoReply:
        wanted = f"line with `{text}`" if text else "line"
        found = [*others, self._received.decode("latin-1")] if self._received else others
        instead = ", ".join(f"`{line}`" for line in found[-LINES_SHOWN:]) or "nothing"
        return late(f"{self._name}: expected a {wanted} within {timeout:g} s, found {instead}", self._describe)

    def close(self) -> None:
        """Ends the connection."""
        self._link.close()
