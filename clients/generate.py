#!/usr/bin/env python3
"""Writes what the clients take from the OpenAPI document: the table of operations, and the fields of documents.

    python3 clients/generate.py            writes the files
    python3 clients/generate.py --check    fails if one of them differs from what it would write

A row of the table is a method and a URI template: `PUT /inputs/{line}`, `GET /transcript{?format}`. Records are the documents that
methods return with fields of their own; everything else stays JSON, with its types for Python and TypeScript."""

import json
import os
import re
import sys
import textwrap

HERE = os.path.dirname(os.path.abspath(__file__))
DOCUMENT = os.path.join(HERE, "..", "crates", "control", "assets", "openapi.json")
NOTE = "Written by clients/generate.py from the OpenAPI document. Do not edit."
WIDTH = 130
# Record, its schema, and its fields in the order of a constructor.
RECORDS = {
    "Program": ("ProgramStatus", "file status line"),
    "Alarm": ("ActiveAlarm", "number level text cause remedy at"),
    "Finding": ("Event", "rule severity message remedy t port text caused-by"),
    "Fault": ("Fault", "id kind spec armed seen fired at"),
    "Clock": ("Clock", "mode now calendar"),
    "Reached": ("WaitResult", "now passed"),
    "Pose": ("ArmPosture", "joints world moving percent"),
}
MEANINGS = {
    "Program": "The selected program.", "Alarm": "An alarm, with its cause and its remedy.",
    "Finding": "A mistake of a host, or what a fault has caused; `ts3100 docs findings` lists the rules.",
    "Fault": "A fault and its outcome.", "Clock": "The virtual time and how it passes.", "Reached": "The end of a wait.",
    "Pose": "Joints in degrees (the third of a SCARA in mm), and the tool point in the world in mm and degrees.",
}


def operations(document):
    """Operation by method and URI template."""
    for path, item in document["paths"].items():
        for method, operation in item.items():
            query = [entry["name"] for entry in operation.get("parameters", []) if entry["in"] == "query"]
            yield operation["operationId"], "%s %s%s" % (method.upper(), path, "{?%s}" % ",".join(query) if query else "")


def named(schema):
    """The schema that a reference names, or None."""
    return schema["$ref"].split("/")[-1] if "$ref" in schema else None


def type_of(schema, words):
    """A schema in the words of a language: of JSON types, `list`, `any` and `union`."""
    if "$ref" in schema:
        return words["name"](named(schema))
    if "enum" in schema:
        return words["literal"](schema["enum"])
    for choice in ("oneOf", "anyOf"):
        if choice in schema:
            return words["union"]([type_of(entry, words) for entry in schema[choice]])
    if isinstance(schema.get("type"), list):
        return words["union"]([type_of({**schema, "type": kind}, words) for kind in schema["type"]])
    if schema.get("type") == "array":
        return words["list"](type_of(schema.get("items", {}), words))
    if schema.get("type") == "object" and schema.get("properties") and "shape" in words:
        return words["shape"](schema)
    return words.get(schema.get("type"), words["any"])


def flattened(schema, schemas):
    """Properties and required names of a schema, and of its parts (`allOf`)."""
    properties, required = dict(schema.get("properties", {})), set(schema.get("required", []))
    for part in schema.get("allOf", []):
        more, needed = flattened(schemas[named(part)] if named(part) else part, schemas)
        properties.update(more)
        required |= needed
    return properties, required


def python_types():
    return {"name": lambda name: '"%s"' % document_name(name), "literal": lambda words: "Literal[%s]" % ", ".join('"%s"' % word for word in words),
            "union": lambda all: "Optional[%s]" % all[0] if all[1:] == ["None"] else "Union[%s]" % ", ".join(dict.fromkeys(all)) if len(set(all)) > 1 else all[0],
            "list": lambda item: "List[%s]" % item, "any": "Any", "string": "str", "number": "float", "integer": "int",
            "boolean": "bool", "null": "None", "object": "Dict[str, Any]"}


def python(document):
    """operations.py: the table, records as data classes, documents as typed dictionaries."""
    schemas, words = document["components"]["schemas"], python_types()
    text = ['"""%s"""' % NOTE, "", "from dataclasses import dataclass",
            "from typing import Any, Dict, List, Literal, Optional, Tuple, TypedDict, Union", "", "OPERATIONS = {"]
    text += ['    "%s": "%s",' % row for row in operations(document)] + ["}"]
    for record, fields in records(schemas):
        text += ["", "", "@dataclass(frozen=True)", "class %s:" % record, '    """%s"""' % MEANINGS[record], ""]
        for name, kind, required, description in fields:
            plain = {"string": "str", "number": "float", "integer": "int", "boolean": "bool", "numbers": "Tuple[float, ...]"}[kind]
            empty = {"string": '""', "number": "0.0"}.get(kind)
            text.append("    %s: %s%s" % (name.replace("-", "_"), plain, "" if required else " = " + empty))
            text.append('    """%s"""' % description)
    text.append("")
    text.append("")
    for name in reachable(document):
        properties, required = flattened(schemas[name], schemas)
        if not properties:
            text += wrapped("%s = %s" % (name, type_of(schemas[name], words)))
            continue
        fields = ", ".join('"%s": %s' % (field, type_of(schema, words)) for field, schema in properties.items())
        total = "" if required >= set(properties) else ", total=False"
        text += wrapped('%s = TypedDict("%s", {%s}%s)' % ((document_name(name),) * 2 + (fields, total)))
    return "\n".join(text) + "\n"


def document_name(name):
    """A record has the plain name."""
    return name + "Document" if name in RECORDS else name


def wrapped(line):
    """Lines of at most WIDTH, none of which ends between a name and its type."""
    joined = re.sub(r"(:|\|) ", "\\1\0", line).replace(" |", "\0|")
    lines = textwrap.wrap(joined, WIDTH, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)
    return [line.replace("\0", " ") for line in lines]


def reachable(document):
    """The schemas that responses are made of, each after those it is made of."""
    schemas, found = document["components"]["schemas"], []

    def visit(node, trail):
        if isinstance(node, dict):
            name = named(node)
            if name and name not in found and name not in trail and name != "Problem":
                visit(schemas[name], trail | {name})
                found.append(name)
            for key, value in node.items():
                if key not in ("example", "examples", "description"):
                    visit(value, trail)
        elif isinstance(node, list):
            for value in node:
                visit(value, trail)

    for item in document["paths"].values():
        for operation in item.values():
            visit({status: response for status, response in operation["responses"].items() if status == "200"}, frozenset())
    return found


def records(schemas):
    """Record and its fields: name, kind, whether it is required, description."""
    for record, (schema, fields) in RECORDS.items():
        properties, required = flattened(schemas[schema], schemas)
        yield record, [(name, kind_of(properties[name], schemas), name in required or record == "Finding" and index < 5,
                        sentence(properties[name].get("description", ""))) for index, name in enumerate(fields.split())]


def kind_of(schema, schemas):
    """string, number, integer, boolean or numbers."""
    while named(schema):
        schema = schemas[named(schema)]
    kind = schema["type"] if isinstance(schema["type"], str) else schema["type"][0]
    return "numbers" if kind == "array" else kind


def sentence(text):
    return " ".join(text.split()).replace('"', "'")


def typescript_words(schemas):
    """JSON types in TypeScript."""
    words = {"name": lambda name: name, "literal": lambda all: " | ".join('"%s"' % word for word in all),
             "union": lambda all: " | ".join(dict.fromkeys(all)), "list": lambda item: ("(%s)[]" if " " in item else "%s[]") % item,
             "any": "any", "string": "string", "number": "number", "integer": "number", "boolean": "boolean", "null": "null",
             "object": "Record<string, any>"}
    words["shape"] = lambda schema: braces(members(schema, schemas, words))
    return words


def members(schema, schemas, words):
    """Member and type of an object; an optional one ends in `?`."""
    properties, required = flattened(schema, schemas)
    return {(name if re.fullmatch(r"\w+", name) else '"%s"' % name) + ("" if name in required else "?"): type_of(value, words)
            for name, value in properties.items()}


def braces(fields):
    return "{ %s }" % "; ".join("%s: %s" % field for field in fields.items()) if fields else "Record<string, any>"


def shapes(document):
    """Of each schema, members and types, or a type; of each operation, call, arguments, body and result."""
    schemas = document["components"]["schemas"]
    words = typescript_words(schemas)
    types = {name: members(schema, schemas, words) or type_of(schema, words) for name, schema in schemas.items()}
    calls, templates = {}, dict(operations(document))
    for item in document["paths"].values():
        for operation in item.values():
            arguments = {entry["name"] + ("" if entry.get("required") else "?"): type_of(entry["schema"], words) for entry in operation.get("parameters", [])}
            body = ""
            for media in operation.get("requestBody", {}).get("content", {}).values():
                kinds = [type_of(entry, words) for entry in media["schema"].get("oneOf", [media["schema"]]) if entry.get("type") != "null"]
                body = "(%s)" % " | ".join(kinds) if len(kinds) > 1 else kinds[0]
            content = operation["responses"]["200"].get("content", {})
            result = type_of(content["application/json"]["schema"], words) if "application/json" in content else "string"
            calls[operation["operationId"]] = {"call": templates[operation["operationId"]], "arguments": arguments, "body": body, "result": result}
    return {"types": types, "operations": calls}


def typescript(document):
    """operations.d.ts: every document, and arguments and result of every operation."""
    shape = shapes(document)
    text = ["// " + NOTE]
    for name, fields in shape["types"].items():
        text += wrapped("export type %s = %s;" % (name, braces(fields) if isinstance(fields, dict) else fields))
    text += ["", "/** Operations of the control interface: [arguments, result]. */", "export interface Operations {"]
    for name, call in shape["operations"].items():
        parts = ([braces(call["arguments"])] if call["arguments"] else []) + ([call["body"]] if call["body"] else [])
        text += ["  " + line for line in wrapped("%s: [%s, %s];" % (name, " & ".join(parts) or "{}", call["result"]))]
    return "\n".join(text + ["}"]) + "\n"


def javascript(document):
    """operations.js: the table."""
    rows = ['  %s: "%s",' % row for row in operations(document)]
    return "\n".join(['"use strict";', "// " + NOTE, "module.exports = {", *rows, "};"]) + "\n"


def pascal(name):
    return "".join(word.capitalize() for word in re.split("[-_]", name))


def csharp(document):
    """Operations.cs: the table, and records as plain classes."""
    names = {"t": "Seconds", "id": "Number"}
    text = ["// " + NOTE, "using System.Collections.Generic;", "", "namespace Ts3100", "{", "    static class Operations", "    {",
            "        public static readonly Dictionary<string, string> All = new Dictionary<string, string>", "        {"]
    text += ['            { "%s", "%s" },' % row for row in operations(document)] + ["        };", "    }"]
    kinds = {"string": ("string", "Text"), "number": ("double", "Number"), "integer": ("int", "Whole"), "boolean": ("bool", "Truth"),
             "numbers": ("double[]", "Numbers")}
    for record, fields in records(document["components"]["schemas"]):
        text += ["", "    /// <summary>%s</summary>" % MEANINGS[record], "    public sealed partial class %s" % record, "    {"]
        assignments = []
        for name, kind, _, description in fields:
            plain, reader = ("Severity", "Severity") if name == "severity" else kinds[kind]
            member = names.get(name, pascal(name))
            text += ["        /// <summary>%s</summary>" % description.replace("&", "&amp;").replace("<", "&lt;"),
                     "        public readonly %s %s;" % (plain, member)]
            assignments.append('            %s = Read.%s(json, "%s");' % (member, reader, name))
        text += ["        internal %s(Json json)" % record, "        {", *assignments, "        }", "    }"]
    return "\n".join(text + ["}"]) + "\n"


def cpp(document):
    """The block of ts3100.hpp: records as structures, and the table."""
    kinds = {"string": "std::string", "number": "double", "integer": "int", "boolean": "bool", "numbers": "std::vector<double>"}
    text = []
    for record, fields in records(document["components"]["schemas"]):
        text += ["/// " + MEANINGS[record], "struct %s {" % record]
        readers = []
        for name, kind, _, description in fields:
            plain, member = "Severity" if name == "severity" else kinds[kind], name.replace("-", "_")
            text.append("    %s %s;  ///< %s" % (plain, member, description))
            readers.append('%s(detail::member<%s>(json, "%s"))' % (member, plain, name))
        text += ["    explicit %s(const Json& json)" % record, *("        %s %s," % (":" if index == 0 else " ", reader)
                 for index, reader in enumerate(readers))]
        text[-1] = text[-1][:-1] + " {}"
        text += ["};"]
    text += ["", "namespace detail {", "", "/// Method and URI template of an operation; empty if there is no such operation.",
             "inline std::string operation(const std::string& name) {", "    static const std::map<std::string, std::string> all = {"]
    text += ['        {"%s", "%s"},' % row for row in operations(document)]
    text += ["    };", "    const auto found = all.find(name);", '    return found == all.end() ? "" : found->second;', "}", "",
             "}  // namespace detail"]
    with open(os.path.join(HERE, "cpp", "ts3100.hpp"), encoding="utf-8") as file:
        before, mark, rest = file.read().partition("// generated: %s\n" % NOTE)
    return before + mark + "\n".join(text) + "\n" + "// end of generated\n" + rest.partition("// end of generated\n")[2]


FILES = {"python/src/ts3100/operations.py": python, "npm/ts3100/operations.js": javascript, "npm/ts3100/operations.d.ts": typescript,
         "dotnet/Ts3100.Client/Operations.cs": csharp, "cpp/ts3100.hpp": cpp}


def main():
    with open(DOCUMENT, encoding="utf-8") as file:
        document = json.load(file)
    stale = []
    for name, writer in FILES.items():
        path, text = os.path.join(HERE, name), writer(document)
        try:
            with open(path, encoding="utf-8") as file:
                same = file.read() == text
        except FileNotFoundError:
            same = False
        if not same and "--check" not in sys.argv:
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        stale += [] if same else [name]
    if stale and "--check" in sys.argv:
        sys.exit("clients/%s: differs from the OpenAPI document; run clients/generate.py" % stale[0])
    print("%d files, %s" % (len(FILES), "written: " + " ".join(stale) if stale else "as they should be"))


if __name__ == "__main__":
    main()
