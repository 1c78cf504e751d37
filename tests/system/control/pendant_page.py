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
import signal
import socket
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from playwright.sync_api import expect

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from browser import LIMIT, SIZES, accessible, chromium, closed, in_sight, opened  # noqa: E402
from emulator import Emulator  # noqa: E402
from pendant_session import POINTS, PROGRAM, session  # noqa: E402
from steps import program, serving  # noqa: E402

VIEWS = ("program", "panel", "pendant", "lines", "traffic", "lab")
# Milliseconds until something is seen; where even an empty page is slow, at most so many times as long.
FIRST_PAINT, SLOWER = 1_000, 4
EMPTY_PAGE = "data:text/html,<p>empty</p>"
# More of them while the machine is busy.
ROUNDS, MOST_ROUNDS = 5, 25
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


def looks(browser, url, pictures):
    """Every view in every size, in light and in dark."""
    for size in SIZES:
        for dark in (False, True):
            page = opened(browser, url, size, dark)
            page.on("response", lambda answer: answer.status < 400 or page.errors.append("%s is answered %d" % (answer.url, answer.status)))
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
    """With an empty cache, beside an empty page. The quickest of some counts: a busy machine only ever adds to a time, to both."""
    quickest, limit = {}, 0
    for done in range(MOST_ROUNDS):
        if done >= ROUNDS and quickest[url] <= limit:
            break
        for place in (url, EMPTY_PAGE):
            context = browser.new_context()
            page = context.new_page()
            page.goto(place)
            page.wait_for_function("() => performance.getEntriesByName('first-contentful-paint').length > 0")
            took = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
            quickest[place] = min(took, quickest.get(place, took))
            context.close()
        limit = max(FIRST_PAINT, SLOWER * quickest[EMPTY_PAGE])
    if quickest[url] > limit:
        sys.exit("the first paint took %d ms, at most %d; an empty page took %d" % (quickest[url], limit, quickest[EMPTY_PAGE]))
    print("ok   first paint after %d ms, of an empty page after %d" % (quickest[url], quickest[EMPTY_PAGE]))


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
        expect(page.locator("#bar .alarm")).to_be_hidden()
        closed(page)
    print("ok   below a path prefix, with the stream of events cut three times")


def frozen(browser, binary):
    """An emulator that stands still is not connected; once it continues it is again. One that has ended says so in words."""
    with Emulator(binary) as emulator:
        page = opened(browser, emulator.url + "/")
        emulator.process.send_signal(signal.SIGSTOP)
        expect(page.locator("#link")).to_have_text("not connected", timeout=LIMIT)
        expect(page.locator("#gone")).to_contain_text("The emulator does not answer.")
        emulator.process.send_signal(signal.SIGCONT)
        expect(page.locator("#link")).to_have_text("connected", timeout=LIMIT)
        expect(page.locator("#gone")).to_be_hidden()
        emulator.process.kill()
        expect(page.locator("#gone")).to_contain_text("The emulator does not answer.", timeout=LIMIT)
        page.locator("#bar .start").click()
        expect(page.locator("#bar")).to_contain_text("the emulator does not answer; is it still running?")
        emulator.process.wait()
        closed(page)
    print("ok   an emulator that stands still for a while, and one that has ended")


def token(browser, binary):
    """A wrong token is told apart from a missing one, on the page and in the explorer."""
    with Emulator(binary, "--control-token", "right-token-of-16") as emulator:
        for path in "/", "/docs":
            page = browser.new_page()
            page.goto(emulator.url + path)
            expect(page.locator("#link")).to_have_text("needs a token")
            page.locator("#token").fill("wrong-token-of-16")
            page.locator("#token").press("Enter")
            expect(page.get_by_text("The emulator refuses this token.")).to_be_visible()
            page.locator("#token").fill("right-token-of-16")
            page.locator("#token").press("Enter")
            expect(page.locator("#link")).to_have_text("connected")
            expect(page.locator("#ask")).to_be_hidden()
            page.close()
    print("ok   a missing token, a wrong one, and the right one")


def everywhere(page, state):
    """A state is told, and the keys are in sight, at every size, in light and in dark."""
    before = page.viewport_size
    for size, (width, height) in SIZES.items():
        page.set_viewport_size({"width": width, "height": height})
        for scheme in "light", "dark":
            page.emulate_media(color_scheme=scheme)
            for what in ("#now", "#bar .emergency", "#bar .start", "#bar .stop"):
                in_sight(page, page.locator(what), "%s, %s, %s: %s" % (state, size, scheme, what))
            # What is laid out differs by size, what is coloured by scheme: each is looked at once.
            if (size, scheme) in (("desktop", "dark"), ("phone", "light")):
                accessible(page, "%s, %s, %s" % (state, size, scheme))
    page.set_viewport_size(before)
    page.emulate_media(color_scheme="light")


# Elements inside a view that scroll down by themselves.
SCROLLERS = """() => [...document.querySelectorAll("#views *")].filter(one => one.offsetParent && one.scrollHeight > one.clientHeight + 1
    && ["auto", "scroll"].includes(getComputedStyle(one).overflowY)).map(one => one.className || one.id)"""
# Values that are wider than their place.
CUT = """() => [...document.querySelectorAll("#views :is(textarea, code, td, th)")].filter(one => one.offsetParent && one.scrollWidth > one.clientWidth + 1
    && getComputedStyle(one).display !== "inline").map(one => one.textContent.slice(0, 40))"""


def reach(browser, url, robot):
    """The keys that stop the robot are in sight on every tab at every size, however far the page is scrolled; so is the arm beside it.
    Nothing scrolls inside the page but the list of the traffic, and nothing is cut."""
    robot.raise_alarm("2-046")
    for size in SIZES:
        page = opened(browser, url, size)
        expect(page.locator("#view-arm canvas")).to_be_visible()
        for view in VIEWS:
            page.goto(url + "#" + view)
            page.wait_for_selector("#view-%s:not([hidden])" % view)
            page.wait_for_timeout(200)
            for where in "0", "document.documentElement.scrollHeight":
                page.evaluate("scrollTo(0, %s)" % where)
                for key in "emergency", "start", "stop":
                    in_sight(page, page.locator("#bar ." + key), "%s on %s, %s" % (key, view, size))
                if size != "phone":
                    in_sight(page, page.locator("#view-arm"), "the arm beside %s, %s" % (view, size))
            inner = [one for one in page.evaluate(SCROLLERS) if one != "grid"]
            cut = page.evaluate(CUT)
            if inner or cut:
                sys.exit("%s, %s: %s scroll by themselves, %s are cut" % (view, size, inner, cut))
        closed(page)
    robot.reset_alarms()
    print("ok   EMERGENCY STOP, START, STOP and the arm are in sight on every tab at every size")


def layout(browser, url):
    """The arm is as wide as its bar says, and can be hidden; both by keyboard, and kept."""
    context = browser.new_context(viewport={"width": SIZES["desktop"][0], "height": SIZES["desktop"][1]})
    page = opened(context, url)
    bar, arm = page.get_by_role("separator", name="Width of the arm"), page.locator("#view-arm")
    before = arm.bounding_box()["width"]
    bar.focus()
    for _ in range(3):
        page.keyboard.press("ArrowLeft")
    narrow = arm.bounding_box()["width"]
    if narrow > before - 50:
        sys.exit("the bar does not make the arm narrower: %s, %s" % (before, narrow))
    page.get_by_role("button", name="Hide arm").click()
    expect(arm).to_be_hidden()
    closed(page)
    page = opened(context, url)
    expect(page.get_by_role("button", name="Show arm")).to_be_visible()
    page.get_by_role("button", name="Show arm").click()
    expect(page.locator("#view-arm")).to_be_visible()
    if abs(page.locator("#view-arm").bounding_box()["width"] - narrow) > 2:
        sys.exit("the width of the arm was not kept")
    # Names never lie on the arm: a limb through the place of a point, and a picture with room beside it.
    found = page.evaluate("""async () => (await import("./ui/labels.js")).labels([{name: "P1", at: [100, 100]}, {name: "world", system: true, at: [100, 180]}], 13,
        [{a: [100, 20], b: [100, 200], r: 30}], [0, 0, 300, 300]).map(one => Math.abs(one.label[0] - 100) - one.w / 2)""")
    if len(found) != 2 or min(found) < 30:
        sys.exit("names lie on the arm: %s" % found)
    closed(page)
    context.close()
    print("ok   the arm beside the view: its width, hidden and shown, its names")


def idle(browser, url):
    """While nothing happens the page asks for nothing; a change is shown without being asked for."""
    page = opened(browser, url)
    page.wait_for_timeout(1500)
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.wait_for_timeout(3000)
    if asked:
        sys.exit("an idle page asks for %s" % asked)
    closed(page)
    print("ok   an idle page asks for nothing")


WAITING = """GLOBAL
  N = 0
END
PROGRAM WAITING
  WAIT DIN(5)
  INPUT IP1, N
  SUBP(N)
END
PROGRAM SUBP(X)
  I = 3
  PRINT I, CR
  I = X / 0
  DELAY 1
END
"""

ASKING = """PROGRAM ASKING
  PRINT "HOW MANY?", CR
  INPUT N
END
"""


def states(browser, binary):
    """What the robot waits for, and why it has stopped, is told in the bar, in words and by colour."""
    with Emulator(binary, "--servo-on", "--time", "stepped") as emulator:
        robot = emulator.robot
        robot.files["WAITING"] = WAITING
        robot.select_file("WAITING")
        page = opened(browser, emulator.url + "/")
        now, start = page.locator("#now"), page.locator("#bar .start")
        expect(start).to_have_text("START WAITING")
        expect(start).to_have_attribute("data-ready", "true")
        if page.get_by_role("button", name="START").count() != 1:
            sys.exit("the page has more than one START")
        robot.request("PUT", "/breakpoints", {"lines": [7]})
        robot.start_program()
        expect(now).to_have_text("waits for input 5")
        expect(now).to_have_attribute("data-kind", "warn")
        expect(page.locator(".source")).to_have_attribute("data-kind", "warn")
        everywhere(page, "waits for an input")
        with socket.create_connection(robot.address("ip1"), timeout=10) as peer:
            robot.inputs[5] = True
            expect(now).to_have_text("waits for a value from IP1")
            everywhere(page, "waits for a peer")
            peer.sendall(b"4\r")
            expect(now).to_have_text("breakpoint, line 7")
            expect(start).to_have_text("START WAITING line 7")
            everywhere(page, "breakpoint")
        robot.request("PUT", "/breakpoints", {"lines": []})
        robot.start_program()
        robot.advance(1)
        alarm = page.locator("#bar .alarm")
        expect(alarm).to_contain_text("line 12")
        expect(page.locator(".codeline[data-failed=true] .gutter")).to_have_text("12")
        expect(start).to_have_attribute("data-ready", "false")
        tasks = page.get_by_role("region", name="Tasks", exact=True)
        expect(tasks.get_by_role("row").filter(has_text="SUBP")).to_contain_text("I = 3")
        expect(tasks.get_by_role("row").filter(has_text="WAITING")).to_contain_text("line 7")
        everywhere(page, "alarm")
        phone = opened(browser, emulator.url + "/", "phone")
        expect(phone.locator(".codeline[data-failed=true]")).to_be_attached()
        if phone.evaluate("scrollY"):
            sys.exit("the page of a phone scrolls away from the arm by itself")
        closed(phone)
        alarm.click()
        page.keyboard.press("Escape")
        expect(page.locator("#alarms")).to_be_hidden()
        alarm.click()
        expect(page.locator("#alarms")).to_contain_text("Remedy: Check the value before dividing.")
        page.locator("#alarms").get_by_role("button", name="ALARM RESET").click()
        expect(alarm).to_be_hidden()
        with socket.create_connection(robot.address("ip0"), timeout=10) as host:
            host.sendall(b"\x02su\r\x03")
            host.recv(1000)
        badge = page.locator("#findings")
        expect(badge).to_have_text("2 findings")
        badge.click()
        expect(page.get_by_role("grid", name="Traffic")).to_contain_text("left-in-exchange")
        expect(page.get_by_label("Show", exact=True)).to_have_value("findings")
        everywhere(page, "findings")
        robot.request("POST", "/power/off", {})
        expect(now).to_have_text("power off")
        expect(start).to_have_attribute("data-ready", "false")
        everywhere(page, "power off")
        # A button that is refused stays where it is.
        before = start.bounding_box()
        start.click()
        expect(page.locator("#bar")).to_contain_text("the power is off")
        if start.bounding_box() != before:
            sys.exit("START moves when it is refused")
        robot.power_on()
        robot.files["ASKING"] = ASKING
        robot.select_file("ASKING")
        robot.servo = True
        robot.start_program()
        expect(now).to_have_text("asks: HOW MANY?")
        everywhere(page, "waits for a value at the pendant")
        closed(page)
    print("ok   what the robot waits for and why it has stopped")


def first_visit(browser, binary):
    """Without a selected file a card says what to do: its button runs the example."""
    with Emulator(binary, "--time", "real") as emulator:
        page = opened(browser, emulator.url + "/")
        card = page.get_by_role("region", name="First steps")
        expect(card).to_contain_text("ts3100 host 127.0.0.1:")
        expect(card.get_by_role("link", name="Open the book")).to_have_attribute("href", "book/")
        with page.expect_file_chooser() as chooser:
            card.get_by_role("button", name="Load a file").click()
        chooser.value.set_files([{"name": "wrong.scol", "mimeType": "text/plain", "buffer": b"PROGRAM WRONG\n  MOVEE P1\nEND\n"}])
        expect(page.get_by_text("wrong.scol is on the RAM drive as WRONG")).to_contain_text("error")
        card.get_by_role("button", name="Run the example").click()
        expect(page.locator("#now")).to_have_text("running")
        expect(card).to_be_hidden()
        poses(page, emulator.robot)
        closed(page)
    print("ok   the first visit: the card runs the example, and all numbers are of one moment")


def poses(page, robot):
    """While the arm moves, joint 1 is the same in each frame wherever it is shown."""
    page.get_by_role("tab", name="Pendant").click()
    page.get_by_role("button", name="STATUS", exact=True).click()
    robot.wait_until("idle", within=30)
    robot.override = 5
    robot.start_program()
    expect(page.locator("#now")).to_have_text("running")
    found = page.evaluate("""async () => {
        const seen = [], number = text => /-?[0-9.]+/.exec(text)[0];
        for (let frame = 0; frame < 60; frame += 1) {
            await new Promise(requestAnimationFrame);
            const display = [...document.querySelectorAll(".screen div")].find(row => row.textContent.startsWith("J1")).textContent.slice(2);
            seen.push([number(document.querySelector(".joints .mono").textContent), number(display), number(document.querySelector(".axes .value").textContent)]);
        }
        return seen;
    }""")
    unequal = [one for one in found if len(set(one)) > 1]
    moments = {one[0] for one in found}
    if unequal or len(moments) < 10:
        sys.exit("the read-outs are not of one moment, or stand still: %s of %d, %d moments" % (unequal[:3], len(found), len(moments)))


def editor(browser, binary):
    """The editor colours the text, offers words and points, and marks mistakes while they are typed; by keyboard alone."""
    with Emulator(binary, "--time", "stepped") as emulator:
        emulator.robot.files["PART"] = PROGRAM % POINTS["six-axis"]
        emulator.robot.select_file("PART")
        page = opened(browser, emulator.url + "/")
        page.get_by_role("button", name="Edit", exact=True).press("Enter")
        text = page.get_by_role("textbox", name="Text of the file")
        expect(text).to_be_focused()
        expect(page.locator(".colours .word").first).to_have_text("GLOBAL")
        text.evaluate("one => one.setSelectionRange(one.value.indexOf('  MOVES P1'), one.value.indexOf('  MOVES P1'))")
        page.keyboard.type("MOVE")
        offer = page.get_by_role("listbox", name="Completion")
        expect(offer.get_by_role("option", name="MOVES")).to_be_visible()
        page.keyboard.press("ArrowDown")
        page.keyboard.press("Escape")
        expect(offer).to_be_hidden()
        page.keyboard.type("S P")
        expect(offer.get_by_role("option").first).to_have_text("P1")
        page.keyboard.press("Enter")
        expect(text).to_have_value(re.compile(r"^MOVES P1  MOVES P1$", re.MULTILINE))
        expect(page.get_by_role("list", name="Diagnostics").get_by_role("listitem").first).to_contain_text("line 8")
        expect(page.locator(".colours [data-severity=error]")).to_have_count(1)
        accessible(page, "editor")
        closed(page)
    print("ok   the editor: colours, completion, diagnostics")


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
    """The keyboard alone: the robot is started and stopped from the bar, and the tabs are reached by Tab."""
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

        press("SERVO")
        expect(page.locator("#bar .lit").first).to_have_attribute("aria-pressed", "true")
        for button, words in (("START DEMO", "running"), ("EMERGENCY STOP", "emergency stop")):
            press(button)
            expect(page.locator("#now")).to_have_text(words)
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
            # The one with an alarm is the first.
            expect(cards.nth(0)).to_contain_text("robot-3")
            for words in "emergency stop", "8-014", "DEMO line 7", "servo off":
                expect(cards.nth(0)).to_contain_text(words)
            expect(cards.nth(1)).to_contain_text("servo on")
            expect(page.locator("#robots svg")).to_have_count(3)
            accessible(page, "robots-" + size)
            if pictures:
                page.screenshot(path=os.path.join(pictures, "robots-%s.png" % size))
            page.get_by_label("alarms first").uncheck()
            expect(cards.nth(2)).to_contain_text("robot-3")
            page.get_by_role("searchbox", name="Find").fill("robot-2")
            expect(cards).to_have_count(1)
            cards.nth(0).get_by_role("link").click()
            expect(page.locator("#name")).to_have_text("robot-2")
            expect(page.locator("#bar .lit").first).to_have_attribute("aria-pressed", "true")
            page.close()
        together(browser, emulator)
    print("ok   the start page of several robots leads to each")


def together(browser, emulator):
    """The keys of the start page act on all robots."""
    robots = [emulator.connect("robot-%d" % number) for number in (1, 2, 3)]
    page = browser.new_page()
    page.goto(emulator.url + "/")
    cards = page.get_by_role("list", name="Robots").locator("> li")
    robots[0].start_program()
    robots[1].start_program()
    expect(cards.filter(has_text="running")).to_have_count(2)
    page.get_by_role("button", name="Advance 1 s").click()
    page.wait_for_function("""() => [...document.querySelectorAll("#all button")].every(one => !one.hasAttribute("aria-busy"))""")
    times = [robot.state["t"] for robot in robots]
    if times != [1, 1, 1]:
        sys.exit("Advance 1 s has advanced the robots to %s" % times)
    page.get_by_role("button", name="STOP ALL").click()
    page.get_by_role("button", name="Advance 1 s").click()
    expect(cards.filter(has_text="running")).to_have_count(0)
    robots[2].emergency_stop = False
    page.get_by_role("button", name="RESET ALL").click()
    expect(page.locator("#count")).to_have_text("3 robots, 3 started")
    page.close()


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
    with chromium() as browser:
        if options.picture:
            picture(browser, binary, options.picture)
            return
        with Emulator(binary, "--servo-on", "--select", "DEMO", "--time", "stepped") as emulator:
            first_paint(browser, emulator.url + "/")
            explorer(browser, emulator.robot)
            looks(browser, emulator.url + "/", options.pictures)
            reach(browser, emulator.url + "/", emulator.robot)
            layout(browser, emulator.url + "/")
            idle(browser, emulator.url + "/")
            below_a_prefix(browser, emulator.robot)
        states(browser, binary)
        first_visit(browser, binary)
        editor(browser, binary)
        keyboard(browser, binary)
        token(browser, binary)
        frozen(browser, binary)
        several(browser, binary, options.pictures)
        sessions(browser, binary)


if __name__ == "__main__":
    sys.exit(program(main))
