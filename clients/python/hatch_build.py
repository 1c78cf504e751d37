"""Puts the program `ts3100` into the wheel, and names the platforms it runs on.

The release feeds every channel from one build, so the program comes from TS3100_BINARY when it is set. Otherwise cargo builds
it from the checkout. That is why this is not maturin, which always compiles.
"""

from __future__ import annotations

import os
import re
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Machine of an ELF, a PE and a Mach-O program, in the words of wheel tags.
ELF_MACHINES = {62: "x86_64", 183: "aarch64"}
PE_MACHINES = {0x8664: "win_amd64", 0xAA64: "win_arm64"}
# Rust's minimum versions of macOS.
MACHO_MACHINES = {0x01000007: "macosx_10_12_x86_64", 0x0100000C: "macosx_11_0_arm64"}
PT_INTERP = 3


class ProgramHook(BuildHookInterface[Any]):
    """Called by hatchling for each wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        program = self._program()
        data = program.read_bytes()
        platform = platform_tag(data)
        name = "ts3100.exe" if platform.startswith("win") else "ts3100"
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{platform}"
        build_data["shared_scripts"] = {str(program): name}

    def _program(self) -> Path:
        chosen = os.environ.get("TS3100_BINARY")
        if chosen:
            path = Path(chosen).resolve()
            if not path.is_file() and not Path(chosen).is_absolute():
                raise SystemExit(f"error: cannot build the wheel: TS3100_BINARY is {chosen}; give the whole path, since the wheel is "
                                 "built in another directory")
            if not path.is_file():
                raise SystemExit(f"error: cannot build the wheel: TS3100_BINARY is {chosen}, which is not a file")
            return path
        workspace = Path(self.root).parents[1]
        cargo = shutil.which("cargo")
        if not cargo or not (workspace / "Cargo.toml").is_file():
            raise SystemExit("error: cannot build the wheel: it needs cargo and a checkout of the project, or TS3100_BINARY with "
                             "the path of a program that is built already")
        subprocess.run([cargo, "build", "--release", "--locked", "--package", "ts3100-emulator"], cwd=workspace, check=True)
        target = Path(os.environ.get("CARGO_TARGET_DIR") or workspace / "target")
        return (workspace / target / "release" / ("ts3100.exe" if os.name == "nt" else "ts3100")).resolve()


def platform_tag(program: bytes) -> str:
    """The platform part of a wheel's tag, from the head of the program itself: a cross build says what it is for."""
    if program.startswith(b"\x7fELF\x02\x01"):
        machine = ELF_MACHINES.get(struct.unpack_from("<H", program, 18)[0])
        if machine:
            return ".".join(f"{system}_{machine}" for system in _linux(program))
    elif program.startswith(b"MZ"):
        (offset,) = struct.unpack_from("<I", program, 60)
        platform = PE_MACHINES.get(struct.unpack_from("<H", program, offset + 4)[0])
        if platform:
            return platform
    elif program.startswith(b"\xcf\xfa\xed\xfe"):
        platform = MACHO_MACHINES.get(struct.unpack_from("<I", program, 4)[0])
        if platform:
            return platform
    raise SystemExit("error: cannot build the wheel: the program is none for Linux, Windows or macOS on x86-64 or ARM64")


def _linux(program: bytes) -> list[str]:
    """Static programs run on every Linux, others on those with their version of glibc."""
    (table,) = struct.unpack_from("<Q", program, 32)
    size, count = struct.unpack_from("<HH", program, 54)
    types = [struct.unpack_from("<I", program, table + size * entry)[0] for entry in range(count)]
    if PT_INTERP not in types:
        return ["manylinux_2_17", "manylinux2014", "musllinux_1_1"]
    versions = [int(minor) for minor in re.findall(rb"\0GLIBC_2\.(\d+)", program)]
    return [f"manylinux_2_{max(versions)}"] if versions else ["linux"]
