#!/usr/bin/env python3
"""Opens the pages of the control interface in Chromium (apt-get install chromium): the control page shows the state of a
robot, /docs every call of the OpenAPI document, and several robots have a page each.

    python3 tests/pages.py --serve target/release/ts3100
    python3 tests/pages.py --serve target/release/ts3100 --picture docs/images/control-page.png

With --picture it also takes the picture of the control page that README.md shows."""

import argparse
import html
import json
import os
import re
import subprocess
import sys
import tempfile
import urllib.request

SIZE = "1200,900"
LIMIT = 60
METHODS = ("get", "put", "post", "delete", "patch")


def chromium(directory, url, *flags):
    """Opens a page for a few seconds of its own time; what it printed."""
    command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
               "--user-data-dir=" + directory, "--window-size=" + SIZE, "--virtual-time-budget=3000", *flags, url]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=LIMIT)
    return done.stdout.decode()


def text_of(page):
    """What a page shows, without marks."""
    page = re.sub(r"<(script|style)\b.*?</\1>", " ", page, flags=re.S)
    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", page)).split())


def expect(found, expected, page):
    if not found:
        sys.exit("%s: expected %s" % (page, expected))


def main():
    parser = argparse.ArgumentParser(description="opens the pages of the control interface")
    parser.add_argument("--serve", required=True, metavar="BINARY", help="the ts3100 to be used")
    parser.add_argument("--picture", metavar="FILE", help="where the picture of the control page goes")
    options = parser.parse_args()
    binary = os.path.abspath(options.serve)
    robot = subprocess.Popen([binary, "serve", "--ports", "auto", "--ready-json", "--servo-on"],
                             stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        ready = json.loads(robot.stdout.readline())
        ip0, control = "127.0.0.1:%d" % ready["ports"]["ip0"], ready["control"]
        for command in (["sl", "DEMO"], ["rn", "--wait"], ["rn"]):
            subprocess.run([binary, "host", ip0, *command], check=True, stdout=subprocess.DEVNULL, timeout=LIMIT)
        with tempfile.TemporaryDirectory(prefix="ts3100-pages-") as directory:
            shown = text_of(chromium(directory, control + "/", "--dump-dom"))
            for words in ("DEMO", "running"):
                expect(words in shown, "%r in %r" % (words, shown[:400]), "/")
            with urllib.request.urlopen(control + "/openapi.json", timeout=LIMIT) as answer:
                document = json.load(answer)
            calls = [(method.upper(), path) for path, item in document["paths"].items()
                     for method in METHODS if method in item]
            page = chromium(directory, control + "/docs", "--dump-dom")
            explorer = text_of(page)
            for method, path in calls:
                expect(re.search(re.escape(method) + r"\s*" + re.escape(path), explorer),
                       "the call %s %s" % (method, path), "/docs")
            expect(page.count("<details") >= len(calls), "%d calls to open" % len(calls), "/docs")
            if options.picture:
                chromium(directory, control + "/", "--screenshot=" + os.path.abspath(options.picture))
                expect(os.path.getsize(options.picture) > 10_000, "a picture", options.picture)
    finally:
        robot.terminate()
        robot.wait(10)
    pages_of_several(binary)
    print("the control page shows the robot, /docs all %d calls; several robots have a page each" % len(calls))


def pages_of_several(binary):
    """The list of the robots of a process, and the page and the calls of one of them."""
    robots = subprocess.Popen([binary, "serve", "--robots", "3", "--ports", "auto", "--ready-json"],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        ready = json.loads(robots.stdout.readline())
        control, ip0 = ready["control"], "127.0.0.1:%d" % ready["robots"]["robot-2"]["ports"]["ip0"]
        subprocess.run([binary, "host", ip0, "sl", "DEMO"], check=True, stdout=subprocess.DEVNULL, timeout=LIMIT)
        with tempfile.TemporaryDirectory(prefix="ts3100-pages-") as directory:
            for path, words in (("/", ("3 robots, 3 started", "robot-2 " + ip0)),
                                ("/robots/robot-2/", ("DEMO", "connected")),
                                ("/robots/robot-3/", ("file none",)),
                                ("/robots/robot-2/docs", ("/emergency-stop",))):
                shown = text_of(chromium(directory, control + path, "--dump-dom"))
                for word in words:
                    expect(word in shown, "%r in %r" % (word, shown[:400]), path)
    finally:
        robots.terminate()
        robots.wait(10)


if __name__ == "__main__":
    main()
