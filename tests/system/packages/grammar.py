#!/usr/bin/env python3
"""The TextMate grammar in the engine of Visual Studio Code: it colours every program of fixtures/scol and of the book, and the page of
the control interface has to colour them alike.

    python3 tests/system/packages/grammar.py [--modules FOLDER]

Needs Node.js and npm. Fetches vscode-textmate and vscode-oniguruma into a folder of its own, or into FOLDER, where a later run
finds them. That the scopes are right is proven by the tests of scol-mini, which ask the lexer."""

import argparse
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import ROOT  # noqa: E402
from steps import Failed, program, true  # noqa: E402

MODULES = ["vscode-textmate@9.3.2", "vscode-oniguruma@2.0.1"]
GRAMMAR = os.path.join(ROOT, "editors", "scol.tmLanguage.json")
PAGE = os.path.join(ROOT, "crates", "control", "assets", "ui")
BLOCK = re.compile(r"^```scol\n(.*?)^```", re.DOTALL | re.MULTILINE)
# Prints one line for each line of a program that the two colour differently, and at the end the number of lines and of pieces.
COMPARE = """
import fs from "node:fs";
import { createRequire } from "node:module";
const require = createRequire(process.argv[2] + "/");
const textmate = require("vscode-textmate"), oniguruma = require("vscode-oniguruma");
await oniguruma.loadWASM(fs.readFileSync(require.resolve("vscode-oniguruma/release/onig.wasm")).buffer);
const { tokens } = await import("./scol.js");
const registry = new textmate.Registry({
  onigLib: Promise.resolve({
    createOnigScanner: patterns => new oniguruma.OnigScanner(patterns),
    createOnigString: text => new oniguruma.OnigString(text),
  }),
  loadGrammar: async () => textmate.parseRawGrammar(fs.readFileSync(process.argv[3], "utf8"), "scol.tmLanguage.json"),
});
const grammar = await registry.loadGrammar("source.scol");

function byLetter(line, pieces) {
  return pieces.flatMap(([text, scope]) => Array(text.length).fill(scope ?? ""));
}

let lines = 0, count = 0;
for (const [name, text] of JSON.parse(fs.readFileSync(process.argv[4], "utf8"))) {
  let state = textmate.INITIAL;
  for (const line of text.split("\\n")) {
    const found = grammar.tokenizeLine(line, state);
    state = found.ruleStack;
    const pieces = found.tokens.map(one => [line.slice(one.startIndex, one.endIndex), one.scopes.slice(1).at(-1)]);
    const own = tokens(line);
    lines += 1;
    count += own.filter(([, scope]) => scope).length;
    if (byLetter(line, pieces).join() !== byLetter(line, own).join())
      console.log(JSON.stringify({ name, line, engine: pieces, page: own }));
  }
}
console.log(JSON.stringify({ lines, count }));
"""


def sources():
    """Every program, with the file it is in."""
    found = []
    for path in sorted(glob.glob(os.path.join(ROOT, "fixtures", "scol", "**", "*.scol"), recursive=True)):
        with open(path, encoding="latin-1") as file:
            found.append((os.path.relpath(path, ROOT), file.read()))
    for path in sorted(glob.glob(os.path.join(ROOT, "docs", "**", "*.md"), recursive=True)):
        with open(path, encoding="utf-8") as file:
            found += [(os.path.relpath(path, ROOT), block) for block in BLOCK.findall(file.read())]
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--modules", metavar="FOLDER", help="where the packages of npm are, or go")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ts3100-grammar-") as folder:
        modules = os.path.abspath(options.modules or os.path.join(folder, "modules"))
        if not os.path.isdir(os.path.join(modules, "node_modules", "vscode-oniguruma")):
            os.makedirs(modules, exist_ok=True)
            subprocess.run(["npm", "install", "--silent", "--no-audit", "--no-fund", "--prefix", modules, *MODULES], check=True)
        for name in ("scol.js", "grammar.js"):
            shutil.copy(os.path.join(PAGE, name), folder)
        programs = sources()
        # Elements are made by a browser; nothing here makes one.
        for name, text in (("dom.js", "export const make = undefined;"), ("package.json", '{"type": "module"}'), ("compare.js", COMPARE), ("programs.json", json.dumps(programs))):
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(text)
        ended = subprocess.run(["node", "compare.js", modules, GRAMMAR, "programs.json"], cwd=folder, stdout=subprocess.PIPE, text=True, check=True)
        *different, last = map(json.loads, ended.stdout.splitlines())
        if different:
            raise Failed("%d lines have other colours in the page, first\n     %s" % (len(different), json.dumps(different[0])))
        true("%d programs, %d lines, %d words and signs: the engine and the page agree" % (len(programs), last["lines"], last["count"]),
             last["count"] > 10_000, last)


if __name__ == "__main__":
    sys.exit(program(main))
