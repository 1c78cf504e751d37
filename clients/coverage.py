#!/usr/bin/env python3
"""Writes docs/reference/clients.md: which method of which client makes each call, as docs/reference/controls.json and their sources say.

    python3 clients/coverage.py            writes the page
    python3 clients/coverage.py --check    fails if it would change

It fails for an operation that a client has no method for, unless GENERIC has the reason; for one that the command line or the embedding
has none for without a reason; for a method with a name of its own in one client; and for a test of the how-to pages that makes other
calls than the same test in another language."""

import json
import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(HERE)
PAGE = os.path.join(ROOT, "docs", "reference", "clients.md")
# Operations that `call` is enough for.
DATA = "data of a page of the browser"
DEBUGGER = "for `ts3100 dap`"
GENERIC = {
    "get_alarm_table": "a table of the documentation", "get_alarm_row": "a table of the documentation",
    "get_fault_kinds": "a table of the documentation", "get_arm": DATA, "get_program_stack": DEBUGGER, "evaluate_expression": DEBUGGER,
    "assign_variable": DEBUGGER, "step_task": DEBUGGER, "get_channels": "part of `state`", "check_program": DATA,
    "get_coverage": DATA, "decode_text": DATA, "get_events": "a stream; with `count` it ends", "get_fault": "`faults` has it",
    "get_health": "for monitoring", "get_metrics": "for monitoring", "get_lines": DATA, "get_parameters": DATA, "get_power": "`state` has it",
    "get_robot": "`address` has its ports", "get_scenario": DATA, "get_snapshot": "a file", "load_snapshot": "a file; JavaScript rounds its seeds",
    "get_named_snapshot": "a file", "get_status_frame": DATA, "get_version": "for the report of a fault", "get_wires": DATA,
    "put_outside": "only with a file of wires",
}
# Methods of the embedding that return or take something else than those of the clients, and so have another name.
EMBEDDED = {"get_clock": "now", "get_program": "status", "put_position": "set_variable", "get_outputs": "read",
            "get_snapshot": "write_snapshot"}
NOT_EMBEDDED = {"check_program": "`scol-mini` checks programs", "decode_text": "`ts3100-proto` reads texts", "put_outside": "one robot has no wires"}
# File, the declaration of a method, and how it spells a name of several words.
CLIENTS = {
    "Python": ("python/src/ts3100/robot.py", r"^    (?:def )?(\w+)(?:\(| = _Setting)"),
    "C#": ("dotnet/Ts3100.Client/Robot.cs", r"^        public [^=(]*?(\w+)\("),
    "JavaScript": ("npm/ts3100/index.js", r"^  (?:async )?(\w+)\(.*\{"),
    "C++": ("cpp/ts3100.hpp", r"^    [\w:<>, ]+? (\w+)\(.*\) const \{"),
}
HOSTS = {"C#": ("dotnet/Ts3100.Client/Host.cs", r"^        public (?!const)[^=({]*?(\w+)\("),
         "JavaScript": ("npm/ts3100/host.js", r"^  (?:static )?(?:async )?(\w+)\(.*\{"), "C++": ("cpp/ts3100.hpp", r"^    [\w:<>, ]+? (\w+)\(.*\) \{")}
# Calls that a language has for itself.
OWN_NAMES = {"dispose", "connect", "constructor", "close", "timeout", "stops"}
PAGES = {"Python": "pytest.md", "C#": "csharp.md", "JavaScript": "node.md", "C++": "cpp.md"}
KINDS = {"Lines": ("input", "output"), "Variables": ("variable", "position"), "Files": ("file",)}


def read(*path):
    with open(os.path.join(*path), encoding="utf-8") as file:
        return file.read()


def plain(name):
    """A name in small letters and underscores."""
    return re.sub(r"(?<=[a-z0-9])([A-Z])", r"_\1", name).lower()


def methods(client, operations):
    """Operation to the methods whose body has its name."""
    path, declaration = CLIENTS[client]
    found, owner, method = {}, "Robot", ""
    for line in read(HERE, path).splitlines():
        if re.match(r"class (\w+)", line):
            owner = re.match(r"class (\w+)", line)[1]
        if re.match(declaration, line):
            method = re.match(declaration, line)[1]
        if line.lstrip().startswith(("//", "*")) or method == "call":
            continue
        for name in re.findall(r'(?:[cC]all|[aA]wait|_request)\("(\w+)"', line):
            found.setdefault(name, []).append(method)
            if name not in operations:
                raise SystemExit("clients/%s: %s is not an operation" % (path, name))
        if client == "Python":
            for setting in re.findall(r'_Setting\[.*\]\("(\w+)"', line):
                found.update({"get_" + setting: [method], "put_" + setting: [method]})
            for kind in KINDS.get(owner, ()):
                name = {"__getitem__": "%ss[]" % kind, "__setitem__": "%ss[]" % kind, "__delitem__": "del %ss[]" % kind,
                        "__iter__": "list(%ss)" % kind, "__len__": "list(%ss)" % kind}.get(method, "%ss.%s" % (kind, method))
                for begin, end in re.findall(r'f"(\w+_)\{self\._kind\}(s?)"', line):
                    found.setdefault(begin + kind + end, []).append(name)
                for literal in set(re.findall(r'"(\w+)"', line)) & set(operations):
                    found[literal] = [name.replace("variables.teach", "positions.teach")]
    if client == "Python":
        found["get_robots"] = ["address"]
    return {name: list(dict.fromkeys(one for one in those if not one.startswith("_"))) for name, those in found.items()}


def embedding(controls, methods):
    """Operation to the method of the embedding, which has the name of the clients' `methods`; GET of anything else is `read` with a closure."""
    sources = "".join(read(ROOT, "crates", "emulator", "src", *path).partition("impl Emulator {")[2] for path in (("embed.rs",), ("embed", "control.rs")))
    table = read(ROOT, "crates", "controller", "src", "controls.rs")
    known = set(re.findall(r"pub fn (\w+)", sources)) | set(re.findall(r"^    (\w+)\([^()]*(?:\([^()]*\))?[^()]*\) =>", sources, re.MULTILINE))
    # The rows of the table of controls are methods, too: switches by what sets them, buttons by their name.
    known |= set(re.findall(r"^ +act: (\w+),", table.partition("buttons {")[0], re.MULTILINE))
    known |= set(re.findall(r"^ +(\w+): \w+ = \"/[^\"]+\" \{", table, re.MULTILINE))
    found = {}
    for row in controls:
        operation = row["operation"]
        names = [EMBEDDED[operation]] if operation in EMBEDDED else [plain(name) for name in methods.get(operation, [operation, operation.replace("get_", "")])]
        name = next((name for name in names if name in known), "read" if row["method"] == "GET" else "")
        if name:
            found[operation] = name
        elif operation not in NOT_EMBEDDED:
            raise SystemExit("%s: the embedding has no method %s" % (operation, " or ".join(names)))
    return found


def matrix(controls):
    """Rows of the page, and what is wrong."""
    operations = {row["operation"]: row for row in controls}
    clients = {client: methods(client, operations) for client in CLIENTS}
    embedded = embedding(controls, clients["C#"])
    rows, wrong = [], ["GENERIC names %s, which is not an operation" % name for name in GENERIC if name not in operations]
    for operation, row in operations.items():
        cells = {client: clients[client].get(operation) for client in CLIENTS}
        lacking = [client for client in CLIENTS if not cells[client]]
        if lacking and operation not in GENERIC:
            wrong.append("%s: no method in %s" % (operation, ", ".join(lacking)))
        if not row["ctl"] and operation not in GENERIC:
            wrong.append("%s: no command of ctl" % operation)
        names = {tuple(plain(name) for name in cells[client]) for client in list(CLIENTS)[1:] if cells[client]}
        if len(names) > 1:
            wrong.append("%s: other names in other languages: %s" % (operation, sorted(names)))
        # In Python, a setting is an attribute without `set_`, and lines, variables and files are mappings.
        attributes = {name for name in cells["Python"] or () if re.fullmatch(r"\w+", name)}
        if names and attributes and not attributes & {re.sub("^set_", "", name) for those in names for name in those}:
            wrong.append("%s: Python has another name: %s" % (operation, sorted(attributes)))
        shown = [" ".join("`%s`" % name for name in cells[client]) if cells[client] else "`call`" for client in CLIENTS]
        around = [row["ctl"][-1].replace("|", "\\|") if row["ctl"] else "", embedded.get(operation, ""), " ".join(row["assistants"])]
        shown = ["`%s`" % name if name else "none" for name in around[:2]] + shown + ["`%s`" % name if name else "none" for name in around[2:]]
        rows.append("| `%s` | `%s %s` | %s |" % (operation, row["method"], row["path"], " | ".join(shown)))
    return rows, wrong


def bodies(client):
    """The classes Host and Channel of a client."""
    text = read(HERE, HOSTS[client][0])
    for name in ("Host", "Channel"):
        body = re.search(r"^( *)(?:public sealed )?class %s\b.*?^\1\}" % name, text, re.MULTILINE | re.DOTALL)[0]
        yield name, [name for name in dict.fromkeys(plain(one) for one in re.findall(HOSTS[client][1], body.split("private:")[0], re.MULTILINE))
                     if name not in OWN_NAMES | {"host", "channel"} and not name.endswith("_")]


def hosts():
    """Rows of the commands, and what is wrong."""
    commands = re.findall(r"^    (\w+) = Operation\(", read(HERE, "python", "src", "ts3100", "host.py"), re.MULTILINE) + ["wait_for_stop"]
    # Sends what is not the protocol; the others leave that to a socket.
    commands.remove("raw")
    lines = re.findall(r"^    def ([a-z]\w+)\(", read(HERE, "python", "src", "ts3100", "channel.py"), re.MULTILINE)
    known = {"Host": commands, "Channel": [name for name in lines if name not in ("connect", "open_serial", "close")]}
    docs = dict(re.findall(r'    def (\w+)\(.*?"""(.*?)[."]', read(HERE, "python", "src", "ts3100", "protocol.py"), re.DOTALL))
    wrong, have = [], {}
    for client in HOSTS:
        for name, found in bodies(client):
            have[client, name] = found
            wrong += ["%s of %s has `%s`, which Python has not" % (name, client, one) for one in found if one not in known[name]]
    wrong += ["Channel of %s has no `%s`" % (client, name) for client in HOSTS for name in known["Channel"] if name not in have[client, "Channel"]]
    rows = []
    for name in commands:
        letters = re.match(r"[A-Z]{2}(?:,[A-Z0-9]+)?(?:, [A-Z]{2} and [A-Z]{2})?(?=:)", docs.get(name, ""))
        via = "`query`" if re.search(r"(?s)def %s\(.*?(self\.query|_binary)" % name, command_body(name)) else "`command`"
        rows.append("| `%s` | %s | %s |" % (name, letters[0] if letters else "", " | ".join("yes" if name in have[client, "Host"] else via for client in HOSTS)))
    return rows, wrong


def command_body(name):
    """The source of a command in Python."""
    found = re.search(r"^    def %s\(.*?(?=^    def |\Z)" % name, read(HERE, "python", "src", "ts3100", "protocol.py"), re.MULTILINE | re.DOTALL)
    return found[0] if found else ""


def dialogue(page):
    """The calls of the test `A dialogue and the emergency stop` of a page, in the words of Python."""
    text = read(ROOT, "docs", "how-to", page).partition("## A dialogue and the emergency stop")[2]
    code = re.search(r"^```\w+\n(.*?)^```", text, re.MULTILINE | re.DOTALL)[1]
    begin = min(code.index(word) for word in ("ervo_on()", "ervoOn()") if word in code)
    calls = []
    for who, what, value in re.findall(r"\b([Rr]obot|host|channel)\.(\w+)( = )?", code[begin - 20:]):
        name = plain(what)
        # What ends the test differs: a `with`, a `using`, a scope, a `close`.
        if name not in ("close", "allow"):
            calls.append("%s.%s%s" % (who.lower(), "set_" if value else "", name))
    return calls


def main():
    rows, wrong = matrix(json.loads(read(ROOT, "docs", "reference", "controls.json")))
    commands, more = hosts()
    wrong += more
    expected = dialogue(PAGES["Python"])
    if len(expected) < 12:
        wrong.append("docs/how-to/pytest.md: the dialogue makes %d calls, too few" % len(expected))
    for client, page in PAGES.items():
        if dialogue(page) != expected:
            wrong.append("docs/how-to/%s: the dialogue makes other calls than that of Python:\n  %s\n  %s" % (page, dialogue(page), expected))
    if wrong:
        sys.exit("\n".join(wrong))
    generic = ["| `%s` | %s |" % row for row in {**GENERIC, **{name: "%s; %s" % (GENERIC[name], why) for name, why in NOT_EMBEDDED.items()}}.items()]
    parts = {"commands": ["| Method | Command | %s |" % " | ".join(HOSTS), "|---|---|" + "---|" * len(HOSTS), *commands],
             "operations": ["| Operation | Call | `ctl` | Rust | %s | Assistants |" % " | ".join(CLIENTS), "|---|---|---|---|---|" + "---|" * len(CLIENTS), *rows],
             "generic": ["| Operation | Why |", "|---|---|", *generic]}
    text = read(PAGE)
    for name, lines in parts.items():
        text = re.sub(r"(<!-- clients: %s -->\n).*?(<!-- end of clients -->)" % name, lambda mark: mark[1] + "\n".join(lines) + "\n" + mark[2], text, flags=re.DOTALL)
    if text != read(PAGE):
        if "--check" in sys.argv:
            sys.exit("docs/reference/clients.md differs from the sources; run clients/coverage.py")
        with open(PAGE, "w", encoding="utf-8") as file:
            file.write(text)
    print("%d operations and %d commands, each with its way in every client" % (len(rows), len(commands)))


if __name__ == "__main__":
    main()
