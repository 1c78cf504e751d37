#!/usr/bin/env python3
"""Packs the extension of Visual Studio Code: one package for each platform of the programs that it is given, and one without a
program. Needs Node.js 20 or newer and npm.

    python3 editors/vscode/vsix.py --out dist [--program ts3100]

Without --program, only the package without a program. A release is made by packaging/release.py, which uses this file.

The packages of npm that bundle and pack are those of package-lock.json, fetched once, into --tools. A package holds the program
compressed by Brotli: compressed as zip files do it, it would be a quarter larger."""

import argparse
import contextlib
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.join(ROOT, "clients"))
from binaries import PLATFORMS, Unfit, kind_of  # noqa: E402

TOOLS = os.path.join(ROOT, "target", "tools")
COPIED = ("package.json", "package-lock.json", "jsconfig.json", "language-configuration.json", "README.md", "src", "test", "walkthrough")
BROTLI = """
const fs = require("node:fs"), { brotliCompressSync, constants } = require("node:zlib");
const content = fs.readFileSync(process.argv[1]);
const params = { [constants.BROTLI_PARAM_LGWIN]: 24, [constants.BROTLI_PARAM_SIZE_HINT]: content.length };
fs.writeFileSync(process.argv[2], brotliCompressSync(content, { params }));
"""
LIMIT = 600


def run(*command, cwd, **variables):
    """A command that has to succeed; its output."""
    done = subprocess.run([str(word) for word in command], cwd=cwd, env={**os.environ, **variables}, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", timeout=LIMIT, check=False)
    if done.returncode:
        raise Unfit("%s: exit code %d\n%s" % (" ".join(map(str, command)), done.returncode, done.stdout))
    return done.stdout


def fetched(tools):
    """The node_modules of the lock file."""
    folder = os.path.join(os.path.abspath(tools), "vscode-extension")
    modules, note = os.path.join(folder, "node_modules"), os.path.join(folder, "installed")
    with open(os.path.join(HERE, "package-lock.json"), encoding="utf-8") as file:
        wanted = file.read()
    with contextlib.suppress(OSError), open(note, encoding="utf-8") as file:
        if file.read() == wanted:
            return modules
    print("installing the packages of editors/vscode/package-lock.json", flush=True)
    os.makedirs(folder, exist_ok=True)
    for name in ("package.json", "package-lock.json"):
        shutil.copy(os.path.join(HERE, name), folder)
    # Nothing of them needs a script of its own.
    run("npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", cwd=folder)
    with open(note, "w", encoding="utf-8") as file:
        file.write(wanted)
    return modules


def staged(folder, tools, version="0.0.0"):
    """A folder with the whole extension, bundled: what is here, the grammar and the licences."""
    for name in COPIED:
        copy = shutil.copytree if os.path.isdir(os.path.join(HERE, name)) else shutil.copy
        copy(os.path.join(HERE, name), os.path.join(folder, name))
    for path in ("editors/scol.tmLanguage.json", "LICENSE-APACHE", "LICENSE-MIT"):
        shutil.copy(os.path.join(ROOT, path), folder)
    os.symlink(fetched(tools), os.path.join(folder, "node_modules"))
    place = os.path.join(folder, "package.json")
    with open(place, encoding="utf-8") as file:
        document = json.load(file)
    document["version"] = version
    with open(place, "w", encoding="utf-8") as file:
        json.dump(document, file, indent=2)
    run("npm", "run", "--silent", "bundle", cwd=folder)
    with open(os.path.join(folder, "LICENSE-BUNDLED"), "w", encoding="utf-8") as file:
        file.write("\n".join(licences(folder)))
    return folder


def bundled(folder):
    """Every package that is in the bundle, as name and folder."""
    with open(os.path.join(folder, "bundled.json"), encoding="utf-8") as file:
        inputs = json.load(file)["inputs"]
    # A link leads to the packages: their paths begin elsewhere, and end alike.
    found = {re.match(r"(.*node_modules/((?:@[^/]+/)?[^/]+))/", path) for path in inputs if "node_modules/" in path}
    return sorted({(one[2], os.path.join(folder, one[1])) for one in found})


def licences(folder):
    """The licence of every package that is in the bundle, whose terms ask for it."""
    for name, package in bundled(folder):
        texts = [text for text in sorted(os.listdir(package)) if re.match("licen[cs]e", text, re.IGNORECASE)]
        if not texts:
            raise Unfit("%s is bundled and has no licence" % name)
        with open(os.path.join(package, texts[0]), encoding="utf-8") as file:
            yield "%s\n\n%s" % (name, file.read().replace("\r\n", "\n"))


def sbom(path, tools, version):
    """What is bundled, as CycloneDX."""
    parts = set()
    with tempfile.TemporaryDirectory() as folder:
        staged(folder, tools, version)
        for _, package in bundled(folder):
            with open(os.path.join(package, "package.json"), encoding="utf-8") as file:
                document = json.load(file)
            parts.add("%(name)s@%(version)s" % document)
        os.remove(os.path.join(folder, "node_modules"))
        # Its --omit=dev leaves out what a tool needs as well.
        document = json.loads(run("npm", "sbom", "--sbom-format=cyclonedx", "--package-lock-only", cwd=folder))
    document["components"] = [one for one in document["components"] if one["bom-ref"] in parts]
    if {one["bom-ref"] for one in document["components"]} != parts:
        raise Unfit("the bill of materials of the extension lacks some of " + ", ".join(sorted(parts)))
    own = document["metadata"]["component"]
    document["dependencies"] = [{"ref": own["bom-ref"], "dependsOn": sorted(parts)}]
    # npm takes the name of the folder.
    own["name"] = "ts3100-vscode"
    # They would be random, and of this hour and machine.
    document.pop("serialNumber", None)
    document["metadata"] = {"component": own}
    with open(path, "w", encoding="utf-8") as file:
        json.dump(document, file, indent=1, sort_keys=True)
        file.write("\n")


def compressed(content, tools):
    """The program as the package holds it. That takes half a minute, so it is kept."""
    kept = os.path.join(os.path.abspath(tools), "vscode-extension", hashlib.sha256(content).hexdigest() + ".br")
    if not os.path.exists(kept):
        with tempfile.TemporaryDirectory(dir=os.path.dirname(kept)) as scratch:
            source, made = os.path.join(scratch, "program"), os.path.join(scratch, "made")
            with open(source, "wb") as file:
                file.write(content)
            run("node", "-e", BROTLI, source, made, cwd=scratch)
            os.replace(made, kept)
    return kept


def targets(platform):
    """The names that the marketplace has for a platform. A static program runs on Alpine too, which is one of its own there."""
    static = any("musl" in rid for rid in platform.rids)
    return [platform.npm, *(["alpine-" + platform.cpu] if static else [])]


def pack(version, binaries, out, tools=TOOLS, time=0):
    """Writes the packages of these programs, {platform: content}, and the one without; their paths. `time` is the date of all
    files in them."""
    out = os.path.abspath(out)
    os.makedirs(out, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        staged(folder, tools, version)
        dated = {"SOURCE_DATE_EPOCH": str(time)} if time else {}
        vsce = [os.path.join(folder, "node_modules", ".bin", "vsce"), "package", "--no-dependencies", "--skip-license",
                "--allow-missing-repository"]
        written = [os.path.join(out, "ts3100-vscode-%s.vsix" % version)]
        run(*vsce, "--allow-unused-files-pattern", "--out", written[0], cwd=folder, **dated)
        os.mkdir(os.path.join(folder, "bin"))
        for platform, content in binaries.items():
            shutil.copy(compressed(content, tools), os.path.join(folder, "bin", "ts3100.br"))
            for target in targets(platform):
                written.append(os.path.join(out, "ts3100-vscode-%s-%s.vsix" % (target, version)))
                run(*vsce, "--target", target, "--out", written[-1], cwd=folder, **dated)
    return written


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description="Pack the extension of Visual Studio Code")
    parser.add_argument("--out", required=True, help="the folder for the packages")
    parser.add_argument("--program", metavar="FILE", help="the program for one platform")
    parser.add_argument("--tools", metavar="DIR", default=TOOLS, help="where tools are kept")
    parser.add_argument("--version", default="0.0.0", help="the version of the packages")
    options = parser.parse_args()
    binaries = {}
    try:
        if options.program:
            with open(options.program, "rb") as file:
                content = file.read()
            found = kind_of(content)
            platform = next((one for one in PLATFORMS.values() if one[:2] == found), None)
            if not platform:
                raise Unfit("%s is not a program" % options.program)
            binaries[platform] = content
        for path in pack(options.version, binaries, options.out, options.tools):
            print("%s: %d bytes" % (path, os.path.getsize(path)))
    except (Unfit, OSError) as error:
        print("error: cannot pack: %s" % error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
