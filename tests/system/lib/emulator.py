"""A fresh `ts3100 serve` for the checks of the control interface, and how they fail."""

import json
import os
import signal
import subprocess
import sys


def fail(text):
    print("FAILED %s" % text, file=sys.stderr)
    sys.exit(1)


class Emulator:
    """A fresh `ts3100 serve` in stepped time, with a token if one is given; it ends with its `with`."""

    def __init__(self, binary, token=None):
        environment = {name: value for name, value in os.environ.items() if not name.startswith("TS3100_")}
        self.token = token
        if token:
            environment["TS3100_CONTROL_TOKEN"] = token
        self.process = subprocess.Popen([binary, "serve", "--ports", "auto", "--ready-json", "--time", "stepped"],
                                        env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                        start_new_session=True)
        line = self.process.stdout.readline()
        if not line:
            fail("the emulator did not start")
        self.url = json.loads(line)["control"]
        self.authority = self.url[len("http://"):]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        self.process.stdout.close()
