"""The one place of `tests/system` that starts emulators. The protocol is spoken by `wire`, which shares nothing with the
product; the control interface is used through the Python package of `clients/python`, as its users do."""

import argparse
import functools
import http.client
import json
import os
import re
import resource
import select
import signal
import socket
import subprocess
import sys
import tempfile

from steps import Failed, equal, program, show

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", ".."))
sys.path.insert(0, os.path.join(ROOT, "clients", "python", "src"))
from ts3100 import NotReached, Refused, Robot  # noqa: E402, F401

READY_TIMEOUT, STOP_TIMEOUT = 60.0, 5.0
# How much of a log is shown when a test fails.
LOG_SHOWN = 8192
# The only setting of the environment that reaches an emulator: legal_variation gives it to the hosts it starts.
PASSED_ON = "TS3100_VARY"


def surroundings(**more):
    """This environment without the settings of other emulators, and more variables."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("TS3100_") or name == PASSED_ON}
    return {**kept, **more}


def answer(url, path, token=None):
    """Status and document of a GET of any control interface; the reason if it is refused."""
    try:
        with Robot.connect(url, token=token) as robot:
            return 200, robot.request("GET", path)
    except Refused as refused:
        return refused.status, str(refused)


class NotStarted(Failed):
    """`serve` has ended before it was ready, with this log."""

    def __init__(self, flags, line, log):
        super().__init__("the ready line of serve %s\n     found    %s\n%s" % (" ".join(flags), show(line), log))
        self.log = log


class Emulator:
    """A `ts3100 serve` on free ports of the loopback interface, unless `ports`, flags and `at` say otherwise; its `with` ends it as
    an operator does. `prefix` starts the command, for example in a network namespace; `more` is for Popen."""

    def __init__(self, binary, *flags, prefix=(), at="127.0.0.1", token=None, ports=("--ports", "auto"), env=None, **more):
        self.at, self.token = at, token
        # The emulator appends wherever this process has read.
        self._log = tempfile.TemporaryFile("a+b")
        more = {"stderr": self._log, **more}
        secret = {"TS3100_CONTROL_TOKEN": token} if token else {}
        self.process = subprocess.Popen([*prefix, binary, "serve", *ports, "--ready-json", *flags], stdout=subprocess.PIPE,
                                        stdin=subprocess.DEVNULL, env={**(env or surroundings()), **secret}, **more)
        ready, _, _ = select.select([self.process.stdout], [], [], READY_TIMEOUT)
        line = self.process.stdout.readline() if ready else b""
        try:
            self.ready = json.loads(line)
            self.url, self.ports = self.ready.get("control"), self.ready.get("ports", {})
        except ValueError:
            self.kill()
            raise NotStarted(flags, line, self.log()) from None

    def address(self, channel):
        """Host and port of a channel, as `ip0`."""
        return (self.at, self.ports[channel])

    def connect(self, robot=None):
        """The control of a robot, by its name if there are several."""
        return Robot.connect(self.url, token=self.token, robot=robot)

    @functools.cached_property
    def robot(self):
        """The control of the only robot, or the first."""
        return self.connect()

    def answer(self, method, path, body=None):
        """Status and document of a call; 200 for any success, and the reason if it is refused."""
        try:
            return 200, self.robot.request(method, path, body)
        except Refused as refused:
            return refused.status, str(refused)

    def log(self):
        """What the process wrote on stderr."""
        self._log.seek(0)
        return self._log.read().decode("utf-8", "replace")

    def stop(self, code=0, by=signal.SIGTERM, within=STOP_TIMEOUT):
        """End it as an operator does, and look at its exit code."""
        self.process.send_signal(by)
        try:
            found = self.process.wait(within)
        except subprocess.TimeoutExpired:
            self.kill()
            raise Failed("%s ends serve within %g s\n     found    still running" % (by.name, within)) from None
        equal("%s ends serve with exit code %d" % (by.name, code), code, found)

    def kill(self):
        """End it whatever its state."""
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        if "robot" in self.__dict__:
            self.robot.close()

    def __enter__(self):
        return self

    def __exit__(self, failure, *_):
        try:
            if failure:
                print(self.log()[-LOG_SHOWN:], file=sys.stderr)
            elif self.process.poll() is None:
                self.stop()
        finally:
            self.kill()


class View:
    """A `ts3100 view` of a recording, until the end of its `with`."""

    def __init__(self, binary, *arguments):
        self.process = subprocess.Popen([binary, "view", *arguments], stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, env=surroundings())
        ready, _, _ = select.select([self.process.stdout], [], [], READY_TIMEOUT)
        self.url = self.process.stdout.readline().decode().strip() if ready else ""
        if not self.url:
            self.kill()
            raise Failed("view %s does not print its URL" % " ".join(arguments))

    def kill(self):
        """End it whatever its state."""
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()


class Fleet(Emulator):
    """A `ts3100 serve` with several robots."""

    def __init__(self, binary, *flags, files=None):
        limit = (lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))) if files else None
        # Nothing of the program can be unwound: a refusal is one all the same.
        super().__init__(binary, *flags, ports=("--control", "127.0.0.1:0"), env=surroundings(RUST_BACKTRACE="1"), preexec_fn=limit)
        self.robots = self.ready["robots"]

    def get(self, path):
        """Status and body of what belongs to no robot."""
        connection = http.client.HTTPConnection(*split(self.url[len("http://"):]), timeout=READY_TIMEOUT)
        connection.request("GET", path)
        answer = connection.getresponse()
        status, body = answer.status, answer.read()
        connection.close()
        return status, body

    def started(self):
        """The names of the robots that have started."""
        return [robot["name"] for robot in json.loads(self.get("/robots")[1])["robots"] if robot["started"]]

    def dial(self, name, port="ip0"):
        """A connection to a port of a robot."""
        robot = self.robots[name]
        return socket.create_connection((robot["address"], robot["ports"][port]), READY_TIMEOUT)

    def memory(self):
        """Resident kB."""
        with open("/proc/%d/status" % self.process.pid, encoding="ascii") as status:
            return int(re.search(r"VmRSS:\s+(\d+)", status.read()).group(1))

    def worked(self):
        """Seconds of processor time so far."""
        with open("/proc/%d/stat" % self.process.pid, encoding="ascii") as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def options(description):
    """The command line of every host."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--serve", metavar="TS3100", type=os.path.abspath, help="start this binary on free ports")
    parser.add_argument("--ip0", metavar="HOST:PORT", type=split, help="IP0 of a running emulator")
    parser.add_argument("--ip1", metavar="HOST:PORT", type=split, help="IP1 of a running emulator")
    parser.add_argument("--stx", action=argparse.BooleanOptionalAction, default=True,
                        help="texts with STX (default) or without")
    return parser


def split(address):
    """HOST:PORT as a pair."""
    host, port = address.rsplit(":", 1)
    return (host, int(port))


def run(job, arguments, *flags):
    """Does a job against the emulator that the command line names; the exit code."""
    if arguments.serve:
        def served():
            with Emulator(arguments.serve, *flags) as emulator:
                job(emulator.address("ip0"), emulator.address("ip1"))
        return program(served)
    if arguments.ip0 and arguments.ip1:
        return program(job, arguments.ip0, arguments.ip1)
    print("either --serve or both of --ip0 and --ip1 are needed", file=sys.stderr)
    return 2
