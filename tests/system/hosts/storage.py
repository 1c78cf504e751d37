#!/usr/bin/env python3
"""What must not be lost or overwritten: files on a disk that is full, read-only, removed or replaced, and what stands where a
report or a snapshot is to be written. Files at a kill -9 are in `crash`.

    python3 tests/system/hosts/storage.py --serve target/release/ts3100

The disk is a tmpfs of 1 MB in a mount namespace of its own: that needs root, or user namespaces."""

import os
import resource
import shutil
import stat
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Emulator  # noqa: E402
from steps import Failed, equal, ok, program, serving, true  # noqa: E402
from wire import Fast  # noqa: E402

# Set in the process that has a mount namespace of its own.
INSIDE = "TS3100_TEST_DISK_INSIDE"
NAMESPACES = (("unshare", "-m"), ("unshare", "-Urm"))
DISK = "1m"
# The longest a start that is refused may take, and the address space of one: a device is never read to its end.
REFUSAL, MEMORY = 10.0, 2 << 30
VARIABLES = b"GLOBAL\nN = 1\nEND\nPROGRAM V\nEND\n"


def source(name, size):
    """A program of about so many bytes."""
    lines = b"".join(b"REMARK %06d\n" % number for number in range(size // 14))
    return b"PROGRAM %s\n%sEND\n" % (name, lines)


class Disk:
    """A small file system, and a directory on it for the drive."""

    def __init__(self):
        self.path = tempfile.mkdtemp(prefix="ts3100-disk-")
        run = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=" + DISK, "tmpfs", self.path],
                             capture_output=True, text=True, check=False)
        if run.returncode != 0:
            os.rmdir(self.path)
            raise Failed("a tmpfs is mounted\n     found    %s" % run.stderr.strip())
        self.drive = os.path.join(self.path, "drive")
        self.filler = os.path.join(self.path, "filler")

    def fill(self):
        """Not a byte is left."""
        with open(self.filler, "wb", buffering=0) as file:
            block = b"x" * 4096
            try:
                while True:
                    file.write(block)
            except OSError:
                pass

    def free(self):
        """There is room again."""
        os.remove(self.filler)

    def writable(self, on):
        """The drive is mounted over itself read-only: the lock that is held open forbids to remount it."""
        steps = [["umount", self.drive]] if on else [["mount", "--bind", self.drive, self.drive],
                                                     ["mount", "-o", "remount,bind,ro", self.drive]]
        for step in steps:
            subprocess.run(step, check=True)

    def content(self, name):
        """The file as the disk has it; None if it is not there."""
        return read(os.path.join(self.drive, name))

    def names(self):
        """What the directory holds, hidden or not, but the files of the store itself."""
        return sorted(name for name in os.listdir(self.drive) if not name.startswith(".ts3100."))

    def end(self):
        subprocess.run(["umount", "-l", self.path], check=False)
        os.rmdir(self.path)


def read(path):
    try:
        with open(path, "rb") as file:
            return file.read()
    except FileNotFoundError:
        return None


class Stored(Emulator):
    """One with a drive, and a host."""

    def __init__(self, binary, drive, *flags):
        super().__init__(binary, "--drive", drive, *flags)
        self.host = Fast(self.address("ip0"), True)

    def drive(self):
        return self.robot.request("GET", "/health")["drive"]

    def metric(self, name):
        lines = self.robot.request("GET", "/metrics").splitlines()
        return float(next(line.split()[1] for line in lines if line.startswith(name + " ")))


def refused(robot, disk, what, calls):
    """Each of these is refused, and neither the RAM drive nor the disk has changed."""
    before = {name: disk.content(name) for name in disk.names()}
    failures = robot.drive()["failures"]
    for number, (call, expected, found) in enumerate(((call, want, call()) for call, want in calls), 1):
        del call
        equal("%s: change %d is refused" % (what, number), expected, found)
    drive = robot.drive()
    true("%s: /health says so" % what, drive["status"] == "failing" and drive["unkept"] == []
         and drive["failures"] == failures + len(calls) and drive["error"], repr(drive))
    true("%s: /metrics says so" % what, robot.metric("ts3100_drive_failing") == 1
         and robot.metric("ts3100_drive_failures") == drive["failures"])
    for name, content in before.items():
        if robot.host.file(b"UL," + name.encode()) != content or disk.content(name) != content:
            raise Failed("%s: %s is as before, on both" % (what, name))
    equal("%s: no other file, whole or half" % what, sorted(before), disk.names())


def lasts(robot, disk, binary, what):
    """What the robot has is what a killed one finds again."""
    files = list(robot.robot.files)
    robot.kill()
    equal("%s: the disk has the files of the drive" % what, files, disk.names())
    with Stored(binary, disk.drive) as robot:
        equal("%s: and so has the next emulator" % what, files, list(robot.robot.files))


def refuse(binary):
    """OK, 200 and 204 mean that it is on the disk."""
    disk = Disk()
    robot = Stored(binary, disk.drive)
    try:
        old, new = source(b"A", 20_000), source(b"A", 30_000)
        host = robot.host
        equal("DL on an empty disk", b"OK", host.load(b"A", old))
        host.load(b"V", VARIABLES)
        host.command(b"SL,V")
        equal("the disk has it", old, disk.content("A"))
        disk.fill()
        refused(robot, disk, "full", [
            (lambda: host.load(b"A", new), b"NG"),
            (lambda: host.load(b"B", new), b"NG"),
            (lambda: robot.answer("PUT", "/files/A", {"text": new.decode()})[0], 507),
            (lambda: robot.answer("PUT", "/files/C", {"text": new.decode()})[0], 507),
        ])
        disk.writable(False)
        refused(robot, disk, "read-only", [
            (lambda: host.answer(b"ER,A"), b"NG"),
            (lambda: host.load(b"A", new), b"NG"),
            (lambda: host.answer(b"MW,1 N 0 2"), b"NG"),
            (lambda: robot.answer("DELETE", "/files/A")[0], 507),
            (lambda: robot.answer("PUT", "/variables/N", {"value": [2], "restore": True})[0], 507),
        ])
        disk.writable(True)
        disk.free()
        equal("with room again: DL", b"OK", host.load(b"A", new))
        equal("with room again: PUT", 200, robot.answer("PUT", "/files/B", {"text": "END\n"})[0])
        equal("with room again: MW", b"OK", host.answer(b"MW,1 N 0 2"))
        equal("with room again: ER", b"OK", host.answer(b"ER,B"))
        equal("with room again: DELETE of a file that is not there", 404, robot.answer("DELETE", "/files/B")[0])
        equal("with room again: /health", "ok", robot.drive()["status"])
        equal("the disk has it all", (new, None), (disk.content("A"), disk.content("B")))
        log = robot.log()
        true("the log says it", "cannot write A to the directory" in log and "No space left on device" in log, log[-500:])
        equal("a line for each cause, not for each change", 2, log.count("to the directory of the RAM drive"))
        lasts(robot, disk, binary, "refuse")
    finally:
        robot.kill()
        disk.end()


def memory(binary):
    """With drive.when_full=memory every change happens, and what the disk lacks is told and made up for."""
    disk = Disk()
    robot = Stored(binary, disk.drive, "--set", "drive.when_full=memory")
    try:
        host = robot.host
        content = source(b"A", 20_000)
        host.load(b"GONE", content)
        disk.fill()
        equal("memory: DL on a full disk", b"OK", host.load(b"A", content))
        disk.writable(False)
        equal("memory: ER on a read-only disk", b"OK", host.answer(b"ER,GONE"))
        equal("memory: PUT", 200, robot.answer("PUT", "/files/B", {"text": "END\n"})[0])
        drive = robot.drive()
        equal("memory: /health names what a restart would lose", ["A", "B", "GONE"], drive["unkept"])
        true("memory: it is failing", drive["status"] == "failing" and robot.metric("ts3100_drive_unkept_files") == 3)
        equal("memory: the robot has it", content, host.file(b"UL,A"))
        disk.writable(True)
        disk.free()
        equal("memory: the next change", b"OK", host.load(b"C", content))
        equal("memory: and nothing is lacking any more", ("ok", []), (robot.drive()["status"], robot.drive()["unkept"]))
        lasts(robot, disk, binary, "memory")
    finally:
        robot.kill()
        disk.end()


def replaced(binary):
    """A directory that is moved away, replaced, or holds planted links."""
    folder = tempfile.mkdtemp(prefix="ts3100-")
    drive, away, theirs = (os.path.join(folder, name) for name in ("drive", "away", "theirs"))
    with open(theirs, "wb") as file:
        file.write(b"theirs")
    with Stored(binary, drive) as robot:
        host = robot.host
        for name in (".A.unfinished", "B", "..ts3100.history.unfinished"):
            os.symlink(theirs, os.path.join(drive, name))
        equal("planted links: DL of A", b"OK", host.load(b"A", b"END\n"))
        equal("planted links: DL of B", b"OK", host.load(b"B", b"END\n"))
        robot.answer("POST", "/alarms", {"number": "2-046"})
        equal("planted links: nothing was written through them", b"theirs", read(theirs))
        os.rename(drive, away)
        for made in (False, True):
            if made:
                os.mkdir(drive)
            what = "replaced" if made else "removed"
            equal("%s: DL" % what, b"NG", host.load(b"A", b"NEW\n"))
            equal("%s: ER" % what, b"NG", host.answer(b"ER,A"))
            status, answer = robot.answer("PUT", "/files/A", {"text": "NEW\n"})
            true("%s: PUT says why" % what, status == 507 and "removed or replaced" in answer, answer)
        equal("replaced: nothing was written there", [], os.listdir(drive))
        os.rmdir(drive)
        os.rename(away, drive)
        equal("put back: ER", b"OK", host.answer(b"ER,A"))
    shutil.rmtree(folder)


def limited():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def told(binary, words, *parts):
    """The command is refused at once, in words with these parts."""
    try:
        run = subprocess.run([binary, *words], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                             timeout=REFUSAL, preexec_fn=limited, check=False)
    except subprocess.TimeoutExpired as error:
        raise Failed("%s is refused within %.0f s" % (" ".join(words), REFUSAL)) from error
    if run.returncode not in (1, 2) or not all(part in run.stderr for part in parts):
        raise Failed("%s is refused with %s\n     found    %d %s" % (" ".join(words), parts, run.returncode, run.stderr))


def device(folder):
    """A device of our own that takes everything, if we may make one; otherwise the system's."""
    path = os.path.join(folder, "device")
    try:
        os.mknod(path, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
    except PermissionError:
        return "/dev/null"
    return path


def targets(binary):
    """Where a report or a snapshot is to be written."""
    folder = tempfile.mkdtemp(prefix="ts3100-")
    try:
        theirs, here = os.path.join(folder, "theirs"), os.path.join(folder, "here")
        os.mkdir(here)
        with open(theirs, "wb") as file:
            file.write(b"theirs")
        node, pipe, link = device(folder), os.path.join(here, "pipe"), os.path.join(here, "link")
        os.mkfifo(pipe)
        os.symlink(theirs, link)
        options = ("--snapshot-on-exit", "--junit", "--findings", "--coverage", "--lcov", "--report", "--transcript")
        for option in options:
            for path, part in ((node, "a device"), (pipe, "pipe"), (here, "a directory"), (link, "symbolic link")):
                told(binary, ["serve", "--ports", "auto", option, path], path, part)
        true("the device is one", stat.S_ISCHR(os.stat(node).st_mode))
        equal("what the link leads to is as before", b"theirs", read(theirs))
        equal("nothing else was made", ["link", "pipe"], sorted(os.listdir(here)))
        ok("%d targets that are no regular file are told before the run" % (4 * len(options)))
    finally:
        shutil.rmtree(folder)


def inputs(binary):
    """What is read: neither a device, which has no end, nor a pipe, which nobody writes."""
    folder = tempfile.mkdtemp(prefix="ts3100-")
    try:
        pipe = os.path.join(folder, "pipe.scol")
        os.mkfifo(pipe)
        count = 0
        for path in ("/dev/zero", pipe, folder):
            serve = ["serve", "--ports", "auto"]
            for option in ("--restore", "--load", "--scenario", "--faults", "--config", "--model", "--points"):
                told(binary, [*serve, option, path], path)
            for words in (["check", path], ["fmt", path], ["run", path], ["diff", path],
                          ["coverage", "merge", path], ["check", "--points", path, path],
                          ["ctl", "--url", "http://127.0.0.1:9", "files", "put", "A", path],
                          ["run", "--input", "ip1=" + path, path]):
                told(binary, words, path)
            count += 15
        with Emulator(binary) as robot:
            for path in ("/dev/zero", pipe):
                told(binary, ["host", "%s:%d" % robot.address("ip0"), "dl", path], path)
        ok("%d inputs that are no regular file are refused at once" % (count + 2))
    finally:
        shutil.rmtree(folder)


def enter(arguments):
    """The same again, in a mount namespace of its own; the exit code."""
    environment = {**os.environ, INSIDE: "1"}
    for namespace in NAMESPACES if shutil.which("unshare") else ():
        if subprocess.run([*namespace, "true"], capture_output=True, check=False).returncode == 0:
            return subprocess.run([*namespace, sys.executable, os.path.abspath(__file__), *arguments],
                                  env=environment, check=False).returncode
    print("FAIL a small disk needs a mount namespace: run this as root, or allow user namespaces (unshare -Urm)",
          flush=True)
    return 1


def main():
    arguments = serving(__doc__).parse_args()
    if INSIDE not in os.environ:
        return enter(sys.argv[1:])
    for part in (refuse, memory, replaced, targets, inputs):
        part(arguments.serve)
    return 0


if __name__ == "__main__":
    sys.exit(program(main))
