#!/usr/bin/env python3
"""What of the control interface would break a client of the last release: fixtures/openapi-baseline.json has its operations and types.

    python3 tests/system/control/openapi_baseline.py             lists what breaks; the exit code is 0 when nothing does
    python3 tests/system/control/openapi_baseline.py --renew     for a release: the present interface becomes the baseline

A client breaks when an operation, an argument or a member goes away, when an argument or a member of a body becomes necessary, when a
member of an answer may be missing that was always there, and when a type changes."""

import copy
import json
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
BASELINE = os.path.join(ROOT, "fixtures", "openapi-baseline.json")
sys.path.insert(0, os.path.join(ROOT, "clients"))
import generate  # noqa: E402


def uses(shape, part):
    """The types that this part of an operation is made of, `body` or `result`, with the types of these."""
    found, new = set(), {word for call in shape["operations"].values() for word in re.findall(r"\w+", call[part])}
    while new:
        name = new.pop()
        if name in shape["types"] and name not in found:
            found.add(name)
            new |= set(re.findall(r"\w+", json.dumps(shape["types"][name])))
    return found


def fields(members):
    """Name, type and whether it is always there."""
    return {name.rstrip("?"): (kind, not name.endswith("?")) for name, kind in members.items()}


def compared(place, old, new, sent, received):
    """What breaks from these members to those."""
    if not isinstance(old, dict) or not isinstance(new, dict):
        return [] if old == new else ["%s: its type was %s and is %s" % (place, old, new)]
    old, new = fields(old), fields(new)
    found = ["%s.%s is gone" % (place, name) for name in old if name not in new]
    for name, (kind, always) in new.items():
        if name not in old:
            found += ["%s.%s is new and necessary" % (place, name)] if sent and always else []
            continue
        before, was_always = old[name]
        if kind != before:
            found.append("%s.%s: its type was %s and is %s" % (place, name, before, kind))
        if sent and always and not was_always:
            found.append("%s.%s has become necessary" % (place, name))
        if received and was_always and not always:
            found.append("%s.%s may be missing" % (place, name))
    return found


def broken(old, new):
    """What breaks a client of `old` that meets `new`."""
    found = []
    for name, before in old["operations"].items():
        after = new["operations"].get(name)
        if after is None or after["call"].split("{?")[0] != before["call"].split("{?")[0]:
            found.append("%s (%s) is gone" % (name, before["call"]))
            continue
        found += compared(name, before["arguments"], after["arguments"], True, False)
        found += ["%s: its %s was %s and is %s" % (name, part, before[part] or "nothing", after[part] or "nothing")
                  for part in ("body", "result") if before[part] != after[part]]
    sent, received = uses(new, "body"), uses(new, "result")
    for name, before in old["types"].items():
        if name in new["types"]:
            found += compared(name, before, new["types"][name], name in sent, name in received)
        elif name in uses(old, "body") | uses(old, "result"):
            found.append("%s is gone" % name)
    return found


def proof(shape):
    """Each kind of break is found, and what breaks nobody is not."""
    def changed(expected, change):
        new = copy.deepcopy(shape)
        change(new["operations"], new["types"])
        if broken(shape, new) != expected:
            sys.exit("expected %s\nfound    %s" % (expected, broken(shape, new)))

    changed([], lambda operations, types: types["Alarms"].update({"level": "number"}))
    changed([], lambda operations, types: types["Pulse"].update({"width?": "number"}))
    changed([], lambda operations, types: operations.update({"get_more": operations["get_alarms"]}))
    changed(["get_alarms (GET /alarms) is gone"], lambda operations, types: operations.pop("get_alarms"))
    changed(["get_alarms (GET /alarms) is gone"], lambda operations, types: operations["get_alarms"].update({"call": "GET /alarm"}))
    changed(["get_events.since is gone"], lambda operations, types: operations["get_events"]["arguments"].pop("since?"))
    changed(["get_alarms: its result was Alarms and is ActiveAlarm[]"], lambda operations, types: operations["get_alarms"].update({"result": "ActiveAlarm[]"}))
    changed(["Alarms.history is gone"], lambda operations, types: types["Alarms"].pop("history"))
    changed(["Pulse.on has become necessary"], lambda operations, types: types["Pulse"].update({"on": types["Pulse"].pop("on?")}))
    changed(["Pulse.width is new and necessary"], lambda operations, types: types["Pulse"].update({"width": "number"}))
    changed(["Alarms.history may be missing"], lambda operations, types: types["Alarms"].update({"history?": types["Alarms"].pop("history")}))
    changed(["Override.percent: its type was number and is string"], lambda operations, types: types["Override"].update({"percent": "string"}))
    changed(['KeyPosition: its type was "teaching" | "internal" | "ext" and is "teaching" | "ext"'],
            lambda operations, types: types.update({"KeyPosition": '"teaching" | "ext"'}))


def main():
    with open(generate.DOCUMENT, encoding="utf-8") as file:
        shape = generate.shapes(json.load(file))
    if "--renew" in sys.argv:
        with open(BASELINE, "w", encoding="utf-8") as file:
            rows = [",\n".join("    %s: %s" % (json.dumps(name), json.dumps(value)) for name, value in shape[part].items()) for part in ("operations", "types")]
            file.write('{\n  "origin": "ours; the control interface of the last release",\n  "operations": {\n%s\n  },\n  "types": {\n%s\n  }\n}\n' % tuple(rows))
    with open(BASELINE, encoding="utf-8") as file:
        baseline = json.load(file)
    proof(baseline)
    found = broken(baseline, shape)
    if found:
        sys.exit("this breaks clients of the last release:\n  " + "\n  ".join(found))
    print("ok   nothing breaks clients of the last release, in %d operations" % len(shape["operations"]))


if __name__ == "__main__":
    main()
