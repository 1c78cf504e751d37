#!/usr/bin/env python3
"""The same seed and the same scenario give the same run, to the byte: transcripts in all three forms, findings, coverage,
lines executed, the report of faults, results and the snapshot at the end are compared between two runs, and another seed
gives another run.

    python3 tests/system/hosts/reproducible_runs.py --serve target/release/ts3100 [--runs 2] [--keep DIR]

(a) Nobody outside: a scenario drives a program in `--time auto`, by `serve` and by `exec`.
(b) A host program over TCP on IP0 and IP1, in `--time stepped`: it moves time itself, by `ts3100 ctl clock`."""

import argparse
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "lib"))
from wire import CR, EOF, ETX, Failed, Host, Line, equal, ok, show, true  # noqa: E402

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
READY_TIMEOUT = 20.0
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


def surroundings(binary):
    """Ours, without what somebody has said to another emulator."""
    found = {name: value for name, value in os.environ.items() if not name.startswith("TS3100_")}
    found["PATH"] = os.path.dirname(binary) + os.pathsep + found.get("PATH", "")
    return found


def clock(url):
    """The virtual time now, in seconds."""
    with urllib.request.urlopen(url + "/clock", timeout=10) as answer:
        return json.load(answer)["now"]


def until_quiet(url):
    """Waits until virtual time stands: nothing more happens by itself."""
    limit, last, since = time.monotonic() + RUN_LIMIT, None, 0.0
    while time.monotonic() < limit:
        now = clock(url)
        if now != last:
            last, since = now, time.monotonic()
        elif time.monotonic() - since > QUIET:
            return now
        time.sleep(0.05)
    raise Failed("virtual time stands within %.0f s\n     found    %.6f s and going on" % (RUN_LIMIT, last))


class Serve:
    """A `ts3100 serve` in a directory."""

    def __init__(self, binary, directory, *flags):
        with open(os.path.join(directory, "log"), "wb") as log:
            self.process = subprocess.Popen([binary, "serve", "--ports", "auto", "--ready-json", *flags], cwd=directory,
                                            env=surroundings(binary), stdout=subprocess.PIPE, stderr=log)
        line = self.process.stdout.readline()
        if not line:
            with open(os.path.join(directory, "log"), encoding="utf-8") as log:
                raise Failed("serve starts\n     found    %s" % log.read())
        self.ready = json.loads(line)

    def end(self):
        """SIGTERM, and its exit code."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(20)

    def kill(self):
        """Whatever its state."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()


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
        robot = Serve(binary, directory, *flags)
        try:
            now = until_quiet(robot.ready["control"])
            code = robot.end()
        finally:
            robot.kill()
        if code != 5:
            raise Failed("serve ends with 5, an expectation that was not met\n     found    %d" % code)
    else:
        wait = "import sys; sys.path.insert(0, %r); import os, reproducible_runs; reproducible_runs.until_quiet(os.environ['TS3100_CONTROL_URL'])"
        ended = subprocess.run([binary, "exec", *flags, "--", sys.executable, "-c", wait % HERE], cwd=directory,
                               env=surroundings(binary), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                               timeout=2 * RUN_LIMIT)
        if ended.returncode != 64:
            raise Failed("exec ends with 64, an expectation that was not met\n     found    %d: %s"
                         % (ended.returncode, ended.stdout.decode("utf-8", "replace")))
        now = None
    return written(directory), now


class Stepped:
    """A host whose pauses are virtual: time passes when it says so, and not otherwise."""

    def __init__(self, binary, robot):
        self.binary, self.url = binary, robot.ready["control"]
        address = {name: ("127.0.0.1", port) for name, port in robot.ready["ports"].items()}
        # One after the other: which of two sockets the system reports first is nobody's promise.
        self.host = Patient(address["ip0"], self)
        self.until_connected("ip0")
        self.line = Patient(address["ip1"], self)
        self.until_connected("ip1")

    def until_connected(self, port):
        """Waits until the emulator has a peer on the port."""
        limit = time.monotonic() + RUN_LIMIT
        while time.monotonic() < limit:
            with urllib.request.urlopen(self.url + "/channels/" + port, timeout=10) as answer:
                if json.load(answer).get("peer"):
                    return
            time.sleep(0.01)
        raise Failed("%s has a peer within %.0f s\n     found    none" % (port, RUN_LIMIT))

    def clock(self, *words):
        """`ts3100 ctl clock ...`: what it says."""
        ended = subprocess.run([self.binary, "ctl", "--url", self.url, "--json", "clock", *words], stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, timeout=60)
        if ended.returncode not in (0, 4):
            raise Failed("ctl clock %s\n     found    %d: %s" % (" ".join(words), ended.returncode, ended.stdout.decode()))
        return json.loads(ended.stdout)

    def advance(self, seconds):
        """So much virtual time passes."""
        self.clock("advance", str(seconds))


class Patient(Host):
    """A line on which time is moved when nothing comes."""

    def __init__(self, address, steps):
        super().__init__(address, stx=True)
        self.steps = steps
        self.repeated = 0

    def text(self, data):
        """One text; the answer has at least 0.15 s to come."""
        self.raw(self.stx + data + ETX)
        self.steps.advance(0.15)

    def more(self, timeout):
        """Bytes that have come, or come within the next seconds of virtual time."""
        for _ in range(12):
            if super().more(1.0):
                return True
            self.steps.advance(0.5)
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
                self.steps.advance(11)
                while Line.more(self, 0.5):
                    self.kept = b""
        return job()


def shift(binary, directory, vary, fault_seed):
    """(b): a host on IP0 and IP1 in stepped time; the reports."""
    flags = ["--time", "stepped", "--vary", str(vary), "--fault-seed", str(fault_seed), *reports("--junit")]
    for fault in WEATHER:
        flags += ["--fault", fault]
    robot = Serve(binary, directory, *flags)
    try:
        steps = Stepped(binary, robot)
        host, line = steps.host, steps.line
        host.again(lambda: host.command(b"SO"))
        whole = CELL + b"".join(b"REMARK %03d\r\n" % number for number in range(60))
        true("the file needs several texts", host.again(lambda: host.download(b"CELL", whole)) > 3)
        host.again(lambda: host.command(b"SL,CELL"))
        equal("UL gives it back", whole.replace(b"\n", b"\r\n").replace(b"\r\r", b"\r"),
              host.again(lambda: host.file(b"UL,CELL")).replace(b"\n", b"\r\n").replace(b"\r\r", b"\r"))
        host.command(b"RN")
        for part in (7, 8, 9):
            steps.clock("advance-until", "printed", "IP1", "REQ", "--within", "30")
            record = line.until(CR)
            if not record.startswith(b"REQ"):
                raise Failed("REQ comes\n     found    %s" % show(record))
            line.raw(b"%d\r" % part)
            host.again(host.status)
            steps.clock("advance-until", "printed", "IP1", "DONE", "--within", "60")
            record = line.until(CR)
            if [float(word) for word in record[4:].split()][:2] != [part, part - 6]:
                raise Failed("part %d is done\n     found    %s" % (part, show(record)))
        line.until(CR)
        host.again(lambda: host.file(b"CA"))
        host.raw(b"su\r\x03")
        steps.advance(0.5)
        line.raw(b"0\r")
        steps.clock("advance-until", "idle", "--within", "30")
        line.until(CR)
        line.close()
        steps.advance(1)
        host.again(host.status)
        steps.advance(3600)
        host.close()
        time.sleep(0.2)
        code = robot.end()
    finally:
        robot.kill()
    if code != 0:
        raise Failed("serve ends with 0\n     found    %d" % code)
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
    parser = argparse.ArgumentParser(description="Two runs, the same bytes.")
    parser.add_argument("--serve", metavar="TS3100", required=True, help="the binary to start")
    parser.add_argument("--runs", type=int, default=2, help="of each kind (default 2)")
    parser.add_argument("--keep", metavar="DIR", help="leave what the runs wrote here")
    arguments = parser.parse_args()
    binary = os.path.abspath(arguments.serve)
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
    except (Failed, OSError, subprocess.TimeoutExpired) as error:
        print("FAIL %s" % error, flush=True)
        return 1
    finally:
        if not arguments.keep:
            shutil.rmtree(root, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
