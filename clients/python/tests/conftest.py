"""What the tests share. They run against the installed package, whose plugin has the fixture `robot`."""

import asyncio
from typing import Any, Callable, Iterator

import pytest

from ts3100 import AsyncHost, Host, Robot

pytest_plugins = ["pytester"]


class Blocking:
    """An AsyncHost whose methods are called as those of a Host, so that one test tells about both."""

    def __init__(self, **framing: Any) -> None:
        self._loop = asyncio.new_event_loop()
        self._host = self._loop.run_until_complete(AsyncHost.connect(**framing))

    def __getattr__(self, name: str) -> Callable[..., Any]:
        method = getattr(self._host, name)
        return lambda *args, **kwargs: self._loop.run_until_complete(method(*args, **kwargs))

    def close(self) -> None:
        self._loop.run_until_complete(self._host.close())
        self._loop.close()


@pytest.fixture(params=["sync", "async"])
def connect(request: pytest.FixtureRequest, robot: Robot) -> Iterator[Callable[..., Any]]:
    """Connects a host, blocking and with asyncio, to IP0 of the robot."""
    hosts = []

    def connect(**framing: Any) -> Any:
        framing = {"address": robot.address(), "pause": 0.0, **framing}
        hosts.append(Host.connect(**framing) if request.param == "sync" else Blocking(**framing))
        return hosts[-1]

    yield connect
    for host in hosts:
        host.close()
