"""The recorded calls of crates/control/assets/examples.json, for the clients: each plays them by its `call`, against a robot of its own in
stepped time, and prints an answer a line. `check` compares the answers with those of plain HTTP."""

import json
import math
import os
import re
import urllib.parse

from emulator import ROOT, Emulator
from steps import Failed, ok

ASSETS = os.path.join(ROOT, "crates", "control", "assets")
# Operations without a recorded example; each is refused, and so has an answer as well.
FURTHER = [("drop_peer", {"port": "IP2"}), ("get_scenario", {}), ("load_snapshot", {"version": 0}), ("put_outside", {"name": "GATE", "on": True})]
# In a text: ports, the point of a whole number, and the place of an error in the body.
VARIES = re.compile(r"(?<=127\.0\.0\.1:)\d+|(?<=\d)\.0\b|(?<=column )\d+")


def write(path):
    """Writes the calls as a list of `operation` and `arguments`; returns it."""
    with open(os.path.join(ASSETS, "openapi.json"), encoding="utf-8") as file:
        paths = json.load(file)["paths"]
    with open(os.path.join(ASSETS, "examples.json"), encoding="utf-8") as file:
        session = json.load(file)
    calls = []
    for recorded in session:
        method, place = recorded["call"].split(" ")
        arguments = {**recorded.get("parameters", {}), **recorded.get("request", {})}
        calls.append({"operation": paths[place][method.lower()]["operationId"], "arguments": arguments})
    calls += [{"operation": operation, "arguments": arguments} for operation, arguments in FURTHER]
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
    with Emulator(binary, "--time", "stepped") as emulator:
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


def check(what, binary, calls, printed):
    """The lines that a client has printed are the answers to these calls."""
    lines = printed.splitlines()
    if len(lines) != len(calls):
        raise Failed("%s: expected %d answers, found %d\n%s" % (what, len(calls), len(lines), printed[-2000:]))
    for call, expected, line in zip(calls, answers(binary, calls), lines):
        why = differs(expected, json.loads(line))
        if why:
            raise Failed("%s: %s %s: over HTTP and by `call`: %s" % (what, call["operation"], call["arguments"], why))
    ok("%s: %d recorded calls, every operation among them, have the answers of plain HTTP" % (what, len(calls)))
