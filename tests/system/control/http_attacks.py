#!/usr/bin/env python3
"""The control interface against a fuzzer, a hostile page, and peers that hold its connections.

    python3 tests/system/control/http_attacks.py --serve target/release/ts3100 [--examples 40] [--venv DIR]

schemathesis reads the interface's own OpenAPI document and calls every operation with values that fit it and values
that do not, all of its checks on. A hostile page is a client with a foreign Origin, a foreign Host, or no token. Peers that
hold connections send a part of a request, or nothing. The exit code is 0 when nothing was found."""

import http.client
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import python_environment  # noqa: E402
from emulator import Emulator, split  # noqa: E402
from steps import Failed, equal, program, serving, true  # noqa: E402

SCHEMATHESIS = "schemathesis==4.32.5"
TOKEN = "a-token-of-the-test-0123456789"
LIMIT = 420
# Connections of an attacker: five times the places there are. How long others may wait meanwhile, and how long a connection may
# be held that nobody else needs: the limits are 5 s for a head or a body, and a busy machine only adds to a time.
HELD, WAIT, GIVEN_UP = 320, 2.0, 8.0
HEAD = b"PUT /servo HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\nContent-Length: 11\r\n"
# What each has sent, and goes on with.
UNFINISHED = {"no byte": (b"", b""), "slow heads": (HEAD, b"X-A: b\r\n"), "slow bodies": (HEAD + b"\r\n{", b" ")}
# Valid, and refused all the same: what takes longer than its `wall` allows.
ACCEPTED = """[checks.positive_data_acceptance]
expected-statuses = ["2xx", "3xx", "401", "403", "404", "408", "409", "429", "5xx"]
"""
# It has no end unless `count` is given, and is asked for by hand below.
STREAM = "/events"


def ask(emulator, method, path, headers, body=None):
    """Status, headers and body of a request that the Python package would not make."""
    connection = http.client.HTTPConnection(emulator.url[len("http://"):], timeout=20)
    try:
        connection.putrequest(method, path, skip_host="Host" in headers, skip_accept_encoding=True)
        for name, value in headers.items():
            connection.putheader(name, value)
        if body is not None:
            connection.putheader("Content-Length", str(len(body)))
        connection.endheaders(body)
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()
    finally:
        connection.close()


def fuzz(emulator, tool, examples, seed):
    """All checks of schemathesis on every operation."""
    command = [tool, "run", emulator.url + "/openapi.json", "--header", "Authorization: Bearer " + TOKEN,
               "--checks", "all", "--max-examples", str(examples), "--seed", str(seed), "--request-timeout", "20",
               "--max-failures", "20", "--exclude-path", STREAM, "--no-color",
               # Waiting for what never comes is what these two are for.
               "--exclude-path", "/wait"]
    with tempfile.TemporaryDirectory(prefix="ts3100-api-") as directory:
        # It reads its settings from the directory in which it runs, and keeps examples there.
        with open(os.path.join(directory, "schemathesis.toml"), "w", encoding="utf-8") as settings:
            settings.write(ACCEPTED)
        done = subprocess.run(command, timeout=LIMIT, cwd=directory, check=False)
    equal("schemathesis (seed %d) ends well" % seed, 0, done.returncode)


def hostile_page(emulator):
    """What a browser would send for a page of somebody else."""
    good = {"Authorization": "Bearer " + TOKEN}
    json_body = {**good, "Content-Type": "application/json"}
    own = emulator.url[len("http://"):]
    calls = [
        ("no token", 401, "GET", "/state", {}, None),
        ("another token", 401, "GET", "/state", {"Authorization": "Bearer 0123456789abcdef"}, None),
        # Where a token is needed any name will do: such a page has none.
        ("a name that resolves to this machine", 401, "GET", "/state", {"Host": "evil.example"}, None),
        ("the same with the port", 401, "GET", "/events", {"Host": "evil.example:3100"}, None),
        ("the same with its own origin", 401, "GET", "/state",
         {"Host": "evil.example", "Origin": "http://evil.example", "Sec-Fetch-Site": "same-origin"}, None),
        ("another name of this machine, with the token", 200, "GET", "/state", {**good, "Host": "robot"}, None),
        ("a foreign origin reads", 403, "GET", "/state", {**good, "Origin": "http://evil.example"}, None),
        ("a foreign origin listens", 403, "GET", "/events?since=1", {**good, "Origin": "null"}, None),
        ("a foreign origin writes", 403, "PUT", "/servo", {**json_body, "Origin": "http://evil.example"}, b'{"on":true}'),
        ("another port of this machine", 403, "PUT", "/servo", {**json_body, "Origin": "http://localhost:1"}, b'{"on":true}'),
        ("an image", 403, "GET", "/metrics", {**good, "Sec-Fetch-Site": "cross-site"}, None),
        ("a form", 415, "POST", "/reset", {**good, "Content-Type": "application/x-www-form-urlencoded"}, b"a=1"),
        ("a beacon", 415, "POST", "/power/off", {**good, "Content-Type": "text/plain"}, b"{}"),
        ("a preflight", 403, "OPTIONS", "/servo", {"Origin": "http://evil.example",
                                                   "Access-Control-Request-Method": "PUT"}, None),
        ("the own page", 200, "GET", "/state", {**good, "Origin": "http://" + own, "Sec-Fetch-Site": "same-origin"}, None),
    ]
    for name, expected, method, path, headers, body in calls:
        status, answered, _ = ask(emulator, method, path, headers, body)
        equal("%s: %d" % (name, expected), expected, status)
        told = [header for header in answered if header.lower().startswith("access-control-")]
        if told:
            raise Failed("%s: no CORS header\n     found    %s" % (name, told))
    true("the emulator is as it was", emulator.robot.state["power"])
    emulator.robot.battery = True
    status, _, body = ask(emulator, "GET", "/events?since=1&count=1", good)
    true("an event is sent to who has the token", status == 200 and body.startswith(b"event: "), body[:200])


def held(emulator):
    """Peers that hold connections give way to others at once, and are given up in their time."""
    address = split(emulator.url[len("http://"):])
    for name, (begin, further) in UNFINISHED.items():
        peers, stop = [], threading.Event()

        def drip(peers=peers, stop=stop, further=further):
            # A byte now and then keeps no connection.
            while not stop.wait(0.5):
                for peer in list(peers):
                    try:
                        peer.sendall(further)
                    except OSError:
                        pass

        dripping = threading.Thread(target=drip)
        dripping.start()
        try:
            worst = 0.0
            for _ in range(HELD):
                peers.append(socket.create_connection(address))
                peers[-1].sendall(begin)
                if len(peers) % 32 == 0:
                    begun = time.monotonic()
                    equal("%s, %d connections: /health is answered" % (name, len(peers)), 200, emulator.answer("GET", "/health")[0])
                    worst = max(worst, time.monotonic() - begun)
            true("%s: others wait %.0f ms at most" % (name, 1e3 * worst), worst < WAIT)
        finally:
            stop.set()
            dripping.join()
            for peer in peers:
                peer.close()
        alone = socket.create_connection(address, timeout=2 * GIVEN_UP)
        alone.sendall(begin)
        begun = time.monotonic()
        while alone.recv(1 << 16):
            pass
        took = time.monotonic() - begun
        alone.close()
        true("%s: a connection is given up after %.1f s" % (name, took), took < GIVEN_UP)


def main():
    parser = serving(__doc__)
    parser.add_argument("--examples", type=int, default=40, help="examples an operation")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--venv", help="where schemathesis is, or is put; default: a temporary directory")
    options = parser.parse_args()
    with Emulator(options.serve, "--time", "stepped", token=TOKEN) as emulator:
        hostile_page(emulator)
    with Emulator(options.serve, "--time", "stepped") as emulator:
        held(emulator)
    with tempfile.TemporaryDirectory(prefix="ts3100-api-") as directory, \
            Emulator(options.serve, "--time", "stepped", token=TOKEN) as emulator:
        python = python_environment.python_with(options.venv or directory, SCHEMATHESIS)
        fuzz(emulator, os.path.join(os.path.dirname(python), "schemathesis"), options.examples, options.seed)
        equal("the emulator answers after it", 200, emulator.answer("GET", "/health")[0])


if __name__ == "__main__":
    sys.exit(program(main))
