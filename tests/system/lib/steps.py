"""Steps of the programs of `tests/system`: each prints what it saw, and the first that does not hold ends its program. Also
their command line and their end."""

import argparse
import os
import subprocess
import time


class Failed(Exception):
    """A step did not see what it had to see."""


def ok(what):
    """Report a step that held."""
    print("ok   " + what, flush=True)


def show(data):
    """Bytes as a person reads them: hexadecimal and text."""
    if not isinstance(data, (bytes, bytearray)):
        return repr(data)
    text = "".join(chr(b) if 0x20 <= b < 0x7F else "<%02X>" % b for b in data)
    return "%s   (%s)" % (data.hex(" "), text) if len(data) <= 64 else "%d bytes: %s" % (len(data), text)


def equal(what, expected, found):
    """The step holds when both are the same."""
    if expected != found:
        raise Failed("%s\n     expected %s\n     found    %s" % (what, show(expected), show(found)))
    ok(what)


def true(what, condition, found=""):
    """The step holds when the condition does."""
    if not condition:
        raise Failed("%s\n     found    %s" % (what, show(found)))
    ok(what)


def until(what, condition, timeout, state=lambda: "", pause=0.05):
    """Looks again and again until a condition holds. Returns its value; fails with `state()` after so many seconds."""
    limit = time.monotonic() + timeout
    while True:
        found = condition()
        if found:
            return found
        if time.monotonic() > limit:
            raise Failed("%s within %g s\n     found    %s" % (what, timeout, state()))
        time.sleep(pause)


def serving(description):
    """A command line that names the program to be started."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--serve", metavar="TS3100", required=True, type=os.path.abspath, help="the program to be started")
    return parser


def program(job, *arguments):
    """Runs a job; the exit code of the program, 1 after the first step that did not hold."""
    begun = time.monotonic()
    try:
        code = job(*arguments)
    except (Failed, OSError, subprocess.SubprocessError) as error:
        print("FAIL %s" % error, flush=True)
        return 1
    if not code:
        print("all of it held, in %.1f s" % (time.monotonic() - begun), flush=True)
    return code or 0
