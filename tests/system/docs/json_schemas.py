#!/usr/bin/env python3
"""The JSON schemas for editors against the program: what the pages show is taken by both, and a mistake is refused by both.

    python3 tests/system/docs/json_schemas.py --serve target/release/ts3100

A file that one takes and the other refuses would be a wrong word in somebody's editor, or a silent one."""

import copy
import glob
import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import python_environment  # noqa: E402
from emulator import ROOT, surroundings  # noqa: E402
from steps import Failed, equal, program, serving, true  # noqa: E402

PACKAGES = ["jsonschema==4.26.0"]
LIMIT = 60
# The file of the schema, the words that print it, the flag that reads such a file.
FILES = {"config": ("configuration", "--config"), "scenario": ("scenario", "--scenario"), "faults": ("faults", "--faults")}
# How `exec` ends when the emulator cannot start.
CANNOT_START = 125
# One mistake each: more than a wrong key, which is tried in every table.
MISTAKES = {
    "config": ("port-offset = 70000", "dialect = 'old'", "[options]\ntext.stx = 'maybe'", "[options]\nsig.low_speed = 0",
               "[options]\ndo.min_run = '200'", "[options]\nnone = 1", "load = [1]"),
    "scenario": ("name = 1", "[start]\nkey-switch = 'TEACHING'", "[start]\ninputs = 5", "[start]\nservo-on = 'yes'",
                 "[[do]]\nactions = ['servo on']", "[[do]]\nat = '1 s'\nwhen = 'idle'\nactions = []",
                 "[[do]]\nat = '1 s'\ntimes = 2\nactions = []", "[[do]]\nat = '1 s'", "[[do]]\nat = 1\nactions = []",
                 "[[do]]\nat = '1 hour'\nactions = []", "[[do]]\nat = '1 s'\nactions = 'servo on'",
                 "[[do]]\nat = '1 s'\nactions = ['servos on']", "[[expect]]\nwhat = 'idles'", "[[expect]]\nwithin = '1 s'",
                 "[[expect]]\nwhat = 'idle'\ntimes = 0", "[[never]]\nwhat = 'idle'\nwithin = '1 s'", "do = 3"),
    "faults": ("fault = 3", "[[fault]]\nafter = 1", "[[fault]]\nkind = 'ngg'", "[[fault]]\nkind = 'ng'\nafter = -1",
               "[[fault]]\nkind = 'ng'\nprobability = 2", "[[fault]]\nkind = 'ng'\ncommand = 'XX'", "[[fault]]\nkind = 'ng'\nchannel = 'IP1'",
               "[[fault]]\nkind = 'ng'\nid = 0", "[[fault]]\nkind = 'late-reply'\ndelay = '1 hour'", "[[fault]]\nkind = 'late-reply'\ndelay = -1",
               "[[fault]]\nkind = 'alarm'\nnumber = '9-999'", "[[fault]]\nkind = 'flipped-bit'\nway = 'up'",
               "[[fault]]\nkind = 'ng'\ndelay = 5"),
}
# Of kinds whose parameters no page shows.
MORE = {
    "scenario": ("[[do]]\nwhen = 'alarm'\nafter = '.5 s'\ntimes = 0\nactions = ['channel IP1 inject 4<CR>', 'faults arm ng:command=SU']\n"
                 "[[expect]]\nwhat = 'printed DONE'\nwithin = '5. min'\nafter = 'command SU'\ntimes = 2\n"
                 "[[never]]\nname = 'x'\nwhat = 'line 3'\nuntil = 'idle'\nafter = 'servo off'",),
    "faults": ("[[fault]]\nkind = 'slow-line'\nspeed = 1200\nchannel = 'IP0'\n[[fault]]\nkind = 'wrong-reply'\ncommand = 'SO'\ntext = 'OK<CR>'\n"
               "[[fault]]\nkind = 'alarm'\nnumber = '4-101'\n[[fault]]\nkind = 'flipped-bit'\nway = 'in'\nbyte = 1\nbit = '0'\n"
               "[[fault]]\nid = 7\nkind = 'late-reply'\ndelay = '1500'\n[[fault]]\nkind = 'late-reply'\ncommand = 'SU'\ndelay = 250",),
}


def shown():
    """The files that the pages show, and what the configuration of the Debian package suggests: {schema: [text]}."""
    found = {name: list(MORE.get(name, ())) for name in FILES}
    for page in glob.glob(os.path.join(ROOT, "docs", "**", "*.md"), recursive=True):
        with open(page, encoding="utf-8") as file:
            text = file.read()
        blocks = re.findall(r"^```toml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
        blocks += re.findall(r"^cat > \S+\.toml <<'EOF'\n(.*?)^EOF$", text, re.MULTILINE | re.DOTALL)
        for block in blocks:
            keys = set(tomllib.loads(block))
            if "fault" in keys and os.path.basename(page) == "faults.md":
                found["faults"].append(block)
            elif keys & {"do", "expect", "never", "start"}:
                found["scenario"].append(block)
            elif os.path.basename(page) == "configuration.md":
                found["config"].append(block)
    with open(os.path.join(ROOT, "packaging", "debian", "ts3100.toml"), encoding="utf-8") as file:
        # Its suggestions, without a file that is not here.
        found["config"].append("\n".join(re.findall(r"^#((?!control-token-file)[\w-]+ = .*)$", file.read(), re.MULTILINE)))
    return found


class Program:
    """The program as a reader of files."""

    def __init__(self, binary, folder):
        self.binary, self.folder = binary, folder

    def schema(self, words):
        done = subprocess.run([self.binary, "config", "schema", words], stdout=subprocess.PIPE, text=True, timeout=LIMIT, check=True)
        return json.loads(done.stdout)

    def refuses(self, flag, text):
        """What it says of a file that it refuses; `None` if it takes it."""
        path = os.path.join(self.folder, "file.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        for name in tomllib.loads(text).get("start", {}).get("load", []) or tomllib.loads(text).get("load", []):
            with open(os.path.join(self.folder, str(name)), "w", encoding="utf-8") as file:
                file.write("PROGRAM PICK\nEND\n")
        command = [self.binary, "exec", "--ports", "auto", "--control", "off", flag, path, "--", "true"]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=LIMIT,
                              env=surroundings())
        return done.stderr if done.returncode == CANNOT_START else None


def agree(program, flag, text, errors, says):
    """Schema and program both take the file, for `says` None, or both refuse it, the program in these words."""
    if bool(errors) != (says is not None):
        raise Failed("the schema %s\n%s\n%s" % ("refuses" if errors else "takes", text, errors))
    said = program.refuses(flag, text)
    if (said is None) != (says is None) or (says and says not in said):
        raise Failed("the program %s\n%s\n%s" % ("takes" if said is None else "refuses", text, said))


def with_a_wrong_key(document):
    """The document with a key that nobody knows, once in each of its tables."""
    def tables(node, path):
        if isinstance(node, dict):
            yield path
            for key, value in node.items():
                yield from tables(value, [*path, key])
        elif isinstance(node, list):
            for index, value in enumerate(node):
                yield from tables(value, [*path, index])

    for path in tables(document, []):
        changed = copy.deepcopy(document)
        node = changed
        for step in path:
            node = node[step]
        node["qqq"] = 1
        yield changed


def toml(document):
    """A document as TOML: inline but for the top."""
    def value(node):
        if isinstance(node, dict):
            return "{ %s }" % ", ".join("%s = %s" % (json.dumps(key), value(inner)) for key, inner in node.items())
        if isinstance(node, list):
            return "[%s]" % ", ".join(map(value, node))
        return json.dumps(node)

    return "".join("%s = %s\n" % (json.dumps(key), value(node)) for key, node in document.items())


def main():
    arguments = serving(__doc__).parse_args()
    code = python_environment.run_with(*PACKAGES)
    if code is not None:
        return code
    import jsonschema

    with tempfile.TemporaryDirectory() as folder:
        reader = Program(os.path.realpath(arguments.serve), folder)
        for name, texts in shown().items():
            words, flag = FILES[name]
            with open(os.path.join(ROOT, "docs", "reference", name + ".schema.json"), encoding="utf-8") as file:
                schema = json.load(file)
            equal("config schema %s prints the file of docs/reference" % words, schema, reader.schema(words))
            jsonschema.Draft202012Validator.check_schema(schema)
            validator = jsonschema.Draft202012Validator(schema)
            wrong = 0
            for text in texts:
                agree(reader, flag, text, [error.message for error in validator.iter_errors(tomllib.loads(text))], None)
                for changed in with_a_wrong_key(tomllib.loads(text)):
                    agree(reader, flag, toml(changed), None if validator.is_valid(changed) else ["wrong key"], "qqq")
                    wrong += 1
            for text in MISTAKES[name]:
                agree(reader, flag, text, None if validator.is_valid(tomllib.loads(text)) else ["mistake"], "")
            true("%s: %d files of the pages are taken by schema and program; both refuse %d wrong keys and %d mistakes"
                 % (name, len(texts), wrong, len(MISTAKES[name])), texts and wrong)


if __name__ == "__main__":
    sys.exit(program(main))
