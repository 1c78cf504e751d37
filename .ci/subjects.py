#!/usr/bin/env python3
"""Refuses commits whose subject has more than 72 characters: those that a branch has and its base has not.

    python3 .ci/subjects.py [BASE]    (default: origin/main)

`git log --oneline` is how a history is read, and a terminal has 80 columns. CONTRIBUTING.md says what belongs in a subject."""

import subprocess
import sys

LONGEST = 72


def main():
    base = sys.argv[1] if len(sys.argv) > 1 else "origin/main"
    listed = subprocess.run(["git", "log", "--no-merges", "--format=%h %s", base + "..HEAD"], stdout=subprocess.PIPE, text=True, check=True)
    commits = [line.split(" ", 1) for line in listed.stdout.splitlines()]
    long = [(commit, subject) for commit, subject in commits if len(subject) > LONGEST]
    for commit, subject in long:
        print("error: commit %s: its subject has %d characters, at most %d:\n    %s" % (commit, len(subject), LONGEST, subject))
    if long:
        sys.exit("Shorten the subject and say why in the body: git rebase -i %s, then `reword`." % base)
    print("%d commits since %s, each with a subject of at most %d characters" % (len(commits), base, LONGEST))


if __name__ == "__main__":
    main()
