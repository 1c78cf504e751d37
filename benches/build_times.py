#!/usr/bin/env python3
"""How long people wait for a build, beside one that they know: ripgrep 14.1.1, built in the same run.

    python3 benches/build_times.py

Three builds from nothing, one after the other: ripgrep with its release profile, `cargo build --release` of this workspace, and what
`cargo test` builds before it runs. Sources are fetched before. The seconds depend on the machine and the hour, the ratios little.
Prints a table; nothing is checked, for a busy hour would fail it."""

import os
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PEER, VERSION = "ripgrep", "14.1.1"
# What is aimed at, as multiples of the peer's build.
BUILDS = [("cargo build --release", ["build", "--release"], 1.8), ("cargo test --workspace --no-run", ["test", "--workspace", "--no-run"], 2.6)]


def cargo(*words, cwd=ROOT, **variables):
    subprocess.run(["cargo", *words], cwd=cwd, env={**os.environ, **variables}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)


def seconds(*words, cwd=ROOT, target):
    shutil.rmtree(target, ignore_errors=True)
    begun = time.monotonic()
    cargo(*words, "--locked", "--offline", cwd=cwd, CARGO_TARGET_DIR=target)
    took = time.monotonic() - begun
    shutil.rmtree(target)
    return took


def fetched(folder):
    """The sources of the peer and of all it needs."""
    # `cargo info` gets the package into the cache of the registry.
    cargo("info", "%s@%s" % (PEER, VERSION), cwd=folder)
    home = os.environ.get("CARGO_HOME") or os.path.join(os.path.expanduser("~"), ".cargo")
    cache = os.path.join(home, "registry", "cache")
    name = "%s-%s" % (PEER, VERSION)
    package = next(os.path.join(cache, index, name + ".crate") for index in os.listdir(cache)
                   if os.path.exists(os.path.join(cache, index, name + ".crate")))
    shutil.unpack_archive(package, folder, "gztar")
    source = os.path.join(folder, name)
    cargo("fetch", "--locked", cwd=source)
    return source


def main():
    with tempfile.TemporaryDirectory() as folder:
        source, target = fetched(folder), os.path.join(folder, "target")
        cargo("fetch", "--locked")
        peer = seconds("build", "--release", cwd=source, target=target)
        print("%-34s %6.0f s" % ("%s %s" % (PEER, VERSION), peer), flush=True)
        for name, words, aim in BUILDS:
            took = seconds(*words, target=target)
            print("%-34s %6.0f s  %.2f times, aim %.1f" % (name, took, took / peer, aim), flush=True)


if __name__ == "__main__":
    sys.exit(main())
