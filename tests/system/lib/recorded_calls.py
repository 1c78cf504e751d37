"""The recorded calls of crates/control/assets/examples.json, for the clients: each plays them by its `call`, at a robot of `cell`, and
prints an answer a line. `check` compares the answers with those of plain HTTP."""

import contextlib
import json
import math
import os
import re
import socket
import tempfile
import urllib.parse

from emulator import ROOT, Emulator
from steps import Failed, ok

ASSETS = os.path.join(ROOT, "crates", "control", "assets")
# Calls that need more than a robot: wires, a scenario, a peer on IP2. `cell` has all of it.
NEED_CELL = ("GET /scenario", "PUT /wires/outside/{name}", "POST /channels/{port}/drop")
CELL = '[[robot]]\nname = "robot-1"\n\n[[wire]]\nfrom = "outside.GATE"\nto = "robot-1.din.60"\n'
SCENARIO = 'name = "gate"\n\n[[do]]\nwhen = "input 60 on"\nactions = ["feed-hold on"]\n'
# In a text: ports, the point of a whole number, and the place of an error in the body.
VARIES = re.compile(r"(?<=127\.0\.0\.1:)\d+|(?<=\d)\.0\b|(?<=column )\d+")


@contextlib.contextmanager
def cell(binary):
    """A robot in stepped time in which every recorded call succeeds."""
    with tempfile.TemporaryDirectory() as folder:
        paths = {}
        for name, text in (("config", CELL), ("scenario", SCENARIO)):
            paths[name] = os.path.join(folder, name + ".toml")
            with open(paths[name], "w", encoding="ascii") as file:
                file.write(text)
        flags = [word for name, path in paths.items() for word in ("--" + name, path)]
        with Emulator(binary, "--time", "stepped", *flags) as emulator, socket.create_connection(emulator.robot.address("ip2")):
            while "peer" not in emulator.robot.channel_state("IP2"):
                pass
            yield emulator


def write(path, binary, exact):
    """Writes the calls as a list of `operation` and `arguments`; returns it. A client that is not `exact` rounds the seeds in a snapshot, so
    one that is refused stands for it."""
    with open(os.path.join(ASSETS, "openapi.json"), encoding="utf-8") as file:
        paths = json.load(file)["paths"]
    with open(os.path.join(ASSETS, "examples.json"), encoding="utf-8") as file:
        session = json.load(file)
    with cell(binary) as emulator:
        snapshot = emulator.robot.call("get_snapshot") if exact else {"version": 0}
    # A whole controller is no example.
    calls = [{"operation": "load_snapshot", "arguments": snapshot}]
    for recorded in session:
        method, place = recorded["call"].split(" ")
        arguments = {**recorded.get("parameters", {}), **recorded.get("request", {})}
        calls.append({"operation": paths[place][method.lower()]["operationId"], "arguments": arguments})
    missing = {operation["operationId"] for item in paths.values() for operation in item.values()} - {call["operation"] for call in calls}
    if missing:
        raise Failed("no recorded call of %s" % ", ".join(sorted(missing)))
    with open(path, "w", encoding="utf-8") as file:
        json.dump(calls, file)
    return calls


def answers(binary, calls):
    """What each call is answered over plain HTTP: a document, a text, or the error of a refusal."""
    with open(os.path.join(ASSETS, "openapi.json"), encoding="utf-8") as file:
        operations = {operation["operationId"]: (method.upper(), path, operation) for path, item in json.load(file)["paths"].items()
                      for method, operation in item.items()}
    found = []
    with cell(binary) as emulator:
        for call in calls:
            method, path, operation = operations[call["operation"]]
            rest, query = dict(call["arguments"]), {}
            for parameter in operation.get("parameters", []):
                if parameter["name"] in rest:
                    value = rest.pop(parameter["name"])
                    if parameter["in"] == "path":
                        path = path.replace("{%s}" % parameter["name"], urllib.parse.quote(str(value), safe=""))
                    else:
                        query[parameter["name"]] = value
            status, document = emulator.answer(method, path + ("?" + urllib.parse.urlencode(query) if query else ""), rest if "requestBody" in operation else None)
            found.append(document if status == 200 else {"error": document})
    return found


def differs(one, other):
    """Where two answers differ, or nothing. Ports differ, and the last digits of a number."""
    if isinstance(one, bool) or isinstance(other, bool) or type(one) is not type(other) and not all(isinstance(it, (int, float)) for it in (one, other)):
        return "" if one is other else "%r, %r" % (one, other)
    if isinstance(one, (int, float)):
        return "" if math.isclose(one, other, rel_tol=1e-12, abs_tol=1e-12) else "%r, %r" % (one, other)
    if isinstance(one, str):
        return "" if VARIES.sub("", one) == VARIES.sub("", other) else "%r, %r" % (one, other)
    if isinstance(one, list):
        return "lengths" if len(one) != len(other) else next(("[%d]%s" % (at, why) for at, why in enumerate(map(differs, one, other)) if why), "")
    if isinstance(one, dict):
        if set(one) != set(other):
            return "members %s" % (set(one) ^ set(other))
        return next((".%s %s" % (name, why) for name, value in one.items() if name != "accepts" and (why := differs(value, other[name]))), "")
    return ""


def check(what, binary, folder, player, exact=True):
    """The lines that a client prints are the answers to these calls; `player` runs it with their file and the URL, and returns its output."""
    path = os.path.join(folder, "calls.json")
    calls = write(path, binary, exact)
    with cell(binary) as emulator:
        printed = player(path, emulator.url)
    lines = printed.splitlines()
    if len(lines) != len(calls):
        raise Failed("%s: expected %d answers, found %d\n%s" % (what, len(calls), len(lines), printed[-2000:]))
    for call, expected, line in zip(calls, answers(binary, calls), lines):
        why = differs(expected, json.loads(line))
        if isinstance(expected, dict) and "error" in expected and (exact or call["operation"] != "load_snapshot"):
            why = why or expected["error"]
        if why:
            raise Failed("%s: %s %.200s: over HTTP and by `call`: %s" % (what, call["operation"], call["arguments"], why))
    ok("%s: %d recorded calls, every operation among them, have the answers of plain HTTP" % (what, len(calls)))
