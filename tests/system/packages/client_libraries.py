#!/usr/bin/env python3
"""The clients for .NET, C++, npm, Java, Node and Go, as their users get them: compiled with warnings as errors, packed,
installed in a clean folder and run. Each ends with a host that talks to a robot, and a wrong host that is named.

    python3 tests/system/packages/client_libraries.py --serve target/release/ts3100 [--static STATIC_TS3100] [dotnet|cpp|npm|containers ...]

.NET is tested on Mono and, by the runtime that PyPI has, on .NET Core 3.1; an SDK is not needed. With --static the
examples for containers run in an engine as well, otherwise with `ts3100 exec` only. What apt has is installed where it
is missing; another toolchain that is missing fails its part."""

import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile
import traceback
import zipfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import container_engine  # noqa: E402
import pages  # noqa: E402
import recorded_calls  # noqa: E402
from emulator import ROOT, Emulator, surroundings  # noqa: E402
from steps import Failed, equal, ok, serving, true  # noqa: E402

CLIENTS = os.path.join(ROOT, "clients")
VERSION = "0.1.0"
RUN_TIMEOUT, BUILD_TIMEOUT = 120, 400
MONO = {"mcs": "mono-mcs", "mono": "mono-runtime", "nunit-console": "nunit-console"}
MONO_LIBRARIES = ("libmono-system-core4.0-cil", "libmono-system-net-http4.0-cil", "libnunit-framework2.6.3-cil")
NUNIT = "/usr/lib/cli/nunit.framework-2.6.3/nunit.framework.dll"
# The newest runtime that a registry of Python packages has.
DOTNET = "dotnetcore2==3.1.23"
FINDING = 'IP0: unknown command "XX" (unknown-command, error). Use a command that `ts3100 docs commands` lists, in upper case.'
LAST_TEXTS = "> IP0 XX<CR>"
TRACE = " --first unknown-command\n"


class Missing(Exception):
    """A toolchain is missing."""


def run(*command, timeout=RUN_TIMEOUT, cwd=None, **variables):
    """Exit code and output of a command. The settings of the caller must not reach the robots of the tests."""
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          errors="replace", timeout=timeout, cwd=cwd, env=surroundings(**variables))
    return done.returncode, done.stdout


def succeeds(what, *command, **more):
    """Output of a command that has to succeed."""
    code, said = run(*command, **more)
    true(what, code == 0, "exit code %d\n%s" % (code, said))
    return said


def named(what, code, said, *parts):
    """A run that failed and said these things."""
    true(what, code != 0 and all(part in said for part in parts), "exit code %d\n%s" % (code, said))


def lines(text):
    """Lines without their indentation, blank ones left out."""
    return "".join(line.strip() + "\n" for line in text.splitlines() if line.strip())


def shown(page):
    """The blocks of a page that say where they are from are in those files."""
    with open(os.path.join(ROOT, "docs", "how-to", page), encoding="utf-8") as file:
        blocks = re.findall(r"^<!-- from: (\S+) -->\n```\w+\n(.*?)^```$", file.read(), re.MULTILINE | re.DOTALL)
    true("%s shows code that is run here" % page, bool(blocks))
    for path, block in blocks:
        with open(os.path.join(ROOT, path), encoding="utf-8") as file:
            true("%s: a block of %s" % (page, path), lines(block) in lines(file.read()), block)


def plays(what, binary, folder, *player, exact=True, **more):
    """A client makes every call of the control interface by its operation."""
    recorded_calls.check(what, binary, folder, lambda *to: succeeds("%s plays the recorded calls" % what, *player, *to, **more), exact)


def need(*tools):
    """Skips what these are needed for."""
    missing = [tool for tool in tools if not shutil.which(tool)]
    if missing:
        raise Missing("%s: not installed" % ", ".join(missing))


def install_mono():
    """Mono's compiler and runtime, the runner of NUnit, and the libraries that are no dependency of them."""
    packages = [package for tool, package in MONO.items() if not shutil.which(tool)]
    packages += [name for name in MONO_LIBRARIES if not container_engine.succeeds("dpkg", "-s", name)]
    for package in packages:
        container_engine.install(package)


def dotnet(binary, folder):
    """The libraries for .NET on Mono and on .NET, under NUnit, and the packages of the tool."""
    shown("csharp.md")
    install_mono()
    source, build = os.path.join(CLIENTS, "dotnet"), os.path.join(folder, "build")
    os.mkdir(build)
    shutil.copy(NUNIT, build)

    def compiled(name, *arguments, sources):
        files = [file for pattern in sources for file in sorted(glob.glob(os.path.join(source, pattern)))]
        succeeds("%s compiles" % name, "mcs", "-langversion:7", "-warn:4", "-warnaserror", "-out:" + name, *arguments, *files, cwd=build)

    libraries = ("-r:Ts3100.Client.dll", "-r:Ts3100.Testing.dll")
    compiled("Ts3100.Client.dll", "-target:library", "-doc:Ts3100.Client.xml", "-r:System.Net.Http.dll", sources=["Ts3100.Client/*.cs"])
    compiled("Ts3100.Testing.dll", "-target:library", "-doc:Ts3100.Testing.xml", libraries[0], sources=["Ts3100.Testing/*.cs"])
    pasted("csharp.md", binary, folder)
    compiled("Checks.exe", *libraries, sources=["tests/Checks.cs"])
    compiled("Play.exe", *libraries, sources=["tests/Play.cs"])
    nunit = ("-target:library", "-define:NUNIT2", "-r:nunit.framework.dll", *libraries)
    compiled("Cell.dll", *nunit, sources=["examples/NUnitTests.cs", "examples/DialogueTest.cs"])
    compiled("Wrong.dll", *nunit, sources=["examples/NUnitTests.cs", "tests/WrongHost.cs"])

    print(succeeds("the checks on Mono", "mono", "Checks.exe", cwd=build, TS3100_BINARY=binary), end="")
    plays(".NET", binary, folder, "mono", "Play.exe", cwd=build)
    runner = ("nunit-console", "-nologo", "-nodots")
    succeeds("the NUnit example", *runner, "Cell.dll", cwd=build, TS3100_BINARY=binary)
    code, said = run(*runner, "-run:WrongHost", "Wrong.dll", cwd=build, TS3100_BINARY=binary)
    named("a wrong host under NUnit fails with its finding", code, said, FINDING, LAST_TEXTS, TRACE,
          "RN: servo power is off (start-servo-off, warning)", "Errors: 2")
    transcripts = glob.glob(os.path.join(build, "ts3100-transcripts", "*.txt"))
    equal("each failed test has its transcript", 2, len(transcripts))
    true("and each a page", all(os.path.exists(path[:-len("txt")] + "html") for path in transcripts))

    succeeds("the .NET runtime is there", sys.executable, "-m", "pip", "-q", "download", "--no-deps", "-d", folder, DOTNET)
    with zipfile.ZipFile(glob.glob(os.path.join(folder, "dotnetcore2*.whl"))[0]) as wheel:
        wheel.extractall(os.path.join(folder, "dotnet"))
    host = os.path.join(folder, "dotnet", "dotnetcore2", "bin", "dotnet")
    os.chmod(host, 0o755)
    with open(os.path.join(build, "Checks.runtimeconfig.json"), "w", encoding="ascii") as file:
        file.write('{"runtimeOptions":{"framework":{"name":"Microsoft.NETCore.App","version":"3.1.0"}}}')
    print(succeeds("the checks on .NET", host, "Checks.exe", cwd=build, TS3100_BINARY=binary, DOTNET_SYSTEM_GLOBALIZATION_INVARIANT="1"), end="")
    print(succeeds("the packages of the tool", sys.executable, os.path.join(source, "tests", "packages.py"), "--serve", binary), end="")


def cpp(binary, folder):
    """The header, by two compilers and for Windows, and its CTest example."""
    shown("cpp.md")
    windows = "x86_64-w64-mingw32-g++-posix"
    tools = ("cmake", "cmake"), ("g++", "g++"), ("clang++", "clang"), (windows, "g++-mingw-w64-x86-64-posix")
    for tool, package in tools:
        if not shutil.which(tool):
            container_engine.install(package)
    source = os.path.join(CLIENTS, "cpp")
    for compiler in ("g++", "clang++"):
        # The page is the way to build it.
        place = os.path.join(folder, compiler)
        os.mkdir(place)
        place, said = pasted("cpp.md", binary, place, CXX=compiler)
        build = os.path.join(place, "build")
        true("%s: its four tests ran" % compiler, "100% tests passed, 0 tests failed out of 4" in said, said)
        equal("%s: the log of the emulator stays out of the output of a test" % compiler, "", succeeds("%s: a test alone" % compiler,
              os.path.join(build, "dialogue_test"), TS3100_BINARY=binary))
        code, said = run(os.path.join(build, "wrong_host"), cwd=build, TS3100_BINARY=binary)
        named("%s: a wrong host fails with its finding" % compiler, code, said, FINDING, LAST_TEXTS, TRACE)
    plays("C++", binary, folder, os.path.join(folder, "g++", "page", "build", "play"))
    succeeds("it compiles for Windows", windows, "-std=c++17", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror",
             os.path.join(source, "checks.cpp"), "-o", os.path.join(folder, "checks.exe"), "-lws2_32", timeout=BUILD_TIMEOUT)


def pasted(page, binary, folder, by="packages/client_libraries", **variables):
    """The commands of a page, in a folder that looks like a clone with a built program: the folder, and what they printed."""
    place = os.path.join(folder, "page")
    os.mkdir(place)
    pages.prepare(place, binary)
    page = os.path.join(ROOT, "docs", "how-to", page)
    said = pages.run(by, binary, [page], directory=place, limit=BUILD_TIMEOUT, **variables)
    true("the page has commands", said)
    return place, "".join(said)


def npm(binary, folder):
    """The packages of npm, installed in a clean folder."""
    shown("node.md")
    need("node", "npm")
    dist, home = os.path.join(folder, "dist"), os.path.join(folder, "home")
    os.mkdir(home)
    said = succeeds("npm pack", sys.executable, os.path.join(CLIENTS, "npm", "pack.py"), "--version", VERSION, "--out", dist,
                    "x86_64-unknown-linux-gnu=" + binary)
    packages = said.split()
    with open(os.path.join(home, "package.json"), "w", encoding="ascii") as file:
        file.write('{"private":true}')
    # Offline: what is tested is what was packed, not what a registry has.
    succeeds("it installs", "npm", "install", "--offline", "--no-audit", "--no-fund", *packages, cwd=home)
    own = os.path.join(home, "node_modules", "ts3100")
    equal("the package has these files", sorted(["LICENSE-APACHE", "LICENSE-MIT", "README.md", "binary.js", "errors.js", "host.js", "index.d.ts",
                                                 "index.js", "launch.js", "operations.d.ts", "operations.js", "package.json", "trace.js"]), sorted(os.listdir(own)))
    equal("and that of the platform these", sorted(["LICENSE-APACHE", "LICENSE-MIT", "package.json", "ts3100"]),
          sorted(os.listdir(os.path.join(home, "node_modules", "@ts3100", "linux-x64"))))
    page, _ = pasted("node.md", binary, folder)
    said = succeeds("npx ts3100 --version after them", "npx", "--offline", "ts3100", "--version", cwd=page)
    true("says its version", "ts3100 " in said, said)
    said = succeeds("npx ts3100 --version", "npx", "--offline", "ts3100", "--version", cwd=home)
    true("says its version", said.splitlines()[-1].startswith("ts3100 "), said)
    launcher = os.path.join(home, "node_modules", ".bin", "ts3100")
    equal("the launcher passes the exit code on", 2, run(launcher, "serve", "--no-such-option", cwd=home)[0])
    with_launcher(launcher)
    for file in os.listdir(os.path.join(CLIENTS, "npm", "tests")):
        shutil.copy(os.path.join(CLIENTS, "npm", "tests", file), home)
    print(succeeds("start() under Node's test runner", "node", "--test", "cell.test.mjs", "dialogue.test.mjs", cwd=home), end="")
    # A number of JavaScript has 53 bits.
    plays("Node", binary, folder, "node", "play.mjs", exact=False, cwd=home)
    code, said = run("node", "--test", "wrong_host.test.mjs", cwd=home)
    named("a wrong host fails with its finding", code, said, FINDING, LAST_TEXTS, TRACE)
    succeeds("TypeScript is there", "npm", "install", "--no-save", "--no-audit", "--no-fund", "typescript@5", "@types/node@22", cwd=home)
    succeeds("the types hold", os.path.join(home, "node_modules", ".bin", "tsc"), "--noEmit", "--strict", "--module", "nodenext",
             "--target", "es2022", "types.ts", cwd=home)
    shutil.rmtree(os.path.join(home, "node_modules", "@ts3100"))
    code, said = run(launcher, "--version", cwd=home)
    equal("without its binary it says what to do", (126, "error: cannot find ts3100: the package @ts3100/linux-x64 is not installed; "
          "install without --omit=optional, or set TS3100_BINARY to its path\n"), (code, said))
    succeeds("TS3100_BINARY names another one", launcher, "--version", TS3100_BINARY=binary)


def with_launcher(launcher):
    """A robot started by the launcher ends with it, in order."""
    with Emulator(launcher) as robot:
        robot.stop()
        true("the emulator has ended in order, not been killed", "ended" in robot.log(), robot.log())


# The command of each example, and what its output has when three tests have passed.
EXAMPLES = {"node": (["npm", "test"], "# pass 3"), "go": (["go", "test", "-count=1", "-v", "./..."], "--- PASS: TestAWrongHostIsNamed"),
            "java": (["mvn", "-B", "test"], "Tests run: 3, Failures: 0, Errors: 0, Skipped: 0")}


def containers(binary, folder, static):
    """The examples with testcontainers: around them `ts3100 exec`, and in an engine where a static binary is at hand."""
    need("npm", "go", "mvn")
    place, printed = pasted("node.md", binary, folder, "packages/client_libraries:containers")
    for name, (_, passed) in EXAMPLES.items():
        true("%s: its three tests ran with ts3100 exec" % name, passed in printed, printed)
    if not static:
        print("     no --static binary: not run in a container engine")
        return
    with container_engine.docker():
        container_engine.build(static)
        for name, (command, passed) in EXAMPLES.items():
            # The reaper of testcontainers is an image of a registry that is not in reach everywhere.
            said = succeeds("%s: with a container" % name, *command, cwd=os.path.join(place, "clients", name), timeout=BUILD_TIMEOUT,
                            TS3100_IMAGE=container_engine.IMAGE, TESTCONTAINERS_RYUK_DISABLED="true")
            true("%s: its three tests ran in it" % name, passed in said, said)


def main():
    parser = serving(__doc__)
    parser.add_argument("--static", metavar="TS3100", help="one without shared libraries, for a container")
    parser.add_argument("parts", nargs="*", metavar="PART", help="dotnet, cpp, npm or containers; all of them if none is named")
    options = parser.parse_args()
    binary = options.serve
    parts = {"dotnet": dotnet, "cpp": cpp, "npm": npm, "containers": lambda *of: containers(*of, options.static)}
    counts = {"passed": 0, "failed": 0}
    for name in options.parts or parts:
        print("-- %s" % name, flush=True)
        try:
            with tempfile.TemporaryDirectory() as folder:
                parts[name](binary, folder)
            ok(name)
            counts["passed"] += 1
        except Missing as reason:
            print("FAIL %s: %s" % (name, reason), flush=True)
            counts["failed"] += 1
        except (Failed, OSError, subprocess.TimeoutExpired) as error:
            print("FAIL %s: %s" % (name, error if isinstance(error, Failed) else traceback.format_exc()), flush=True)
            counts["failed"] += 1
    print("%(passed)d passed, %(failed)d failed" % counts)
    return counts["failed"] > 0


if __name__ == "__main__":
    sys.exit(main())
