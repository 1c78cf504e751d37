"""Types what README.md shows of a session, word for word, and compares what comes back.

    python3 tests/system/docs/readme_session.py README.md TARGET_DIRECTORY LOG_OF_THE_ROBOT

Each fenced block behind a line <!-- ci:session --> is taken: of `sh` every line is typed, of `console` the lines behind
`$ ` and what a here-document needs, the others are what has to be printed; of `text` each line stands in the log of the
robot, behind its time. The blocks share one shell, in a directory where nothing but `target` is."""

import os
import subprocess
import sys
import tempfile
import time

import page_examples

MARK = "<!-- ci:session -->"
LIMIT = 60.0
END = "--- end of this command ---"


def blocks(path):
    """(language, lines) of each marked block."""
    with open(path, encoding="utf-8") as page:
        lines = page.read().split("\n")
    for number, line in enumerate(lines):
        if line == MARK:
            begin = next(k for k in range(number, len(lines)) if lines[k].startswith("```"))
            end = next(k for k in range(begin + 1, len(lines)) if lines[k].startswith("```"))
            yield lines[begin][3:], lines[begin + 1:end]


def commands(language, lines):
    """(what is typed, what is to be printed or None where the page does not say) of a block."""
    return [("\n".join(lines), None)] if language == "sh" else page_examples.commands(lines)


def in_log(line, log):
    """Whether a line of the log says so, sooner or later."""
    limit = time.monotonic() + LIMIT
    while time.monotonic() < limit:
        with open(log, encoding="utf-8") as written:
            if any(" ".join(found.split()).endswith(" " + line) for found in written):
                return True
        time.sleep(0.1)
    return False


def main():
    page, target, log = sys.argv[1:]
    found = list(blocks(page))
    steps = [step for language, lines in found if language != "text" for step in commands(language, lines)]
    if not steps:
        sys.exit("%s has no block behind %s" % (page, MARK))
    script = "shopt -s expand_aliases\n" + "".join("%s\necho '%s'\n" % (typed, END) for typed, _ in steps)
    with tempfile.TemporaryDirectory(prefix="ts3100-session-") as directory:
        os.symlink(os.path.abspath(target), os.path.join(directory, "target"))
        shell = subprocess.run(["bash"], input=script, cwd=directory, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               timeout=LIMIT, check=False)
    answers = shell.stdout.split(END + "\n")
    if len(answers) != len(steps) + 1:
        sys.exit("the session did not come to its end:\n" + shell.stdout)
    for (typed, expected), printed in zip(steps, answers):
        if expected is not None and printed.rstrip("\n").split("\n") != (expected or [""]):
            sys.exit("%s: behind\n  $ %s\nit shows\n%s\n     found\n%s" % (page, typed, "\n".join(expected), printed))
    said = [line for language, lines in found if language == "text" for line in lines]
    for line in said:
        if not in_log(line, log):
            sys.exit("%s: the log of the robot does not say %r" % (page, line))
    print("%d commands of the session and %d lines of the log are as %s shows them" % (len(steps), len(said), page))


if __name__ == "__main__":
    main()
