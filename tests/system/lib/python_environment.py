"""Runs a script again in an environment of its own, with the packages of PyPI that it needs."""

import os
import subprocess
import sys
import tempfile

# Tells the second run that it is one.
VARIABLE = "TS3100_TEST_PACKAGES"


def run_with(*packages):
    """The exit code of this script with these packages; `None` in that run itself, which goes on."""
    if os.environ.get(VARIABLE):
        return None
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        python = os.path.join(folder, "bin", "python")
        subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *packages], check=True)
        return subprocess.run([python, *sys.argv], env={**os.environ, VARIABLE: "1"}, check=False).returncode
