"""Plays the calls of a file at a URL by Robot.call, and prints an answer a line: tests/system/lib/recorded_calls.py compares them."""

import json
import sys
from pathlib import Path

from ts3100 import Refused, Robot

with Robot.connect(sys.argv[2]) as robot:
    for call in json.loads(Path(sys.argv[1]).read_text()):
        try:
            print(json.dumps(robot.call(call["operation"], call["arguments"])))
        except Refused as error:
            print(json.dumps({"error": str(error)}))
