"""`Host` and `AsyncHost`: the commands of `protocol.Protocol` over TCP or a serial port, blocking or with asyncio."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import socket
import threading
import time
from typing import TYPE_CHECKING, Any, Awaitable, Callable, Generic, Iterator, Optional, Protocol as Interface, Tuple, Type, TypeVar
from typing import Union, cast, overload

from .closing import Closing, Strict
from .errors import Disconnected, Error, NoReply
from .protocol import Exchange, Protocol

if TYPE_CHECKING:
    from typing_extensions import Concatenate, ParamSpec, Self

    P = ParamSpec("P")
else:
    # Python 3.9 has no ParamSpec, and a bare TypeVar says nothing to anybody at run time.
    P = TypeVar("P")

T = TypeVar("T")
Address = Union[str, Tuple[str, int]]
# What the message of a wait that took too long adds: the state of an emulator.
Describe = Callable[[], str]

DEFAULT_TIMEOUT = 5.0
# The manual's pause between a text of the robot and the next one of the host.
ADVISED_PAUSE = 0.050
PIECE = 4096
# Bytes of a command in a message.
TEXT_SHOWN = 40
STOP = "the SP of a stop"


def nothing() -> str:
    """The description of a robot that cannot be asked."""
    return ""


def late(message: str, describe: Describe) -> NoReply:
    """What to raise where nothing came in time: this message, and the state of the robot."""
    described = describe()
    return NoReply(message + (f": {described}" if described else ""))


def _resolve(address: Address) -> Tuple[str, int]:
    """HOST:PORT as a pair."""
    if isinstance(address, tuple):
        return address
    host, _, port = address.rpartition(":")
    if not host or not port.isdigit():
        raise ValueError(f"cannot connect to {address!r}: expected HOST:PORT, for example 192.168.0.124:1000")
    return host.strip("[]"), int(port)


class Link(Interface):
    """Bytes to and from the robot. An end is an empty `receive` or another OSError; nothing in time is a TimeoutError."""

    def send(self, data: bytes) -> None: ...

    def receive(self, timeout: float) -> bytes: ...

    def close(self) -> None: ...


class TcpLink:
    """A TCP connection."""

    def __init__(self, address: Address, timeout: float) -> None:
        self._socket = socket.create_connection(_resolve(address), timeout)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._timeout = timeout

    def send(self, data: bytes) -> None:
        self._socket.settimeout(self._timeout)
        self._socket.sendall(data)

    def receive(self, timeout: float) -> bytes:
        self._socket.settimeout(timeout)
        try:
            return self._socket.recv(PIECE)
        except (BlockingIOError, socket.timeout):
            raise TimeoutError from None

    def close(self) -> None:
        self._socket.close()


class SerialLink:
    """A serial port, or a URL of pyserial such as rfc2217://HOST:PORT. Needs the extra `serial`."""

    def __init__(self, port: str, **settings: Any) -> None:
        try:
            import serial
        except ImportError:
            raise ImportError("a serial port needs pyserial: pip install 'ts3100[serial]'") from None
        self._port = serial.serial_for_url(port, **settings)

    def send(self, data: bytes) -> None:
        self._port.write(data)

    def receive(self, timeout: float) -> bytes:
        self._port.timeout = timeout
        data = self._port.read(1)
        if not data:
            raise TimeoutError
        return data + self._port.read(self._port.in_waiting)

    def close(self) -> None:
        self._port.close()


class Operation(Generic[P, T]):
    """A command of `Protocol` as a method: of `Host` it returns the answer, of `AsyncHost` an awaitable."""

    def __init__(self, command: Callable[Concatenate[Protocol, P], Exchange[T]]) -> None:
        self._command = command
        self.__doc__ = command.__doc__

    @overload
    def __get__(self, host: None, owner: object) -> Callable[Concatenate[Protocol, P], Exchange[T]]: ...

    @overload
    def __get__(self, host: Host, owner: object) -> Callable[P, T]: ...

    @overload
    def __get__(self, host: AsyncHost, owner: object) -> Callable[P, Awaitable[T]]: ...

    def __get__(self, host: Union[Host, AsyncHost, None], owner: object) -> Callable[..., Any]:
        if host is None:
            return self._command

        @functools.wraps(self._command)
        def method(*args: P.args, **kwargs: P.kwargs) -> Any:
            return host.run(self._command(host.protocol, *args, **kwargs))

        return method


class Operations(Strict):
    """Every command, with its letters in the documentation of `Protocol`."""

    __slots__ = ("protocol", "timeout", "pause", "_describe", "_expected", "_last", "_busy", "__weakref__")

    raw = Operation(Protocol.raw)
    command = Operation(Protocol.command)
    query = Operation(Protocol.query)
    start = Operation(Protocol.start)
    stop = Operation(Protocol.stop)
    servo_on = Operation(Protocol.servo_on)
    servo_off = Operation(Protocol.servo_off)
    feed_hold = Operation(Protocol.feed_hold)
    break_motion = Operation(Protocol.break_motion)
    set_override = Operation(Protocol.set_override)
    set_run_mode = Operation(Protocol.set_run_mode)
    execute = Operation(Protocol.execute)
    select = Operation(Protocol.select)
    deselect = Operation(Protocol.deselect)
    reset_program = Operation(Protocol.reset_program)
    reset_step = Operation(Protocol.reset_step)
    reset_cycle = Operation(Protocol.reset_cycle)
    reset_signals = Operation(Protocol.reset_signals)
    reset_alarms = Operation(Protocol.reset_alarms)
    upload = Operation(Protocol.upload)
    download = Operation(Protocol.download)
    erase = Operation(Protocol.erase)
    directory = Operation(Protocol.directory)
    status = Operation(Protocol.status)
    total_status = Operation(Protocol.total_status)
    quick_status = Operation(Protocol.quick_status)
    error_history = Operation(Protocol.error_history)
    alarms = Operation(Protocol.alarms)
    alarm_history = Operation(Protocol.alarm_history)
    version = Operation(Protocol.version)
    position = Operation(Protocol.position)
    speed = Operation(Protocol.speed)
    maintenance = Operation(Protocol.maintenance)
    read_variable = Operation(Protocol.read_variable)
    write_variable = Operation(Protocol.write_variable)
    set_outputs = Operation(Protocol.set_outputs)
    lines = Operation(Protocol.lines)
    read_inputs = Operation(Protocol.read_inputs)
    write_outputs = Operation(Protocol.write_outputs)
    set_work = Operation(Protocol.set_work)
    set_tool = Operation(Protocol.set_tool)
    set_guide = Operation(Protocol.set_guide)
    jog = Operation(Protocol.jog)
    watchdog = Operation(Protocol.watchdog)

    def __init__(self, timeout: float, pause: float, stx: bool, checksum: bool, total_split: bool, describe: Describe) -> None:
        self.protocol = Protocol(stx, checksum, total_split)
        self.timeout = timeout
        self.pause = pause
        self._describe = describe
        # For the message of an answer that does not come.
        self._expected = ""
        self._last = 0.0
        self._busy = threading.Lock()

    @contextlib.contextmanager
    def _one_exchange(self) -> Iterator[None]:
        """Around an exchange: one at a time, and the end of the connection is one exception."""
        if not self._busy.acquire(blocking=False):
            raise Error("another call of this host is still running; a connection has one exchange at a time: wait for its end")
        try:
            yield
        except Error:
            raise
        except OSError as error:
            raise Disconnected(f"the connection has ended: {error}") from error
        finally:
            self._busy.release()

    def _rest(self) -> float:
        """What is left of the pause after the last text, of the robot or the OK to it."""
        return max(self._last + self.pause - time.monotonic(), 0.0)

    def _hear(self, data: bytes) -> None:
        if not data:
            raise Disconnected("the robot closed the connection; a port serves one host at a time")
        self._last = time.monotonic()
        self.protocol.feed(data)

    def _note_sent(self, data: bytes) -> None:
        """Notes what the robot is expected to answer."""
        self._last = time.monotonic()
        if data.strip(b"\2\3") != b"OK\r":
            self._expected = "an answer to " + data.strip(b"\2\3").partition(b"\r")[0][:TEXT_SHOWN].decode("latin-1")

    def _late(self, timeout: float) -> NoReply:
        return late(f"the robot did not send {self._expected} within {timeout:g} s", self._describe)


class Host(Closing, Operations):
    """A host of the robot, blocking.

    `timeout` is the longest wait for more bytes of an answer. `pause` is the time between a text of the robot and the next
    one of the host; with a stopped clock (`--time stepped`) 0 is as good. A connection has one exchange at a time: while a call
    is under way, one of another thread is an `Error`.

        with Host.connect("192.168.0.124:1000") as host:
            host.servo_on()
            print(host.status().file)
    """

    __slots__ = ("_link",)

    def __init__(self, link: Link, *, timeout: float = DEFAULT_TIMEOUT, pause: float = ADVISED_PAUSE, stx: bool = True,
                 checksum: bool = False, total_split: bool = False, describe: Describe = nothing) -> None:
        super().__init__(timeout, pause, stx, checksum, total_split, describe)
        self._link = link

    @classmethod
    def connect(cls, address: Address, *, timeout: float = DEFAULT_TIMEOUT, pause: float = ADVISED_PAUSE, stx: bool = True,
                checksum: bool = False, total_split: bool = False, describe: Describe = nothing) -> Self:
        """Connects over TCP: IP0 of the robot, or a serial line served as bare TCP. `describe` adds to the message of NoReply."""
        return cls(TcpLink(address, timeout), timeout=timeout, pause=pause, stx=stx, checksum=checksum, total_split=total_split,
                   describe=describe)

    @classmethod
    def open_serial(cls, port: str, *, baudrate: int = 9600, timeout: float = DEFAULT_TIMEOUT, pause: float = ADVISED_PAUSE,
                    stx: bool = True, checksum: bool = False, total_split: bool = False, **settings: Any) -> Self:
        """Opens a serial port; `settings` are those of pyserial."""
        return cls(SerialLink(port, baudrate=baudrate, **settings), timeout=timeout, pause=pause, stx=stx, checksum=checksum,
                   total_split=total_split)

    def run(self, exchange: Exchange[T], timeout: Optional[float] = None) -> T:
        """Carries out an exchange of `protocol`."""
        timeout = self.timeout if timeout is None else timeout
        with self._one_exchange():
            # What comes during the pause came before the command, too.
            time.sleep(self._rest())
            self._take_waiting()
            try:
                while True:
                    data = next(exchange)
                    if data is not None:
                        time.sleep(self._rest())
                        self._link.send(data)
                        self._note_sent(data)
                        continue
                    try:
                        self._hear(self._link.receive(timeout))
                    except TimeoutError:
                        raise self._late(timeout) from None
            except StopIteration as end:
                return cast(T, end.value)

    def _take_waiting(self) -> None:
        """Takes what came since the last exchange: an unsolicited SP, or an answer after its time limit."""
        try:
            while True:
                self._hear(self._link.receive(0))
        except TimeoutError:
            self.protocol.discard()

    def wait_for_stop(self, timeout: Optional[float] = None) -> None:
        """Waits for the SP of a stop without a command, for example at the end of a cycle.

        The robot sends none on a connection that used an extension or texts without STX.
        """
        self._expected = STOP
        self.run(self.protocol.wait_for_stop(), timeout)

    def close(self) -> None:
        """Ends the connection."""
        self._link.close()


class AsyncHost(Operations):
    """A host of the robot for asyncio, with the methods and parameters of `Host`. Await a call before you make the next one.

        async with await AsyncHost.connect("192.168.0.124:1000") as host:
            await host.servo_on()
    """

    __slots__ = ("_link",)

    def __init__(self, link: Union[_StreamLink, _ThreadLink], *, timeout: float = DEFAULT_TIMEOUT, pause: float = ADVISED_PAUSE,
                 stx: bool = True, checksum: bool = False, total_split: bool = False) -> None:
        super().__init__(timeout, pause, stx, checksum, total_split, nothing)
        self._link = link

    @classmethod
    async def connect(cls, address: Address, *, timeout: float = DEFAULT_TIMEOUT, pause: float = ADVISED_PAUSE,
                      stx: bool = True, checksum: bool = False, total_split: bool = False) -> Self:
        """Connects over TCP: IP0 of the robot, or a serial line served as bare TCP."""
        loop = asyncio.get_running_loop()
        host, port = _resolve(address)
        _, link = await asyncio.wait_for(loop.create_connection(_StreamLink, host, port), timeout)
        return cls(link, timeout=timeout, pause=pause, stx=stx, checksum=checksum, total_split=total_split)

    @classmethod
    async def open_serial(cls, port: str, *, baudrate: int = 9600, timeout: float = DEFAULT_TIMEOUT,
                          pause: float = ADVISED_PAUSE, stx: bool = True, checksum: bool = False, total_split: bool = False,
                          **settings: Any) -> Self:
        """Opens a serial port; `settings` are those of pyserial. A thread waits for its bytes."""
        link = _ThreadLink(SerialLink(port, baudrate=baudrate, **settings))
        return cls(link, timeout=timeout, pause=pause, stx=stx, checksum=checksum, total_split=total_split)

    async def run(self, exchange: Exchange[T], timeout: Optional[float] = None) -> T:
        """Carries out an exchange of `protocol`."""
        timeout = self.timeout if timeout is None else timeout
        with self._one_exchange():
            await asyncio.sleep(self._rest())
            await self._take_waiting()
            try:
                while True:
                    data = next(exchange)
                    if data is not None:
                        await asyncio.sleep(self._rest())
                        await self._link.send(data)
                        self._note_sent(data)
                        continue
                    try:
                        self._hear(await self._link.receive(timeout))
                    except (TimeoutError, asyncio.TimeoutError):
                        raise self._late(timeout) from None
            except StopIteration as end:
                return cast(T, end.value)

    async def _take_waiting(self) -> None:
        """Takes what came since the last exchange: an unsolicited SP, or an answer after its time limit."""
        try:
            # One turn of the loop finds what has arrived, the next one takes it.
            await asyncio.sleep(0)
            await asyncio.sleep(0)
            while True:
                self._hear(await self._link.receive(0))
        except (TimeoutError, asyncio.TimeoutError):
            self.protocol.discard()

    async def wait_for_stop(self, timeout: Optional[float] = None) -> None:
        """Waits for the SP of a stop without a command, for example at the end of a cycle.

        The robot sends none on a connection that used an extension or texts without STX.
        """
        self._expected = STOP
        await self.run(self.protocol.wait_for_stop(), timeout)

    async def close(self) -> None:
        """Ends the connection."""
        await self._link.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, exception_type: Optional[Type[BaseException]], *_: object) -> None:
        await self.close()


class _StreamLink(asyncio.Protocol):
    """A TCP connection in an event loop. `receive` with 0 takes what the loop has read."""

    def __init__(self) -> None:
        self._received = bytearray()
        self._ended = False
        self._changed = asyncio.Event()
        self._closed = asyncio.get_running_loop().create_future()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)

    def data_received(self, data: bytes) -> None:
        self._received += data
        self._changed.set()

    def connection_lost(self, exception: Optional[Exception]) -> None:
        self._ended = True
        self._changed.set()
        if not self._closed.done():
            self._closed.set_result(None)

    async def send(self, data: bytes) -> None:
        self._transport.write(data)

    async def receive(self, timeout: float) -> bytes:
        if not self._received and not self._ended:
            if not timeout:
                raise TimeoutError
            self._changed.clear()
            await asyncio.wait_for(self._changed.wait(), timeout)
        data = bytes(self._received)
        self._received.clear()
        return data

    async def close(self) -> None:
        self._transport.close()
        await self._closed


class _ThreadLink:
    """A blocking link whose calls run in a thread."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._receiving: Optional[asyncio.Future[bytes]] = None

    async def send(self, data: bytes) -> None:
        await asyncio.get_running_loop().run_in_executor(None, self._link.send, data)

    async def receive(self, timeout: float) -> bytes:
        """What the thread of a cancelled call still receives is for the next call."""
        until = time.monotonic() + timeout
        while True:
            left = max(until - time.monotonic(), 0.0)
            late = self._receiving is not None
            if self._receiving is None:
                self._receiving = asyncio.get_running_loop().run_in_executor(None, self._link.receive, left)
            done, _ = await asyncio.wait({self._receiving}, timeout=left if late else None)
            if not done:
                raise TimeoutError
            received, self._receiving = self._receiving, None
            try:
                return received.result()
            except TimeoutError:
                if not late:
                    raise

    async def close(self) -> None:
        if self._receiving:
            self._receiving.cancel()
        await asyncio.get_running_loop().run_in_executor(None, self._link.close)
