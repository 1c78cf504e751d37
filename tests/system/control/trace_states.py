#!/usr/bin/env python3
"""Compares a recorded run with what the robot showed while it was recorded, moment by moment, and measures the page of one file.

    python3 tests/system/control/trace_states.py --serve target/release/ts3100

The clock of the robot is stepped: nothing here depends on how fast the machine is."""

import gzip
import json
import os
import re
import socket
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Emulator  # noqa: E402
from steps import equal, program, serving, true  # noqa: E402

PICK = """GLOBAL
  N = 0
END
PROGRAM PICK
  SPEED = 30
AGAIN:
  MOVE POINT(380, 100, 260)
  DOUT(5)
  MOVES POINT(380, -100, 300)
  DOUT(-5)
  N = N + 1
  PRINT IP1, "PART", N, CR
  DELAY 0.3
  GOTO AGAIN
END
"""
# What only a process has: how its time passes, its ports and those of its peers.
OF_PROCESS = ("time_mode", "scenario", "ether_pages")
OF_PORT = ("accepts", "serial")
# Most characters of the data of a page, by the seconds of its run with SF at 10 Hz; most bytes of its code, compressed.
MOST_DATA = {30: 30_000, 600: 450_000}
MOST_CODE = 100_000


def shown(state):
    """The state without what only a process has."""
    state = {key: value for key, value in state.items() if key not in OF_PROCESS}
    channels = [{key: value for key, value in channel.items() if key not in OF_PORT} for channel in state["channels"]]
    # A recording has the address of a peer without its port number.
    state["channels"] = [{**channel, "peer": channel.get("peer", "").split(":")[0]} for channel in channels]
    return state


def live(binary, path):
    """A run of everything; the states of its moments."""
    states = []
    with Emulator(binary, "--time", "stepped") as emulator:
        robot = emulator.robot

        def look():
            robot.advance(0.137)
            states.append(shown(robot.request("GET", "/state")))
            # So that what comes next is later.
            robot.advance(0.001)

        robot.files["PICK"] = PICK
        robot.servo = True
        with socket.create_connection(robot.address("ip0"), timeout=10) as host, socket.create_connection(robot.address("ip1"), timeout=10) as peer:
            def ask(words):
                host.sendall(b"\x02" + words.encode() + b"\r\x03")
                robot.advance(0.05)
                return host.recv(4096)

            look()
            ask("SL,PICK")
            ask("RN")
            for _ in range(6):
                ask("SF")
                host.sendall(b"\x02OK\r\x03")
                look()
            robot.inputs[3] = True
            robot.override = 40
            look()
            peer.sendall(b"12,34\r")
            look()
            true("a command that is refused", b"NG" in ask("SL,NOPE"))
            look()
            robot.emergency_stop = True
            look()
            robot.emergency_stop = False
            robot.reset_alarms()
            look()
            robot.request("PUT", "/snapshots/later", {})
            robot.servo = True
            look()
        look()
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(robot.transcript())
    return states


def compare(binary, path, states):
    """Each moment of the recording is what it was."""
    for state in states:
        found = subprocess.run([binary, "view", path, "--at", "%.6f" % state["t"], "--json"], stdout=subprocess.PIPE, check=True).stdout
        replayed = shown(json.loads(found))
        different = [key for key in state if state[key] != replayed.get(key)]
        details = {key: (state[key], replayed.get(key)) for key in different}
        true("the state at %.3f s is what it was" % state["t"], not different and state.keys() == replayed.keys(), details)
    true("the moments differ", len({json.dumps(state["arm"]) for state in states}) > 8, len(states))


def sizes(binary, folder):
    """A page of one file stays small, its data as well as its code."""
    for seconds, most in MOST_DATA.items():
        path, page = os.path.join(folder, "%d.txt" % seconds), os.path.join(folder, "%d.html" % seconds)
        with open(path, "w", encoding="utf-8") as file:
            file.write("origin: written by this program, ours\nfile PICK\n")
            # No peer reads what it prints.
            file.writelines("| %s\n" % line for line in PICK.splitlines() if "PRINT" not in line)
            file.write("! servo on\n! connect IP0\n@+100ms\n> IP0 SL,PICK<CR>\n@+100ms\n> IP0 RN<CR>\n")
            file.write("@+50ms\n> IP0 SF<CR>\n@+50ms\n> IP0 OK<CR>\n" * (10 * seconds))
        subprocess.run([binary, "view", path, "--html", page], check=True)
        with open(page, encoding="utf-8") as file:
            text = file.read()
        data = re.search(r'id="trace">([^<]*)<', text).group(1)
        true("%d s with SF at 10 Hz: %d characters of data, at most %d" % (seconds, len(data), most), len(data) <= most)
        code = len(gzip.compress(text.replace(data, "").encode()))
        true("the page itself: %d bytes compressed, at most %d" % (code, MOST_CODE), code <= MOST_CODE)
        equal("it connects to nothing", [], re.findall(r'(?:src|href)="(?:https?:)?//[^"]*"', text))


def main():
    binary = serving(__doc__).parse_args().serve
    with tempfile.TemporaryDirectory(prefix="ts3100-trace-") as folder:
        path = os.path.join(folder, "run.txt")
        compare(binary, path, live(binary, path))
        sizes(binary, folder)


if __name__ == "__main__":
    sys.exit(program(main))
