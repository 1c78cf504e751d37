#!/usr/bin/env python3
"""kill -9 at any moment: while an emulator starts, while a host downloads, erases, saves parameters and variables, while alarms
enter the history, while a snapshot is written, while transcripts are, and over a whole fleet. The next emulator starts on the
same folder. Each file is whole, old or new; nothing that was answered OK is lost; `ts3100 diff` reads the transcripts.

    python3 tests/system/hosts/crash.py --serve target/release/ts3100 [--kills 400] [--seed 1] [--jobs 2] [KIND...]
    python3 tests/system/hosts/crash.py --serve target/release/ts3100 --canary

`--canary` halves the files after each kill: the exit code is 0 if every kind notices."""

import collections
import concurrent.futures
import contextlib
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Emulator, surroundings  # noqa: E402
from steps import Failed, ok, program, serving  # noqa: E402
from wire import Fast  # noqa: E402

# The kill comes so many seconds after the emulator is ready at the latest: some ten changes later on a disk with fsync.
LONGEST = 0.06
# How many of a hundred kills come while the emulator starts, and how long after its birth at the latest.
STARTING, BIRTH = 0.1, 0.012
# A process that got SIGTERM writes its snapshot within so many seconds.
WRITING = 0.012
# So many kills of a kind are enough to notice its canary.
CANARY_KILLS = 30
FLEET = 4


def read(path):
    """The content of a file, None if there is none."""
    try:
        with open(path, "rb") as file:
            return file.read()
    except FileNotFoundError:
        return None


def marked(version):
    """A program that is another one throughout for each version."""
    return b"PROGRAM P\n%sEND\n" % (b"REMARK version %d\n" % version * 120)


@contextlib.contextmanager
def until_killed():
    """Work that ends when the emulator is gone."""
    try:
        yield
    except OSError:
        pass
    except Failed as error:
        # The connection of a killed emulator is closed.
        if "closed after" not in str(error):
            raise


class Change:
    """A file that is changed again and again: the content that was answered OK, and the one that is under way."""

    def __init__(self, path):
        self.path = path
        self.kept = self.begun = read(path)
        self.answered = self.inside = 0

    def to(self, content, call):
        """Changes it by a call that has to be answered OK."""
        self.begun = content
        answer = call()
        if answer != b"OK":
            raise Failed("a change of %s is answered OK\n     found    %r" % (self.path, answer))
        self.kept = content
        self.answered += 1

    def left(self):
        """Looks at the file after a kill."""
        found = read(self.path)
        if found not in (self.kept, self.begun):
            raise Failed("%s is whole, as answered or as begun\n     answered %r\n     begun    %r\n     found    %r"
                         % (self.path, self.kept, self.begun, found))
        self.inside += self.kept != self.begun
        self.kept = self.begun = found


class Kind:
    """What is written while the kill comes, in a folder that outlives the emulators. This one: DL of a program."""

    names = ("P",)
    flags = ()

    def __init__(self, binary, folder, dice):
        self.binary, self.folder, self.dice = binary, folder, dice
        self.drive = os.path.join(folder, "drive")
        self.changes = {name: Change(os.path.join(self.drive, name)) for name in self.names}
        self.version = 0

    def arguments(self):
        """The command line of the next emulator."""
        return ("--drive", self.drive, *self.flags)

    def next(self):
        self.version += 1
        return self.version

    def restarted(self, emulator):
        """Looks at an emulator that has started on what the last kill left."""
        host = Fast(emulator.address("ip0"), True)
        for name, change in self.changes.items():
            if change.kept is not None:
                found = host.file(b"UL," + name.encode())
                if found != change.kept:
                    raise Failed("UL,%s gives what the last emulator left\n     found    %r" % (name, found))
        unfinished = [name for name in os.listdir(self.drive) if name.endswith(".unfinished")]
        if unfinished:
            raise Failed("no half file is left after a restart\n     found    %s" % unfinished)
        host.close()

    def work(self, emulator):
        """Writes until the emulator is gone."""
        host = Fast(emulator.address("ip0"), True)
        while True:
            self.change(host)

    def change(self, host):
        """One change."""
        content = marked(self.next())
        self.changes["P"].to(content, lambda: host.load(b"P", content))

    def left(self):
        """Looks at the folder after a kill."""
        for change in self.changes.values():
            change.left()

    def files(self):
        """What the canary halves."""
        return [change.path for change in self.changes.values()]

    def counts(self):
        """Changes answered, and changes that were under way at a kill."""
        return (sum(change.answered for change in self.changes.values()), sum(change.inside for change in self.changes.values()))


class Erase(Kind):
    """DL and ER in turn."""

    def change(self, host):
        change = self.changes["P"]
        if change.kept is None:
            super().change(host)
        else:
            change.to(None, lambda: host.answer(b"ER,P"))


class Parameters(Kind):
    """DL of the three parameter files. The next emulator accepts them: no alarm 1-101."""

    names = ("USER.PAR", "ETHERNET.PAR", "STRING.PAR")

    def restarted(self, emulator):
        super().restarted(emulator)
        if self.version == 0:
            # The factory files, which the first emulator made.
            for change in self.changes.values():
                change.kept = change.begun = read(change.path)
        alarms = Fast(emulator.address("ip0"), True).file(b"AC")
        if alarms != b"0":
            raise Failed("parameter files raise no alarm\n     found    %r" % alarms)

    def change(self, host):
        version, name = self.next(), self.dice.choice(self.names)
        if name == "STRING.PAR":
            content = b"".join(b'= %d "V%d"\n' % (row, version) for row in range(100))
        elif name == "USER.PAR":
            content = (b"[U06] Version %d\n" % version + b"{Version %d}\n" % version * 40
                       + b"{COM1} = %d 8 0 1\n{HOST} = 9600 8 0 1\n[END]\n" % (1200 << version % 4))
        else:
            content = re.sub(rb'= "[^"]*"', b'= "VERSION-%d"' % version, self.changes[name].kept)
        self.changes[name].to(content, lambda: host.load(name.encode(), content))


class Variables(Kind):
    """MW with flag 1, which writes the value into the program file."""

    names = ("V",)

    @staticmethod
    def source(value):
        return b"GLOBAL\nN = %d\nEND\nPROGRAM V\nEND\n" % value

    def work(self, emulator):
        host = Fast(emulator.address("ip0"), True)
        if self.changes["V"].kept is None:
            self.changes["V"].to(self.source(0), lambda: host.load(b"V", self.source(0)))
        host.command(b"SL,V")
        while True:
            value = self.next()
            self.changes["V"].to(self.source(value), lambda: host.answer(b"MW,1 N 0 %d" % value))


class History(Kind):
    """Alarms, which enter the error history in a hidden file of the drive."""

    names = ()

    def __init__(self, *more):
        super().__init__(*more)
        self.kept = self.begun = self.answered = self.inside = 0

    def restarted(self, emulator):
        found = [int(row["text"].rsplit(" ", 1)[-1]) for row in emulator.robot.request("GET", "/alarms")["history"]]
        newest = found[0] if found else 0
        if newest not in (self.kept, self.begun) or found != list(range(newest, newest - len(found), -1)):
            raise Failed("the history has alarm %d or %d and all before it\n     found    %s" % (self.kept, self.begun, found))
        self.kept = self.begun = newest
        emulator.robot.call("reset_alarms")

    def work(self, emulator):
        while True:
            self.begun = self.kept + 1
            emulator.robot.raise_alarm("1-102", "number %d" % self.begun)
            self.kept = self.begun
            self.answered += 1

    def left(self):
        self.inside += self.begun != self.kept

    def files(self):
        return [os.path.join(self.drive, ".ts3100.history")]

    def counts(self):
        return self.answered, self.inside


class Snapshot(Kind):
    """SIGTERM, which makes the emulator write a snapshot, and the kill right behind it. The next emulator starts from it."""

    names = ()

    def __init__(self, *more):
        super().__init__(*more)
        self.path = os.path.join(self.folder, "snapshot.json")
        self.kept = self.begun = None
        self.answered = self.inside = 0

    def arguments(self):
        return ("--snapshot-on-exit", self.path, *(("--restore", self.path) if os.path.exists(self.path) else ()))

    def restarted(self, emulator):
        host = Fast(emulator.address("ip0"), True)
        found = None if self.kept is None else host.file(b"UL,P")
        if found != self.kept:
            raise Failed("an emulator continues from the snapshot\n     expected %r\n     found    %r" % (self.kept, found))
        host.close()

    def work(self, emulator):
        content = marked(self.next())
        if Fast(emulator.address("ip0"), True).load(b"P", content) != b"OK":
            raise Failed("DL is answered OK")
        self.begun = content
        emulator.process.send_signal(signal.SIGTERM)
        try:
            if emulator.process.wait(self.dice.uniform(0, WRITING)) == 0:
                # The end came before the kill: the snapshot is written.
                self.kept = content
                self.answered += 1
        except subprocess.TimeoutExpired:
            emulator.process.kill()

    def left(self):
        content = read(self.path)
        try:
            files = {} if content is None else json.loads(content)["drive"]["files"]
        except ValueError as error:
            raise Failed("a snapshot is whole\n     found    %s in %d bytes" % (error, len(content))) from None
        text = json.dumps(files)
        found = [version for version in (self.kept, self.begun)
                 if version is None and content is None or version and json.dumps(version.decode())[1:-1] in text]
        if not found:
            raise Failed("a snapshot is as it was or as it is\n     found    %r" % (content or b"")[:400])
        self.inside += self.kept != self.begun
        self.kept = self.begun = found[-1]

    def files(self):
        return [self.path]

    def counts(self):
        return self.answered, self.inside


class Transcript(Kind):
    """Two transcripts of a host that writes a variable: each answer the host has seen is in both, and `diff` reads them."""

    names = ()

    def __init__(self, *more):
        super().__init__(*more)
        self.paths = [os.path.join(self.folder, name) for name in ("day.txt", "day.jsonl")]
        self.answered = self.inside = 0
        source = os.path.join(self.folder, "v.scol")
        with open(source, "wb") as file:
            file.write(Variables.source(0))
        self.flags = ("--load", source, "--select", "V", *(word for path in self.paths for word in ("--transcript", path)))

    def arguments(self):
        self.kept = self.begun = 0
        for path in self.paths:
            if os.path.exists(path):
                os.remove(path)
        return self.flags

    def restarted(self, emulator):
        pass

    def work(self, emulator):
        host = Fast(emulator.address("ip0"), True)
        while True:
            self.begun = self.kept + 1
            if host.answer(b"MW,0 N 0 %d" % self.begun) != b"OK":
                raise Failed("MW is answered OK")
            self.kept = self.begun

    def left(self):
        self.answered += self.kept
        self.inside += self.begun != self.kept
        for path in self.paths:
            content = read(path)
            if self.begun == 0 and not (content or b"").endswith(b"\n"):
                # Killed before the heading was complete.
                continue
            text = content.decode("ascii")
            # Whole records only: what is behind the last line end is none.
            text = text[:text.rindex("\n") + 1]
            asked = [int(number) for number in re.findall(r"MW,0 N 0 (\d+)<CR>", text)]
            answers = len(re.findall(r"^(?:< IP0 OK<CR>$|.*\"from-robot\".*<STX>OK<CR><ETX>\"}$)", text, re.MULTILINE))
            if asked != list(range(1, len(asked) + 1)) or not self.kept <= answers <= len(asked) <= self.begun:
                raise Failed("%s has %d or %d exchanges\n     found    %d requests, %d answers"
                             % (path, self.kept, self.begun, len(asked), answers))
            run = subprocess.run([self.binary, "diff", path], capture_output=True, text=True, env=surroundings(), check=False)
            # 1: the answer that the kill has cut off is missing.
            if run.returncode not in (0, 1) or run.returncode == 1 and answers == len(asked):
                raise Failed("diff reads %s\n     found    %d %s%s" % (path, run.returncode, run.stdout[-400:], run.stderr))

    def files(self):
        return self.paths

    def counts(self):
        return self.answered, self.inside


class Fleet(Kind):
    """A process of several robots, a host at each: DL on all of them at a time."""

    names = tuple("robot-%d" % number for number in range(1, FLEET + 1))

    def __init__(self, *more):
        super().__init__(*more)
        self.changes = {name: Change(os.path.join(self.drive, name, "P")) for name in self.names}

    def arguments(self):
        return ("--robots", str(FLEET), "--drive", os.path.join(self.drive, "{robot}"))

    def hosts(self, emulator):
        robots = emulator.ready["robots"]
        return {name: Fast((robots[name]["address"], robots[name]["ports"]["ip0"]), True) for name in self.names}

    def restarted(self, emulator):
        for name, host in self.hosts(emulator).items():
            if self.changes[name].kept is not None and host.file(b"UL,P") != self.changes[name].kept:
                raise Failed("UL,P of %s gives what the last emulator left" % name)
            host.close()

    def work(self, emulator):
        def one(name, host):
            with until_killed():
                version = self.version
                while True:
                    version += 1
                    content = marked(version)
                    self.changes[name].to(content, lambda: host.load(b"P", content))
        with concurrent.futures.ThreadPoolExecutor(FLEET) as pool:
            for done in [pool.submit(one, *pair) for pair in self.hosts(emulator).items()]:
                done.result()
        # Beyond any version that was begun.
        self.version += 1000


KINDS = {"download": Kind, "erase": Erase, "parameters": Parameters, "variables": Variables, "history": History,
         "snapshot": Snapshot, "transcript": Transcript, "fleet": Fleet}


def kill_starting(kind):
    """A start that is cut short."""
    process = subprocess.Popen([kind.binary, "serve", "--ports", "auto", *kind.arguments()], stdin=subprocess.DEVNULL,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=surroundings())
    time.sleep(kind.dice.uniform(0, BIRTH))
    process.kill()
    process.wait()


def kill_working(kind):
    """A start, a look at what the last kill left, work, and the kill."""
    emulator = Emulator(kind.binary, *kind.arguments())
    killer = threading.Timer(kind.dice.uniform(0, LONGEST), emulator.process.kill)
    try:
        kind.restarted(emulator)
        killer.start()
        with until_killed():
            kind.work(emulator)
    finally:
        killer.cancel()
        emulator.kill()


def halve(path):
    if os.path.exists(path):
        os.truncate(path, os.path.getsize(path) // 2)


def rounds(name, binary, seed, kills, canary):
    """Kills of one kind, one after the other: counts, and what does not hold."""
    folder = tempfile.mkdtemp(prefix="ts3100-crash-")
    kind = KINDS[name](binary, folder, random.Random("%s/%s" % (seed, name)))
    begun, counts = time.monotonic(), collections.Counter()
    failure = None
    try:
        for number in range(1, kills + 1):
            starting = number > 1 and kind.dice.random() < STARTING
            counts["starting"] += starting
            (kill_starting if starting else kill_working)(kind)
            counts["kills"] += 1
            if canary:
                for path in kind.files():
                    halve(path)
            kind.left()
        last = Emulator(binary, *kind.arguments())
        try:
            kind.restarted(last)
        finally:
            last.kill()
    except (Failed, OSError) as error:
        failure = "%s, seed %s, kill %d: %s" % (name, seed, counts["kills"], error)
    finally:
        shutil.rmtree(folder)
    answered, inside = kind.counts()
    counts.update(answered=answered, inside=inside)
    return name, counts, time.monotonic() - begun, failure


def main():
    parser = serving(__doc__)
    parser.add_argument("--kills", metavar="N", type=int, default=400, help="kills of all kinds together [default: 400]")
    parser.add_argument("--seed", metavar="S", default="1", help="draws moments and changes [default: 1]")
    parser.add_argument("--jobs", metavar="N", type=int, default=os.cpu_count() or 1,
                        help="emulators side by side [default: processors]")
    parser.add_argument("--canary", action="store_true", help="halve the files after each kill; every kind has to notice")
    parser.add_argument("kinds", metavar="KIND", nargs="*", help="kinds [default: all]: " + ", ".join(KINDS))
    options = parser.parse_args()
    unknown = [name for name in options.kinds if name not in KINDS]
    if unknown:
        parser.error("unknown kind %s; the kinds are %s" % (unknown[0], ", ".join(KINDS)))
    names = options.kinds or list(KINDS)
    kills = CANARY_KILLS if options.canary else max(2, options.kills // len(names))
    total, failures = collections.Counter(), []
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        running = [pool.submit(rounds, name, options.serve, options.seed, kills, options.canary) for name in names]
        for done in concurrent.futures.as_completed(running):
            name, counts, seconds, failure = done.result()
            if options.canary:
                if failure:
                    ok("the canary of %s was found by kill %d: %s" % (name, counts["kills"], failure.splitlines()[0][:200]))
                else:
                    failures.append("the canary of %s was NOT found by %d kills" % (name, counts["kills"]))
                continue
            total.update(counts)
            if failure:
                failures.append(failure)
                continue
            if not counts["inside"]:
                failures.append("no kill of %s came while a change was under way" % name)
            ok("%s: %d kills, %d while it started, %d changes under way, %d answered OK before, %.0f s"
               % (name, counts["kills"], counts["starting"], counts["inside"], counts["answered"], seconds))
    if failures:
        raise Failed("\nFAIL ".join(failures))
    if options.canary:
        ok("%d kinds of %d found their canary" % (len(names), len(names)))
    else:
        ok("%d kills, %d changes under way, %d answered OK before, nothing lost" % (total["kills"], total["inside"], total["answered"]))


if __name__ == "__main__":
    sys.exit(program(main))
