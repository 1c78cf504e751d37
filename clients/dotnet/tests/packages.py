#!/usr/bin/env python3
"""Packs the binary as a .NET tool and opens what came out: every file of every package, the manifests, and the program,
which has to run as it left the package. Binaries of the other platforms are stand-ins of a few bytes with a true header.

    python3 clients/dotnet/tests/packages.py --serve target/release/ts3100"""

import argparse
import os
import stat
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as Xml
import zipfile

PACK = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "pack.py")
VERSION = "1.2.3-rc.1"
LICENCES = ["LICENSE-APACHE", "LICENSE-MIT", "README.md"]
HEADERS = {
    "aarch64-unknown-linux-musl": b"\x7fELF" + bytes(14) + struct.pack("<H", 0xB7),
    "x86_64-pc-windows-msvc": b"MZ" + bytes(58) + struct.pack("<I", 64) + b"PE\0\0" + struct.pack("<H", 0x8664),
    "aarch64-apple-darwin": b"\xcf\xfa\xed\xfe" + struct.pack("<I", 0x0100000C),
}
RIDS = ["linux-x64", "linux-musl-x64", "linux-arm64", "linux-musl-arm64", "win-x64", "osx-arm64"]
NUSPEC = "{http://schemas.microsoft.com/packaging/2013/05/nuspec.xsd}"


def equal(what, expected, found):
    """A step that holds is printed."""
    if expected != found:
        sys.exit("FAIL %s\n     expected %r\n     found    %r" % (what, expected, found))
    print("ok   " + what, flush=True)


def run(*arguments):
    """The packer's exit code and output."""
    done = subprocess.run([sys.executable, PACK, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120)
    return done.returncode, done.stdout


def package(path, identity, kind, tool):
    """Opens a package: its files, its nuspec, its content types; returns the settings of the tool."""
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        equal("%s: its files" % identity, sorted(["[Content_Types].xml", "_rels/.rels", identity + ".nuspec", *LICENCES, *tool]), sorted(names))
        metadata = Xml.fromstring(archive.read(identity + ".nuspec")).find(NUSPEC + "metadata")
        equal("%s: its nuspec" % identity, [identity, VERSION, kind], [
            metadata.find(NUSPEC + "id").text, metadata.find(NUSPEC + "version").text,
            metadata.find(NUSPEC + "packageTypes/" + NUSPEC + "packageType").get("name")])
        types = Xml.fromstring(archive.read("[Content_Types].xml"))
        typed = {one.get("Extension") for one in types} | {one.get("PartName") for one in types}
        equal("%s: every file has a type" % identity, [], [
            name for name in names if name != "[Content_Types].xml"
            and os.path.splitext(name)[1][1:] not in typed and "/" + name not in typed and name != "_rels/.rels"])
        relation = Xml.fromstring(archive.read("_rels/.rels"))[0].get("Target")
        equal("%s: its relation leads to the nuspec" % identity, "/%s.nuspec" % identity, relation)
        return Xml.fromstring(archive.read(next(name for name in names if name.endswith("DotnetToolSettings.xml"))))


def main():
    parser = argparse.ArgumentParser(description="Check the packages of the .NET tool")
    parser.add_argument("--serve", metavar="TS3100", required=True, help="the binary, of this machine")
    binary = parser.parse_args().serve
    with tempfile.TemporaryDirectory() as folder:
        pairs = ["x86_64-unknown-linux-musl=" + binary]
        for target, content in HEADERS.items():
            path = os.path.join(folder, target)
            with open(path, "wb") as file:
                file.write(content)
            pairs.append("%s=%s" % (target, path))
        first, second = (os.path.join(folder, name) for name in ("first", "second"))
        code, said = run("--version", VERSION, "--out", first, *pairs)
        names = ["ts3100.%s.%s.nupkg" % (rid, VERSION) for rid in RIDS] + ["ts3100.%s.nupkg" % VERSION]
        equal("the packages, the one that names the others last", (0, names), (code, [os.path.basename(line) for line in said.split()]))
        for rid in RIDS:
            program = "ts3100.exe" if rid == "win-x64" else "ts3100"
            settings = package(os.path.join(first, "ts3100.%s.%s.nupkg" % (rid, VERSION)), "ts3100." + rid, "DotnetToolRidPackage",
                               ["tools/any/%s/%s" % (rid, name) for name in ("DotnetToolSettings.xml", program)])
            equal("ts3100.%s: its command" % rid, ("2", {"Name": "ts3100", "EntryPoint": program, "Runner": "executable"}),
                  (settings.get("Version"), settings.find("Commands/Command").attrib))
        settings = package(os.path.join(first, names[-1]), "ts3100", "DotnetTool", ["tools/any/any/DotnetToolSettings.xml"])
        equal("ts3100 names the packages", [{"RuntimeIdentifier": rid, "Id": "ts3100." + rid} for rid in RIDS],
              [one.attrib for one in settings.find("RuntimeIdentifierPackages")])
        equal("and has a command without a program", {"Name": "ts3100"}, settings.find("Commands/Command").attrib)
        with zipfile.ZipFile(os.path.join(first, names[0])) as archive:
            entry = archive.getinfo("tools/any/linux-x64/ts3100")
            equal("the program may be run", 0o755, stat.S_IMODE(entry.external_attr >> 16))
            program = os.path.join(folder, "ts3100")
            with open(program, "wb") as file:
                file.write(archive.read(entry))
        os.chmod(program, 0o755)
        equal("and runs", "ts3100", subprocess.run([program, "--version"], stdout=subprocess.PIPE, text=True, check=True, timeout=10).stdout.split()[0])
        run("--version", VERSION, "--out", second, *pairs)
        equal("the same input, the same bytes", True, all(
            open(os.path.join(first, name), "rb").read() == open(os.path.join(second, name), "rb").read() for name in names))
        code, said = run("--version", VERSION, "--out", first, "x86_64-pc-windows-msvc=" + binary)
        equal("a binary of another platform", (1, True), (code, "expected PE for machine 0x8664, found ELF for 0x3e" in said))
        equal("a target without a name", 1, run("--version", VERSION, "--out", first, "linux=" + binary)[0])
        equal("a version that is none", 1, run("--version", "v1", "--out", first, pairs[0])[0])
    print("all of it")


if __name__ == "__main__":
    main()
