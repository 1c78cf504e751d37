#!/usr/bin/env python3
"""The Wireshark dissector, read by tshark: our own captures, and a capture of a wire that is none of ours.

    python3 tests/system/packages/wireshark_dissector.py

The captures of the emulator are those of tests/suites/wireshark.rs, whose tests are ignored where nobody asks
for them. The other one is made here, byte by byte: TCP at a port nobody has told the dissector. Without tshark this
fails (apt-get install tshark). The exit code is 0 when everything was read as it should be."""

import os
import shutil
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from steps import Failed, equal, program, true  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
SCRIPT = os.path.join(ROOT, "packaging", "wireshark", "ts3100.lua")
LINKTYPE_RAW = 101
HOST, ROBOT = (0x0A000001, 40000), (0x0A000002, 5000)
FIELDS = ["ts3100.sender", "ts3100.command", "ts3100.meaning", "ts3100.reply", "ts3100.answer_to", "ts3100.sf.servo"]


def packet(source, target, sequence, acknowledged, flags, data):
    """An IPv4 packet with a TCP segment; tshark does not ask for the checksums."""
    tcp = struct.pack(">HHIIBBHHH", source[1], target[1], sequence, acknowledged, 5 << 4, flags, 65535, 0, 0)
    length = 20 + len(tcp) + len(data)
    ip = struct.pack(">BBHHHBBHII", 0x45, 0, length, 0, 0, 64, 6, 0, source[0], target[0])
    return ip + tcp + data


class Wire:
    """A connection as a capture has it."""

    def __init__(self):
        self.packets = []
        self.sent = {HOST: 1, ROBOT: 1}
        self.send(HOST, b"", 0x02)
        self.send(ROBOT, b"", 0x12)
        self.sent = {HOST: 2, ROBOT: 2}

    def send(self, source, data, flags=0x18):
        target = ROBOT if source is HOST else HOST
        self.packets.append(packet(source, target, self.sent[source], self.sent[target], flags, data))
        self.sent[source] += len(data)

    def write(self, path):
        with open(path, "wb") as capture:
            capture.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, LINKTYPE_RAW))
            for at, data in enumerate(self.packets):
                capture.write(struct.pack("<IIII", at, 0, len(data), len(data)) + data)


def read(path):
    """What tshark prints of each packet that is a text."""
    words = ["tshark", "-X", "lua_script:" + SCRIPT, "-r", path, "-Y", "ts3100", "-T", "fields", "-E", "separator=|"]
    for field in FIELDS:
        words += ["-e", field]
    found = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True, check=False)
    if found.returncode != 0 or "Lua" in found.stderr:
        raise Failed("tshark: " + found.stderr)
    return found.stdout.splitlines()


def another_wire(directory):
    record = bytearray(250)
    record[0] = 1
    wire = Wire()
    for source, data in [
            (HOST, b"\x02SO\r\x03"), (ROBOT, b"\x02OK\r\x03"),
            (HOST, b"\x02QQ\r\x03"), (ROBOT, b"\x02NG\r\x03"),
            (HOST, b"SF\r\x03"), (ROBOT, b"FL," + bytes(record[:100])), (ROBOT, bytes(record[100:]) + b"\x03"),
            (HOST, b"OK\r\x03")]:
        wire.send(source, data)
    path = os.path.join(directory, "wire.pcap")
    wire.write(path)
    expected = [
        "host|SO|servo power on|||", "controller|||OK|SO|",
        "host|QQ|unknown command|||", "controller|||NG|QQ|",
        "host|SF|system total status|||", "controller|||FL|SF|1",
        "host|OK|affirmative answer|||",
    ]
    equal("a capture of another wire, at a port nobody has named", expected, read(path))


def main():
    true("tshark is installed (apt-get install tshark)", shutil.which("tshark"))
    with tempfile.TemporaryDirectory(prefix="ts3100-wire-") as directory:
        another_wire(directory)
    # With the whole workspace, as everything else is built: the package alone would be built anew, with other features.
    tests = ["cargo", "test", "-q", "--locked", "--workspace", "--test", "suites", "--", "--include-ignored", "--skip", "bless_", "wireshark::"]
    equal("the captures of the emulator are read", 0, subprocess.run(tests, cwd=ROOT, check=False).returncode)


if __name__ == "__main__":
    sys.exit(program(main))
