#!/usr/bin/env python3
"""Works the pages of the control interface in Chromium as a person would: a whole session on both kinds of arm, every view in
three sizes, the start page of several robots, the explorer of the calls.

    python3 tests/system/control/pendant_page.py --serve target/release/ts3100 [--pictures DIRECTORY]
    python3 tests/system/control/pendant_page.py --serve target/release/ts3100 --picture docs/images/control-page.png

The second takes only the picture that README.md shows.

Needs Playwright and axe (pip install playwright axe-playwright-python) and Chromium (apt-get install chromium). The clock of
the robot is stepped, so nothing here depends on how fast the machine is. With --pictures it keeps a picture of each view in
each size, in light and in dark."""

import contextlib
import http.client
import os
import re
import shutil
import signal
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect, sync_playwright

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from emulator import Emulator  # noqa: E402
from pendant_session import POINTS, PROGRAM, session  # noqa: E402
from steps import program, serving  # noqa: E402

CHROMIUM = shutil.which("chromium") or "/usr/bin/chromium"
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SIZES = {"desktop": (1440, 900), "tablet": (820, 1180), "phone": (390, 844)}
VIEWS = ("arm", "panel", "pendant", "program", "lines", "traffic", "lab")
LIMIT = 20_000
FIRST_PAINT = 1_000
ROUNDS = 5
METHODS = ("get", "put", "post", "delete", "patch")


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
        with contextlib.suppress(OSError, ValueError, AttributeError, http.client.HTTPException):
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


def accessible(page, name):
    """Nothing sideways, nothing that axe calls serious."""
    wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    if wide > 0:
        sys.exit("%s: the page is %d pixels wider than the screen" % (name, wide))
    found = [one for one in Axe().run(page).response["violations"] if one["impact"] in ("serious", "critical")]
    for one in found:
        print(name, one["id"], one["help"], [node["html"][:120] for node in one["nodes"][:3]])
    if found:
        sys.exit("%s: axe found what is serious" % name)


def looks(browser, url, pictures):
    """Every view in every size, in light and in dark."""
    for size in SIZES:
        for dark in (False, True):
            page = opened(browser, url, size, dark)
            for view in VIEWS:
                page.goto(url + "#" + view)
                page.wait_for_selector("#view-%s:not([hidden])" % view)
                # Until it has read what it shows.
                page.wait_for_timeout(300)
                name = "%s-%s-%s" % (view, size, "dark" if dark else "light")
                accessible(page, name)
                if pictures:
                    page.screenshot(path=os.path.join(pictures, name + ".png"))
            closed(page)
    print("ok   every view in %d sizes, light and dark: no overflow, nothing serious for axe" % len(SIZES))


def first_paint(browser, url):
    """With an empty cache. The quickest of some counts: a busy machine only ever adds to a time."""
    took = []
    for _ in range(ROUNDS):
        context = browser.new_context()
        page = context.new_page()
        page.goto(url)
        page.wait_for_function("() => performance.getEntriesByName('first-contentful-paint').length > 0")
        took.append(page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime"))
        context.close()
    if min(took) > FIRST_PAINT:
        sys.exit("the first paint took %d ms, at most %d" % (min(took), FIRST_PAINT))
    print("ok   first paint after %d ms" % min(took))


def below_a_prefix(browser, robot):
    """The page works below a prefix, and its stream goes on where it was cut: no event twice, none left out."""
    with proxy(robot.url) as (url, handler):
        page = opened(browser, url + "#traffic")
        rows = page.get_by_role("grid", name="Traffic")
        numbers = [row["number"] for row in robot.request("GET", "/alarms/table")][:3]
        for number in numbers:
            robot.raise_alarm(number)
            for stream in list(handler.streams):
                with contextlib.suppress(OSError, AttributeError):
                    stream.sock.close()
            handler.streams.clear()
        for number in numbers:
            # It may take a pause until the stream is opened again.
            expect(rows.get_by_role("row").filter(has_text=number, visible=True)).to_have_count(1, timeout=LIMIT)
        robot.reset_alarms()
        expect(page.locator("#lamps")).not_to_contain_text(numbers[0])
        closed(page)
    print("ok   below a path prefix, with the stream of events cut three times")


def frozen(browser, binary):
    """An emulator that stands still is not connected; once it goes on it is again."""
    with Emulator(binary) as emulator:
        page = opened(browser, emulator.url + "/")
        emulator.process.send_signal(signal.SIGSTOP)
        expect(page.locator("#link")).to_have_text("not connected", timeout=LIMIT)
        emulator.process.send_signal(signal.SIGCONT)
        expect(page.locator("#link")).to_have_text("connected", timeout=LIMIT)
        closed(page)
    print("ok   an emulator that stands still for a while")


def sessions(browser, binary):
    """A whole session on each kind of arm, and on a phone."""
    for kind, model, size in (("six-axis", "ts3100-tv800", "desktop"), ("scara", "tsl3000-thl400", "tablet"),
                              ("six-axis", "ts3100-tv800", "phone")):
        with Emulator(binary, "--time", "stepped", "--model", model) as emulator:
            page = opened(browser, emulator.url + "/", size)
            session(page, emulator.robot, kind)
            closed(page)
        print("ok   a whole session with a %s arm, %s" % (kind, size))


def keyboard(browser, binary):
    """The keyboard alone: every button of the panel is reached by Tab, and the robot is started and stopped."""
    with Emulator(binary, "--select", "DEMO", "--time", "stepped") as emulator:
        page = opened(browser, emulator.url + "/#panel", "tablet")
        name = "document.activeElement.getAttribute('aria-label') || document.activeElement.textContent"

        def press(wanted):
            for _ in range(100):
                page.keyboard.press("Tab")
                if page.evaluate(name).strip() == wanted:
                    page.keyboard.press("Enter")
                    return
            sys.exit("Tab does not lead to %r" % wanted)

        for button, lamp in (("SERVO", "servo on"), ("START", "running"), ("EMERGENCY STOP", "EMERGENCY STOP")):
            press(button)
            expect(page.locator("#lamps")).to_contain_text(lamp)
        page.locator("#tab-panel").focus()
        page.keyboard.press("ArrowRight")
        expect(page.locator("#view-pendant")).to_be_visible()
        closed(page)
    print("ok   the keyboard alone")


def explorer(browser, robot):
    """/docs shows every call of the OpenAPI document."""
    paths = robot.request("GET", "/openapi.json")["paths"]
    calls = [(method.upper(), path) for path, item in paths.items() for method in METHODS if method in item]
    page = browser.new_page()
    page.goto(robot.url + "/docs")
    expect(page.locator("details")).to_have_count(len(calls))
    shown = " ".join(page.locator("summary").all_inner_texts())
    for method, path in calls:
        if not re.search(re.escape(method) + r"\s*" + re.escape(path) + r"(\s|$)", shown):
            sys.exit("/docs does not show %s %s" % (method, path))
    page.close()
    print("ok   /docs shows all %d calls" % len(calls))


def several(browser, binary, pictures):
    """The start page of several robots shows their lamps and arms, and leads to the page of each."""
    with Emulator(binary, "--robots", "3", "--servo-on", "--select", "DEMO", "--time", "stepped") as emulator:
        emulator.connect("robot-3").emergency_stop = True
        for size, (width, height) in SIZES.items():
            page = browser.new_page(viewport={"width": width, "height": height})
            page.goto(emulator.url + "/")
            expect(page.locator("#count")).to_have_text("3 robots, 3 started, 1 with alarms")
            cards = page.get_by_role("list", name="Robots").locator("> li")
            expect(cards).to_have_count(3)
            expect(cards.nth(0)).to_contain_text("servo on")
            expect(cards.nth(2)).to_contain_text("EMERGENCY STOP")
            expect(page.locator("#robots svg")).to_have_count(3)
            accessible(page, "robots-" + size)
            if pictures:
                page.screenshot(path=os.path.join(pictures, "robots-%s.png" % size))
            page.get_by_label("alarms first").check()
            expect(cards.nth(0)).to_contain_text("robot-3")
            page.get_by_role("searchbox", name="Find").fill("robot-2")
            expect(cards).to_have_count(1)
            cards.nth(0).get_by_role("link").click()
            expect(page.locator("#name")).to_have_text("robot-2")
            expect(page.locator("#lamps")).to_contain_text("servo on")
            page.close()
    print("ok   the start page of several robots leads to each")


def picture(browser, binary, path):
    """The picture of README.md: a program that runs, in the middle of a motion."""
    with Emulator(binary, "--servo-on", "--time", "stepped") as emulator:
        robot = emulator.robot
        robot.files["PART"] = PROGRAM % POINTS["six-axis"]
        robot.select_file("PART")
        robot.start_program()
        robot.press_keys("3\r")
        page = opened(browser, emulator.url + "/#program")
        for _ in range(8):
            robot.advance(0.1)
            page.wait_for_timeout(250)
        page.screenshot(path=path)
        closed(page)


def main():
    parser = serving(__doc__)
    parser.add_argument("--pictures", metavar="DIRECTORY", help="where pictures of each view go")
    parser.add_argument("--picture", metavar="FILE", help="take the picture for README.md, and nothing else")
    options = parser.parse_args()
    binary = options.serve
    if options.pictures:
        os.makedirs(options.pictures, exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        if options.picture:
            picture(browser, binary, options.picture)
            return
        with Emulator(binary, "--servo-on", "--select", "DEMO", "--time", "stepped") as emulator:
            first_paint(browser, emulator.url + "/")
            explorer(browser, emulator.robot)
            looks(browser, emulator.url + "/", options.pictures)
            below_a_prefix(browser, emulator.robot)
        keyboard(browser, binary)
        frozen(browser, binary)
        several(browser, binary, options.pictures)
        sessions(browser, binary)
        browser.close()


if __name__ == "__main__":
    sys.exit(program(main))
