#!/usr/bin/env python3
"""Packs the binary as a .NET tool, without an SDK: a package `ts3100` that names one package for each platform.

    python3 clients/dotnet/pack.py --version 0.1.0 --out dist x86_64-unknown-linux-musl=ts3100 x86_64-pc-windows-msvc=ts3100.exe

Users then run `dotnet tool install ts3100` (SDK 10 or later). Push the packages of the platforms before `ts3100` itself:
a published `ts3100` whose platforms are missing cannot be installed. The same input gives the same bytes."""

import os
import sys
import zipfile
from xml.sax.saxutils import quoteattr

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.dirname(HERE))
from binaries import command  # noqa: E402

ID = "ts3100"
# A zip file has no earlier date, and a build date would make each build different.
DATE = (1980, 1, 1, 0, 0, 0)
PROGRAM, DATA = 0o755, 0o644

NUSPEC = """<?xml version="1.0" encoding="utf-8"?>
<package xmlns="http://schemas.microsoft.com/packaging/2013/05/nuspec.xsd">
  <metadata>
    <id>%(id)s</id>
    <version>%(version)s</version>
    <authors>The ts3100 developers</authors>
    <license type="expression">MIT OR Apache-2.0</license>
    <readme>README.md</readme>
    <description>Emulates the Toshiba Machine TS3100 / TSL3100 robot controller for tests of host programs.%(about)s</description>
    <tags>robot emulator testing scol</tags>
    <packageTypes>
      <packageType name="%(kind)s" />
    </packageTypes>
  </metadata>
</package>
"""
SETTINGS = """<?xml version="1.0" encoding="utf-8"?>
<DotNetCliTool Version="2">
  <Commands>
    <Command Name="ts3100"%s />
  </Commands>%s
</DotNetCliTool>
"""
CONTENT_TYPES = """<?xml version="1.0" encoding="utf-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
  <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml" />
  <Default Extension="nuspec" ContentType="application/octet" />
  <Default Extension="xml" ContentType="application/octet" />
  <Default Extension="md" ContentType="application/octet" />
  <Default Extension="exe" ContentType="application/octet" />
%s</Types>
"""
OVERRIDE = '  <Override PartName=%s ContentType="application/octet" />\n'
RELATIONS = """<?xml version="1.0" encoding="utf-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
  <Relationship Type="http://schemas.microsoft.com/packaging/2010/07/manifest" Target="/%s.nuspec" Id="manifest" />
</Relationships>
"""


def package(path, identity, version, kind, about, files):
    """Writes a .nupkg: a zip file with the parts that the Open Packaging Conventions ask for."""
    parts = [("_rels/.rels", RELATIONS % identity, DATA),
             (identity + ".nuspec", NUSPEC % {"id": identity, "version": version, "kind": kind, "about": about}, DATA)]
    for name in ("LICENSE-APACHE", "LICENSE-MIT"):
        with open(os.path.join(ROOT, name), encoding="utf-8") as file:
            parts.append((name, file.read(), DATA))
    with open(os.path.join(HERE, "README.md"), encoding="utf-8") as file:
        parts.append(("README.md", file.read(), DATA))
    parts += files
    # A part without an extension needs its type by name.
    bare = "".join(OVERRIDE % quoteattr("/" + name) for name, _, _ in parts if "." not in os.path.basename(name))
    parts.insert(0, ("[Content_Types].xml", CONTENT_TYPES % bare, DATA))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content, mode in parts:
            entry = zipfile.ZipInfo(name, DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # so that the mode counts
            entry.external_attr = (0o100000 | mode) << 16
            archive.writestr(entry, content)
    return path


def pack(version, binaries, folder):
    """Writes the packages of the platforms, then the one that names them; the order in which to push them."""
    os.makedirs(folder, exist_ok=True)
    written, names = [], []
    for platform, content in binaries.items():
        program = "ts3100.exe" if platform.os == "win32" else "ts3100"
        for rid in platform.rids:
            settings = SETTINGS % (' EntryPoint="%s" Runner="executable"' % program, "")
            written.append(package(os.path.join(folder, "%s.%s.%s.nupkg" % (ID, rid, version)), "%s.%s" % (ID, rid), version,
                                   "DotnetToolRidPackage", " The binary for %s; install %s." % (rid, ID),
                                   [("tools/any/%s/DotnetToolSettings.xml" % rid, settings, DATA),
                                    ("tools/any/%s/%s" % (rid, program), content, PROGRAM)]))
            names.append('\n    <RuntimeIdentifierPackage RuntimeIdentifier="%s" Id="%s.%s" />' % (rid, ID, rid))
    settings = SETTINGS % ("", "\n  <RuntimeIdentifierPackages>%s\n  </RuntimeIdentifierPackages>" % "".join(names))
    written.append(package(os.path.join(folder, "%s.%s.nupkg" % (ID, version)), ID, version, "DotnetTool", "",
                           [("tools/any/any/DotnetToolSettings.xml", settings, DATA)]))
    return written


if __name__ == "__main__":
    sys.exit(command("Pack the binary as a .NET tool", pack))
