"""Finds the program `ts3100` that came with this package."""

from __future__ import annotations

import os
import shutil
import sys
import sysconfig
from pathlib import Path

from .errors import StartError

NAME = "ts3100.exe" if os.name == "nt" else "ts3100"


def find_binary() -> str:
    """The path of the program: that of TS3100_BINARY, of this installation, or of PATH, in this order."""
    chosen = os.environ.get("TS3100_BINARY")
    if chosen:
        if os.path.isfile(chosen):
            return chosen
        raise StartError(f"cannot find the program: TS3100_BINARY is {chosen}, which is not a file")
    user = f"{os.name}_user"
    schemes = [sysconfig.get_path("scripts")]
    if user in sysconfig.get_scheme_names():
        schemes.append(sysconfig.get_path("scripts", user))
    # `pip install --target DIR` puts the program into DIR/bin, and the package into DIR.
    schemes.append(str(Path(__file__).parents[1] / "bin"))
    for folder in schemes:
        path = os.path.join(folder, NAME)
        if os.path.isfile(path):
            return path
    found = shutil.which("ts3100")
    if found:
        return found
    raise StartError(f"cannot find the program {NAME} of this package; looked in {', '.join(schemes)} and PATH. "
                     "Install the package again, or set TS3100_BINARY")


def main() -> None:
    """`python -m ts3100 ...`: the program; it replaces this process where the system can do that."""
    command = [find_binary(), *sys.argv[1:]]
    if os.name == "nt":
        import subprocess

        sys.exit(subprocess.run(command).returncode)
    os.execv(command[0], command)
