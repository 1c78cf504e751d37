"""Runs the commands of the pages as they are written. docs/page_examples.py says which marks a block can have; a program that
has what some blocks need runs those that name it (`@packages/python_package`)."""

import collections
import contextlib
import fnmatch
import glob
import os
import re
import shutil
import signal
import subprocess
import tempfile

from console import Served, commands
from emulator import ROOT, Emulator, surroundings
from steps import Failed, until

LIMIT = 120
MARK = re.compile(r"\s*<!-- ci:(\S+)((?: @\S+)?)\s*(.*?) *-->$")
FENCE = re.compile(r"\s*```(\w*)")
# A reader types what is in these.
TYPED = ("sh", "bash", "console", "powershell")
# Kinds of blocks whose program has a way of its own.
OWN = {"run": "docs/readme_session", "session": "docs/readme_session", "test": "../../.ci/phases"}
# A command that stays until it is ended, and what it says when it is ready.
STAYS = re.compile(r"\bts3100 (serve|tap)\b[^|&]*$")
READY = re.compile(r"^ts3100 is ready\.|IP3: .* leads to ", re.MULTILINE)
# A robot of the pages, and the emulator in its place: see CONTRIBUTING.md.
ROBOT = "192.168.0.124"
IN_ITS_PLACE = "127.0.0.124:31000"
FILES = os.path.join(ROOT, "tests", "system", "docs", "files")
BUILT = ("debug", "dist", "release", "x86_64-unknown-linux-musl/dist")

Block = collections.namedtuple("Block", "kind by flags line text")


def every():
    """The pages whose commands are run."""
    names = ["README.md", "CONTRIBUTING.md", "RELEASING.md", "SECURITY.md", "clients/**/README.md", "packaging/**/*.md", "docs/**/*.md"]
    found = [path for name in names for path in sorted(glob.glob(os.path.join(ROOT, name), recursive=True))]
    return [path for path in found if "node_modules" not in path]


def blocks(path):
    """Every marked block, and as one of no kind each block of commands that has no mark."""
    with open(path, encoding="utf-8") as page:
        lines = page.read().split("\n")
    mark, at = None, 0
    while at < len(lines):
        found, fence = MARK.match(lines[at]), FENCE.match(lines[at])
        place = "%s:%d" % (os.path.relpath(path), at + 1)
        if fence:
            end = next((k for k in range(at + 1, len(lines)) if FENCE.match(lines[k])), None)
            if end is None:
                raise Failed("%s: the block has no end" % place)
            if mark:
                kind, by, flags = mark.groups()
                yield Block(kind, by.strip(" @") or OWN.get(kind), flags, at + 2, "\n".join(lines[at + 1:end]) + "\n")
            elif fence.group(1) in TYPED:
                yield Block(None, None, fence.group(1), at + 1, "")
            mark, at = None, end
        elif mark and lines[at].strip():
            raise Failed("%s: a block expected after the mark" % place)
        mark = found or mark
        at += 1


def problems(path):
    """What is wrong with the marks of a page, so that no command is forgotten."""
    for block in blocks(path):
        wrong = None
        if block.kind is None:
            wrong = "a block of %s has no mark: say how it is run, or <!-- ci:not-run REASON -->" % block.flags
        elif block.kind not in KINDS and block.kind not in OWN:
            wrong = "unknown mark ci:%s" % block.kind
        elif block.kind == "not-run" and not block.flags:
            wrong = "ci:not-run without a reason"
        elif block.by and not runs(block):
            wrong = "no program runs the blocks of @%s" % block.by
        if wrong:
            yield "%s:%d: %s" % (os.path.relpath(path), block.line, wrong)


def runs(block):
    """Whether a program asks for blocks like this one: by its own name, or by the mark."""
    try:
        with open(os.path.join(ROOT, "tests", "system", block.by.split(":")[0] + ".py"), encoding="utf-8") as program:
            text = program.read()
    except FileNotFoundError:
        return False
    return "pages.run(" in text and '"%s"' % block.by in text or "<!-- ci:%s -->" % block.kind in text


class Page:
    """A page while it is run: its folder, and what stays for the rest of it."""

    def __init__(self, binary, directory, path, limit, variables):
        self.binary, self.directory, self.limit = binary, directory, limit
        # State files of the emulators: `ctl` without a URL finds the emulator of the page and no other.
        self.state = tempfile.TemporaryDirectory(prefix="ts3100-docs-state-")
        folders = [*path, os.path.dirname(binary), FILES, os.environ.get("PATH", "")]
        self.environment = surroundings(XDG_RUNTIME_DIR=self.state.name, PATH=os.pathsep.join(folders), **variables)
        self.printed, self.served, self.background, self.robot = None, None, {}, None

    def check_background(self):
        """Fails if a command in the background has failed."""
        for command, served in self.background.items():
            if served.process.poll():
                raise Failed("`%s` ended with exit code %d; it printed\n%s" % (command, served.process.poll(), served.printed()))

    def close(self):
        """Ends what stays."""
        self.end_served()
        for served in self.background.values():
            served.close()
        if self.robot:
            self.robot.kill()
        self.state.cleanup()

    def end_served(self):
        if self.served:
            self.served.close()
        self.served = None

    def with_robot(self, text):
        """The text with the address of a robot that answers."""
        if ROBOT in text and not self.robot:
            address, port = IN_ITS_PLACE.split(":")
            flags = ("--listen", address, "--port-offset", str(int(port) - 1000), "--control", address + ":0", "--servo-on")
            self.robot = Emulator(self.binary, *flags, ports=())
        return text.replace(ROBOT, IN_ITS_PLACE)

    def shell(self, text, strict=True, **more):
        """Runs a block; what it printed until its end. Whatever it has started in the background ends with it."""
        # A file, since a pipe has no end before the last process in the background has ended.
        with tempfile.TemporaryFile() as output:
            process = subprocess.Popen(["bash", "-euo" if strict else "-uo", "pipefail", "-c", text], cwd=self.directory,
                                       env={**self.environment, **more}, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                                       start_new_session=True)
            try:
                process.wait(self.limit)
            except subprocess.TimeoutExpired:
                pass
            ended_in_time = process.poll() is not None
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            output.seek(0)
            printed = output.read().decode(errors="replace")
        if not ended_in_time:
            raise Failed("not ended within %d s; it printed\n%s" % (self.limit, printed))
        if process.returncode != 0:
            raise Failed("exit code %d; it printed\n%s" % (process.returncode, printed))
        return printed

    def stay(self, command):
        """Starts a command that stays, in the place of the one before it; what it printed until it is ready."""
        self.end_served()
        self.served = served = Served(command, self.directory, self.environment)
        until("`%s` is ready" % command, lambda: READY.search(served.printed()) or served.process.poll() is not None, self.limit, served.printed)
        if served.process.poll() is not None:
            raise Failed("`%s` has ended; it printed\n%s" % (command, served.printed()))
        return served.printed()

    def typed(self, command, strict=True):
        """Runs one command as a reader does; what it printed."""
        if STAYS.search(command.split("#")[0].strip()):
            return self.stay(command)
        if command.endswith("&"):
            self.background[command] = Served(command.rstrip("& "), self.directory, self.environment)
            return ""
        # A refused command of a console is an answer, not a failure of the page.
        return self.shell(command if strict else command + "\n:", strict)

    # The kinds of blocks.

    def example(self, text, _):
        return self.shell(text)

    def control(self, text, flags):
        with Emulator(self.binary, *flags.split(), cwd=self.directory, env=self.environment) as emulator:
            addresses = {name.upper(): "%s:%d" % emulator.address(name) for name in emulator.ports}
            return self.shell(text, TS3100_CONTROL_URL=emulator.url, **addresses)

    def commands(self, text, flags):
        lines = [line for line in text.replace("\\\n", " ").split("\n") if line.strip() and not line.startswith("#")]
        return "".join([self.typed(re.sub(r"\bts3100 [a-z]+", r"\g<0> " + flags, line, count=1)) for line in lines])

    def console(self, text, _):
        for command, shown in commands(text.rstrip("\n").split("\n")):
            printed = self.typed(command, strict=False)
            if not as_shown(printed, "\n".join(shown)):
                raise Failed("%s printed\n%s\n     expected\n%s" % (command, printed, "\n".join(shown)))

    def output(self, text, _):
        if self.printed is None:
            raise Failed("no example comes before it")
        if not as_shown(self.printed, text):
            raise Failed("the example printed\n%s\n     expected\n%s" % (self.printed, text))

    def log(self, text, _):
        missing = [said for said in text.strip().split("\n") if self.served is None or not self.served.says(said)]
        if missing:
            raise Failed("not in the log: %s" % missing[0])

    def file(self, text, name):
        with open(os.path.join(self.directory, name), "w", encoding="utf-8") as file:
            file.write(text)

    def check(self, text, codes):
        self.file(text, "example.scol")
        arm = ["--model", "tsl3000-thl400"] if text.startswith("' arm: scara") else []
        process = subprocess.run([self.binary, "check", *arm, "example.scol"], cwd=self.directory, stdout=subprocess.PIPE,
                                 stderr=subprocess.STDOUT, timeout=self.limit, check=False)
        printed = process.stdout.decode(errors="replace")
        found = set(re.findall(r"^.*:\d+:\d+: (?:error|warning)\[(\w+)\]", printed, re.MULTILINE))
        if found != set(codes.split()):
            raise Failed("check found\n%s\n     expected %s" % (printed, codes or "nothing"))


KINDS = {"run-example": Page.example, "control": Page.control, "commands": Page.commands, "console": Page.console, "output": Page.output,
         "log": Page.log, "file": Page.file, "check": Page.check, "not-run": None}


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


def prepare(directory, binary):
    """Makes a folder look like a clone in which the program is built, with the files that pages name. Clients are copied, since
    their tools write beside the sources."""
    for entry in os.scandir(ROOT):
        if entry.is_file() or entry.name in ("packaging", "editors"):
            os.symlink(entry.path, os.path.join(directory, entry.name))
    shutil.copytree(os.path.join(ROOT, "clients"), os.path.join(directory, "clients"), ignore=shutil.ignore_patterns("node_modules", "target"))
    for name in BUILT:
        os.makedirs(os.path.join(directory, "target", name))
        os.symlink(binary, os.path.join(directory, "target", name, "ts3100"))
    shutil.copytree(FILES, directory, dirs_exist_ok=True)


def run_page(path, by, page):
    """Runs every block of a page that names this program; what each printed."""
    said = []
    for block in blocks(path):
        if block.by != by or block.kind not in KINDS or block.kind == "not-run":
            continue
        place = "%s:%d" % (os.path.relpath(path), block.line)
        try:
            page.printed = KINDS[block.kind](page, page.with_robot(block.text), block.flags) or page.printed
            said.append(page.printed or "")
        except Failed as failure:
            raise Failed("%s: %s" % (place, failure)) from None
        print("ok   %s" % place, flush=True)
    page.check_background()
    return said


def run(by, binary, paths=None, directory=None, path=(), limit=LIMIT, **variables):
    """Runs the blocks that name this program (`None`: those that name none), with more folders in PATH and more variables, in
    this directory or one of each page. What each printed."""
    said = []
    for name in paths or every():
        if not any(block.by == by and block.kind in KINDS for block in blocks(name)):
            continue
        with tempfile.TemporaryDirectory(prefix="ts3100-docs-") as own:
            if not directory:
                prepare(own, binary)
            page = Page(binary, directory or own, path, limit, variables)
            try:
                said += run_page(name, by, page)
            finally:
                page.close()
    return said
