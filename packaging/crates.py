#!/usr/bin/env python3
"""Packs the crates of the workspace as crates.io would get them, and builds each from its package. Publishes nothing unless asked.

    packaging/crates.py              cargo publish --dry-run of all crates, in the order in which they depend on each other
    packaging/crates.py --list       the order, and the files of each package
    packaging/crates.py --publish    publishes them; needs CARGO_REGISTRY_TOKEN

A crate embeds files that lie outside of it, such as the book or a model of an arm, and a package has only what is inside. So a copy
of the workspace is packed, in which these files are in the crate and every dependency on a crate of ours has its version."""

import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r'(include_(?:str|bytes)!\(\s*")((?:\.\./)+[^"]+)("\s*\))')
PATH = re.compile(r'^(\S+ = \{ path = "crates/[^"]+")(?!.*version)', re.MULTILINE)


def cargo(*words, cwd=ROOT):
    """A run of cargo that has to succeed; its output."""
    return subprocess.run(["cargo", *words], cwd=cwd, stdout=subprocess.PIPE, text=True, check=True).stdout


def crates(root):
    """The crates that are published, {name: names of ours that it needs}, each after those."""
    packages = {package["name"]: package for package in json.loads(cargo("metadata", "--format-version", "1", "--no-deps", cwd=root))["packages"]
                if package["publish"] != []}
    needs = {name: {needed["name"] for needed in package["dependencies"] if needed["kind"] != "dev" and needed["name"] in packages}
             for name, package in packages.items()}
    ordered = {}
    while len(ordered) < len(needs):
        ready = sorted(name for name in needs if name not in ordered and needs[name] <= set(ordered))
        if not ready:
            sys.exit("crates depend on each other in a circle: %s" % ", ".join(sorted(set(needs) - set(ordered))))
        ordered.update((name, sorted(needs[name])) for name in ready)
    return ordered


def stage(folder):
    """A copy of the workspace with its crates alone, as they are in the working tree."""
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "Cargo.toml", "Cargo.lock", "crates",
                             "LICENSE-*"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.split("\0")[:-1]
    for name in filter(lambda name: (ROOT / name).exists(), listed):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    manifest = (folder / "Cargo.toml").read_text()
    number = re.search(r'^version = "(.*)"', manifest, re.MULTILINE)[1]
    manifest = re.sub(r'(, )?"(tests|benches)"', "", manifest)
    manifest = PATH.sub(lambda found: '%s, version = "=%s"' % (found[1], number), manifest)
    (folder / "Cargo.toml").write_text(manifest)
    # The build script of the book packs the pages that are beside it, and the files of JSON that they link.
    for page in [*(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.json")]:
        copy = folder / "crates/book/pages" / page.relative_to(ROOT / "docs")
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(page, copy)
    for crate in (folder / "crates").iterdir():
        for licence in folder.glob("LICENSE-*"):
            shutil.copy(licence, crate)
        for source in crate.rglob("*.rs"):
            taken = []

            def inside(found, source=source, crate=crate, taken=taken):
                original = (ROOT / source.relative_to(folder).parent / found[2]).resolve()
                if original.is_relative_to(ROOT / crate.relative_to(folder)):
                    return found[0]
                copy = crate / "embedded" / original.relative_to(ROOT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(original, copy)
                taken.append(copy)
                return found[1] + os.path.relpath(copy, source.parent) + found[3]

            text = INCLUDE.sub(inside, source.read_text())
            if taken:
                source.write_text(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="the order, and the files of each package")
    parser.add_argument("--publish", action="store_true", help="publish them")
    parser.add_argument("--target-dir", metavar="DIR", default=ROOT / "target/crates", type=os.path.abspath, help="where cargo builds")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ts3100-crates-") as folder:
        folder = pathlib.Path(folder).resolve()
        stage(folder)
        ordered = crates(folder)
        for number, (name, needs) in enumerate(ordered.items(), 1):
            print("%d. %s%s" % (number, name, " after " + ", ".join(needs) if needs else ""), flush=True)
            if options.list:
                print("".join("     %s\n" % file for file in cargo("package", "--list", "-p", name, cwd=folder).split()), end="")
        if not options.list:
            # All at once: cargo takes each from the package that it has just made, not from the registry, and in this order.
            chosen = [word for name in ordered for word in ("-p", name)]
            subprocess.run(["cargo", "publish", *chosen, "--target-dir", str(options.target_dir), *([] if options.publish else ["--dry-run"])],
                           cwd=folder, check=True)
    print("%d crates" % len(ordered))


if __name__ == "__main__":
    try:
        main()
    except subprocess.CalledProcessError as error:
        sys.exit("error: %s: exit code %d" % (" ".join(map(str, error.cmd)), error.returncode))
