#!/usr/bin/env python3
"""The same seed and the same scenario give the same run, to the byte: transcripts in all three forms, findings, coverage,
lines executed, the report of faults, results and the snapshot at the end are compared between two runs, and another seed
gives another run.

    python3 tests/system/hosts/reproducible_runs.py --serve target/release/ts3100 [--runs 2] [--keep DIR]

(a) Nobody outside: a scenario drives a program in `--time auto`, by `serve` and by `exec`.
(b) A host program over TCP on IP0 and IP1, in `--time stepped`: it moves time itself, over the control interface."""

import contextlib
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Emulator, NotReached, Robot, surroundings  # noqa: E402
from steps import Failed, equal, ok, program, serving, show, true, until  # noqa: E402
from wire import CR, ETX, Host, Line  # noqa: E402

CELL = b"""PROGRAM CELL
REMARK Output 1 asks for a part; part 0 ends the shift.
N = 0
GOOD = 0
SPEED = 60
MOVE REST
AGAIN:
PULOUT(1, 0.02)
PRINT IP1, "REQ", CR
INPUT IP1, N
IF N == 0 THEN GOTO LEAVE
MOVE PICK
MOVES PICK + POINT(0, 0, -40) WITH SPEED=20
DOUT(5)
DELAY 0.2
MOVE PLACE
DOUT(-5)
GOOD = GOOD + 1
PRINT IP1, "DONE", N, GOOD, TIMER, CR
GOTO AGAIN
LEAVE:
PRINT IP1, "OVER", GOOD, CR
END
DATA
POINT REST=420,0,260,0,0,0,0,0/
POINT PICK=380,180,160,0,0,0,0,0/
POINT PLACE=300,-260,120,0,0,0,0,0/
END
"""
SCENARIO = """name = "a shift without a host"

[start]
load = ["CELL.scol"]
select = "CELL"
servo-on = true

[[do]]
at = "100 ms"
actions = ["program start"]

[[do]]
when = "output 1 on"
after = "70 ms"
times = 0
actions = ["channel IP1 inject 4<CR>"]

[[do]]
when = "output 5 on"
after = "50 ms"
times = 0
actions = ["input 3 pulse on 40 ms", "channel IP1 inject 9<CR>"]

[[do]]
when = "alarm"
after = "300 ms"
times = 0
actions = ["emergency-stop release", "alarms reset", "servo on", "program start"]

[[do]]
at = "9 s"
actions = ["faults arm emergency-stop:channel=IP1,delay=200,release=250"]

[[do]]
at = "20 s"
actions = ["alarms raise 2-046 shown by hand", "feed-hold on"]

[[do]]
at = "21 s"
actions = ["feed-hold off"]

[[do]]
at = "40 s"
actions = ["channel IP1 inject 0<CR>0<CR>", "channel IP2 inject lost<CR>"]

[[expect]]
what = "alarm"
times = 3

[[expect]]
what = "command RN"

[[never]]
what = "output 5 on"
after = "alarm 8-014"
"""
# Whatever a run writes.
REPORTS = {"--transcript": ["day.txt", "day.jsonl", "day.pcapng"],
           "--findings": ["found.json", "found.xml", "found.sarif"],
           "--coverage": ["coverage.json", "coverage.html"],
           "--lcov": ["run.info"], "--report": ["faults.json"], "--junit": ["results.xml"],
           "--snapshot-on-exit": ["end.json"]}
FAULTS = ["lost-record:probability=0.2,times=0", "alarm:channel=IP1,number=2-046,probability=0.15,times=0,delay=150",
          "servo-failure:channel=IP1,after=3,times=2,delay=900"]
# What a host can live with that reads on until ETX and asks again when nothing comes.
WEATHER = ["split-bytes:channel=IP0,probability=0.15,times=0,size=40", "late-reply:channel=IP0,probability=0.1,times=0,delay=700",
           "no-reply:command=SU,probability=0.2,times=0", "slow-line:channel=IP1,probability=0.3,times=0,speed=2400",
           "ng:command=SO,times=2"]
QUIET = 0.4
RUN_LIMIT = 60.0


def reports(*but):
    """The flags that ask for every report, but these."""
    return [word for flag, files in REPORTS.items() if flag not in but for name in files for word in (flag, name)]


def written(directory, *but):
    """The reports of a run: name and bytes."""
    found = {}
    for flag, files in REPORTS.items():
        for name in files if flag not in but else ():
            with open(os.path.join(directory, name), "rb") as report:
                found[name] = report.read()
    return found


def until_quiet(robot):
    """Waits until virtual time stands: nothing more happens by itself."""
    seen = [None, time.monotonic()]

    def stands():
        if robot.clock.now != seen[0]:
            seen[:] = robot.clock.now, time.monotonic()
        return time.monotonic() - seen[1] > QUIET

    until("virtual time stands", stands, RUN_LIMIT, lambda: "%.6f s and going on" % seen[0])
    return seen[0]


def alone(binary, how, directory, vary, fault_seed):
    """(a): a scenario and nobody else; the reports."""
    for name, content in (("CELL.scol", CELL), ("shift.toml", SCENARIO.encode())):
        with open(os.path.join(directory, name), "wb") as file:
            file.write(content)
    flags = ["--time", "auto", "--set", "channel.no_peer=silent", "--vary", str(vary), "--fault-seed", str(fault_seed),
             "--scenario", "shift.toml", *reports()]
    for fault in FAULTS:
        flags += ["--fault", fault]
    if how == "serve":
        with Emulator(binary, *flags, cwd=directory) as emulator:
            now = until_quiet(emulator.robot)
            emulator.stop(code=5, within=20)
    else:
        ended = subprocess.run([binary, "exec", *flags, "--", sys.executable, os.path.abspath(__file__), "--until-quiet"], cwd=directory,
                               env=surroundings(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=2 * RUN_LIMIT)
        if ended.returncode != 64:
            raise Failed("exec ends with 64, an expectation that was not met\n     found    %d: %s"
                         % (ended.returncode, ended.stdout.decode("utf-8", "replace")))
        now = None
    return written(directory), now


class Stepped:
    """A host whose pauses are virtual: time passes when it says so, and not otherwise."""

    def __init__(self, emulator):
        self.robot = emulator.robot
        # One after the other: which of two sockets the system reports first is nobody's promise.
        self.host, self.line = (self.connected(emulator, port) for port in ("ip0", "ip1"))

    def connected(self, emulator, port):
        """A line that the emulator has as the peer of the port."""
        line = Patient(emulator.address(port), self.robot)
        until("%s has a peer" % port, lambda: self.robot.channel_state(port).get("peer"), RUN_LIMIT)
        return line

    def advance_until(self, condition, within):
        """Virtual time passes until the condition is met, or so many seconds."""
        with contextlib.suppress(NotReached):
            self.robot.advance_until(condition, within)


class Patient(Host):
    """A line on which time is moved when nothing comes."""

    def __init__(self, address, robot):
        super().__init__(address, stx=True)
        self.robot = robot
        self.repeated = 0

    def text(self, data):
        """One text; the answer has at least 0.15 s to come."""
        self.raw(self.stx + data + ETX)
        self.robot.advance(0.15)

    def more(self, timeout):
        """Bytes that have come, or come within the next seconds of virtual time."""
        for _ in range(12):
            if super().more(1.0):
                return True
            self.robot.advance(0.5)
        return False

    def until(self, end, timeout=5.0):
        return super().until(end, timeout=1e6)

    def receive(self, timeout=5.0):
        return super().receive(timeout=1e6)

    def again(self, job):
        """Until it succeeds, five times at most."""
        for _ in range(5):
            try:
                return job()
            except Failed:
                self.kept, self.repeated = b"", self.repeated + 1
                # An exchange that hangs is over after 10 s without a text.
                self.robot.advance(11)
                while Line.more(self, 0.5):
                    self.kept = b""
        return job()


def shift(binary, directory, vary, fault_seed):
    """(b): a host on IP0 and IP1 in stepped time; the reports."""
    flags = ["--time", "stepped", "--vary", str(vary), "--fault-seed", str(fault_seed), *reports("--junit")]
    for fault in WEATHER:
        flags += ["--fault", fault]
    with Emulator(binary, *flags, cwd=directory) as emulator:
        steps = Stepped(emulator)
        host, line = steps.host, steps.line
        host.again(lambda: host.command(b"SO"))
        whole = CELL + b"".join(b"REMARK %03d\r\n" % number for number in range(60))
        true("the file needs several texts", host.again(lambda: host.download(b"CELL", whole)) > 3)
        host.again(lambda: host.command(b"SL,CELL"))
        equal("UL gives it back", whole.replace(b"\n", b"\r\n").replace(b"\r\r", b"\r"),
              host.again(lambda: host.file(b"UL,CELL")).replace(b"\n", b"\r\n").replace(b"\r\r", b"\r"))
        host.command(b"RN")
        for part in (7, 8, 9):
            steps.advance_until("printed IP1 REQ", 30)
            record = line.until(CR)
            if not record.startswith(b"REQ"):
                raise Failed("REQ comes\n     found    %s" % show(record))
            line.raw(b"%d\r" % part)
            host.again(host.status)
            steps.advance_until("printed IP1 DONE", 60)
            record = line.until(CR)
            if [float(word) for word in record[4:].split()][:2] != [part, part - 6]:
                raise Failed("part %d is done\n     found    %s" % (part, show(record)))
        line.until(CR)
        host.again(lambda: host.file(b"CA"))
        host.raw(b"su\r\x03")
        steps.robot.advance(0.5)
        line.raw(b"0\r")
        steps.advance_until("idle", 30)
        line.until(CR)
        line.close()
        steps.robot.advance(1)
        host.again(host.status)
        steps.robot.advance(3600)
        host.close()
        until("IP0 has no peer", lambda: not steps.robot.channel_state("ip0").get("peer"), RUN_LIMIT)
        emulator.stop(within=20)
    return written(directory, "--junit"), host.repeated


def compare(what, first, other):
    """Both runs are the same, to the byte."""
    for name, content in first.items():
        if content == other[name]:
            continue
        ours, theirs = content.splitlines(), other[name].splitlines()
        pairs = list(enumerate(zip(ours, theirs), 1)) + [(min(len(ours), len(theirs)) + 1, (b"end or more", b"more or end"))]
        number, (one, two) = next(pair for pair in pairs if pair[1][0] != pair[1][1])
        raise Failed("%s: %s is the same each time\n     expected %s, line %d: %s\n     found    %s"
                     % (what, name, name, number, show(one), show(two)))


def differ(what, first, other, *names):
    """Another seed is another run."""
    same = [name for name in names if first[name] == other[name]]
    if same:
        raise Failed("%s: another run\n     found    the same %s" % (what, ", ".join(same)))
    ok("%s: another run" % what)


def digest(found):
    """A few digits that stand for all reports, and how many bytes they are."""
    whole = hashlib.sha256(b"".join(found[name] for name in sorted(found)))
    return "%d reports, %d bytes, sha256 %s" % (len(found), sum(map(len, found.values())), whole.hexdigest()[:16])


def main():
    if sys.argv[1:] == ["--until-quiet"]:
        until_quiet(Robot.connect(os.environ["TS3100_CONTROL_URL"]))
        return
    parser = serving(__doc__)
    parser.add_argument("--runs", type=int, default=2, help="of each kind (default 2)")
    parser.add_argument("--keep", metavar="DIR", help="leave what the runs wrote here")
    arguments = parser.parse_args()
    binary = arguments.serve
    root = os.path.abspath(arguments.keep) if arguments.keep else tempfile.mkdtemp(prefix="ts3100-repeat-")

    def run(name, job, *seeds):
        """A run, always in the same directory: tracefiles of lcov name their files by whole paths."""
        directory, kept = os.path.join(root, "run"), os.path.join(root, name)
        for old in (directory, kept):
            shutil.rmtree(old, ignore_errors=True)
        os.makedirs(directory)
        try:
            return job(directory, *seeds)
        finally:
            os.rename(directory, kept)

    texts = ["day.txt", "day.jsonl", "day.pcapng"]
    try:
        for how in ("serve", "exec"):
            def job(directory, *seeds, how=how):
                return alone(binary, how, directory, *seeds)
            first, now = run(how + "-1", job, 7, 3)
            for number in range(2, arguments.runs + 1):
                compare("%s, run %d" % (how, number), first, run("%s-%d" % (how, number), job, 7, 3)[0])
            ok("%s, a scenario alone, %d runs%s: %s"
               % (how, arguments.runs, " of %.1f s" % now if now else "", digest(first)))
            differ("%s, another --fault-seed" % how, first, run(how + "-seed", job, 7, 4)[0], *texts)

        def job(directory, *seeds):
            return shift(binary, directory, *seeds)
        first, repeated = run("host-1", job, 7, 3)
        true("the host had to repeat itself", repeated > 0, repeated)
        for number in range(2, arguments.runs + 1):
            compare("host, run %d" % number, first, run("host-%d" % number, job, 7, 3)[0])
        ok("a host over TCP in stepped time, %d runs: %s" % (arguments.runs, digest(first)))
        differ("a host, another --vary", first, run("host-vary", job, 8, 3)[0], *texts)
    finally:
        if not arguments.keep:
            shutil.rmtree(root, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(program(main))
