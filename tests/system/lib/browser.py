"""The pages of the control interface in Chromium, for the programs that work them: how a page is opened and closed, and what
every page has to hold in each size.

Needs Playwright and axe (pip install playwright axe-playwright-python) and Chromium (apt-get install chromium)."""

import contextlib
import shutil
import sys

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Error, expect, sync_playwright

CHROMIUM = shutil.which("chromium") or "/usr/bin/chromium"
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SIZES = {"desktop": (1440, 900), "tablet": (820, 1180), "phone": (390, 844)}
LIMIT = 20_000


@contextlib.contextmanager
def chromium():
    """The browser."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


def opened(browser, url, size="desktop", dark=False, link="connected"):
    """The page of a robot or of a recorded run, in a browser or one of its contexts; an error of a script fails the test."""
    width, height = SIZES[size]
    page = browser.new_page() if hasattr(browser, "pages") else browser.new_page(viewport={"width": width, "height": height}, color_scheme="dark" if dark else "light")
    page.set_default_timeout(LIMIT)
    page.errors = []
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.goto(url)
    expect(page.locator("#link")).to_have_text(link, timeout=LIMIT)
    return page


def closed(page):
    page.close()
    if page.errors:
        sys.exit("the page failed: %s" % page.errors)


def accessible(page, name):
    """Nothing sideways, nothing that axe calls serious."""
    # The picture of the arm follows its place some frames later.
    try:
        page.wait_for_function("() => document.documentElement.scrollWidth <= document.documentElement.clientWidth", timeout=LIMIT)
    except Error:
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        sys.exit("%s: the page is %d pixels wider than the screen" % (name, wide))
    found = [one for one in Axe().run(page).response["violations"] if one["impact"] in ("serious", "critical")]
    for one in found:
        print(name, one["id"], one["help"], [node["html"][:120] for node in one["nodes"][:3]])
    if found:
        sys.exit("%s: axe found what is serious" % name)


def in_sight(page, locator, what):
    """The whole box is inside the viewport."""
    box, size = locator.bounding_box(), page.viewport_size
    if not box or box["x"] < 0 or box["y"] < 0 or box["x"] + box["width"] > size["width"] or box["y"] + box["height"] > size["height"]:
        sys.exit("%s is not in sight: %s in %s" % (what, box, size))
