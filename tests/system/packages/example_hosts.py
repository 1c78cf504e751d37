#!/usr/bin/env python3
"""The example clients, as their reader runs them: the Python host and the C# host of `clients/`, and the C# program
printed in docs/how-to/csharp.md, each compiled and run against an emulator, over IP0 and IP1 and over HOST and COM1 as
bare TCP. What they printed, what they left on the RAM drive, and their exit codes have to be right.

    python3 tests/system/packages/example_hosts.py --serve target/release/ts3100

The C# compiler is Mono's mcs; where it is missing it is installed by apt, which needs root or sudo and is said."""

import os
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import container_engine  # noqa: E402
from emulator import ROOT, Emulator  # noqa: E402
from steps import equal, program, serving, true  # noqa: E402

PACKAGES = ("mono-mcs", "mono-runtime", "libmono-system-core4.0-cil")
RUN_TIMEOUT = 60
# What both hosts say of the same job; only the name of their file differs.
SAID = """SO: servo on
DL: {size} bytes in 2 texts
UL: the same bytes
SL: {name}
the robot asks: HOW FAR?
SU: running
the robot says: THERE      62.500
SF: servo on, motion 0, 0 alarms, X 400.0 Y 62.5 Z 200.0
BR: servo off
"""
# What the program of the page says.
PAGE_SAID = """HOW FAR?
THAT IS       2.500
MODE:external(ethernet)/cycle FILE:ASK1 OVRD:100% LSPEED:100% MACHINE:free STATUS:stop(reset)
"""


def install_compiler():
    """Mono's C# compiler and what runs its programs; installed when they are not there."""
    if not (shutil.which("mcs") and shutil.which("mono")):
        for package in PACKAGES:
            container_engine.install(package)


def compiled(source, folder):
    """A C# source as the command that runs it; a warning is an error."""
    program = os.path.join(folder, os.path.splitext(os.path.basename(source))[0] + ".exe")
    done = subprocess.run(["mcs", "-warn:4", "-warnaserror", "-out:" + program, source],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    true("%s compiles" % os.path.relpath(source, ROOT if source.startswith(ROOT) else folder),
         done.returncode == 0, done.stdout)
    return ["mono", program]


def page_blocks(name, language):
    """The fenced blocks of this language in docs/how-to/NAME."""
    with open(os.path.join(ROOT, "docs", "how-to", name), encoding="utf-8") as page:
        return re.findall(r"^```%s\n(.*?)^```$" % language, page.read(), re.MULTILINE | re.DOTALL)


def run(command, *addresses):
    """A client's run: exit code, stdout, stderr."""
    done = subprocess.run([*command, *addresses], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          timeout=RUN_TIMEOUT)
    return done.returncode, done.stdout, done.stderr


def address(pair):
    """HOST:PORT."""
    return "%s:%d" % pair


def over_ethernet(binary, what, command, name, folder):
    """Over IP0 and IP1: the job, twice, and what it left; then a robot that refuses, and nobody there."""
    drive = os.path.join(folder, name)
    with Emulator(binary, "--drive", drive) as robot:
        ways = (address(robot.address("ip0")), address(robot.address("ip1")))
        for time in ("first", "second"):
            code, said, complaint = run(command, *ways)
            equal("%s over IP0 and IP1, the %s time: it ends well" % (what, time), (0, ""), (code, complaint))
            with open(os.path.join(drive, name), "rb") as file:
                stored = file.read()
            equal("and says what happened", SAID.format(size=len(stored), name=name), said)
            true("and its program is on the drive", b"PROGRAM %s\n" % name.encode() in stored, stored)
        robot.stop()
        code, said, complaint = run(command, *ways)
        equal("nobody there: exit code 1, nothing on stdout", (1, ""), (code, said))
    with Emulator(binary, "--key-switch", "teaching") as robot:
        code, said, complaint = run(command, address(robot.address("ip0")), address(robot.address("ip1")))
        equal("a robot in TEACHING: exit code 1, and why", (1, "", "SO is answered by NG\n"), (code, said, complaint))
    equal("without addresses: exit code 2", 2, run(command)[0])


def over_serial(binary, what, command, name):
    """Over HOST and COM1 as bare TCP."""
    with Emulator(binary, "--control-right", "rs232c", "--serial-host-tcp", "127.0.0.1:0", "--serial-com1-tcp", "127.0.0.1:0") as robot:
        ways = [robot.ready["serial"][line].split("://")[-1] for line in ("host", "com1")]
        code, said, complaint = run(command, *ways, "COM1")
        equal("%s over HOST and COM1: it ends well" % what, (0, ""), (code, complaint))
        equal("and says what happened", SAID.format(size=re.search(r"DL: (\d+)", said).group(1), name=name), said)


def page_program(binary, folder):
    """The C# program of docs/how-to/csharp.md and the SCOL program that it names."""
    programs = [block for block in page_blocks("csharp.md", "csharp") if "static void Main" in block]
    scol = page_blocks("serial-ports.md", "text")
    equal("docs/how-to/csharp.md shows one C# program", 1, len(programs))
    source = os.path.join(folder, "Ask.cs")
    with open(source, "w", encoding="utf-8") as file:
        file.write(programs[0])
    command = compiled(source, folder)
    load = os.path.join(folder, "ask1.scol")
    with open(load, "w", encoding="utf-8") as file:
        file.write(scol[0].replace("PROGRAM ASK", "PROGRAM ASK1").replace("COM1", "IP1"))
    with Emulator(binary, "--load", load) as robot:
        code, said, complaint = run(command, *(str(robot.ports[channel]) for channel in ("ip0", "ip1")))
        equal("the C# program of the page ends well", (0, ""), (code, complaint))
        equal("and says what the page says", PAGE_SAID, said)


def main():
    binary = serving(__doc__).parse_args().serve
    install_compiler()
    with tempfile.TemporaryDirectory() as folder:
        hosts = {
            "PYHOST": ("host.py", [sys.executable, os.path.join(ROOT, "clients", "python", "host.py")]),
            "CSHOST": ("Host.cs", compiled(os.path.join(ROOT, "clients", "csharp", "Host.cs"), folder)),
        }
        for name, (what, command) in hosts.items():
            over_ethernet(binary, what, command, name, folder)
            over_serial(binary, what, command, name)
        page_program(binary, folder)


if __name__ == "__main__":
    sys.exit(program(main))
