#!/usr/bin/env python3
"""The page in a frame of another page, in Chromium: shown by the origins that `--control-frame-ancestor` names, and by no other.

    python3 tests/system/control/framed_page.py --serve target/dist/ts3100

Needs Playwright and axe (pip install playwright axe-playwright-python) and Chromium (apt-get install chromium)."""

import contextlib
import functools
import http.server
import os
import sys
import tempfile
import threading

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from browser import LIMIT, chromium  # noqa: E402
from emulator import Emulator  # noqa: E402
from playwright.sync_api import expect  # noqa: E402
from steps import equal, program, serving  # noqa: E402

# A page that shows another one, and one that shows that page: each page around the innermost has to be allowed.
FRAME = '<!doctype html><iframe src="%s" width="1200" height="800"></iframe>'


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves a folder without a log."""

    def log_message(self, *_):
        pass


@contextlib.contextmanager
def site(folder):
    """The origin of a server of this folder."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield "http://127.0.0.1:%d" % server.server_port
    server.shutdown()


def shown(browser, url, depth):
    """Whether the innermost frame is the page of the robot. If not, it is an error of the browser, or the refusal as JSON."""
    page = browser.new_page()
    frame = page
    page.goto(url)
    for _ in range(depth):
        frame = frame.frame_locator("iframe")
    place = frame.locator("#link, #main-frame-error, body > pre:first-child")
    expect(place).to_be_attached(timeout=LIMIT)
    found = place.get_attribute("id") == "link"
    if found:
        expect(place).to_have_text("connected", timeout=LIMIT)
    page.close()
    return found


def main():
    options = serving(__doc__).parse_args()
    with tempfile.TemporaryDirectory() as folder, site(folder) as editor, site(folder) as other, chromium() as browser:
        for name, ancestors, expected in (("named", [editor], {"editor": True, "other": False, "editor in other": False}),
                                          ("both named", [editor, other], {"editor": True, "other": True, "editor in other": True}),
                                          ("none named", [], {"editor": False, "other": False, "editor in other": False})):
            flags = [word for ancestor in ancestors for word in ("--control-frame-ancestor", ancestor)]
            with Emulator(options.serve, *flags) as emulator:
                for file, url in (("frame.html", emulator.url + "/"), ("outer.html", editor + "/frame.html")):
                    with open(os.path.join(folder, file), "w", encoding="utf-8") as page:
                        page.write(FRAME % url)
                found = {"editor": shown(browser, editor + "/frame.html", 1), "other": shown(browser, other + "/frame.html", 1),
                         "editor in other": shown(browser, other + "/outer.html", 2)}
                equal("%s: the page is shown where it may be" % name, expected, found)


if __name__ == "__main__":
    sys.exit(program(main))
