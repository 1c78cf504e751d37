#!/usr/bin/env python3
"""What is checked of the emulator, by commands that anyone can repeat, and the page of their figures.

    python3 tests/trust.py run --serve target/release/ts3100 [--whole] [--record] [NAME...]
    python3 tests/trust.py page [--check]

The means are in tests/trust.toml, the figures of their last recorded runs in tests/trust.json. `run` runs the bounded form of
each, or of those that are named, `--whole` the whole form; the first that fails ends it. `page` writes docs/explanation/trust.md;
with `--check` it fails if the page is another."""

import argparse
import collections
import csv
import datetime
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
TABLE, RESULTS, PAGE = ROOT / "tests/trust.toml", ROOT / "tests/trust.json", ROOT / "docs/explanation/trust.md"
LEDGER, CLAUSES = ROOT / "docs/explanation/fidelity.md", ROOT / "docs/clauses.tsv"
# The evidence of a row of the ledger, and the source that it is counted for: the first that fits.
SOURCES = {"assumed": "none: our own reading", "ours": "none: no robot has it", "SCARA": "its SCARA edition", "library": "the manual of the client library",
           "observed": "real hosts", "inferred": "follows from what is stated", "stated": "the manual"}
CERTAINTIES = {"stated": "the manual states it", "implied": "follows from what it states", "garbled": "it contradicts itself, or is damaged in print",
               "silent": "it says nothing, the clause is our reading", "observed": "real hosts show it", "open": "a reading for later",
               "library": "the manual of the client library", "wiring": "the wiring shows it"}
# Most figures of one kind that the page has; the rest is counted.
MOST_FIGURES = 12


def ended(command):
    """Runs a command; its exit code, its output, its seconds. What it prints is shown as it comes."""
    begun, lines = time.monotonic(), []
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace") as process:
        for line in process.stdout:
            print(line, end="", flush=True)
            lines.append(line)
    return process.returncode, "".join(lines), time.monotonic() - begun


def figures(patterns, output):
    """What the patterns find, the same thing several times with its number."""
    found = [" ".join(match.group().replace(";", ",").split()) for pattern in patterns for match in re.finditer(pattern, output)]
    counted = ["%s (%d times)" % (text, count) if count > 1 else text for text, count in collections.Counter(found).items()]
    more = ["and %d more" % (len(counted) - MOST_FIGURES)] if len(counted) > MOST_FIGURES else []
    return ", ".join(counted[:MOST_FIGURES] + more)


def commands(row, form):
    """The commands of a form, each with the name of its results: the row's, or that of one of its parts."""
    if form == "bounded" or "parts" not in row:
        return [(row["name"], row[form])]
    return [("%s: %s" % (row["name"], part), row[form].format(part=part)) for part in row["parts"]]


def run(options, means):
    """Runs the chosen means; the exit code."""
    form = "whole" if options.whole else "bounded"
    known = {name for row in means for name, _ in [(row["name"], None), *commands(row, form)]}
    unknown = set(options.names) - known
    if unknown:
        sys.exit("unknown: %s; there are %s" % (", ".join(sorted(unknown)), ", ".join(sorted(known))))
    for row in means:
        for name, words in commands(row, form):
            # What another phase of CI runs is run here when it is asked for.
            if not {name, row["name"]} & set(options.names) and (options.names or "phase" in row):
                continue
            print("-- %s: %s" % (name, words), flush=True)
            commit = subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
            code, output, seconds = ended([options.serve if word == "ts3100" else word for word in shlex.split(words)])
            found = figures(row["figures"], output)
            if code or not found:
                print("FAIL %s: exit code %d%s" % (name, code, "" if found else ", and none of its figures were printed"))
                return 1
            if options.record:
                # Read only now: runs of hours go side by side.
                results = json.loads(RESULTS.read_text())
                results.setdefault(name, {})[form] = {"figures": found, "seconds": round(seconds), "commit": commit,
                                                      "date": datetime.date.today().isoformat()}
                RESULTS.write_text(json.dumps(results, indent=1, sort_keys=True) + "\n")
    return 0


def duration(seconds):
    """Seconds as people say them."""
    return "%d s" % seconds if seconds < 120 else "%.0f min" % (seconds / 60) if seconds < 7200 else "%.1f h" % (seconds / 3600)


def ledger():
    """How many rows of the ledger rest on which source."""
    rows = re.findall(r"^\| [a-z]+-\d+ \| .* \| ([^|]+) \| [^|]* \| [^|]*(?:\\\|[^|]*)* \| [^|]* \|$", LEDGER.read_text(), re.MULTILINE)
    return collections.Counter(next((source for word, source in SOURCES.items() if word in row), "other") for row in rows)


def clauses():
    """Clauses by certainty: how many, and how many are proven by a test."""
    with CLAUSES.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))
    return collections.Counter(row["certainty"] for row in rows), collections.Counter(row["certainty"] for row in rows if row["tests"] not in ("", "-"))


def cell(text):
    """Text in a table."""
    return text.replace("|", "\\|")


def grouped(text):
    """Figures as people read them: 10,784,994,155."""
    return re.sub(r"\b\d{5,}\b", lambda digits: "{:,}".format(int(digits[0])), text)


def page(table, results):
    """The page."""
    lines = ["# Trust", "", "What is known of the emulator's errors, and how: each figure has the command that gives it. The page is written by",
             "`python3 tests/trust.py page`. The commands are run in a clone, with the path of the built program for `ts3100`.", "",
             "## What is not known", "", *("- " + text for text in table["unknown"]), "",
             "## What is checked", "",
             "The bounded form is run by CI with every change, or weekly where that is said; the whole one by hand. A figure says which of the two",
             "it is of, and the commit. What a command builds or installs the first time is not in its time.", ""]
    for row in table["means"]:
        beyond = ["It cannot produce:", "", *("- " + text for text in row["beyond"]), ""] if "beyond" in row else []
        lines += ["### %s" % (row["name"][0].upper() + row["name"][1:]), "", row["what"] + ".", "", *beyond, "| | Command | Result | Took | Commit | Date |", "|---|---|---|---|---|---|"]
        forms = ["bounded"] if row["whole"] == row["bounded"] else ["whole", "bounded"]
        for form in forms:
            for name, words in commands(row, form):
                result = results.get(name, {}).get(form)
                said = (cell(grouped(result["figures"])), duration(result["seconds"]), result["commit"], result["date"]) if result else ("not run yet", "-", "-", "-")
                lines.append("| %s | `%s` | %s |" % ("whole and bounded" if len(forms) == 1 else form, cell(words), " | ".join(said)))
        lines.append("")
    counted, proven = clauses()
    lines += ["## Clauses", "", "The statements of the manuals and the decisions of this project, one by one (`docs/clauses.tsv`). CI fails if one that was proven is",
              "no longer.", "", "| Certainty | Meaning | Clauses | With a test |", "|---|---|---|---|"]
    lines += ["| %s | %s | %d | %d |" % (certainty, CERTAINTIES[certainty], count, proven[certainty]) for certainty, count in counted.most_common()]
    lines += ["", "## The ledger by source", "", "Where the manual leaves something open, [the ledger](fidelity.md) says what the emulator does and why.", "",
              "| Source | Rows |", "|---|---|"]
    lines += ["| %s | %d |" % row for row in ledger().most_common()]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    running = commands.add_parser("run", help="run the means")
    running.add_argument("--serve", metavar="TS3100", required=True, type=os.path.abspath, help="the program")
    running.add_argument("--whole", action="store_true", help="the whole form, which takes up to hours")
    running.add_argument("--record", action="store_true", help="write the figures to tests/trust.json")
    running.add_argument("names", metavar="NAME", nargs="*", help="means to run [default: all that no other phase of CI runs]")
    written = commands.add_parser("page", help="write docs/explanation/trust.md")
    written.add_argument("--check", action="store_true", help="fail if the page is another")
    options = parser.parse_args()
    table = tomllib.loads(TABLE.read_text())
    if options.command == "run":
        return run(options, table["means"])
    text = page(table, json.loads(RESULTS.read_text()))
    if not options.check:
        PAGE.write_text(text)
    elif not PAGE.exists() or PAGE.read_text() != text:
        sys.exit("docs/explanation/trust.md is another: python3 tests/trust.py page")
    return 0


if __name__ == "__main__":
    sys.exit(main())
