#!/usr/bin/env python3
"""Takes the picture of the control page that README.md shows, with Chromium (apt-get install chromium).

    python3 tests/page_picture.py --serve target/release/ts3100 --out docs/images/control-page.png

Without --out the picture is taken and thrown away: the exit code is 0 if the page has rendered the state of the robot."""

import argparse
import json
import os
import subprocess
import sys
import tempfile

SIZE = "1200,900"
LIMIT = 60


def main():
    parser = argparse.ArgumentParser(description="takes the picture of the control page")
    parser.add_argument("--serve", required=True, metavar="BINARY", help="the ts3100 to be used")
    parser.add_argument("--out", metavar="FILE", help="where the picture goes")
    options = parser.parse_args()
    binary = os.path.abspath(options.serve)
    robot = subprocess.Popen([binary, "serve", "--ports", "auto", "--ready-json", "--servo-on"],
                             stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        ready = json.loads(robot.stdout.readline())
        ip0 = "127.0.0.1:%d" % ready["ports"]["ip0"]
        for command in (["sl", "DEMO"], ["rn", "--wait"], ["rn"]):
            subprocess.run([binary, "host", ip0, *command], check=True, stdout=subprocess.DEVNULL, timeout=LIMIT)
        with tempfile.TemporaryDirectory(prefix="ts3100-picture-") as directory:
            picture = options.out or os.path.join(directory, "page.png")
            subprocess.run(["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                            "--user-data-dir=" + directory, "--window-size=" + SIZE, "--virtual-time-budget=3000",
                            "--screenshot=" + os.path.abspath(picture), ready["control"] + "/"],
                           check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=LIMIT)
            if os.path.getsize(picture) < 10_000:
                sys.exit("the picture is empty")
    finally:
        robot.terminate()
        robot.wait(10)
    print("picture taken")


if __name__ == "__main__":
    main()
