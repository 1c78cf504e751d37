#!/usr/bin/env python3
"""Runs the examples of docs/**/*.md as they are written.

    python3 tests/system/docs/page_examples.py --serve target/release/ts3100 [docs/reference/ctl.md ...]

A fenced block of shell after one of these lines is run by `bash -euo pipefail` in a directory of its own that the
blocks of one page share, with the directory of the binary first in PATH, and `packaging` of the repository in it:

    <!-- ci:run-example -->               as it is
    <!-- ci:control FLAGS -->             against a fresh `ts3100 serve --ports auto --ready-json FLAGS`: its control
                                          interface is in TS3100_CONTROL_URL, its ports in IP0 to IP3 as HOST:PORT
    <!-- ci:output -->                    the block is what the example before it printed; in it a line of three dots
                                          matches any lines, and three dots in a line match any text
    <!-- ci:serve -->                     a command that stays for the rest of the page, once it says that it is ready
    <!-- ci:console -->                   lines after `$ ` are run, in one shell for the page; the others are what they
                                          print, with three dots as above
    <!-- ci:log -->                       each line is in the log of the command of ci:serve, after its time
    <!-- ci:check [CODE] -->              the block is a SCOL file in which `ts3100 check` finds this code and no other,
                                          or nothing; one that begins with `' arm: scara` is checked for that arm

The exit code is 0 when every block ended with 0 and printed what the page says."""

import fnmatch
import glob
import os
import re
import signal
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from console import Served, commands  # noqa: E402
from emulator import ROOT, Emulator, surroundings  # noqa: E402
from steps import Failed, program, serving, true  # noqa: E402

LIMIT = 120
MARK = re.compile(r"<!-- ci:(run-example|control|output|serve|console|log|check)\s*(.*?) *-->$")


def blocks(path):
    """(kind, flags, number of the first line, text) of every marked block."""
    with open(path, encoding="utf-8") as page:
        lines = page.read().split("\n")
    mark = None
    at = 0
    while at < len(lines):
        found = MARK.match(lines[at])
        if found:
            mark = found
        elif mark and lines[at].startswith("```"):
            end = next((k for k in range(at + 1, len(lines)) if lines[k].startswith("```")), None)
            if end is None:
                raise Failed("%s:%d: the block has no end" % (path, at + 1))
            yield mark.group(1), mark.group(2).split(), at + 2, "\n".join(lines[at + 1:end]) + "\n"
            mark, at = None, end
        elif mark and lines[at].strip():
            raise Failed("%s:%d: a block expected after the mark" % (path, at + 1))
        at += 1


# State files of the emulators: `ctl` without a URL finds the emulator of the page and no other.
STATE = tempfile.TemporaryDirectory(prefix="ts3100-docs-state-")


def environment(binary, **more):
    """Ours, with the binary in PATH and nothing said to it."""
    path = os.path.dirname(binary) + os.pathsep + os.environ.get("PATH", "")
    return surroundings(XDG_RUNTIME_DIR=STATE.name, PATH=path, **more)


def shell(text, surroundings, directory, strict=True):
    """Runs a block; what it printed until its end. Whatever it has started in the background ends with it."""
    # A file, since a pipe has no end before the last process in the background has ended.
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(["bash", "-euo" if strict else "-uo", "pipefail", "-c", text], cwd=directory,
                                   env=surroundings, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                                   start_new_session=True)
        try:
            process.wait(LIMIT)
        except subprocess.TimeoutExpired:
            pass
        ended_in_time = process.poll() is not None
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        process.wait()
        output.seek(0)
        printed = output.read().decode(errors="replace")
    if not ended_in_time:
        raise Failed("not ended within %d s; it printed\n%s" % (LIMIT, printed))
    if process.returncode != 0:
        raise Failed("exit code %d; it printed\n%s" % (process.returncode, printed))
    return printed


def against_an_emulator(binary, flags, text, directory):
    """Runs a block beside a fresh emulator."""
    with Emulator(binary, *flags, cwd=directory, env=environment(binary)) as emulator:
        addresses = {name.upper(): "%s:%d" % emulator.address(name) for name in emulator.ports}
        return shell(text, environment(binary, TS3100_CONTROL_URL=emulator.url, **addresses), directory)


def console(text, binary, directory):
    """Runs the commands of a console block and compares what each prints."""
    for typed, shown in commands(text.rstrip("\n").split("\n")):
        # A refused command is an answer, not a failure of the page.
        printed = shell(typed + "\n:", environment(binary), directory, strict=False)
        if not as_shown(printed, "\n".join(shown)):
            raise Failed("%s printed\n%s\n     expected\n%s" % (typed, printed, "\n".join(shown)))


def checked(binary, codes, text, directory):
    """Runs `check` over a block; fails unless it finds what the mark names."""
    path = os.path.join(directory, "example.scol")
    with open(path, "w", encoding="utf-8") as source:
        source.write(text)
    arm = ["--model", "tsl3000-thl400"] if text.startswith("' arm: scara") else []
    process = subprocess.run([binary, "check", *arm, path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                             timeout=LIMIT, check=False)
    printed = process.stdout.decode(errors="replace")
    found = set(re.findall(r"^.*:\d+:\d+: (?:error|warning)\[(\w+)\]", printed, re.MULTILINE))
    if found != set(codes):
        raise Failed("check found\n%s\n     expected %s" % (printed, " ".join(codes) or "nothing"))


def as_shown(printed, shown):
    """Whether the output is what the page shows."""
    def pattern(line):
        escaped = re.sub(r"[\[*?]", r"[\g<0>]", line)
        return escaped.replace("...", "*")

    def fits(have, want):
        if not want:
            return not have
        if want[0].strip() == "...":
            return any(fits(have[k:], want[1:]) for k in range(len(have) + 1))
        return bool(have) and fnmatch.fnmatchcase(have[0].rstrip(), pattern(want[0].rstrip())) \
            and fits(have[1:], want[1:])

    return fits(printed.rstrip("\n").split("\n"), shown.rstrip("\n").split("\n"))


def run_page(path, binary):
    """Runs every block of a page; how many there were."""
    count, printed, served = 0, None, None
    with tempfile.TemporaryDirectory(prefix="ts3100-docs-") as directory:
        os.symlink(os.path.join(ROOT, "packaging"), os.path.join(directory, "packaging"))
        for kind, flags, line, text in blocks(path):
            place = "%s:%d" % (path, line)
            try:
                if kind == "output":
                    if printed is None:
                        raise Failed("no example comes before it")
                    if not as_shown(printed, text):
                        raise Failed("the example printed\n%s\n     expected\n%s" % (printed, text))
                    continue
                if kind == "serve":
                    served = Served(text.strip(), directory, environment(binary))
                    if not served.says("ts3100 is ready."):
                        raise Failed("not ready; it printed\n%s" % served.printed())
                elif kind == "console":
                    console(text, binary, directory)
                elif kind == "log":
                    missing = [said for said in text.strip().split("\n") if served is None or not served.says(said)]
                    if missing:
                        raise Failed("not in the log: %s" % missing[0])
                elif kind == "check":
                    checked(binary, flags, text, directory)
                elif kind == "control":
                    printed = against_an_emulator(binary, flags, text, directory)
                else:
                    printed = shell(text, environment(binary), directory)
            except Failed as failure:
                if served:
                    served.close()
                raise Failed("%s: %s" % (place, failure)) from None
            count += 1
            print("ok   %s" % place, flush=True)
        if served:
            served.close()
    return count


def main():
    parser = serving(__doc__)
    parser.add_argument("pages", nargs="*", help="docs/**/*.md if none is given")
    options = parser.parse_args()
    pages = options.pages or sorted(glob.glob(os.path.join(ROOT, "docs", "**", "*.md"), recursive=True))
    count = sum(run_page(os.path.relpath(page), options.serve) for page in pages)
    true("%d examples did what their pages say" % count, count)


if __name__ == "__main__":
    sys.exit(program(main))
