#!/usr/bin/env python3
"""The packages of a release, made by packaging/release.py from programs that it built, and installed as users install them.

    python3 tests/system/packages/release_packages.py --programs DIR [--tools target/tools] [--again PROGRAM]

DIR has TARGET/ts3100 of `packaging/release.py build`: the one of this machine at least. Each program is started and asked
for its status: for another processor by qemu, for Windows by Wine. `--again` is the program of this machine from another
checkout, to compare. Needs apt for what is missing, root or sudo for a port below 1024, npm and go; publishes nothing."""

import argparse
import functools
import glob
import hashlib
import http.server
import json
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import tomllib
import tty
import zipfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", "packaging"))
import verify  # noqa: E402
from container_engine import ROOT, ROOT_COMMAND, run  # noqa: E402
from emulator import Emulator  # noqa: E402
from steps import Failed, equal, program, true  # noqa: E402
from transport import Descriptor  # noqa: E402
from wire import Host  # noqa: E402

RELEASE = os.path.join(ROOT, "packaging", "release.py")
ACTIONLINT = "github.com/rhysd/actionlint/cmd/actionlint@v1.7.12"
SCHEMAS = "check-jsonschema==0.33.0"
MINE = platform.machine() + "-unknown-linux-musl"
# How a program is started that is not for this machine.
BY = {"aarch64-unknown-linux-musl": ["qemu-aarch64-static"], "x86_64-unknown-linux-musl": ["qemu-x86_64-static"],
      "x86_64-pc-windows-gnu": ["wine"]}
MINGW = "x86_64-w64-mingw32-g++-posix"
MEANS = {MINGW: ["g++-mingw-w64-x86-64-posix"], "qemu-aarch64-static": ["qemu-user-static"],
         "qemu-x86_64-static": ["qemu-user-static"], "wine": ["wine", "wine64"], "shellcheck": ["shellcheck"],
         "setpriv": ["util-linux"], "systemd-analyze": ["systemd"]}
# Wine 8 lacks the library from which Rust takes its random numbers since Windows 10. This one takes them from where they were.
PRNG = """
__declspec(dllimport) unsigned char __stdcall SystemFunction036(void *buffer, unsigned long length);
__declspec(dllexport) int __stdcall ProcessPrng(unsigned char *buffer, unsigned long long length) {
    return SystemFunction036(buffer, (unsigned long)length);
}
int __stdcall DllMainCRTStartup(void *module, unsigned long reason, void *reserved) { return 1; }
"""
WINE_TIMEOUT = 120


def need(*commands):
    """Installs what is missing."""
    packages = [package for command in commands if not shutil.which(command) for package in MEANS[command]]
    if packages:
        run(*ROOT_COMMAND, "apt-get", "update", "-q")
        run(*ROOT_COMMAND, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "install", "-y", "-q", "--no-install-recommends",
            *packages)


def ran(*command, **variables):
    """Exit code and output of a command."""
    done = subprocess.run(command, env={**os.environ, **variables}, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False)
    return done.returncode, done.stdout


def sums(folder):
    """SHA256SUMS of a folder: {name: sum}."""
    with open(os.path.join(folder, "SHA256SUMS"), encoding="ascii") as file:
        return dict(reversed(line.split()) for line in file)


def strictness(tools, scratch):
    """What `verify` refuses of a program: symbols, another way of linking, and paths of the machine that built it."""
    need(MINGW)
    source, program = os.path.join(scratch, "small.c"), os.path.join(scratch, "small.exe")
    with open(source, "w", encoding="ascii") as file:
        file.write("static int twice(int n) { return n * 2; }\nint main(int n, char **v) { return (v, twice)(n); }\n")
    zig = [os.path.join(tools, "zig", "bin", "python"), "-m", "ziglang", "cc", "-target", "aarch64-macos"]
    for system, compiler in (("Linux", ["cc"]), ("macOS", zig), ("Windows", [MINGW])):
        for more, expected in (([], True), (["-s"], False)):
            run(*compiler, "-O1", *more, "-o", program, source)
            with open(program, "rb") as file:
                found = verify.unstripped(file.read())
            equal("a program for %s %s" % (system, found or "is stripped"), expected, bool(found))
    for linked, expected in (("-pie", []), ("-no-pie", ["has a fixed address"])):
        run("cc", linked, "-s", "-o", program, source)
        with open(program, "rb") as file:
            found = [problem for problem in verify.mislinked(file.read()) if "address" in problem]
        equal("a program linked with %s" % linked, expected, found)
    equal("paths of a machine are found", ["names /home/me/x.rs", "names C:\\Users\\me"],
          verify.foreign_paths(b"\0/home/me/x.rs\0/cargo/y.rs\0C:\\Users\\me\0"))


def packages(programs, tools, scratch):
    """All packages, made twice, and listed."""
    dist, second = os.path.join(scratch, "dist"), os.path.join(scratch, "second")
    for out in (dist, second):
        run(sys.executable, RELEASE, "--tools", tools, "pack", "--out", out, programs)
    print(run(sys.executable, RELEASE, "--tools", tools, "verify", dist), flush=True)
    equal("the packages, made twice, are the same", sums(dist), sums(second))
    strictness(tools, scratch)
    # verify has to notice: something foreign in a package, a package that was replaced.
    shutil.copy(os.path.join(ROOT, "Cargo.toml"), os.path.join(second, "ts3100.hpp"))
    os.rename(os.path.join(second, "install.sh"), os.path.join(second, "notes.txt"))
    code, said = ran(sys.executable, RELEASE, "--tools", tools, "verify", second)
    true("verify refuses what is not a release", code == 1 and "ts3100.hpp is not the file that SHA256SUMS has" in said
         and "notes.txt" in said, said)
    return dist


def answers(name, binary, *prefix, stop=signal.SIGTERM):
    """The program starts, answers SU with STX and without, and ends cleanly."""
    with Emulator(binary, "--servo-on", prefix=prefix) as emulator:
        for stx in (True, False):
            host = Host(emulator.address("ip0"), stx)
            status = host.status()
            true("%s answers SU %s STX" % (name, "with" if stx else "without"), len(status) == 6, status)
            host.close()
        emulator.stop(by=stop, within=20)


def com_port(program):
    """HOST on a COM port, which is a terminal to Wine; the host has its other end."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    os.symlink(os.ttyname(theirs), os.path.join(os.environ["WINEPREFIX"], "dosdevices", "com10"))
    with Emulator(program, "--serial-host", "COM10", "--control-right", "rs232c", prefix=["wine"]) as emulator:
        host = Host(Descriptor(ours), True)
        equal("HOST on COM10 answers SU", "external(host)/cycle", host.status()["MODE"])
        host.command(b"SO")
        emulator.stop(by=signal.SIGINT, within=20)


def windows(program, tools, scratch):
    """The program for Windows by Wine."""
    need("wine")
    folder = os.path.join(scratch, "windows")
    os.makedirs(folder)
    shutil.copy(program, folder)
    source = os.path.join(folder, "prng.c")
    with open(source, "w", encoding="ascii") as file:
        file.write(PRNG)
    run(os.path.join(tools, "zig", "bin", "python"), "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu", "-nostdlib", "-shared",
        "-s", "-o", os.path.join(folder, "bcryptprimitives.dll"), source, "-ladvapi32")
    os.environ.update(WINEPREFIX=os.path.join(scratch, "wine"), WINEDEBUG="-all", DISPLAY="")
    subprocess.run(["wineboot", "--init"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=WINE_TIMEOUT, check=True)
    program = os.path.join(folder, "ts3100.exe")
    try:
        true("the program for Windows tells its version", "ts3100 " in run("wine", program, "--version"))
        answers("the program for Windows", program, "wine", stop=signal.SIGINT)
        said = run("wine", program, "exec", "--time", "auto", "--", "cmd", "/c", "ts3100.exe host %TS3100_IP0% su", cwd=folder)
        true("exec starts a Windows program, which asks the robot", "EXT (ETHER)" in said, said)
        com_port(program)
    finally:
        subprocess.run(["wineserver", "--kill", "--wait"], check=False)


def serve(folder):
    """The address of a web server for this folder."""
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=folder)
    handler.log_message = lambda *_: None
    http.server.SimpleHTTPRequestHandler.log_message = lambda *_: None
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return "http://127.0.0.1:%d" % server.server_port


def installer(dist, number, scratch):
    """install.sh with a release of its own, a newest one, a damaged one, none."""
    web = os.path.join(scratch, "web", "releases")
    os.makedirs(os.path.join(web, "download"))
    shutil.copytree(dist, os.path.join(web, "download", "v" + number))
    os.makedirs(os.path.join(web, "latest"))
    shutil.copytree(dist, os.path.join(web, "latest", "download"))
    to = os.path.join(scratch, "bin")
    script = os.path.join(dist, "install.sh")
    address = serve(os.path.join(scratch, "web")) + "/releases/download"
    for more in (["--version", number], ["--version", "v" + number], []):
        shutil.rmtree(to, ignore_errors=True)
        code, said = ran("sh", script, "--to", to, *more, TS3100_RELEASES=address)
        true("install.sh %s" % " ".join(more), code == 0 and "ts3100 %s is %s/ts3100" % (number, to) in said, said)
    true("and says what PATH lacks", "is not in PATH: add" in said, said)
    answers("what it installed", os.path.join(to, "ts3100"))
    code, said = ran("sh", script, "--to", to, "--version", "9.9.9", TS3100_RELEASES=address)
    true("a version that does not exist is refused", code == 1 and "there is no release 9.9.9" in said, said)
    code, said = ran("sh", script, "--to", to, TS3100_RELEASES="")
    true("no address of releases is refused", code == 1 and "set TS3100_RELEASES" in said, said)
    # The Action takes the same files.
    environment = {"RUNNER_OS": "Linux", "RUNNER_ARCH": {"x86_64": "X64", "aarch64": "ARM64"}[platform.machine()],
                   "RUNNER_TEMP": scratch, "INPUT_VERSION": number, "TS3100_RELEASES": address,
                   "GITHUB_PATH": os.path.join(scratch, "path")}
    code, said = ran("bash", os.path.join(ROOT, "packaging", "action.sh"), "get", **environment)
    true("the Action gets its program there", code == 0 and "ts3100 " + number in said, said)
    (archive,) = glob.glob(os.path.join(web, "download", "v" + number, "*-%s.tar.gz" % MINE))
    with open(archive, "r+b") as file:
        file.seek(-100, 2)
        file.write(b"damaged")
    shutil.rmtree(to)
    code, said = ran("sh", script, "--to", to, "--version", number, TS3100_RELEASES=address)
    true("a damaged archive is refused, and nothing installed",
         code == 1 and "it was damaged or replaced" in said and not os.path.exists(to), said)


def debian(dist, scratch):
    """The .deb, installed below a folder; its service as systemd would start it."""
    need("setpriv", "systemd-analyze")
    root = os.path.join(scratch, "debian")
    for folder in ("var/lib/dpkg/info", "var/lib/dpkg/updates"):
        os.makedirs(os.path.join(root, folder))
    open(os.path.join(root, "var/lib/dpkg/status"), "w", encoding="ascii").close()
    architecture = run("dpkg", "--print-architecture")
    (package,) = glob.glob(os.path.join(dist, "*_%s.deb" % architecture))
    run(*ROOT_COMMAND, "dpkg", "--root=" + root, "--force-not-root", "--log=/dev/null", "--install", package)
    listed = run("dpkg", "--root=" + root, "--listfiles", "ts3100").splitlines()
    true("dpkg installs it: program, service, manual pages, completions", {
        "/usr/bin/ts3100", "/usr/lib/systemd/system/ts3100.service", "/usr/share/man/man1/ts3100-serve.1.gz",
        "/usr/share/bash-completion/completions/ts3100", "/etc/ts3100.toml"} <= set(listed), "\n".join(listed))
    unit = os.path.join(root, "usr/lib/systemd/system/ts3100.service")
    code, said = ran("systemd-analyze", "verify", "--man=no", "--root=" + root, "ts3100.service")
    # The folder has no other units.
    said = [line for line in said.splitlines() if "ts3100.service" in line and "not found" not in line]
    equal("systemd finds nothing wrong with the service", [], said)
    code, said = ran("systemd-analyze", "security", "--offline=true", "--threshold=30", unit)
    true("and its exposure is low", code == 0, said)
    # As the service does: nobody, with one right, at the ports of the robot, which are free in a network of its own.
    with open(unit, encoding="utf-8") as file:
        start = re.search(r"^ExecStart=(.*)$", file.read(), re.MULTILINE)[1].split()
    drive = os.path.join(scratch, "drive")
    os.mkdir(drive)
    os.chmod(scratch, 0o755)
    run(*ROOT_COMMAND, "chown", "65534", drive)
    places = {"/var/lib/ts3100": drive, "/etc/ts3100.toml": root + "/etc/ts3100.toml", "/usr/bin/ts3100": root + "/usr/bin/ts3100"}
    start = [places.get(word, word) for word in start]
    ask = ["sh", "-c", "ip link set lo up; %s & robot=$!; %s ready --wait 10s >&2; %s host 127.0.0.1:1000 su; kill $robot; wait $robot"
           % (" ".join(["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "$RIGHTS", *start]), start[0], start[0])]
    for rights, expected in (("--inh-caps=-all,+net_bind_service --ambient-caps=-all,+net_bind_service", True), ("", False)):
        code, said = ran(*ROOT_COMMAND, "env", "RIGHTS=" + rights, "XDG_RUNTIME_DIR=" + drive, "unshare", "--net", *ask)
        true("a robot at port 1000 %s" % ("with the right of the service" if expected else "is refused without it"),
             ("EXT (ETHER)" in said) == expected and (expected or "1000" in said), said)
    run(*ROOT_COMMAND, "dpkg", "--root=" + root, "--force-not-root", "--log=/dev/null", "--purge", "ts3100")
    true("dpkg removes all of it", not os.path.exists(unit) and not os.path.exists(os.path.join(root, "etc/ts3100.toml")))
    run(*ROOT_COMMAND, "rm", "-rf", root, drive)


def registries(dist, number, scratch):
    """What pip and npm install, without a registry."""
    venv = os.path.join(scratch, "venv")
    run(sys.executable, "-m", "venv", venv)
    wheels = [path for path in glob.glob(os.path.join(dist, "*.whl")) if platform.machine() in path]
    run(os.path.join(venv, "bin", "pip"), "-q", "--disable-pip-version-check", "install", "--no-index", *wheels)
    equal("pip installs the wheel", "ts3100 " + number, run(os.path.join(venv, "bin", "ts3100"), "--version"))
    folder = os.path.join(scratch, "npm")
    os.mkdir(folder)
    cpu = {"x86_64": "x64", "aarch64": "arm64"}[platform.machine()]
    run("npm", "install", "--offline", "--no-audit", "--no-fund", "--omit=optional", "--prefix", folder,
        os.path.join(dist, "ts3100-%s.tgz" % number), os.path.join(dist, "ts3100-linux-%s-%s.tgz" % (cpu, number)))
    equal("npm installs launcher and program", "ts3100 " + number, run(os.path.join(folder, "node_modules", ".bin", "ts3100"), "--version"))


def extension(dist, number, scratch):
    """The program that the extension of Visual Studio Code unpacks."""
    cpu = {"x86_64": "x64", "aarch64": "arm64"}[platform.machine()]
    for system in ("linux", "alpine"):
        folder = os.path.join(scratch, "vscode-" + system)
        with zipfile.ZipFile(os.path.join(dist, "ts3100-vscode-%s-%s-%s.vsix" % (system, cpu, number))) as package:
            package.extractall(folder)
        places = {"setting": "", "packaged": os.path.join(folder, "extension", "bin", "ts3100.br"), "storage": os.path.join(folder, "storage"),
                  "environment": {}, "platform": "linux"}
        find = "console.log(require(process.argv[1]).findProgram(JSON.parse(process.argv[2])).program)"
        found = run("node", "-e", find, os.path.join(ROOT, "editors", "vscode", "src", "place.js"), json.dumps(places))
        equal("the extension for %s unpacks the program" % system, "ts3100 " + number, run(found, "--version"))


def metadata(dist, number, programs):
    """What `cargo binstall` would look for is there, and the bill of materials names what is in the program."""
    with open(os.path.join(ROOT, "crates", "emulator", "Cargo.toml"), "rb") as file:
        binstall = tomllib.load(file)["package"]["metadata"]["binstall"]
    for target in programs:
        place = {**binstall, **binstall["overrides"].get(target, {})}
        suffix = {"tgz": ".tar.gz", "zip": ".zip"}[place["pkg-fmt"]]
        values = {"repo": "", "version": number, "target": target, "archive-suffix": suffix, "bin": "ts3100",
                  "binary-ext": ".exe" if suffix == ".zip" else ""}
        filled = {key: re.sub(r"\{ ([a-z-]+) \}", lambda found: values[found[1]], place[key]) for key in ("pkg-url", "bin-dir")}
        archive = os.path.join(dist, os.path.basename(filled["pkg-url"]))
        listed = run("tar", "-tzf", archive) if suffix == ".tar.gz" else run(sys.executable, "-m", "zipfile", "-l", archive)
        true("cargo binstall finds the program for %s" % target, filled["bin-dir"] in listed, listed)
    for name, line in (("action.yml", "    default: " + number), ("clients/dotnet/Directory.Build.props", "    <Version>%s</Version>" % number)):
        with open(os.path.join(ROOT, name), encoding="utf-8") as file:
            true("%s has the version of Cargo.toml" % name, line in file.read().splitlines(), line)
    with open(os.path.join(dist, "ts3100-%s.cdx.json" % number), encoding="utf-8") as file:
        bill = json.load(file)
    with open(os.path.join(ROOT, "Cargo.lock"), "rb") as file:
        locked = {(package["name"], package["version"]) for package in tomllib.load(file)["package"]}
    parts = {(part["name"], part["version"]) for part in bill["components"]}
    true("the bill of materials has %d parts, all of the lock file, with licences" % len(parts),
         {"tokio", "nom", "clap"} <= {name for name, _ in parts} <= {name for name, _ in locked} and parts <= locked
         and all(part.get("licenses") for part in bill["components"]), parts - locked)


def workflows(tools):
    """The workflows and scripts keep to what their services and shells know."""
    need("shellcheck")
    go = shutil.which("go") or "/usr/local/go/bin/go"
    folder = os.path.join(os.path.abspath(tools), "go")
    program = os.path.join(folder, "actionlint")
    if not os.path.exists(program):
        if not os.path.exists(go):
            raise Failed("go is missing: apt has it as golang-go")
        run(go, "install", ACTIONLINT, env={**os.environ, "GOBIN": folder, "GOFLAGS": "-modcacherw"})
    files = sorted(glob.glob(os.path.join(ROOT, ".github", "workflows", "*.yml")))
    code, said = ran(program, *files)
    true("actionlint has no word about %d workflows" % len(files), code == 0, said)
    scripts = [*glob.glob(os.path.join(ROOT, "packaging", "*.sh")), os.path.join(ROOT, "fuzz", "run")]
    code, said = ran("shellcheck", *scripts)
    true("shellcheck has none about %d scripts" % len(scripts), code == 0, said)


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description="The packages of a release")
    parser.add_argument("--programs", metavar="DIR", required=True, help="TARGET/ts3100 of packaging/release.py build")
    parser.add_argument("--tools", metavar="DIR", default=os.path.join(ROOT, "target", "tools"), help="where tools are kept")
    parser.add_argument("--again", metavar="PROGRAM", help="the program of this machine, built in another place")
    options = parser.parse_args()
    programs = {os.path.basename(os.path.dirname(path)): os.path.abspath(path)
                for path in sorted(glob.glob(os.path.join(options.programs, "*", "ts3100*")))}
    tools = os.path.abspath(options.tools)
    scratch = tempfile.mkdtemp()
    try:
        true("the program of this machine is there", MINE in programs, list(programs))
        number = run(programs[MINE], "--version").split()[1]
        if options.again:
            digests = []
            for path in (programs[MINE], options.again):
                with open(path, "rb") as file:
                    digests.append(hashlib.sha256(file.read()).hexdigest())
            equal("built in another place: the same bytes", *digests)
        workflows(tools)
        dist = packages(options.programs, tools, scratch)
        for target, binary in programs.items():
            if target == MINE:
                answers(target, binary)
            elif target.endswith("-windows-gnu"):
                windows(binary, tools, scratch)
            elif target in BY:
                need(*BY[target])
                answers(target, binary, *BY[target])
            else:
                raise Failed("%s cannot be tried on this machine" % target)
        metadata(dist, number, programs)
        installer(dist, number, scratch)
        registries(dist, number, scratch)
        extension(dist, number, scratch)
        debian(dist, scratch)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(program(main))
