"""What `cargo deny check bans licenses sources` says, of the same deny.toml, where building cargo-deny would take longer
than everything else here: the licence of every package, where it comes from, and that no requirement is a wildcard. Known
holes and yanked packages need data from outside; cargo-deny looks them up before a release.

    python3 .ci/licences.py
"""

import json
import re
import subprocess
import sys
import tomllib

CRATES_IO = "registry+https://github.com/rust-lang/crates.io-index"


def allowed(expression, licences):
    """Whether an SPDX expression can be met by these licences: `A OR B`, `A AND B`, parentheses, the old `A/B`."""
    words = re.findall(r"[()]|[^\s()]+", expression.replace("/", " OR "))

    def term():
        word = words.pop(0)
        if word == "(":
            met = either()
            words.pop(0)
            return met
        if words[:1] == ["WITH"]:
            word = " ".join((word, words.pop(0), words.pop(0)))
        return word in licences

    def both():
        met = term()
        while words[:1] == ["AND"]:
            words.pop(0)
            met = term() and met
        return met

    def either():
        met = both()
        while words[:1] == ["OR"]:
            words.pop(0)
            met = both() or met
        return met

    return either()


def complaints(packages, rules):
    """One line for each thing that the rules do not let pass."""
    exceptions = {row["crate"]: row["allow"] for row in rules["licenses"].get("exceptions", [])}
    for package in packages:
        name = "%s %s" % (package["name"], package["version"])
        licences = rules["licenses"]["allow"] + exceptions.get(package["name"], [])
        expression = package["license"]
        if not expression:
            yield "%s: names no licence" % name
        elif not allowed(expression, licences):
            yield "%s: %s is not among the licences of deny.toml" % (name, expression)
        if package["source"] not in (None, CRATES_IO):
            yield "%s: comes from %s, not from crates.io" % (name, package["source"])
        if package["source"] is None:
            for needed in package["dependencies"]:
                if needed["req"] == "*" and not needed.get("path"):
                    yield "%s: any version of %s would do" % (name, needed["name"])
    unused = set(exceptions) - {package["name"] for package in packages}
    for name in sorted(unused):
        yield "deny.toml: the exception for %s is of no use any more" % name


def main():
    # First itself: a check that lets everything pass is none.
    assert allowed("(MIT OR GPL-3.0) AND Zlib", ["MIT", "Zlib"]) and not allowed("MIT AND GPL-3.0", ["MIT"])
    assert allowed("GPL-2.0/MIT", ["MIT"]) and not allowed("Apache-2.0 WITH LLVM-exception", ["Apache-2.0"])
    with open("deny.toml", "rb") as file:
        rules = tomllib.load(file)
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--all-features"]
    packages = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)["packages"]
    found = list(complaints(packages, rules))
    print("\n".join(found) or "%d packages: licences and sources as deny.toml allows" % len(packages))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
