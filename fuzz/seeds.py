#!/usr/bin/env python3
"""Writes the seed corpus of every fuzz target into the folder named: from fixtures/ programs, transcripts, snapshots and surveys, the recorded
calls of the control interface, parameter files, and what a client of RFC 2217 says.

The formats are those that src/ reads."""
import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PORTS = ["HOST", "IP0", "COM1", "IP1", "IP2", "IP3"]
OPERATIONS = 24
RECEIVED, PASS = range(0, 9), 13


def operation(kind, port=0):
    """A byte that means `kind` (one of a range of numbers) on `port`."""
    for byte in range(port << 5, (port << 5) + 32):
        if byte % OPERATIONS in kind and byte >> 5 == port:
            return bytes([byte])
    raise SystemExit(f"no byte means {kind} on port {port}")


def received(port, data):
    parts = [data[at : at + 255] for at in range(0, len(data), 255)]
    return b"".join(operation(RECEIVED, port) + bytes([len(part)]) + part for part in parts)


def passing(millis):
    return operation(range(PASS, PASS + 1)) + millis.to_bytes(2, "big")


def transcript(text):
    script = b"\x00"
    for line in text.splitlines():
        found = re.match(r">> (\w+) ((?:[0-9A-F]{2} ?)+)$", line.strip())
        if found and found.group(1) in PORTS:
            script += received(PORTS.index(found.group(1)), bytes.fromhex(found.group(2))) + passing(60)
    return script


def around(source):
    """What a fixture says happens outside, as operations."""
    script = b"\x00\x00"
    for data in re.findall(r"^' @\d+ (?:ip1|key) (.*)$", source, re.M) or ["1,2,3", "4"]:
        script += received(PORTS.index("IP1"), data.encode() + b"\r") + passing(500)
    for line in re.findall(r"^' @\d+ din (\d+) on", source, re.M):
        line = int(line).to_bytes(2, "big")
        script += operation(range(19, 20), 4) + line + passing(300) + operation(range(19, 20)) + line
    return script + passing(3000) + operation(range(17, 18)) + passing(2000) + operation(range(16, 17)) + passing(9000)


def calls():
    """The calls of the recorded session with the control interface, by name."""
    for number, entry in enumerate(json.loads((ROOT / "crates/control/assets/examples.json").read_text())):
        path = entry["call"]
        for name, value in entry.get("parameters", {}).items():
            path = path.replace("{%s}" % name, str(value))
        body = json.dumps(entry["request"]) if "request" in entry else ""
        yield "%03d" % number, (path + "\n" + body).encode()


def telnet():
    """What a client of RFC 2217 says: an offer, the settings, masks, a break, a purge, bytes."""
    iac, end = b"\xff", b"\xff\xf0"
    commands = [b"\x00", b"\x01\x00\x00\x25\x80", b"\x02\x07", b"\x03\x03", b"\x04\x02", b"\x05\x05", b"\x05\x06", b"\x05\x07", b"\x08",
                b"\x09", b"\x0a\x60", b"\x0b\xff\xff", b"\x0c\x03"]
    said = [iac + verb + option for verb in (b"\xfb", b"\xfd") for option in (b"\x00", b"\x03", b"\x2c")]
    said += [iac + b"\xfa\x2c" + command + end for command in commands] + [b"\x02SU\r\x03", b"\xff\xff", b"\x02OK\r\x03"]
    for number, piece in enumerate([*said, b"".join(said)]):
        parts = [piece[at : at + 100] for at in range(0, len(piece), 100)]
        yield "%02d" % number, b"".join(bytes([len(part)]) + part for part in parts)


def surveys():
    """Surveys with one answer each, and one with all that a survey can say besides."""
    head, *answers = (ROOT / "fixtures/controllers/emulator-six-axes.toml").read_text().split("\n[[answer]]")
    head = head[: head.index("# From a command")]
    for number, answer in enumerate(answers):
        yield "%02d" % number, (head + "\n[[answer]]" + answer).encode()
    head = head.replace("\n[controller]", 'stopped = "no answer"\nleft = ["servo power"]\n\n[controller]')
    yield "stopped", (head + "\n[delays]\nms = [0.0, 0.5, 1.5, 2.0, 9.0]\n").encode()


def program_tests():
    """Files of tests of the program in src/program_test.rs: one with every key, and one for each way a test ends."""
    every = """program = "main.scol"
model = "tv800"
points = "points.csv"
options = ["io.field_bus=present"]
[[test]]
name = "every key"
call = "PUT(2, SIZE)"
limit = "100 ms"
at = ["1 ms: input 5 on", "2 ms: override 50"]
[test.given]
position = [400, 0, 200]
variables = { COUNT = 4, "GRID(1,1)" = 2, P1 = [400, 5, 200, 0, 0, 0, 0, 0, 11111] }
inputs = [5]
records = { tp = ["1"], com1 = ["2"], ip1 = ["3", "4"], ip2 = [] }
[[test.do]]
when = "output 8 on"
after = "1 ms"
times = 2
actions = ["input 5 off", "channel IP1 inject 4<CR>"]
[[test.expect]]
name = "comes"
what = "printed IP1"
after = "input 5 on"
within = "10 ms"
times = 1
[[test.never]]
what = "alarm"
until = "output 8 on"
[test.then]
printed = { ip1 = ["DONE           2"] }
outputs-on = [8]
outputs-off = [9]
variables = { COUNT = 6, "MAIN.T" = 1 }
position = "P1"
tolerance = 0.5
alarm = "2-046"
within = "1 s"
ending = "alarm"
"""
    yield "every", every.encode()
    main = 'name = "main"\nat = ["1 ms: %s"]\n'
    for name, test in [("end", main % "input 5 on"), ("stuck", main % "input 6 on"), ("off", main % "power off"),
                       ("alarm", main % "alarms raise 2-046"), ("stopped", main % "program stop"), ("call", 'name = "asks"\ncall = "ASK(COUNT)"\n'),
                       ("out", 'name = "asks"\ncall = "ASK(3)"\ngiven.records.ip1 = []\nthen.ending = "out-of-input"\n'),
                       ("again", main % "input 5 on" + '[[test.do]]\nwhen = "idle"\ntimes = 0\nactions = ["program start"]\n')]:
        yield name, b"[[test]]\n" + test.encode()


# What `tap` writes of a robot: SF of six axes would be long, SU tells enough to begin with.
ROBOT = b"""origin: observed, ts3100 tap 0.1.0 in front of 192.168.0.124
! connect IP0 192.168.0.2
@+5ms
> IP0 SU<CR>
@+2ms
< IP0 FL,MODE:external(ethernet)/cycle FILE:PICK OVRD:100% LSPEED:100% MACHINE:free STATUS:stop(reset)<EOF>
@+60ms
> IP0 OK<CR>
@+60ms
> IP0 SL,NOPE<CR>
@+3ms
< IP0 NG<CR>
"""


def debugging():
    """Sessions of an editor that debugs: one that was recorded, and one of all requests, in other orders too."""
    recorded = (ROOT / "fixtures/sessions/debug/vscode.jsonl").read_text().replace("/cell/pick.scol", "/work/main.scol")
    sent = [entry["editor"] for entry in map(json.loads, recorded.splitlines()) if "editor" in entry]
    yield "vscode", b"\0" + "\n".join(json.dumps(message, separators=(",", ":")) for message in sent).encode()
    source = {"path": "/work/main.scol"}
    frame = {"threadId": 1}
    asked = [
        ("initialize", {"adapterID": "scol"}), ("launch", {"program": "/work/main.scol", "stopOnEntry": True}),
        ("setBreakpoints", {"source": source, "breakpoints": [
            {"line": 17, "condition": "ROW == 2"}, {"line": 15, "hitCondition": "%2"}, {"line": 16, "logMessage": "at {D} {X"},
            {"line": 18, "condition": "1 / 0"}, {"line": 99}]}),
        ("setExceptionBreakpoints", {"filters": ["alarms"]}), ("configurationDone", {}), ("threads", {}), ("stackTrace", frame),
        ("scopes", {"frameId": 1}), ("variables", {"variablesReference": 1}), ("next", frame), ("stepIn", frame), ("continue", frame),
        ("stackTrace", frame), ("scopes", {"frameId": 1}), ("variables", {"variablesReference": 2}),
        ("setVariable", {"variablesReference": 2, "name": "COUNT", "value": "7"}),
        ("evaluate", {"expression": "GRID(1,1) + ROW", "frameId": 1, "context": "watch"}),
        ("evaluate", {"expression": "ROW = 3", "frameId": 1, "context": "repl"}),
        ("setExpression", {"expression": "PLACE", "value": "(1, 2, 3, 0, 0, 0, 0, 0, 0)", "frameId": 1}), ("stepOut", frame),
        ("stepMotion", frame), ("stepBack", frame), ("reverseContinue", frame), ("pause", {}), ("exceptionInfo", frame),
        ("breakpointLocations", {"source": source, "line": 1, "endLine": 40}), ("source", {"sourceReference": 1}), ("continue", frame),
        ("gotoTargets", {}), ("terminate", {}),
    ]
    lines = [json.dumps({"seq": seq, "type": "request", "command": command, "arguments": arguments}).encode()
             for seq, (command, arguments) in enumerate(asked, 1)]
    for choice in (0, 1, 2, 8, 0x31, 0x52, 0x98):
        yield "everything-%d" % choice, bytes([choice]) + b"\n".join(lines)


def sessions():
    """Sessions of editors with the language server: those that were recorded, and one that asks for everything, each in a few orders."""
    for path in sorted((ROOT / "fixtures/sessions").glob("*.jsonl")):
        sent = [entry["editor"] for entry in map(json.loads, path.read_text().splitlines()) if "editor" in entry]
        for choice in (0, 7):
            yield f"{path.stem}-{choice}", bytes([choice]) + "\n".join(json.dumps(message, separators=(",", ":")) for message in sent).encode()
    program = "GLOBAL\nN=0\nEND\nPROGRAM M\nL: MOVE UP\nS(P, 2)\nMOVEL P\nIF DIN(3) THEN GOTO L\nEND\nPROGRAM S(A, B)\nEND\nDATA\nPOINT P=1,2,3/\nEND\n"
    uri = {"uri": "file:///c/m.scol"}
    whole = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
    messages = [("initialize", {"capabilities": {}, "rootUri": "file:///c"}), ("initialized", {}),
                ("textDocument/didOpen", {"textDocument": dict(uri, version=1, text=program)})]
    for name in ("hover", "completion", "signatureHelp", "definition", "references", "documentHighlight", "prepareRename", "rename"):
        for line, column in ((4, 9), (5, 2), (7, 8)):
            messages.append(("textDocument/" + name, {"textDocument": uri, "position": {"line": line, "character": column}, "newName": "Q",
                                                      "context": {"includeDeclaration": True}}))
    for name in ("documentSymbol", "formatting", "foldingRange", "semanticTokens/full", "inlayHint", "codeAction"):
        messages.append(("textDocument/" + name, {"textDocument": uri, "range": whole}))
    messages += [("workspace/symbol", {"query": "m"}),
                 ("textDocument/didChange", {"textDocument": dict(uri, version=2), "contentChanges": [{"range": whole, "text": "PROGRAM \u00e9\n"}]}),
                 ("textDocument/didSave", {"textDocument": uri}), ("textDocument/didClose", {"textDocument": uri})]
    silent = ("initialized", "textDocument/did")
    lines = []
    for number, (method, params) in enumerate(messages):
        message = {"jsonrpc": "2.0", "id": number, "method": method, "params": params}
        if method.startswith(silent):
            del message["id"]
        lines.append(json.dumps(message, separators=(",", ":")))
    for choice in (0, 1, 6, 0x38):
        yield f"everything-{choice}", bytes([choice]) + "\n".join(lines).encode()


def main(folder):
    folder = pathlib.Path(folder)
    for name in ["front", "run", "cell", "protocol", "parameters", "snapshot", "rfc2217", "control", "recording", "survey", "trace", "lsp", "dap", "program_test", "canary"]:
        (folder / name).mkdir(parents=True, exist_ok=True)
    for path in sorted((ROOT / "fixtures/scol").glob("*/*.scol")):
        name, source = f"{path.parent.name}-{path.stem}", path.read_text()
        arm = b"\x01" if "' arm: scara" in source else b"\x00"
        (folder / "front" / name).write_bytes(arm + source.encode())
        if path.parent.name != "err":
            tail = bytes((7 * at) % 256 for at in range(64))
            (folder / "run" / name).write_bytes(source.encode() + b"\x00" + tail)
            (folder / "cell" / name).write_bytes(source.replace("\n", "\r").encode() + around(source))
    for path in sorted((ROOT / "fixtures/transcripts").glob("*.txt")):
        (folder / "protocol" / path.stem).write_bytes(transcript(path.read_text()))
        (folder / "recording" / path.stem).write_bytes(b"0" + path.read_bytes())
        (folder / "trace" / path.stem).write_bytes(b"0\x40\xc0" + path.read_bytes())
    (folder / "recording" / "json").write_bytes(b"1" + (ROOT / "fixtures/golden/events/transcript.jsonl").read_bytes())
    begin = json.dumps(json.loads(sorted((ROOT / "fixtures/snapshots/v1").glob("*.json"))[0].read_text()), separators=(",", ":"))
    (folder / "trace" / "robot").write_bytes(b"0\x40\xff" + ROBOT)
    (folder / "recording" / "begin").write_text(f"0origin: observed\n! begin 5us IP0 {begin}\n@+1ms\n> IP0 SU<CR>\n")
    for number in range(len(list((ROOT / "fixtures/snapshots/v1").glob("*.json")))):
        (folder / "snapshot" / str(number)).write_bytes(bytes([number, 0]) + passing(1000))
    (folder / "canary" / "wd").write_bytes(b"WD,9999 8")
    for name, said in telnet():
        (folder / "rfc2217" / name).write_bytes(said)
    for name, call in calls():
        (folder / "control" / name).write_bytes(call)
    for name, messages in sessions():
        (folder / "lsp" / name).write_bytes(messages)
    for name, messages in debugging():
        (folder / "dap" / name).write_bytes(messages)
    for path in sorted((ROOT / "fixtures/scol/cookbook").glob("*.test.toml")):
        (folder / "program_test" / path.name.split(".")[0]).write_bytes(path.read_bytes())
    for name, file in program_tests():
        (folder / "program_test" / name).write_bytes(file)
    for name, file in surveys():
        (folder / "survey" / name).write_bytes(file)
    for path in sorted((ROOT / "fuzz/parameters").glob("*.par")):
        (folder / "parameters" / path.stem).write_bytes(path.read_bytes())


if __name__ == "__main__":
    main(sys.argv[1])
