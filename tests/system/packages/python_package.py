#!/usr/bin/env python3
"""The Python package, as those who install it get it: the wheel is built around the given program, its contents are listed, and
it is installed into clean virtual environments. There its commands, its types, its tests and the speed of its fixture are tried.

    python3 tests/system/packages/python_package.py --serve target/release/ts3100 [--python PYTHON ...] [--out DIR]

`--python` gives further interpreters for the tests of the package; `--out` keeps the wheel."""

import hashlib
import importlib.util
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import types
import zipfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import pages  # noqa: E402
import recorded_calls  # noqa: E402
from emulator import ROOT, Emulator, surroundings  # noqa: E402
from steps import Failed, equal, ok, program, serving, true  # noqa: E402

PACKAGE = os.path.join(ROOT, "clients", "python")
# Versions for Python 3.9 and newer.
BUILD = ["hatchling==1.27.0", "build==1.4.4", "uv==0.13.9"]
TEST = ["pytest==8.4.2", "pytest-xdist==3.8.0", "pyserial==3.5"]
TYPES = ["mypy==1.19.1", "types-pyserial==3.5.0.20251001"]
LIMIT = 600
MODULES = ["__init__", "__main__", "binary", "channel", "closing", "errors", "host", "operations", "protocol", "pytest_plugin", "records", "robot"]
LICENCES = ["LICENSE-APACHE", "LICENSE-MIT"]
# Tests of each kind in the figures, the calls of one that only calls, and for how many calls a fresh robot may take. A time depends
# on the hour; a fresh robot and a call take longer together.
COUNT, CALLS, MOST_CALLS = 500, 3, 8.0
# Of several runs the quickest counts: the others tell about the machine.
RUNS = 3

# Every answer has its type, blocking and awaited.
TYPED = """
from typing import List, Optional, Tuple, Union
import ts3100

def blocking(host: ts3100.Host, robot: ts3100.Robot) -> None:
    status: ts3100.Status = host.status()
    files: List[ts3100.FileEntry] = host.directory()
    content: bytes = host.upload("PICK")
    limit: Optional[int] = status.speed_limit
    values: Tuple[Union[int, float], ...] = host.read_variable("N", ts3100.VariableType.INTEGER)
    nothing: None = host.write_variable("N", [3], restore=True)
    servo: bool = robot.servo
    robot.override = 30

async def awaited(host: ts3100.AsyncHost) -> None:
    status: ts3100.Status = await host.status()
    files: List[ts3100.FileEntry] = await host.directory()
"""
MISTYPED = """
import ts3100

def wrong(host: ts3100.Host, other: ts3100.AsyncHost, robot: ts3100.Robot) -> None:
    a: int = host.status()
    b: ts3100.Status = other.status()
    host.upload(3)
    host.select()
    robot.override = "30"
    robot.srvo = True
"""

# The same run has both kinds of tests, so that both meet the same machine.
FIGURES = """
import time
import pytest

spent = {}

@pytest.fixture
def empty():
    yield

@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    begun = time.perf_counter()
    result = yield
    spent.setdefault(item.originalname, []).append(time.perf_counter() - begun)
    return result

def pytest_terminal_summary(terminalreporter):
    # The first of each kind starts the process or imports what is missing.
    for name, times in spent.items():
        terminalreporter.write_line("FIGURE %s %.6f" % (name, sum(times[1:]) / len(times[1:])))
"""
FIGURED = """
import pytest
from ts3100 import Robot

@pytest.mark.parametrize("number", range(COUNT))
def test_empty(empty, number):
    pass

@pytest.mark.parametrize("number", range(COUNT))
def test_robot(robot, number):
    pass

@pytest.fixture(scope="module")
def other():
    with Robot.start() as robot:
        yield robot

@pytest.mark.parametrize("number", range(COUNT))
def test_calls(other, number):
    for _ in range(CALLS):
        other.request("GET", "/health")
"""


def run(*command, where=None, code=0, **environment):
    """A command's output; its exit code has to be this one."""
    variables = {name: value for name, value in os.environ.items() if not name.startswith(("TS3100_", "PYTEST_", "PYTHON"))}
    done = subprocess.run(command, cwd=where, env={**variables, **environment}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, timeout=LIMIT)
    if done.returncode != code:
        raise Failed("%s\n     expected exit code %d\n     found    %d\n%s" % (" ".join(command), code, done.returncode, done.stdout))
    return done.stdout


def environment(folder, python, *packages):
    """A clean virtual environment with these packages: its folder of programs."""
    run(python, "-m", "venv", folder)
    programs = os.path.join(folder, "bin")
    run(os.path.join(programs, "pip"), "install", "-q", "--disable-pip-version-check", *packages)
    return programs


def digest(data):
    return hashlib.sha256(data).hexdigest()


def sections(program):
    """The names of the sections of an ELF program."""
    (table,) = struct.unpack_from("<Q", program, 40)
    size, count, names = struct.unpack_from("<HHH", program, 58)
    headers = [struct.unpack_from("<IIQQQQ", program, table + size * number) for number in range(count)]
    start = headers[names][4]
    return {program[start + header[0]:program.index(b"\0", start + header[0])].decode() for header in headers}


def build(programs, binary, out):
    """The wheel around this program, without cargo."""
    run(os.path.join(programs, "python"), "-m", "build", "--wheel", "--no-isolation", "--outdir", out, PACKAGE,
        TS3100_BINARY=binary, PATH=programs + os.pathsep + "/usr/bin:/bin")
    (wheel,) = os.listdir(out)
    return os.path.join(out, wheel)


def contents(wheel, binary):
    """Nothing is in the wheel but the program, the modules, licences and metadata."""
    with open(os.path.join(ROOT, "Cargo.toml"), encoding="utf-8") as file:
        version = re.search('^version = "(.*)"', file.read(), re.MULTILINE).group(1)
    name = "ts3100-%s" % version
    info, program = name + ".dist-info/", name + ".data/scripts/ts3100"
    expected = {program, "ts3100/py.typed", *("ts3100/%s.py" % module for module in MODULES),
                *(info + file for file in ("METADATA", "WHEEL", "RECORD", "entry_points.txt")),
                *(info + "licenses/" + licence for licence in LICENCES)}
    with zipfile.ZipFile(wheel) as archive:
        for entry in sorted(archive.infolist(), key=lambda entry: entry.filename):
            print("     %9d  %s" % (entry.file_size, entry.filename))
        equal("the wheel has the program, the modules, licences and metadata, and nothing else",
              sorted(expected), sorted(archive.namelist()))
        with open(binary, "rb") as file:
            original = file.read()
        equal("its program is the one given", digest(original), digest(archive.read(program)))
        for licence in LICENCES:
            with open(os.path.join(ROOT, licence), "rb") as file:
                equal("%s is that of the project" % licence, digest(file.read()), digest(archive.read(info + "licenses/" + licence)))
        metadata = archive.read(info + "METADATA").decode()
        tag = re.search("^Tag: (.*)$", archive.read(info + "WHEEL").decode(), re.MULTILINE).group(1)
    unwanted = {section for section in sections(original) if section == ".symtab" or section.startswith(".debug")}
    equal("the program is stripped", set(), unwanted)
    true("it needs nothing else", "Requires-Dist" not in re.sub("Requires-Dist: .*; extra == .*", "", metadata), metadata)
    true("it is for every Python 3 on its platform: %s" % tag, re.match("py3-none-(manylinux|musllinux)_", tag), tag)


def build_hook(folder, binary):
    """Where the program of a wheel comes from, and which platform each kind of program is for."""
    stub = types.ModuleType("interface")
    stub.BuildHookInterface = dict
    names = "hatchling.builders.hooks.plugin".split(".")
    for count in range(1, len(names) + 1):
        sys.modules.setdefault(".".join(names[:count]), types.ModuleType(names[count - 1]))
    sys.modules["hatchling.builders.hooks.plugin.interface"] = stub
    spec = importlib.util.spec_from_file_location("hatch_build", os.path.join(PACKAGE, "hatch_build.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def elf(machine, *types_of_segments, rest=b""):
        head = bytearray(64)
        head[:6] = b"\x7fELF\x02\x01"
        struct.pack_into("<H", head, 18, machine)
        struct.pack_into("<Q", head, 32, 64)
        struct.pack_into("<HH", head, 54, 56, len(types_of_segments))
        return bytes(head) + b"".join(struct.pack("<I", kind).ljust(56, b"\0") for kind in types_of_segments) + rest

    def pe(machine):
        return b"MZ".ljust(60, b"\0") + struct.pack("<I", 64) + b"PE\0\0" + struct.pack("<H", machine)

    static = "manylinux_2_17_%s.manylinux2014_%s.musllinux_1_1_%s"
    for what, content, tag in (
        ("a static program for x86-64", elf(62, 1), static % (("x86_64",) * 3)),
        ("a static program for ARM64", elf(183, 1), static % (("aarch64",) * 3)),
        ("a program with glibc", elf(62, 1, 3, rest=b"\0GLIBC_2.9\0GLIBC_2.28\0"), "manylinux_2_28_x86_64"),
        ("a program with another libc", elf(62, 3), "linux_x86_64"),
        ("a program for Windows", pe(0x8664), "win_amd64"),
        ("a program for macOS", b"\xcf\xfa\xed\xfe\x0c\x00\x00\x01", "macosx_11_0_arm64"),
    ):
        equal("%s: %s" % (what, tag), tag, module.platform_tag(content))
    try:
        module.platform_tag(b"#!/bin/sh\n")
        raise Failed("a script is taken for a program")
    except SystemExit as error:
        true("a script is no program", "is none for Linux" in str(error), str(error))

    # Without TS3100_BINARY cargo builds: the one here only says what it was asked for, and where.
    tools, target = os.path.join(folder, "tools"), os.path.join(folder, "target")
    os.makedirs(tools)
    with open(os.path.join(tools, "cargo"), "w", encoding="utf-8") as file:
        file.write('#!/bin/sh\nset -e\necho "$PWD: $*" > "%s/asked"\nmkdir -p "$CARGO_TARGET_DIR/release"\n'
                   'cp "%s" "$CARGO_TARGET_DIR/release/ts3100"\n' % (folder, binary))
    os.chmod(file.name, 0o755)
    return tools, target


def from_source(programs, folder, binary):
    """`pip install` from a checkout has cargo build the program; without cargo it says what to do."""
    tools, target = build_hook(folder, binary)
    pip = [os.path.join(programs, "pip"), "install", "--disable-pip-version-check", "--no-build-isolation", "--no-deps",
           "--target", os.path.join(folder, "source"), PACKAGE]
    run(*pip, PATH=os.pathsep.join([tools, programs, "/usr/bin", "/bin"]), CARGO_TARGET_DIR=target)
    with open(os.path.join(folder, "asked"), encoding="utf-8") as file:
        equal("pip install from a checkout has cargo build it",
              "%s: build --release --locked --package ts3100-emulator\n" % ROOT, file.read())
    said = run(*pip, code=1, PATH=os.pathsep.join([programs, "/usr/bin", "/bin"]))
    true("without cargo it says what it needs", "it needs cargo and a checkout of the project, or TS3100_BINARY" in said, said)
    said = run(*pip, code=1, TS3100_BINARY="/no/such")
    true("a program that is not there", "TS3100_BINARY is /no/such, which is not a file" in said, said)
    said = run(*pip, code=1, TS3100_BINARY="no/such")
    true("a path from the directory of pip", "TS3100_BINARY is no/such; give the whole path" in said, said)


def served(command, what, script, **variables):
    """`serve` by this command: it answers a host, and ends well with SIGTERM."""
    *prefix, binary = command
    with Emulator(binary, prefix=prefix, env=surroundings(**variables)) as emulator:
        equal("%s serve answers a host" % what, "OK\n", run(script, "host", "%s:%d" % emulator.address("ip0"), "so"))
        emulator.stop(within=30)


def commands(programs, uv, wheel, folder):
    """The console script, `python -m ts3100`, `pip install --target`, and uvx."""
    script, python = os.path.join(programs, "ts3100"), os.path.join(programs, "python")
    said = run(script, "--version")
    true("the console script runs: %s" % said.strip(), re.fullmatch(r"ts3100 \d+\.\d+\.\d+.*\n", said), said)
    equal("python -m ts3100 too", said, run(python, "-m", "ts3100", "--version"))
    served([script], "ts3100", script)
    there = os.path.join(folder, "there")
    run(os.path.join(programs, "pip"), "install", "-q", "--no-index", "--target", there, wheel)
    found = run(sys.executable, "-c", "import ts3100; print(ts3100.find_binary())", PYTHONPATH=there, PATH="/usr/bin:/bin")
    equal("the program is found after pip install --target", os.path.join(there, "bin", "ts3100"), found.strip())
    cache = {"UV_CACHE_DIR": os.path.join(folder, "cache"), "UV_NO_INDEX": "1", "UV_FIND_LINKS": os.path.dirname(wheel)}
    equal("uvx ts3100 --version", said, run(os.path.join(uv, "uvx"), "-q", "ts3100", "--version", **cache))
    served([os.path.join(uv, "uvx"), "-q", "ts3100"], "uvx ts3100", script, **cache)


def typed(programs, folder):
    """mypy sees the types of the installed package."""
    mypy = [os.path.join(programs, "mypy"), "--strict", "--cache-dir", os.path.join(folder, "mypy")]
    run(*mypy, "--config-file", os.path.join(PACKAGE, "pyproject.toml"), where=PACKAGE)
    ok("mypy --strict finds nothing in the package and its tests")
    for name, code in (("typed", TYPED), ("mistyped", MISTYPED)):
        with open(os.path.join(folder, name + ".py"), "w", encoding="utf-8") as file:
            file.write(code)
    run(*mypy, "typed.py", where=folder)
    said = run(*mypy, "mistyped.py", where=folder, code=1)
    equal("a user's program has its types, and each of six mistakes is found", [5, 6, 7, 8, 9, 10],
          [int(line) for line in re.findall(r"^mistyped\.py:(\d+): error", said, re.MULTILINE)])


def tests(programs, folder):
    """The tests of the package against the installed wheel: one after the other, and in parallel."""
    for arguments in ([], ["-n2"]):
        said = run(os.path.join(programs, "python"), "-m", "pytest", "-q", "-p", "no:cacheprovider", "--basetemp",
                   os.path.join(folder, "pytest"), *arguments, where=PACKAGE)
        ok("the tests of the package %s: %s" % (" ".join(arguments), said.strip().splitlines()[-1]))


def plays(programs, folder, binary):
    """The client makes every call of the control interface by its operation."""
    recorded_calls.check("Python", binary, folder, lambda *to: run(os.path.join(programs, "python"), os.path.join(PACKAGE, "tests", "play.py"), *to))


def page(programs, folder):
    """docs/how-to/pytest.md and the README of the package: their files, and what the page says of their run."""
    with open(os.path.join(ROOT, "docs", "how-to", "pytest.md"), encoding="utf-8") as file:
        text = file.read()
    where = os.path.join(folder, "page")
    os.makedirs(where)
    files = re.findall(r"^```(?:python|toml)\n# (\S+)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    late, shown = re.findall(r"^```text\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    (dialogue,) = (code for name, code in files if name == "test_dialogue.py")
    files.append(("test_late.py", dialogue.replace('        channel.send_line("62.5")\n', "")))
    files.append(("pick.scol", "PROGRAM PICK\nEND\n"))
    with open(os.path.join(PACKAGE, "README.md"), encoding="utf-8") as file:
        files += [("test_readme.py", code) for code in re.findall(r"^```python\n(.*?)^```", file.read(), re.MULTILINE | re.DOTALL)]
    for name, code in files:
        with open(os.path.join(where, name), "w", encoding="utf-8") as file:
            file.write(code)
    pytest = [os.path.join(programs, "python"), "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    ran = sorted(name for name, _ in files if name.startswith("test_") and name != "test_late.py")
    equal("these tests are shown", ["test_cell.py", "test_dialogue.py", "test_my_host.py", "test_protocol.py", "test_readme.py"], ran)
    # The configuration of the page is for a program of its own; the tests of the page are for the plain one.
    os.rename(os.path.join(where, "pyproject.toml"), os.path.join(where, "kept.toml"))
    said = run(*pytest, "test_cell.py", "test_dialogue.py", "test_protocol.py", "test_readme.py", where=where)
    true("the tests of the page and of the README pass", "6 passed" in said, said)
    said = run(*pytest, "test_late.py", where=where, code=1)
    true("a line that does not come is said as the page shows", " ".join(late.split()) in " ".join(said.split()), said)
    said = run(*pytest, "test_my_host.py", where=where, code=1)
    form = re.escape(shown).replace(re.escape("..."), ".*")
    true("and the wrong host fails as the page shows", re.search(form, said, re.DOTALL), said)
    os.rename(os.path.join(where, "kept.toml"), os.path.join(where, "pyproject.toml"))
    run(*pytest, "test_my_host.py", where=where, code=1)
    equal("its configuration is taken", [".html", ".txt"], sorted(os.path.splitext(name)[1] for name in os.listdir(os.path.join(where, "traces"))))


def pasted(programs, binary):
    """Commands of the pages that need pytest or pip, in the environment of the user: the package is installed once more, from a clone."""
    pages.run("packages/python_package", binary, path=[programs], PIP_DISABLE_PIP_VERSION_CHECK="1",
              PYTEST_ADDOPTS="-p no:cacheprovider --ignore=clients --ignore=packaging")


def figures(programs, folder):
    """What a fresh robot adds to a test."""
    where = os.path.join(folder, "figures")
    os.makedirs(where)
    for name, code in (("conftest.py", FIGURES), ("test_figures.py", FIGURED.replace("COUNT", str(COUNT)).replace("CALLS", str(CALLS)))):
        with open(os.path.join(where, name), "w", encoding="utf-8") as file:
            file.write(code)
    added = []
    for _ in range(RUNS):
        said = run(os.path.join(programs, "python"), "-m", "pytest", "-q", "-p", "no:cacheprovider", where=where)
        mean = {name: 1000 * float(value) for name, value in re.findall(r"^FIGURE (\S+) (\S+)", said, re.MULTILINE)}
        call = (mean["test_calls"] - mean["test_empty"]) / CALLS
        added.append((mean["test_robot"] - mean["test_empty"]) / call)
        print("     %d tests each: %.3f ms with an empty fixture, %.3f ms with a fresh robot, %.3f ms a call: as %.1f calls"
              % (COUNT, mean["test_empty"], mean["test_robot"], call, added[-1]), flush=True)
    true("a fresh robot takes no longer than %.0f calls: as %.1f" % (MOST_CALLS, min(added)), min(added) < MOST_CALLS, added)


def main():
    parser = serving(__doc__)
    parser.add_argument("--python", nargs="*", default=[], help="further interpreters for the tests of the package")
    parser.add_argument("--out", metavar="DIR", help="keep the wheel here")
    arguments = parser.parse_args()
    binary = os.path.realpath(arguments.serve)
    folder = tempfile.mkdtemp()
    try:
        builder = environment(os.path.join(folder, "build"), sys.executable, *BUILD)
        wheel = build(builder, binary, os.path.join(folder, "wheel"))
        contents(wheel, binary)
        from_source(builder, folder, binary)
        user = environment(os.path.join(folder, "user"), sys.executable, wheel, *TEST, *TYPES)
        commands(user, builder, wheel, folder)
        typed(user, folder)
        plays(user, folder, binary)
        page(user, folder)
        tests(user, folder)
        figures(user, folder)
        pasted(user, binary)
        for number, python in enumerate(arguments.python):
            tests(environment(os.path.join(folder, "python%d" % number), python, wheel, *TEST), folder)
        if arguments.out:
            os.makedirs(arguments.out, exist_ok=True)
            shutil.copy(wheel, arguments.out)
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    sys.exit(program(main))
