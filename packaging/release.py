#!/usr/bin/env python3
"""Makes a release: the program for each platform, and from these programs every package. Publishes nothing.

    packaging/release.py build --out programs [TARGET ...]    the programs, as programs/TARGET/ts3100
    packaging/release.py pack --out dist programs             archives, .deb, wheels, npm, NuGet and editor packages, SBOM, SHA256SUMS
    packaging/release.py verify dist                          lists each package and checks what is in it

Without TARGET, `build` makes those that can be made here. Linux and Windows are built on Linux, with `cargo zigbuild` where
the target is not the machine's own; macOS on macOS. What cargo and Python packages are needed is fetched once, into --tools.
The same commit gives the same bytes, wherever the checkout is. `pack` and `verify` need python3, npm, and dpkg-deb for the
.deb; `pack` runs the program of its own machine once, for the manual pages and the completions."""

import argparse
import gzip
import hashlib
import io
import json
import os
import platform
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(HERE)
sys.path.insert(0, os.path.join(ROOT, "clients"))
sys.path.insert(0, os.path.join(ROOT, "editors", "vscode"))
sys.path.insert(0, HERE)
import vsix  # noqa: E402
from binaries import PLATFORMS, Unfit, kind_of, read  # noqa: E402
from verify import contents, foreign_paths, mislinked, too_large, unstripped  # noqa: E402

LINUX = {"x86_64": "x86_64-unknown-linux-musl", "aarch64": "aarch64-unknown-linux-musl", "arm64": "aarch64-unknown-linux-musl"}
CROSS = ["x86_64-unknown-linux-musl", "aarch64-unknown-linux-musl", "x86_64-pc-windows-gnu"]
MACOS = ["x86_64-apple-darwin", "aarch64-apple-darwin"]
DEBIAN = {"x86_64-unknown-linux-musl": "amd64", "aarch64-unknown-linux-musl": "arm64"}
ZIG = ["cargo-zigbuild==0.24.0", "ziglang==0.17.1"]
WHEELS = ["hatchling==1.27.0", "build==1.4.4"]
CYCLONEDX = "0.5.9"
SHELLS = {"bash": "ts3100.bash", "zsh": "_ts3100", "fish": "ts3100.fish", "powershell": "ts3100.ps1", "elvish": "ts3100.elv"}
TEXTS = ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"]
# Owner and group in a package, where they are root's.
ROOTS = 0
# What the profile `dist` has for speed, and its level in a package.
FOR_SIZE = {"scol-mini": "z", "libm": "z", "ts3100-controller": "z", "ts3100-proto": "z", "ts3100-driver": "z", "tokio": "z", "mio": "z",
            "bytes": "z", "ts3100-control": "z", "ts3100-recording": "z"}


def run(*command, cwd=ROOT, **variables):
    """A command that has to succeed; its output."""
    done = subprocess.run([str(word) for word in command], cwd=cwd, env={**os.environ, **variables}, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace", check=False)
    if done.returncode:
        raise Unfit("%s: exit code %d\n%s%s" % (" ".join(map(str, command)), done.returncode, done.stdout, done.stderr))
    return done.stdout


def version():
    """The version of the workspace."""
    with open(os.path.join(ROOT, "Cargo.toml"), encoding="utf-8") as file:
        return next(line for line in file if line.startswith("version = ")).split('"')[1]


def commit_time():
    """The date in every package: that of the commit, or SOURCE_DATE_EPOCH."""
    return int(os.environ.get("SOURCE_DATE_EPOCH") or run("git", "log", "-1", "--format=%ct"))


class Tools:
    """What builds and packs, fetched once."""

    def __init__(self, folder):
        self.folder = os.path.abspath(folder)

    def python(self, name, packages):
        """The bin folder of an environment with these packages of PyPI."""
        venv = os.path.join(self.folder, name)
        programs = os.path.join(venv, "bin")
        note, wanted = os.path.join(venv, "installed"), "\n".join(packages)
        try:
            with open(note, encoding="utf-8") as file:
                if file.read() == wanted:
                    return programs
        except OSError:
            pass
        print("installing %s" % ", ".join(packages), flush=True)
        run(sys.executable, "-m", "venv", "--clear", venv)
        run(os.path.join(programs, "python"), "-m", "pip", "-q", "--disable-pip-version-check", "install", *packages)
        with open(note, "w", encoding="utf-8") as file:
            file.write(wanted)
        return programs

    def cyclonedx(self):
        """cargo-cyclonedx."""
        root = os.path.join(self.folder, "cyclonedx-" + CYCLONEDX)
        program = os.path.join(root, "bin", "cargo-cyclonedx")
        if not os.path.exists(program):
            print("installing cargo-cyclonedx %s" % CYCLONEDX, flush=True)
            # It is used once: what it costs to compile counts, not how fast it is.
            run("cargo", "install", "--locked", "--quiet", "cargo-cyclonedx", "--version", CYCLONEDX, "--root", root,
                "--target-dir", os.path.join(self.folder, "build"), CARGO_PROFILE_RELEASE_OPT_LEVEL="0",
                CARGO_PROFILE_RELEASE_LTO="false", CARGO_TARGET_DIR="")
        return program


def fetch(options):
    """Fetches the tools."""
    options.tools.python("zig", ZIG)
    options.tools.python("wheels", WHEELS)
    options.tools.cyclonedx()
    vsix.fetched(options.tools.folder)


def build(options):
    """Compiles the programs."""
    system, machine = platform.system(), platform.machine()
    own = LINUX.get(machine) if system == "Linux" else None
    targets = options.targets or (CROSS if system == "Linux" else MACOS)
    work = os.path.abspath(options.target_dir)
    for target in targets:
        if target not in PLATFORMS:
            raise Unfit("%s is none of the targets %s" % (target, ", ".join(PLATFORMS)))
        if (target in MACOS) != (system == "Darwin"):
            raise Unfit("%s cannot be built on %s" % (target, system))
        run("rustup", "target", "add", target)
        cargo, path = ["cargo", "build"], os.environ["PATH"]
        if target not in MACOS and target != own:
            path = options.tools.python("zig", ZIG) + os.pathsep + path
            cargo = ["cargo", "zigbuild"]
        # Neither whose machine it was nor where on it belongs in a program, and with them no two builds are the same.
        sysroot = run("rustc", "--print", "sysroot").strip()
        home = os.environ.get("CARGO_HOME") or os.path.join(os.path.expanduser("~"), ".cargo")
        places = [(sysroot, "/rust"), (home, "/cargo"), (ROOT, "/ts3100"), (work, "/target")]
        flags = ["--remap-path-prefix=%s=%s" % place for place in places]
        if target == own:
            # A position-independent program relocates itself at its start: in this form the table takes 400 kB less. zig's linker has it not.
            flags.append("-Clink-arg=-Wl,-z,pack-relative-relocs")
            # The linker of the toolchain folds functions whose code is the same: a twentieth of the program.
            shims = os.path.join(sysroot, "lib", "rustlib", target.replace("musl", "gnu"), "bin", "gcc-ld")
            flags += ["-Clink-arg=-B" + shims, "-Clink-arg=-fuse-ld=lld", "-Clink-arg=-Wl,--icf=all"]
        # A package has all of its code for size, to stay below 9 MB: an SU takes as long, a statement 21 ns instead of 8.
        for package, level in FOR_SIZE.items():
            cargo += ["--config", 'profile.dist.package.%s.opt-level="%s"' % (package, level)]
        print("building %s" % target, flush=True)
        run(*cargo, "--locked", "--profile", "dist", "--package", "ts3100-emulator", "--bin", "ts3100", "--target", target,
            CARGO_ENCODED_RUSTFLAGS="\x1f".join(flags), CARGO_TARGET_DIR=work, CARGO_INCREMENTAL="0", PATH=path)
        name = program_name(target)
        folder = os.path.join(options.out, target)
        os.makedirs(folder, exist_ok=True)
        shutil.copy(os.path.join(work, target, "dist", name), os.path.join(folder, name))
        print("%s: %d bytes" % (os.path.join(folder, name), os.path.getsize(os.path.join(folder, name))), flush=True)


def program_name(target):
    """The file name of the program."""
    return "ts3100.exe" if PLATFORMS[target].os == "win32" else "ts3100"


def runs_here(target):
    """Whether a program for this target can be started on this machine."""
    mine = PLATFORMS[target]
    system = {"Linux": "linux", "Darwin": "darwin", "Windows": "win32"}[platform.system()]
    cpu = {"x86_64": "x64", "AMD64": "x64", "aarch64": "arm64", "arm64": "arm64"}.get(platform.machine())
    return (mine.os, mine.cpu) == (system, cpu)


def described(programs, folder):
    """Manual pages and completions, made by the program itself: {path in an archive: content}."""
    try:
        program = next(path for target, path in programs.items() if runs_here(target))
    except StopIteration:
        raise Unfit("none of the programs runs on this machine, and one has to write the manual pages") from None
    run(program, "man", folder)
    files = {}
    for name in sorted(os.listdir(folder)):
        with open(os.path.join(folder, name), "rb") as file:
            files["man/" + name] = file.read()
    for shell, name in SHELLS.items():
        files["completions/" + name] = run(program, "completions", shell).encode()
    return files


def archive(path, top, files, time):
    """A .tar.gz or .zip with one folder. The order, owners and dates are not those of the machine."""
    if path.endswith(".zip"):
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as zipped:
            for name, (content, mode) in sorted(files.items()):
                entry = zipfile.ZipInfo("%s/%s" % (top, name), (1980, 1, 1, 0, 0, 0))
                entry.compress_type, entry.create_system = zipfile.ZIP_DEFLATED, 3
                entry.external_attr = (0o100000 | mode) << 16
                zipped.writestr(entry, content)
        return
    with open(path, "wb") as raw, gzip.GzipFile("", "wb", 9, raw, time) as packed, \
            tarfile.open(fileobj=packed, mode="w", format=tarfile.GNU_FORMAT) as tar:
        for name, (content, mode) in sorted(files.items()):
            entry = tarfile.TarInfo("%s/%s" % (top, name))
            entry.size, entry.mode, entry.mtime, entry.uid, entry.gid = len(content), mode, time, ROOTS, ROOTS
            tar.addfile(entry, io.BytesIO(content))


def debian(path, architecture, number, program, files, time):
    """A .deb: the program needs nothing of the system, so dpkg-deb and five fields are enough."""
    with tempfile.TemporaryDirectory() as root:
        def put(name, content, mode=0o644):
            there = os.path.join(root, name)
            os.makedirs(os.path.dirname(there), exist_ok=True)
            with open(there, "wb") as file:
                file.write(content)
            os.chmod(there, mode)
            return len(content)

        size = put("usr/bin/ts3100", program, 0o755)
        for name, content in files.items():
            if name.startswith("man/"):
                size += put("usr/share/man/man1/%s.gz" % os.path.basename(name), gzip.compress(content, 9, mtime=0))
        places = {"bash": "bash-completion/completions/ts3100", "zsh": "zsh/vendor-completions/_ts3100",
                  "fish": "fish/vendor_completions.d/ts3100.fish"}
        for shell, place in places.items():
            size += put("usr/share/" + place, files["completions/" + SHELLS[shell]])
        for name, place in {"debian/ts3100.service": "usr/lib/systemd/system/ts3100.service",
                            "debian/ts3100.toml": "etc/ts3100.toml",
                            "debian/copyright": "usr/share/doc/ts3100/copyright",
                            "../CHANGELOG.md": "usr/share/doc/ts3100/CHANGELOG.md"}.items():
            with open(os.path.join(HERE, name), "rb") as file:
                size += put(place, file.read())
        with open(os.path.join(HERE, "debian", "control"), encoding="utf-8") as file:
            control = file.read() % {"version": number, "architecture": architecture, "kilobytes": (size + 1023) // 1024}
        put("DEBIAN/control", control.encode())
        put("DEBIAN/conffiles", b"/etc/ts3100.toml\n")
        for folder, _, _ in os.walk(root):
            os.chmod(folder, 0o755)
        run("dpkg-deb", "--root-owner-group", "-Zxz", "--build", root, path, SOURCE_DATE_EPOCH=str(time))


def sbom(path, tools, number, time):
    """What the programs are made of, as CycloneDX."""
    program = tools.cyclonedx()
    made = os.path.join(ROOT, "crates", "emulator", "ts3100-release.json")
    try:
        run(program, "cyclonedx", "--manifest-path", os.path.join(ROOT, "crates", "emulator", "Cargo.toml"), "--format", "json",
            "--override-filename", "ts3100-release", "--target", "all", SOURCE_DATE_EPOCH=str(time))
        with open(made, encoding="utf-8") as file:
            document = json.load(file)
    finally:
        # It writes one beside each crate of the workspace.
        for folder, _, names in os.walk(os.path.join(ROOT)):
            if "ts3100-release.json" in names and "/target" not in folder:
                os.remove(os.path.join(folder, "ts3100-release.json"))
    # The number would be random, and the crates of this project have addresses of this machine.
    document.pop("serialNumber", None)
    text = json.dumps(document, indent=1, sort_keys=True).replace("file://" + ROOT, "file:///ts3100").replace(ROOT, "/ts3100")
    if number not in text:
        raise Unfit("the bill of materials does not name version " + number)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text + "\n")


def pack(options):
    """Makes every package of these programs."""
    number, time = version(), commit_time()
    programs = {}
    for target in PLATFORMS:
        path = os.path.join(options.programs, target, program_name(target))
        if os.path.exists(path):
            with open(path, "rb") as file:
                found = kind_of(file.read())
            if found != PLATFORMS[target][:2]:
                raise Unfit("%s is not a program for %s" % (path, target))
            programs[target] = os.path.abspath(path)
    if not programs:
        raise Unfit("%s has no program: build them first, as TARGET/ts3100" % options.programs)
    out = os.path.abspath(options.out)
    if os.path.exists(out) and os.listdir(out):
        raise Unfit("%s is not empty: what is in it would be released as well" % options.out)
    os.makedirs(out, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        texts = described(programs, os.path.join(scratch, "man"))
        extras = {name: (content, 0o644) for name, content in texts.items()}
        for name in TEXTS:
            with open(os.path.join(ROOT, name), "rb") as file:
                extras[name] = (file.read(), 0o644)
        for target, path in programs.items():
            with open(path, "rb") as file:
                program = file.read()
            top = "ts3100-%s-%s" % (number, target)
            ending = ".zip" if PLATFORMS[target].os == "win32" else ".tar.gz"
            archive(os.path.join(out, top + ending), top, {**extras, program_name(target): (program, 0o755)}, time)
            if target in DEBIAN:
                debian(os.path.join(out, "ts3100_%s_%s.deb" % (number, DEBIAN[target])), DEBIAN[target], number, program, texts,
                       time)
            tools = options.tools.python("wheels", WHEELS)
            named = os.path.join(scratch, program_name(target))
            shutil.copy(path, named)
            run(os.path.join(tools, "python"), "-m", "build", "--wheel", "--no-isolation", "--outdir", out,
                os.path.join(ROOT, "clients", "python"), TS3100_BINARY=named, SOURCE_DATE_EPOCH=str(time))
        pairs = ["%s=%s" % pair for pair in programs.items()]
        for packer in ("npm", "dotnet"):
            run(sys.executable, os.path.join(ROOT, "clients", packer, "pack.py"), "--version", number, "--out", out, *pairs)
        vsix.pack(number, read(pairs), out, options.tools.folder, time)
    if not options.no_sbom:
        sbom(os.path.join(out, "ts3100-%s.cdx.json" % number), options.tools, number, time)
        vsix.sbom(os.path.join(out, "ts3100-vscode-%s.cdx.json" % number), options.tools.folder, number)
    shutil.copy(os.path.join(ROOT, "clients", "cpp", "ts3100.hpp"), out)
    shutil.copy(os.path.join(HERE, "install.sh"), out)
    for name in ("config", "scenario", "faults"):
        shutil.copy(os.path.join(ROOT, "docs", "reference", name + ".schema.json"), os.path.join(out, "ts3100-%s.schema.json" % name))
    names = sorted(os.listdir(out))
    with open(os.path.join(out, "SHA256SUMS"), "w", encoding="ascii") as file:
        for name in names:
            file.write("%s  %s\n" % (digest(os.path.join(out, name)), name))
    print("%s has %d files" % (options.out, len(names) + 1))


def digest(path):
    """The SHA-256 of a file."""
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def verify(options):
    """Lists and checks each package; the problems of all of them."""
    problems = []
    with open(os.path.join(options.dist, "SHA256SUMS"), encoding="ascii") as file:
        sums = dict(reversed(line.rstrip("\n").split("  ", 1)) for line in file)
    names = sorted(set(os.listdir(options.dist)) - {"SHA256SUMS"})
    if names != sorted(sums):
        problems.append("SHA256SUMS lists other files than the folder has: %s" % sorted(set(names) ^ set(sums)))
    for name in names:
        path = os.path.join(options.dist, name)
        if digest(path) != sums.get(name):
            problems.append("%s is not the file that SHA256SUMS has" % name)
        try:
            files = contents(path)
        except (OSError, ValueError, subprocess.SubprocessError) as error:
            problems.append("%s cannot be read: %s" % (name, error))
            continue
        print("%s, %d bytes" % (name, os.path.getsize(path)))
        problems += ["%s %s" % (name, too_large(path))] if too_large(path) else []
        for inner, (content, refused) in files.items():
            print("    %9d  %s" % (len(content), inner))
            problems += ["%s: %s %s" % (name, inner, refused)] if refused else []
            if kind_of(content) in [place[:2] for place in PLATFORMS.values()]:
                found = unstripped(content) + mislinked(content) + foreign_paths(content)
                problems += ["%s: %s %s" % (name, inner, problem) for problem in found]
    for problem in problems:
        print("error: " + problem, file=sys.stderr)
    if problems:
        raise Unfit("%d problems" % len(problems))
    print("all %d files are as they should be" % len(names))


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description="Make a release; publish nothing")
    parser.add_argument("--tools", metavar="DIR", default=os.path.join(ROOT, "target", "tools"), help="where tools are kept")
    commands = parser.add_subparsers(dest="command", required=True)
    part = commands.add_parser("tools", help="fetch now what `build` and `pack` would fetch")
    part.set_defaults(what=fetch)
    part = commands.add_parser("build", help="compile the programs")
    part.add_argument("targets", nargs="*", metavar="TARGET", help="such as x86_64-unknown-linux-musl")
    part.add_argument("--out", required=True, help="the folder for TARGET/ts3100")
    part.add_argument("--target-dir", default=os.environ.get("CARGO_TARGET_DIR") or os.path.join(ROOT, "target"),
                      help="the target directory of cargo")
    part.set_defaults(what=build)
    part = commands.add_parser("pack", help="make every package of these programs")
    part.add_argument("programs", help="the folder with TARGET/ts3100")
    part.add_argument("--out", required=True, help="an empty folder for the packages")
    part.add_argument("--no-sbom", action="store_true", help="without the bill of materials")
    part.set_defaults(what=pack)
    part = commands.add_parser("verify", help="list and check each package")
    part.add_argument("dist", help="the folder with the packages")
    part.set_defaults(what=verify)
    options = parser.parse_args()
    options.tools = Tools(options.tools)
    try:
        options.what(options)
    except (Unfit, OSError) as error:
        print("error: cannot %s: %s" % (options.command, error), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
