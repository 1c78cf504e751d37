"""What is in a package, and whether it belongs there. Used by release.py."""

import io
import os
import re
import struct
import subprocess
import tarfile
import zipfile

LICENCES = ["LICENSE-(APACHE|MIT)"]
PROGRAM = r"ts3100(\.exe)?"
# What each kind of package may hold: everything else in it is refused.
ALLOWED = [
    (r"ts3100-[^/]*\.(tar\.gz|zip)",
     [r"ts3100-[^/]*/(%s|README\.md|CHANGELOG\.md|%s|man/ts3100[a-z-]*\.1|completions/[\w.]+)" % (PROGRAM, LICENCES[0])]),
    (r".*\.deb", [r"usr/bin/ts3100", r"usr/share/man/man1/ts3100[a-z-]*\.1\.gz", r"usr/share/(bash-completion|zsh|fish)/[\w./-]+",
                  r"usr/lib/systemd/system/ts3100\.service", r"etc/ts3100\.toml", r"usr/share/doc/ts3100/(copyright|CHANGELOG\.md)"]),
    (r".*\.whl", [r"ts3100/[\w/]+\.py", r"ts3100/py\.typed", r"ts3100-[^/]*\.data/scripts/" + PROGRAM,
                  r"ts3100-[^/]*\.dist-info/(METADATA|WHEEL|RECORD|entry_points\.txt|licenses/%s)" % LICENCES[0]]),
    (r".*\.nupkg", [r"\[Content_Types\]\.xml", r"_rels/\.rels", r"ts3100[\w.-]*\.nuspec", r"README\.md", *LICENCES,
                    r"tools/any/[\w-]+/(DotnetToolSettings\.xml|%s)" % PROGRAM]),
    (r".*\.tgz", [r"package/(package\.json|README\.md|%s|%s|(launch|index|binary|host|errors|operations|trace)\.js|(index|operations)\.d\.ts)" % (PROGRAM, LICENCES[0])]),
    (r"ts3100-vscode-[\w.-]*\.vsix", [r"extension\.vsixmanifest", r"\[Content_Types\]\.xml", r"extension/(package|language-configuration|scol\.tmLanguage)\.json",
                          r"extension/(readme\.md|dist/extension\.js|bin/ts3100\.br|walkthrough/\w+\.(md|scol)|%s|LICENSE-BUNDLED)" % LICENCES[0]]),
    (r"ts3100\.hpp|ts3100-(config|scenario|faults)\.schema\.json|install\.sh|ts3100-[^/]*\.cdx\.json", [r"[^/]+"]),
]
# The type of an ELF file that runs at any address, and the processor for which the toolchain makes no static ones.
ET_DYN, EM_AARCH64 = 3, 183
# The C runtime alone has unwind tables of a few bytes; those of all functions are an eighth of the code.
LEAST_UNWIND = 1 / 50
# Symbols and debug information of an ELF file.
ELF_DEBUG = re.compile(rb"\.symtab$|\.strtab$|\.debug_|\.zdebug_|\.stab")
# The load command of a Mach-O file with its symbols; those of debuggers (N_FUN, N_SO, N_OSO), and those of the first
# section, which is the code, that no other program sees. Linkers leave some of data in every file.
LC_SYMTAB, MACH_O_DEBUG, MACH_O_LOCAL = 2, (0x24, 0x64, 0x66), (0x0E, 1)
# Where a machine keeps its users and scratch files. A program may speak of /tmp itself.
HOMES = re.compile(rb"(?:/root|/home/[a-z]|/Users/|/tmp/[\w.-]+/|/builds/|/github/|[A-Z]:\\Users\\)[\w./\\-]*")


# Most bytes of a package: what a marketplace and its users load for one platform.
LARGEST = [(r".*\.vsix", 4_000_000)]


def too_large(path):
    """Why the size of a package is refused, or ""."""
    size = os.path.getsize(path)
    most = next((most for package, most in LARGEST if re.fullmatch(package, os.path.basename(path))), size)
    return "has %d bytes, and at most %d are allowed" % (size, most) if size > most else ""


def contents(path):
    """The files in a package: {name: (content, why it must not be there or "")}."""
    name = os.path.basename(path)
    try:
        allowed = next(patterns for package, patterns in ALLOWED if re.fullmatch(package, name))
    except StopIteration:
        raise ValueError("no package has such a name") from None
    files = {}
    for inner, content in unpacked(path):
        is_allowed = any(re.fullmatch(pattern, inner) for pattern in allowed)
        files[inner] = (content, "" if is_allowed else "does not belong there")
    return files


def unpacked(path):
    """Names and contents."""
    if path.endswith((".zip", ".whl", ".nupkg", ".vsix")):
        with zipfile.ZipFile(path) as archive:
            files = [(name, archive.read(name)) for name in archive.namelist() if not name.endswith("/")]
            # As a user has it: Visual Studio Code's extension unpacks its program.
            return [(name, of_brotli(content) if name.endswith(".br") else content) for name, content in files]
    if path.endswith((".tar.gz", ".tgz")):
        with open(path, "rb") as file:
            return of_tar(file.read())
    if path.endswith(".deb"):
        done = subprocess.run(["dpkg-deb", "--fsys-tarfile", path], stdout=subprocess.PIPE, check=True)
        return [(name.removeprefix("./"), content) for name, content in of_tar(done.stdout)]
    with open(path, "rb") as file:
        return [(os.path.basename(path), file.read())]


def of_brotli(data):
    """The content of a file that Brotli has compressed."""
    unpack = "process.stdout.write(require('node:zlib').brotliDecompressSync(require('node:fs').readFileSync(0)))"
    return subprocess.run(["node", "-e", unpack], input=data, stdout=subprocess.PIPE, check=True).stdout


def of_tar(data):
    """Names and contents of the files of a tar archive."""
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        return [(entry.name, archive.extractfile(entry).read()) for entry in archive if entry.isfile()]


def sections(program):
    """Name and size of each section of an ELF file of 64 bits with the low byte first: all of ours."""
    headers, size, count, names = struct.unpack_from("<Q", program, 40) + struct.unpack_from("<HHH", program, 58)
    texts = struct.unpack_from("<Q", program, headers + size * names + 24)[0]
    found = {}
    for index in range(count):
        begin = texts + struct.unpack_from("<I", program, headers + size * index)[0]
        found[program[begin:program.index(b"\0", begin)]] = struct.unpack_from("<Q", program, headers + size * index + 32)[0]
    return found


def mislinked(program):
    """What an ELF file lacks that a network daemon needs: an address that differs from start to start, and backtraces."""
    if program[:4] != b"\x7fELF":
        return []
    kind, processor = struct.unpack_from("<HH", program, 16)
    size = sections(program)
    problems = ["has a fixed address"] if kind != ET_DYN and processor != EM_AARCH64 else []
    if size.get(b".eh_frame", 0) < size[b".text"] * LEAST_UNWIND:
        problems.append("has no unwind tables")
    return problems


def unstripped(program):
    """What of a program is for debuggers only."""
    if program[:4] == b"\x7fELF":
        return ["has the section " + name.decode() for name in sections(program) if ELF_DEBUG.match(name)]
    if program[:2] == b"MZ":
        header = struct.unpack_from("<I", program, 60)[0]
        symbols = struct.unpack_from("<I", program, header + 16)[0]
        return ["has %d symbols" % symbols] if symbols else []
    if program[:4] == b"\xcf\xfa\xed\xfe":
        # The load commands of a 64-bit Mach-O file, and the symbols of its table: type and section of each.
        at, found = 32, 0
        for _ in range(struct.unpack_from("<I", program, 16)[0]):
            command, size, symbols, count = struct.unpack_from("<IIII", program, at)
            at += size
            if command == LC_SYMTAB:
                kinds = [struct.unpack_from("<BB", program, symbols + 16 * index + 4) for index in range(count)]
                found += sum(kind in MACH_O_DEBUG or (kind, section) == MACH_O_LOCAL for kind, section in kinds)
        return ["has %d symbols" % found] if found else []
    raise ValueError("a program of an unknown kind")


def foreign_paths(program):
    """Paths of the machine that built it."""
    return ["names " + path for path in sorted({found.decode() for found in HOMES.findall(program)})]
