#!/usr/bin/env python3
"""Writes the seed corpus of every fuzz target from fixtures/ into the folder named: programs, transcripts, parameter files.

The formats are those that src/lib.rs and the targets read."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PORTS = ["HOST", "IP0", "COM1", "IP1", "IP2", "IP3"]
OPERATIONS = 24
RECEIVED, PASS = range(0, 9), 13


def operation(kind, port=0):
    """A byte that means `kind` (one of a range of numbers) on `port`."""
    for byte in range(port << 5, (port << 5) + 32):
        if byte % OPERATIONS in kind and byte >> 5 == port:
            return bytes([byte])
    raise SystemExit(f"no byte means {kind} on port {port}")


def received(port, data):
    parts = [data[at : at + 255] for at in range(0, len(data), 255)]
    return b"".join(operation(RECEIVED, port) + bytes([len(part)]) + part for part in parts)


def passing(millis):
    return operation(range(PASS, PASS + 1)) + millis.to_bytes(2, "big")


def transcript(text):
    script = b"\x00"
    for line in text.splitlines():
        found = re.match(r">> (\w+) ((?:[0-9A-F]{2} ?)+)$", line.strip())
        if found and found.group(1) in PORTS:
            script += received(PORTS.index(found.group(1)), bytes.fromhex(found.group(2))) + passing(60)
    return script


def around(source):
    """What a fixture says happens outside, as operations."""
    script = b"\x00\x00"
    for data in re.findall(r"^' @\d+ (?:ip1|key) (.*)$", source, re.M) or ["1,2,3", "4"]:
        script += received(PORTS.index("IP1"), data.encode() + b"\r") + passing(500)
    for line in re.findall(r"^' @\d+ din (\d+) on", source, re.M):
        line = int(line).to_bytes(2, "big")
        script += operation(range(19, 20), 4) + line + passing(300) + operation(range(19, 20)) + line
    return script + passing(3000) + operation(range(17, 18)) + passing(2000) + operation(range(16, 17)) + passing(9000)


def main(folder):
    folder = pathlib.Path(folder)
    for name in ["front", "run", "cell", "protocol", "parameters"]:
        (folder / name).mkdir(parents=True, exist_ok=True)
    for path in sorted((ROOT / "fixtures/scol").glob("*/*.scol")):
        name, source = f"{path.parent.name}-{path.stem}", path.read_text()
        arm = b"\x01" if "' arm: scara" in source else b"\x00"
        (folder / "front" / name).write_bytes(arm + source.encode())
        if path.parent.name != "err":
            tail = bytes((7 * at) % 256 for at in range(64))
            (folder / "run" / name).write_bytes(source.encode() + b"\x00" + tail)
            (folder / "cell" / name).write_bytes(source.replace("\n", "\r").encode() + around(source))
    for path in sorted((ROOT / "fixtures/transcripts").glob("*.txt")):
        (folder / "protocol" / path.stem).write_bytes(transcript(path.read_text()))
    for path in sorted((ROOT / "fuzz/parameters").glob("*.par")):
        (folder / "parameters" / path.stem).write_bytes(path.read_bytes())


if __name__ == "__main__":
    main(sys.argv[1])
