"""The binaries that the packers of NuGet and npm put into packages, one for each platform. A mixed-up platform is the
error that users would meet first, so each binary is compared with the target that it is said to be for."""

import argparse
import collections
import re
import struct
import sys

Platform = collections.namedtuple("Platform", "kind machine rids npm os cpu")

ELF, PE, MACH_O = "ELF", "PE", "Mach-O"
# The static Linux binaries run on every C library. NuGet counts Alpine as a platform of its own, npm does not.
PLATFORMS = {
    "x86_64-unknown-linux-musl": Platform(ELF, 0x3E, ("linux-x64", "linux-musl-x64"), "linux-x64", "linux", "x64"),
    "x86_64-unknown-linux-gnu": Platform(ELF, 0x3E, ("linux-x64",), "linux-x64", "linux", "x64"),
    "aarch64-unknown-linux-musl": Platform(ELF, 0xB7, ("linux-arm64", "linux-musl-arm64"), "linux-arm64", "linux", "arm64"),
    "x86_64-pc-windows-msvc": Platform(PE, 0x8664, ("win-x64",), "win32-x64", "win32", "x64"),
    "x86_64-pc-windows-gnu": Platform(PE, 0x8664, ("win-x64",), "win32-x64", "win32", "x64"),
    "x86_64-apple-darwin": Platform(MACH_O, 0x01000007, ("osx-x64",), "darwin-x64", "darwin", "x64"),
    "aarch64-apple-darwin": Platform(MACH_O, 0x0100000C, ("osx-arm64",), "darwin-arm64", "darwin", "arm64"),
}
VERSION = re.compile(r"\d+\.\d+\.\d+(-[0-9A-Za-z.-]+)?$")


class Unfit(Exception):
    """What was given cannot be packed."""


def kind_of(content):
    """Form and machine of a program."""
    if content[:4] == b"\x7fELF":
        return ELF, struct.unpack_from("<H", content, 18)[0]
    if content[:4] == b"\xcf\xfa\xed\xfe":
        return MACH_O, struct.unpack_from("<I", content, 4)[0]
    if content[:2] == b"MZ":
        header = struct.unpack_from("<I", content, 60)[0]
        return PE, struct.unpack_from("<H", content, header + 4)[0]
    return "no program", 0


def read(pairs):
    """The platforms and contents of arguments TARGET=FILE."""
    binaries = {}
    for pair in pairs:
        target, _, path = pair.partition("=")
        if target not in PLATFORMS or not path:
            raise Unfit("%s: expected TARGET=FILE, TARGET one of %s" % (pair, ", ".join(PLATFORMS)))
        platform = PLATFORMS[target]
        with open(path, "rb") as file:
            content = file.read()
        found = kind_of(content)
        if found != (platform.kind, platform.machine):
            raise Unfit("%s: expected %s for machine %#x, found %s for %#x: build it for %s"
                        % (path, platform.kind, platform.machine, *found, target))
        if platform.npm in {other.npm for other in binaries}:
            raise Unfit("%s: %s has a binary already" % (pair, platform.npm))
        binaries[platform] = content
    return binaries


def command(description, pack):
    """The command line of a packer: `pack(version, binaries, folder)` returns the files that it wrote."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("binaries", nargs="+", metavar="TARGET=FILE", help="x86_64-unknown-linux-musl=target/.../ts3100")
    parser.add_argument("--version", required=True, help="the version of the packages")
    parser.add_argument("--out", required=True, help="the folder for them")
    options = parser.parse_args()
    try:
        if not VERSION.match(options.version):
            raise Unfit("%s: expected a version such as 1.2.3 or 1.2.3-rc.1" % options.version)
        for file in pack(options.version, read(options.binaries), options.out):
            print(file)
    except (Unfit, OSError) as error:
        print("error: cannot pack: %s" % error, file=sys.stderr)
        return 1
    return 0
