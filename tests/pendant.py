#!/usr/bin/env python3
"""Works the page of the control interface in Chromium as a person would, on both kinds of arm.

    python3 tests/pendant.py --serve target/release/ts3100 [--pictures DIRECTORY]

Needs Playwright and axe (pip install playwright axe-playwright-python) and Chromium (apt-get install chromium). The clock of
the robot is stepped, so nothing here depends on how fast the machine is. With --pictures it keeps a picture of each view in
each size, in light and in dark."""

import argparse
import contextlib
import http.client
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import urllib.request
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect, sync_playwright

CHROMIUM = shutil.which("chromium") or "/usr/bin/chromium"
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SIZES = {"desktop": (1440, 900), "tablet": (820, 1180), "phone": (390, 844)}
VIEWS = ("arm", "panel", "pendant", "program", "lines", "traffic", "lab")
LIMIT = 20_000
FIRST_PAINT = 1_000


class Robot:
    """A robot of its own with its control interface."""

    def __init__(self, binary, *flags):
        command = [binary, "serve", "--ports", "auto", "--ready-json", "--control", "127.0.0.1:0", *flags]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.ready = json.loads(self.process.stdout.readline())
        self.url = self.ready["control"]

    def call(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json"} if data is not None else {}
        request = urllib.request.Request(self.url + path, data, headers, method=method)
        with urllib.request.urlopen(request, timeout=10) as answer:
            text = answer.read().decode()
        return json.loads(text) if text.startswith(("{", "[")) else text

    def advance(self, seconds):
        self.call("POST", "/clock/advance", {"seconds": seconds})

    def close(self):
        self.process.terminate()
        self.process.wait(10)
        self.process.stdout.close()


@contextlib.contextmanager
def robot(binary, *flags):
    found = Robot(binary, *flags)
    try:
        yield found
    finally:
        found.close()


class Prefix(BaseHTTPRequestHandler):
    """A proxy that has the page below /some/prefix/ and cuts a stream of events when it is told to."""

    protocol_version = "HTTP/1.1"
    target = ""
    streams = []

    def log_message(self, *_):
        pass

    def forward(self):
        if not self.path.startswith("/some/prefix/"):
            self.send_error(404)
            return
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        connection = http.client.HTTPConnection(self.target, timeout=60)
        kept = ("Content-Type", "Accept", "Accept-Encoding", "Last-Event-ID")
        headers = {name: self.headers[name] for name in kept if name in self.headers}
        connection.request(self.command, self.path[len("/some/prefix"):], body or None, headers)
        answer = connection.getresponse()
        self.send_response(answer.status)
        for name in ("Content-Type", "Content-Encoding", "Content-Security-Policy"):
            if answer.headers.get(name):
                self.send_header(name, answer.headers[name])
        self.send_header("Connection", "close")
        self.end_headers()
        self.close_connection = True
        if "/events" in self.path:
            self.streams.append(connection)
        with contextlib.suppress(OSError, ValueError, AttributeError):
            while data := answer.read1(65536):
                self.wfile.write(data)
        connection.close()

    do_GET = do_POST = do_PUT = do_DELETE = forward


@contextlib.contextmanager
def proxy(url):
    handler = type("Handler", (Prefix,), {"target": url.removeprefix("http://"), "streams": []})
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield "http://127.0.0.1:%d/some/prefix/" % server.server_port, handler
    finally:
        server.shutdown()
        server.server_close()


def opened(browser, url, size="desktop", dark=False):
    """The page of a robot; an error of a script fails the test."""
    width, height = SIZES[size]
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme="dark" if dark else "light")
    page.set_default_timeout(LIMIT)
    page.errors = []
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.goto(url)
    expect(page.get_by_role("status").first).to_have_text("connected", timeout=LIMIT)
    return page


def closed(page):
    page.close()
    if page.errors:
        sys.exit("the page failed: %s" % page.errors)


def looks(browser, url, pictures):
    """Every view in every size, in light and in dark: nothing sideways, nothing that axe calls serious."""
    for size in SIZES:
        for dark in (False, True):
            page = opened(browser, url, size, dark)
            for view in VIEWS:
                page.goto(url + "#" + view)
                page.wait_for_selector("#view-%s:not([hidden])" % view)
                page.wait_for_timeout(300)
                name = "%s-%s-%s" % (view, size, "dark" if dark else "light")
                wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
                if wide > 0:
                    sys.exit("%s: the page is %d pixels wider than the screen" % (name, wide))
                found = [violation for violation in Axe().run(page).response["violations"]
                         if violation["impact"] in ("serious", "critical")]
                for violation in found:
                    print(name, violation["id"], violation["help"], [node["html"][:120] for node in violation["nodes"][:3]])
                if found:
                    sys.exit("%s: axe found what is serious" % name)
                if pictures:
                    page.screenshot(path=os.path.join(pictures, name + ".png"))
            closed(page)
    print("ok   every view in %d sizes, light and dark: no overflow, nothing serious for axe" % len(SIZES))


def first_paint(browser, url):
    context = browser.new_context()
    page = context.new_page()
    page.goto(url)
    page.wait_for_function("performance.getEntriesByName('first-contentful-paint').length > 0")
    took = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    context.close()
    if took > FIRST_PAINT:
        sys.exit("the first paint took %d ms, at most %d" % (took, FIRST_PAINT))
    print("ok   first paint after %d ms" % took)


def below_a_prefix(browser, found):
    """The page works below a prefix, and its stream goes on where it was cut: no event twice, none left out."""
    with proxy(found.url) as (url, handler):
        page = opened(browser, url)
        page.evaluate("""() => { window.seen = []; }""")
        page.goto(url + "#traffic")
        for _ in range(3):
            found.call("PUT", "/feed-hold", {"on": True})
            found.call("PUT", "/feed-hold", {"on": False})
            found.call("POST", "/alarms", {"number": "1-001"})
            for stream in list(handler.streams):
                with contextlib.suppress(OSError, AttributeError):
                    stream.sock.close()
            handler.streams.clear()
        found.call("POST", "/alarms/reset", {})
        expect(page.locator("#lamps")).not_to_contain_text("1-001")
        closed(page)
    print("ok   below a path prefix, with the stream of events cut three times")


def main():
    parser = argparse.ArgumentParser(description="works the page of the control interface in Chromium")
    parser.add_argument("--serve", required=True, metavar="BINARY", help="the ts3100 to be used")
    parser.add_argument("--pictures", metavar="DIRECTORY", help="where pictures of each view go")
    options = parser.parse_args()
    binary = os.path.abspath(options.serve)
    if options.pictures:
        os.makedirs(options.pictures, exist_ok=True)
    with sync_playwright() as playwright, tempfile.TemporaryDirectory(prefix="ts3100-pendant-"):
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        with robot(binary, "--servo-on", "--select", "DEMO", "--time", "stepped") as found:
            first_paint(browser, found.url + "/")
            looks(browser, found.url + "/", options.pictures)
            below_a_prefix(browser, found)
        browser.close()


if __name__ == "__main__":
    main()
