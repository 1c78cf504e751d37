"""Virtual environments with the packages of PyPI that a program needs."""

import os
import subprocess
import sys
import tempfile
import venv

# Tells the second run that it is one.
VARIABLE = "TS3100_TEST_PACKAGES"


def python_with(folder, *packages):
    """The interpreter of a virtual environment in this folder, made unless it is there, with these packages."""
    python = os.path.join(os.path.abspath(folder), "bin", "python")
    if not os.path.exists(python):
        venv.create(os.path.abspath(folder), with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *packages], check=True)
    return python


def run_with(*packages):
    """The exit code of this program with these packages; `None` in that run itself, which goes on."""
    if os.environ.get(VARIABLE):
        return None
    with tempfile.TemporaryDirectory() as folder:
        command = [python_with(folder, *packages), *sys.argv]
        return subprocess.run(command, env={**os.environ, VARIABLE: "1"}, check=False).returncode
