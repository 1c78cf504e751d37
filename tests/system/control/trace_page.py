#!/usr/bin/env python3
"""Works the page of a recorded run in Chromium as a person would: its timeline by pointer and by keyboard, moments as addresses, the
ways to a moment from the traffic, a line of the program and a variable, three sizes, light and dark.

    python3 tests/system/control/trace_page.py --serve target/release/ts3100 [--pictures DIRECTORY]

The recording is made first, by a robot whose clock is stepped: nothing here depends on how fast the machine is."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile

from playwright.sync_api import expect

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from browser import SIZES, accessible, chromium, closed, in_sight, opened  # noqa: E402
from emulator import Emulator, View  # noqa: E402
from steps import equal, ok, program, serving, true  # noqa: E402

VIEWS = ("program", "panel", "pendant", "lines", "traffic")
PICK = """GLOBAL
  N = 0
END
PROGRAM PICK
  SPEED = 60
AGAIN:
  MOVE POINT(300, 100, 100)
  DOUT(1)
  MOVE POINT(300, -100, 150)
  DOUT(-1)
  N = N + 1
  PRINT IP1, "PART", N, CR
  GOTO AGAIN
END
"""
# A position of the middle of the first epoch, at which the arm moves.
MIDDLE = "#t=1.5"


def text(words):
    return b"\x02" + words.encode() + b"\r\x03"


def record(binary, path):
    """A run with two counts of time, a program that moves, NG, a line that is set, and an override that is changed."""
    with Emulator(binary, "--time", "stepped", "--servo-on", "--transcript", path) as emulator:
        robot = emulator.robot
        for part in range(2):
            robot.files["PICK"] = PICK
            robot.servo = True
            with socket.create_connection(robot.address("ip0"), timeout=10) as host, socket.create_connection(robot.address("ip1"), timeout=10):
                def ask(words):
                    host.sendall(text(words))
                    host.recv(4096)
                    robot.advance(0.1)
                    host.sendall(text("OK")) if words == "SF" else None
                    robot.advance(0.1)
                ask("SL,PICK")
                ask("RN")
                for _ in range(15):
                    ask("SF")
                ask("SL,NOPE")
                robot.inputs[3] = True
                robot.override = 40
                for _ in range(5):
                    ask("SF")
            if part == 0:
                robot.request("POST", "/reset", {})


def record_robot(binary, path):
    """What `tap` records in front of a robot: SF once, nothing else that tells its state."""
    with Emulator(binary, "--time", "stepped", "--servo-on", "--select", "DEMO") as emulator:
        port = emulator.address("ip0")[1]
        command = [binary, "tap", "--ports", "auto", "--channels", "ip0=%d" % port, "--transcript", path, "--ready-json", "127.0.0.1:%d" % port]
        tap = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        ready = json.loads(tap.stdout.readline())
        with socket.create_connection(("127.0.0.1", ready["ports"]["ip0"]), timeout=10) as host:
            for words in "VR", "SF", "SL,NOPE":
                host.sendall(text(words))
                host.recv(4096)
                emulator.robot.advance(0.1)
        tap.send_signal(signal.SIGTERM)
        tap.wait()
        tap.stdout.close()


def at(page, seconds):
    """The page shows a moment of this time everywhere: address, clock, slider."""
    expect(page).to_have_url(re.compile(r"t=%s(&|$)" % re.escape(seconds)))
    words = "%.3f s" % float(seconds)
    expect(page.locator("#clock")).to_have_text(words)
    expect(slider(page)).to_have_attribute("aria-valuetext", re.compile("^" + re.escape(seconds)))


def slider(page):
    return page.get_by_role("slider", name="Moment")


def watched(browser, url, hash="", **more):
    """The page of the run when its lanes are there."""
    page = opened(browser, url + hash, link="recorded run", **more)
    # On a phone they are folded at first.
    expect(page.locator("#timeline [role=option]").first).to_be_attached()
    expect(page.locator("#now")).not_to_be_empty()
    return page


def moment(page):
    """Number of the event and time of the moment, from the address that would be copied."""
    found = re.search(r"t=([0-9.]+)&e=(\d+)", page.evaluate("location.hash"))
    return (float(found.group(1)), int(found.group(2))) if found else None


def settled(page, act):
    """What an action makes of the moment."""
    before = page.url
    act()
    page.wait_for_function("before => location.href !== before", arg=before)
    return moment(page)


def addresses(browser, url):
    """An address is a moment, with and without a view; back and forward go through moments."""
    page = watched(browser, url, MIDDLE)
    expect(page.locator("#view-program")).to_be_visible()
    expect(page.locator("#clock")).to_have_text("1.500 s")
    expect(page.locator("#now")).to_have_text("running")
    expect(page.locator(".codeline[data-executed=true] .gutter")).to_have_text(re.compile("^[79]$"))
    page.get_by_role("tab", name="Traffic").click()
    expect(page).to_have_url(re.compile(r"#traffic\?t=1\.5&e=\d+$"))
    first = page.url
    second = settled(page, lambda: page.keyboard.press("N"))
    at(page, "%g" % second[0])
    page.go_back()
    at(page, "1.5")
    page.go_forward()
    at(page, "%g" % second[0])
    closed(page)
    page = watched(browser, url, first[len(url):])
    expect(page.get_by_role("grid", name="Traffic")).to_be_visible()
    at(page, "1.5")
    # An address can be beyond the end, or no moment at all.
    page.goto(url + "#t=99999&e=99999")
    expect(page.locator("#clock")).not_to_have_text("1.500 s")
    page.goto(url + "#t=x&e=y")
    closed(page)
    ok("an address is a moment; back and forward")


def keys(browser, url):
    """Every key of the timeline, without a pointer; a field and the tabs keep theirs."""
    page = watched(browser, url, "#t=0&e=0")
    press = lambda key: settled(page, lambda: page.keyboard.press(key))  # noqa: E731
    end = press("End")
    true("End goes to the last event", end[1] > 100, end)
    equal("Home goes to the start", (0.0, 0), press("Home"))
    equal("the right arrow goes to the next event", 1, press("ArrowRight")[1])
    equal("and to the one after it", 2, press("ArrowRight")[1])
    equal("the left arrow goes back", 1, press("ArrowLeft")[1])
    bad = press("N")
    expect(page.get_by_role("option", name="NG and findings")).to_have_attribute("aria-selected", "true")
    true("N goes to the next finding", bad[1] > 1, bad)
    later = press("N")
    true("and to the one after it", later[1] > bad[1], (bad, later))
    equal("P goes back", bad, press("P"))
    lanes = page.get_by_role("listbox", name="Lanes")
    lanes.get_by_role("option", name="NG and findings").focus()
    while page.evaluate("document.activeElement.textContent") != "Program line":
        page.keyboard.press("ArrowDown")
    moved = press("n")
    again = press("n")
    true("n goes through the items of the lane", again[1] > moved[1], (moved, again))
    equal("p goes back", moved, press("p"))
    # What has the focus keeps its keys.
    page.locator("#tab-program").focus()
    page.keyboard.press("ArrowRight")
    expect(page.locator("#view-panel")).to_be_visible()
    equal("the tabs keep their arrows", moved, moment(page))
    page.get_by_role("tab", name="Program").click()
    field = page.get_by_role("searchbox", name="Find a variable")
    field.press_sequentially("nN p")
    expect(field).to_have_value("nN p")
    equal("a field keeps its keys", moved, moment(page))
    closed(page)


def playing(browser, url):
    """It plays, faster and slower, with the path of the tool, and stops at the end."""
    page = watched(browser, url, MIDDLE)
    page.get_by_label("Speed of playing").select_option("2")
    page.locator("#now").click()
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    page.wait_for_function("() => parseFloat(document.getElementById('clock').textContent) > 2")
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Play", exact=True)).to_be_visible()
    stopped = settled_time(page)
    asked = []
    page.on("request", lambda request: "/ui/" in request.url or asked.append(request.url))
    page.wait_for_timeout(1000)
    equal("while nothing moves nothing is asked for", [], asked)
    page.get_by_label("Speed of playing").select_option("100")
    page.get_by_role("button", name="Play", exact=True).click()
    expect(slider(page)).to_have_attribute("aria-valuetext", re.compile("part 2 of 2"))
    expect(page.get_by_role("button", name="Play", exact=True)).to_be_visible()
    settled_time(page)
    end = moment(page)
    true("it plays to the end, over the border of two counts of time", end[1] > 100 and "part 2 of 2" in slider(page).get_attribute("aria-valuetext"), (stopped, end))
    closed(page)


def settled_time(page):
    """The time of the clock when it stands still."""
    before = None
    while before != (before := page.locator("#clock").inner_text()):
        page.wait_for_timeout(400)
    return before


def dragging(browser, url):
    """A drag moves everything; a click on a mark goes to it; zoom shows more of it; one reading at a time."""
    page = watched(browser, url, "#t=0&e=0")
    under_way, most = [0], [0]

    def began(request):
        if "/moments/" in request.url and request.url.endswith("/state"):
            under_way[0] += 1
            most[0] = max(most[0], under_way[0])

    def ended(request):
        if "/moments/" in request.url and request.url.endswith("/state"):
            under_way[0] -= 1

    page.on("request", began)
    page.on("requestfinished", ended)
    box = page.locator("#timeline .stage").bounding_box()
    joint = page.locator(".joints .mono").first
    before = joint.inner_text()
    page.mouse.move(box["x"] + 20, box["y"] + 8)
    page.mouse.down()
    # The press reads a moment of its own, which is none of the forty.
    settled_time(page)
    asked = []
    page.on("request", lambda request: request.url.endswith("/state") and asked.append(request.url))
    page.evaluate("""() => {
        const stage = document.querySelector("#timeline .stage"), {left, top} = stage.getBoundingClientRect();
        for (let x = 20; x < 60; x += 1) stage.dispatchEvent(new PointerEvent("pointermove", {bubbles: true, clientX: left + x, clientY: top + 8, movementX: 1, pointerId: 99}));
    }""")
    settled_time(page)
    true("of 40 moves at once the first and the newest are read", 0 < len(asked) <= 2, asked)
    seen = set()
    for step in range(30):
        page.mouse.move(box["x"] + 20 + step * box["width"] / 100, box["y"] + 8)
        page.wait_for_timeout(16)
        seen.add(joint.inner_text())
    page.mouse.up()
    page.wait_for_function("() => /t=[1-9]/.test(location.hash)")
    true("the arm follows a drag", len(seen) > 3 and joint.inner_text() != before, seen)
    equal("one moment is read at a time", 1, most[0])
    # The lane of commands, near its first mark.
    row = page.get_by_role("option", name="IP0").bounding_box()
    found = settled(page, lambda: page.mouse.click(box["x"] + 1, row["y"] + row["height"] / 2))
    true("a click on a mark goes to its event", found[0] == 0 and found[1] > 0, found)
    page.mouse.move(box["x"] + 1, row["y"] + row["height"] / 2)
    expect(page.locator("#timeline .tip")).to_contain_text("IP0")
    page.keyboard.down("Control")
    for _ in range(5):
        page.mouse.wheel(0, -200)
    page.keyboard.up("Control")
    near = settled(page, lambda: page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 8))
    true("the wheel with Ctrl zooms", 0 < near[0] < 1, near)
    page.get_by_role("button", name="Show the whole run").click()
    far = settled(page, lambda: page.mouse.click(box["x"] + box["width"] / 4, box["y"] + 8))
    true("Fit shows the whole run", far[0] > 1, far)
    closed(page)


def jumps(browser, url):
    """From a row of the traffic, a line of the program, a variable and an output to its moments; later rows are dimmed."""
    page = watched(browser, url, "#traffic?t=1.5")
    rows = page.get_by_role("grid", name="Traffic").get_by_role("row")
    expect(page.locator("#view-traffic [data-now=true]")).to_be_visible()
    expect(page.locator("#view-traffic .later").first).to_be_visible()
    later = rows.and_(page.locator(".later", has_text="host \u2192 robot")).first
    wanted = later.locator(".time").inner_text()
    found = settled(page, later.click)
    equal("a row leads to its moment", wanted, "%.3f" % found[0])
    page.get_by_role("button", name="Close details").click()
    page.get_by_role("tab", name="Program").click()
    page.get_by_role("button", name="Line 8, when it was executed").click()
    listed = page.get_by_role("region", name="Line 8")
    expect(listed).to_contain_text("Executed")
    hit = settled(page, listed.get_by_role("button", name="Next").click)
    true("a line leads to when it was executed", hit[1] > found[1], (found, hit))
    page.keyboard.press("Escape")
    expect(listed).to_be_hidden()
    page.get_by_role("button", name="Why? Changes of N").click()
    listed = page.get_by_role("region", name="N", exact=True)
    changed = settled(page, listed.get_by_role("button", name="Next").click)
    expect(listed).to_contain_text("Last changed at")
    true("a variable leads to its changes", changed[0] > 0, changed)
    back = settled(page, listed.get_by_role("button", name="Previous").click) if listed.get_by_role("button", name="Previous").is_enabled() else changed
    true("and back", back[1] <= changed[1], back)
    page.keyboard.press("Escape")
    page.get_by_role("tab", name="I/O").click()
    page.get_by_role("region", name="Outputs").get_by_role("button", name="Output 1", exact=True).click()
    expect(page.get_by_role("region", name="Output 1")).to_contain_text("on")
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Why? Changes of the speed override").click()
    expect(page.get_by_role("region", name="the speed override")).to_contain_text("40")
    closed(page)


def locked(browser, url):
    """Nothing looks as if it could be pressed when it cannot, and a change is refused in words."""
    page = watched(browser, url, MIDDLE)
    expect(page.get_by_role("tab", name="Lab")).to_have_count(0)
    for view in VIEWS:
        page.goto(url + "#" + view)
        page.wait_for_selector("#view-%s:not([hidden])" % view)
    for name in "EMERGENCY STOP", "STOP", "SERVO", "FEED HOLD":
        key = page.locator("#bar").get_by_role("button", name=name, exact=True)
        expect(key).to_be_disabled()
        expect(key).to_have_attribute("title", re.compile("recorded run"))
    for name in "RUN", "STEP", "Edit", "Select", "Erase", "New", "TEACH", "ENTER", "SELECT", "Pause", "Add here":
        expect(page.get_by_role("button", name=name, exact=True)).to_have_count(0)
    sent = []
    page.on("request", lambda request: request.method == "GET" or sent.append(request.url))
    for element in page.locator("button:enabled").all():
        if element.is_visible() and element.get_attribute("aria-label") not in ("Play",) and element.inner_text() != "Copy link":
            element.evaluate("one => one.click()")
    page.wait_for_timeout(300)
    equal("no button changes anything", [], [one for one in sent if not one.endswith(("/check", "/decode"))])
    answers = page.request.put(url + "servo", data={"on": False})
    equal("the program that serves it refuses a change", 409, answers.status)
    closed(page)


def looks(browser, url, pictures):
    """Every view in every size, in light and in dark; the timeline is in sight in each."""
    for size in SIZES:
        page = watched(browser, url, MIDDLE, size=size)
        for view in VIEWS:
            page.goto(url + "#" + view + "?t=1.5")
            page.wait_for_selector("#view-%s:not([hidden])" % view)
            for scheme in "light", "dark":
                page.emulate_media(color_scheme=scheme)
                name = "trace-%s-%s-%s" % (view, size, scheme)
                in_sight(page, page.locator("#timeline"), name + ": the timeline")
                # What is laid out differs by size, what is coloured by scheme: each is looked at once.
                if (size, scheme) in (("desktop", "dark"), ("phone", "light")):
                    accessible(page, name)
                if pictures:
                    page.wait_for_timeout(200)
                    page.screenshot(path=os.path.join(pictures, name + ".png"))
        if size == "phone":
            page.get_by_role("button", name="Lanes", exact=True).click()
            in_sight(page, page.locator("#timeline .scroller"), "the lanes on a phone")
            page.get_by_role("button", name="Hide lanes").click()
        closed(page)
    page = watched(browser, url, MIDDLE)
    page.get_by_role("button", name="List", exact=True).click()
    near = page.get_by_role("region", name="Near this moment").get_by_role("button")
    expect(near.filter(has_text="Motion: moves")).to_be_visible()
    found = settled(page, near.filter(has_text="IP0").last.click)
    true("the list near the moment leads to its items", found[0] > 0, found)
    accessible(page, "the list near the moment")
    closed(page)
    ok("every view in %d sizes, light and dark" % len(SIZES))


def of_a_robot(browser, url):
    """A recording of a real robot: the page says what is not known, and shows no values there."""
    page = watched(browser, url, "#program?t=0&e=0")
    expect(page.get_by_role("region", name="Recording")).to_contain_text("recorded from a real robot")
    for name in "Variables", "Tasks and their calls", "RAM drive", "Program":
        expect(page.get_by_role("region", name=name, exact=True)).to_have_text(re.compile("not known$"))
    arm = page.locator("#view-arm .unknown")
    expect(arm).to_contain_text("not known")
    page.keyboard.press("End")
    expect(arm).to_be_hidden()
    expect(page.locator(".joints .mono").first).to_be_visible()
    expect(page.get_by_role("region", name="Speed")).to_contain_text("not known")
    expect(page.get_by_role("option", name="NG and findings")).to_be_visible()
    page.get_by_role("tab", name="Pendant").click()
    expect(page.get_by_role("region", name="Display")).to_contain_text("not known")
    accessible(page, "of a robot")
    closed(page)
    ok("a recording of a real robot")


def state_shown(page, seconds):
    """What the page shows of a moment: what the robot does and where, the numbers of its lines that are on, and the joints."""
    page.wait_for_function("() => document.getElementById('now').textContent && document.querySelectorAll('.joints .mono').length")
    expect(page.locator("#clock")).to_have_text("%.3f s" % float(seconds))
    settled_time(page)
    lines = page.evaluate("[...document.querySelectorAll('#view-lines .line[aria-pressed=true]')].map(one => /\\w+ \\d+/.exec(one.getAttribute('aria-label'))[0])")
    words = [page.locator(one).inner_text() for one in ("#now", "#where", "#clock")]
    return [*words, lines], [float(re.match(r"[-0-9.]+", one).group(0)) for one in page.locator(".joints .mono").all_inner_texts()]


def in_one_file(browser, url, binary, path):
    """The same run in one file, from disk and without a network: at each moment it shows what the served one shows."""
    out = path + ".html"
    subprocess.run([binary, "view", path, "--html", out], check=True, stdout=subprocess.DEVNULL)
    context = browser.new_context(offline=True)
    served, page = watched(browser, url, "#lines"), opened(context, "file://" + out + "#lines", link="recorded run")
    for seconds in "0", "1.5", "2.15", "3.9":
        address = "#lines?t=%s" % seconds
        served.goto(url + address)
        expected, joints = state_shown(served, seconds)
        page.goto("file://" + out + address)
        found, shown_joints = state_shown(page, seconds)
        equal("the file shows the moment %s s as it was" % seconds, expected, found)
        near = all(abs(one - other) <= 0.06 for one, other in zip(joints, shown_joints, strict=True))
        true("with the arm where it was", near, (joints, shown_joints))
    closed(served)
    closed(page)
    page = opened(context, "file://" + out + "#traffic?t=1.5", link="recorded run")
    expect(page.locator("#view-traffic [data-now=true]")).to_contain_text("IP0")
    page.locator("#summary summary").click()
    settled(page, page.locator("#summary a").first.click)
    accessible(page, "one file")
    closed(page)
    page = browser.new_context(java_script_enabled=False).new_page()
    page.goto("file://" + out)
    expect(page.locator("#summary")).to_contain_text("a program is running")
    page.close()


def main():
    parser = serving(__doc__)
    parser.add_argument("--pictures", metavar="DIRECTORY", help="where pictures of each view go")
    options = parser.parse_args()
    if options.pictures:
        os.makedirs(options.pictures, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="ts3100-trace-") as directory, chromium() as browser:
        path = os.path.join(directory, "run.txt")
        record(options.serve, path)
        with View(options.serve, path) as view:
            for step in addresses, keys, playing, dragging, jumps, locked:
                step(browser, view.url)
            in_one_file(browser, view.url, options.serve, path)
            looks(browser, view.url, options.pictures)
        path = os.path.join(directory, "robot.txt")
        record_robot(options.serve, path)
        with View(options.serve, path) as view:
            of_a_robot(browser, view.url)


if __name__ == "__main__":
    sys.exit(program(main))
