#!/usr/bin/env python3
"""Packs the binary for npm: a package `ts3100` with a launcher, and a package @ts3100/PLATFORM for each binary, which
are its optional dependencies; npm installs the one that fits. Needs npm.

    python3 clients/npm/pack.py --version 0.1.0 --out dist x86_64-unknown-linux-musl=ts3100 x86_64-pc-windows-msvc=ts3100.exe

Publish the packages in the order in which they are printed: `ts3100` last."""

import json
import os
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.dirname(HERE))
from binaries import Unfit, command  # noqa: E402

PACK_TIMEOUT = 120


def tarball(source, folder):
    """`npm pack` of a folder."""
    for name in ("LICENSE-APACHE", "LICENSE-MIT"):
        shutil.copy(os.path.join(ROOT, name), source)
    done = subprocess.run(["npm", "pack", "--json", "--ignore-scripts", "--pack-destination", os.path.abspath(folder)],
                          cwd=source, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=PACK_TIMEOUT)
    if done.returncode:
        raise Unfit("npm pack: " + done.stderr.strip())
    return os.path.join(folder, json.loads(done.stdout)[0]["filename"])


def write(path, document):
    """A package.json."""
    with open(path, "w", encoding="utf-8") as file:
        json.dump(document, file, indent=2)
        file.write("\n")


def pack(version, binaries, folder):
    """Writes the packages of the platforms, then the one that depends on them; the order in which to publish them."""
    os.makedirs(folder, exist_ok=True)
    written = []
    with tempfile.TemporaryDirectory() as scratch:
        for platform, content in binaries.items():
            source = os.path.join(scratch, platform.npm)
            os.makedirs(source)
            program = "ts3100.exe" if platform.os == "win32" else "ts3100"
            write(os.path.join(source, "package.json"), {
                "name": "@ts3100/" + platform.npm, "version": version, "license": "MIT OR Apache-2.0",
                "description": "The binary of ts3100 for %s; install ts3100 instead" % platform.npm,
                "os": [platform.os], "cpu": [platform.cpu], "files": [program, "LICENSE-*"],
                # Yarn must not leave the program in a zip file.
                "preferUnplugged": True})
            with open(os.path.join(source, program), "wb") as file:
                file.write(content)
            os.chmod(os.path.join(source, program), 0o755)
            written.append(tarball(source, folder))
        source = os.path.join(scratch, "ts3100")
        shutil.copytree(os.path.join(HERE, "ts3100"), source)
        with open(os.path.join(source, "package.json"), encoding="utf-8") as file:
            document = json.load(file)
        document["version"] = version
        document["optionalDependencies"] = {"@ts3100/" + platform.npm: version for platform in binaries}
        write(os.path.join(source, "package.json"), document)
        written.append(tarball(source, folder))
    return written


if __name__ == "__main__":
    sys.exit(command("Pack the binary for npm", pack))
