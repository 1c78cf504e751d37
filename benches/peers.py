#!/usr/bin/env python3
"""The same work for simulators that install from PyPI and for ts3100: one request, one reply, over one TCP connection.

    python3 benches/peers.py --serve target/dist/ts3100

It makes a virtual environment, installs the pinned versions, and keeps itself and each server on one core. Requests have
a line or a few bytes, replies about as many bytes as the reply to SU. Prints a table in Markdown."""

import argparse
import glob
import json
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import venv

PINNED = ["lewis==1.4.0", "sinstruments==1.5.0", "pymodbus==3.16.1"]
REQUESTS = 2000
ROUNDS = 5
LIMIT = 15.0

LEWIS = '''
from lewis.adapters.stream import Cmd, StreamInterface
from lewis.devices import Device


class Status(Device):
    text = "." * {length}


class StatusInterface(StreamInterface):
    commands = {{Cmd("status", pattern="^SU$")}}
    in_terminator = "\\r\\n"
    out_terminator = "\\r\\n"

    def status(self):
        return self.device.text
'''

SINSTRUMENTS = '''
from sinstruments.simulator import BaseDevice, Server


class Status(BaseDevice):
    def handle_message(self, message):
        return b"." * {length} + b"\\n"


Server(devices=[{{"name": "status", "class": "Status", "package": "__main__", "transports": [{{"type": "tcp", "url": "127.0.0.1:{port}"}}]}}]).serve_forever()
'''

MODBUS = '''
from pymodbus.server import StartTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

registers = SimData(0, count=200, values=17, datatype=DataType.REGISTERS)
StartTcpServer(SimDevice(id=1, simdata=[registers]), address=("127.0.0.1", {port}))
'''


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def processor(process):
    """Processor time of all threads, in seconds."""
    files = glob.glob(f"/proc/{process.pid}/task/*/schedstat")
    return sum(int(open(file).read().split()[0]) for file in files) / 1e9


def memory(process):
    lines = open(f"/proc/{process.pid}/status").read().splitlines()
    return int(next(line.split()[1] for line in lines if line.startswith("VmRSS:"))) / 1000


class Contender:
    """A server: how to start it, one request, and how its reply ends."""

    def __init__(self, name, command, port, request, is_whole, ready=None):
        self.name, self.command, self.port = name, command, port
        self.request, self.is_whole, self.ready = request, is_whole, ready

    def start(self):
        began = time.monotonic()
        self.log = tempfile.TemporaryFile()
        self.process = subprocess.Popen(self.command, stdin=subprocess.DEVNULL, stderr=self.log,
                                        stdout=subprocess.PIPE if self.ready else self.log)
        if self.ready:
            self.port = self.ready(self.process.stdout.readline())
        while True:
            try:
                self.stream = socket.create_connection(("127.0.0.1", self.port), LIMIT)
                break
            except OSError:
                if time.monotonic() - began > LIMIT or self.process.poll() is not None:
                    self.log.seek(0)
                    sys.exit(f"{self.name}: not started\n{self.log.read().decode()[-2000:]}")
                time.sleep(0.002)
        self.stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.bytes = self.ask()
        self.started = time.monotonic() - began

    def ask(self):
        self.stream.sendall(self.request)
        reply = b""
        while not self.is_whole(reply):
            part = self.stream.recv(4096)
            if not part:
                sys.exit(f"{self.name}: it has closed after {reply!r}")
            reply += part
        return len(reply)

    def lap(self, count):
        """Microseconds of processor time of the server for each request, and requests per second."""
        for _ in range(max(1, count // 10)):
            self.ask()
        before, began = processor(self.process), time.monotonic()
        for _ in range(count):
            self.ask()
        seconds = time.monotonic() - began
        return (processor(self.process) - before) / count * 1e6, count / seconds

    def end(self):
        self.stream.close()
        self.process.terminate()
        self.process.wait(LIMIT)


def contenders(serve, python, folder, length):
    def ends_line(reply):
        return reply.endswith(b"\n")

    package = os.path.join(folder, "devices", "status")
    os.makedirs(package)
    open(os.path.join(folder, "devices", "__init__.py"), "w").close()
    with open(os.path.join(package, "__init__.py"), "w") as file:
        file.write(LEWIS.format(length=length - 2))
    lewis = [os.path.join(os.path.dirname(python), "lewis"), "-a", folder, "-k", "devices", "status", "-o", "none"]
    found = []
    echo = os.path.join(os.path.dirname(serve), "ts3100-benches")
    if os.path.exists(echo):
        found.append(Contender("an echo server with tokio", [echo, "--echo", str(length)], None, b"SU\n",
                               lambda reply: reply.endswith(b"\x03"), lambda line: json.loads(line)["port"]))
    found.append(Contender(
        "ts3100, SU", [serve, "serve", "--ports", "auto", "--ready-json", "--servo-on", "--control", "127.0.0.1:0"], None,
        b"\x02SU\r\x03", lambda reply: reply.endswith(b"\x03"), lambda line: json.loads(line)["ports"]["ip0"]))
    for name, cycle in [("lewis 1.4.0, cycle 0.1 s", "0.1"), ("lewis 1.4.0, cycle 0", "0")]:
        port = free_port()
        stream = "stream: {bind_address: 127.0.0.1, port: %d}" % port
        found.append(Contender(name, [*lewis, "-c", cycle, "-p", stream], port, b"SU\r\n", ends_line))
    port = free_port()
    found.append(Contender("sinstruments 1.5.0", [python, "-c", SINSTRUMENTS.format(length=length - 1, port=port)], port,
                           b"SU\n", ends_line))
    port = free_port()
    # Transaction 1, unit 1, read 43 holding registers from 0: 9 bytes and 86 of data.
    found.append(Contender("pymodbus 3.16.1, 43 registers", [python, "-c", MODBUS.format(port=port)], port,
                           bytes([0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 43]), lambda reply: len(reply) >= 95))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--serve", required=True, help="the program ts3100")
    parser.add_argument("--venv", help="a virtual environment to use or to make; default: a temporary one")
    arguments = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    with tempfile.TemporaryDirectory() as folder:
        environment = arguments.venv or os.path.join(folder, "venv")
        python = os.path.join(environment, "bin", "python")
        if not os.path.exists(python):
            venv.create(environment, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PINNED], check=True)
        print("| Server | reply, bytes | processor, µs | requests per second | start, ms | memory, MB |")
        print("|---|---|---|---|---|---|")
        length = 95
        for contender in contenders(os.path.abspath(arguments.serve), python, folder, length):
            contender.start()
            _, rate = contender.lap(10)
            # A server that answers a few times a second is measured for a few seconds.
            count = REQUESTS if rate > 500 else 20
            laps = [contender.lap(count) for _ in range(ROUNDS)]
            spent, rate = (statistics.median(figure) for figure in zip(*laps))
            print(f"| {contender.name} | {contender.bytes} | {spent:,.0f} | {rate:,.0f} | {contender.started * 1e3:,.0f} "
                  f"| {memory(contender.process):.0f} |", flush=True)
            contender.end()


if __name__ == "__main__":
    main()
