#!/usr/bin/env python3
"""A day of editing with `ts3100 lsp`: 28,800 changes of a program, in between everything that an editor asks for. The memory of
the server stays flat, and it ends when the editor does. Prints how long answers take for 1,000 and 4,000 lines.

    python3 tests/system/packages/language_server.py --serve target/dist/ts3100"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from steps import equal, program, serving, true  # noqa: E402

# A change a second for eight hours.
CHANGES, WARM = 28_800, 2_880
# Memory that may come and go with the texts of one round, in kB.
SLACK = 1_500
ASKED = ("hover", "definition", "references", "completion", "signatureHelp", "documentHighlight", "prepareRename")


class Editor:
    """Speaks to a server over pipes."""

    def __init__(self, command):
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.last, self.notes = 0, []

    def send(self, **message):
        data = json.dumps(dict(jsonrpc="2.0", **message)).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(data), data))
        self.process.stdin.flush()

    def receive(self):
        length = 0
        for line in iter(self.process.stdout.readline, b"\r\n"):
            if not line:
                raise EOFError("the server has ended")
            name, value = line.split(b":")
            if name.lower() == b"content-length":
                length = int(value)
        return json.loads(self.process.stdout.read(length))

    def ask(self, method, params):
        self.last += 1
        self.send(id=self.last, method=method, params=params)
        while True:
            answer = self.receive()
            if answer.get("id") == self.last:
                return answer.get("result")
            self.notes.append(answer)

    def diagnostics(self, version):
        """Those of this version of the text."""
        while True:
            found = self.notes.pop(0) if self.notes else self.receive()
            if found.get("params", {}).get("version") == version:
                return found["params"]["diagnostics"]

    def memory(self):
        with open("/proc/%d/status" % self.process.pid, encoding="ascii") as file:
            return int(next(line for line in file if line.startswith("VmRSS")).split()[1])


def text_of(lines):
    rows = ["  N = N + 1", "  MOVE P1", "  DOUT(3)", "  IF N > 5 THEN N = 0"]
    body = [rows[at % len(rows)] for at in range(lines - 8)]
    return "\n".join(["PROGRAM T", "  N = 0", "AGAIN:", *body, "  GOTO AGAIN", "END", "DATA", "  POINT P1=400,0,200/", "END"]) + "\n"


def opened(editor, uri, text):
    editor.send(method="textDocument/didOpen", params={"textDocument": {"uri": uri, "languageId": "scol", "version": 1, "text": text}})
    return editor.diagnostics(1)


def times(editor, uri, lines):
    """Prints how long a server takes to show and to answer."""
    begun = time.perf_counter()
    found = opened(editor, uri, text_of(lines))
    took = {"first diagnostics": [time.perf_counter() - begun]}
    equal("%d lines have no diagnostics" % lines, [], found)
    of = {"textDocument": {"uri": uri}}
    for number in range(10):
        place = dict(of, position={"line": 4 + 4 * (number * lines // 50), "character": 8}, context={"includeDeclaration": True})
        for method in ASKED:
            begun = time.perf_counter()
            editor.ask("textDocument/" + method, place)
            took.setdefault(method, []).append(time.perf_counter() - begun)
    for method in ("documentSymbol", "foldingRange", "formatting", "semanticTokens/full"):
        begun = time.perf_counter()
        editor.ask("textDocument/" + method, of)
        took.setdefault(method, []).append(time.perf_counter() - begun)
    for version in range(2, 12):
        begun = time.perf_counter()
        change(editor, uri, version, lines // 2, "N" if version % 2 else "")
        editor.diagnostics(version)
        took.setdefault("change to diagnostics", []).append(time.perf_counter() - begun)
    for name, values in took.items():
        print("     %5d lines  %-22s %6.1f ms, at most %.1f" % (lines, name, 1000 * statistics.median(values), 1000 * max(values)))


def change(editor, uri, version, line, text):
    """Writes a text at the end of a line, or takes it away."""
    start = {"line": line, "character": 2}
    end = dict(start, character=start["character"] + (0 if text else 1))
    changes = [{"range": {"start": start, "end": end}, "text": text}]
    editor.send(method="textDocument/didChange", params={"textDocument": {"uri": uri, "version": version}, "contentChanges": changes})


def day(editor, uri):
    opened(editor, uri, text_of(100))
    place = {"textDocument": {"uri": uri}, "position": {"line": 6, "character": 8}, "context": {"includeDeclaration": True}}
    before, found = 0, None
    for number in range(1, CHANGES + 1):
        change(editor, uri, number + 1, 5 + (number - 1) // 2 % 80, "N" if number % 2 else "")
        if number % 40 == 0:
            for method in ASKED + ("documentSymbol", "foldingRange", "formatting", "semanticTokens/full"):
                editor.ask("textDocument/" + method, place)
            found = editor.diagnostics(number + 1)
        if number == WARM:
            before = editor.memory()
    equal("after %d changes the text is as before" % CHANGES, [], found)
    grown = editor.memory() - before
    true("from the tenth part of the day to its end the memory grows by less than %d kB (%d kB more than %d kB)" % (SLACK, grown, before), grown < SLACK)


def main():
    options = serving(__doc__).parse_args()
    with tempfile.TemporaryDirectory(prefix="ts3100-lsp-") as folder:
        uri = "file://%s/t%%s.scol" % folder
        editor = Editor([options.serve, "lsp", "--stdio"])
        editor.ask("initialize", {"processId": None, "rootUri": "file://" + folder, "capabilities": {}})
        editor.send(method="initialized", params={})
        for lines in (1_000, 4_000):
            times(editor, uri % lines, lines)
        day(editor, uri % "day")
        editor.ask("shutdown", None)
        editor.send(method="exit")
        equal("it ends when the editor says so", 0, editor.process.wait(10))
        editor = Editor([options.serve, "lsp"])
        editor.ask("initialize", {"capabilities": {}})
        editor.process.stdin.close()
        equal("and when the editor is gone, with another exit code", 1, editor.process.wait(10))


if __name__ == "__main__":
    sys.exit(program(main))
