#!/usr/bin/env python3
"""The extension in the workbench of Visual Studio Code: packed, installed and used in Chromium as a person does, step by step.

    python3 tests/system/packages/vscode.py --serve target/dist/ts3100 [--tools target/tools] [--pictures FOLDER]

The workbench is code-server of npm, which is Visual Studio Code 1.100 in a browser; Node.js of its version comes from npm too.
Both are installed once, in a minute, into --tools. Needs npm, a C++ compiler, Chromium, and of Debian libkrb5-dev and ripgrep.
--pictures keeps what each step shows; those of docs/how-to/write-scol-in-vscode.md are made so. What the debugger answers is
proven by protocol elsewhere."""

import contextlib
import json
import os
import platform
import shutil
import subprocess
import sys
import tarfile
import tempfile
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", "editors", "vscode"))
import vsix  # noqa: E402
from browser import CHROMIUM, FLAGS  # noqa: E402
from emulator import ROOT, surroundings  # noqa: E402
from playwright.sync_api import Error, expect, sync_playwright  # noqa: E402
from steps import Failed, ok, program, serving, until  # noqa: E402

NODE, CODE_SERVER = "20.19.5", "4.100.3"
# Where @vscode/ripgrep looks before it would download.
RIPGREP = ("vscode-ripgrep-cache-1.15.11", "ripgrep-v13.0.0-10-%s-unknown-linux-musl.tar.gz")
# Seconds, and milliseconds for the browser.
INSTALL_LIMIT, LIMIT, AGAIN = 900, 120_000, 5_000
SIZE = {"width": 1280, "height": 800}
SETTINGS = {
    "workbench.colorTheme": "Default Light Modern", "workbench.startupEditor": "none", "workbench.tips.enabled": False,
    "security.workspace.trust.enabled": False, "telemetry.telemetryLevel": "off", "update.mode": "none",
    "extensions.autoCheckUpdates": False, "editor.minimap.enabled": False,
    # A tip would cover the next button.
    "workbench.hover.delay": 1_000_000, "chat.commandCenter.enabled": False,
    "window.menuBarVisibility": "compact", "debug.toolBarLocation": "docked", "files.autoSave": "off"}
PICK = """PROGRAM PICK
  COUNT = 0
AGAIN:
  MOVE HOME
  MOVEL PART
  COUNT = COUNT+1
  PRINT IP1, "PART", COUNT, CR
  IF COUNT < 3 THEN GOTO AGAIN
  RETURN
END
DATA
  POINT HOME=400,0,200,0,0,0,0,0/11111
  POINT PART=400,150,40,0,0,0,0,0/11111
END
"""
BREAK_AT, AFTER_COUNT = 4, 7


def installed(tools):
    """The folder with code-server and its Node.js."""
    folder = os.path.join(os.path.abspath(tools), "workbench-%s-%s" % (CODE_SERVER, NODE))
    if os.path.exists(os.path.join(folder, "installed")):
        return folder
    rg = shutil.which("rg")
    if not rg or not shutil.which("krb5-config"):
        raise Failed("ripgrep and libkrb5-dev are missing: apt-get install ripgrep libkrb5-dev")
    print("installing code-server %s and Node.js %s" % (CODE_SERVER, NODE), flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    cache = os.path.join(folder, "tmp", RIPGREP[0])
    os.makedirs(cache)
    with tarfile.open(os.path.join(cache, RIPGREP[1] % platform.machine()), "w:gz") as archive:
        archive.add(os.path.realpath(rg), "rg")
    with open(os.path.join(folder, "package.json"), "w", encoding="ascii") as file:
        file.write('{"name": "workbench", "version": "0.0.0", "private": true}\n')
    node = "node-linux-%s@%s" % ({"x86_64": "x64", "aarch64": "arm64"}[platform.machine()], NODE)
    npm(folder, "--ignore-scripts", node)
    # Its parts in C++ are compiled with the headers of this Node.js.
    npm(folder, "code-server@" + CODE_SERVER)
    with open(os.path.join(folder, "installed"), "w", encoding="ascii"):
        pass
    return folder


def npm(folder, *words):
    subprocess.run(["npm", "install", "--no-audit", "--no-fund", *words], cwd=folder, env=with_node(folder), check=True, timeout=INSTALL_LIMIT,
                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)


def with_node(folder, **more):
    """The environment of the pinned Node.js."""
    node = os.path.join(folder, "node_modules", "node-linux-" + {"x86_64": "x64", "aarch64": "arm64"}[platform.machine()])
    path = os.path.join(node, "bin") + os.pathsep + os.environ["PATH"]
    return surroundings(PATH=path, TMPDIR=os.path.join(folder, "tmp"), npm_config_nodedir=node, npm_config_yes="true",
                        npm_config_unsafe_perm="true", **more)


@contextlib.contextmanager
def workbench(folder, package, work):
    """The address of a workbench with the extension, which has a folder open."""
    home, extensions, data = (os.path.join(work, name) for name in ("home", "extensions", "data"))
    for place in (home, os.path.join(data, "User"), os.path.join(work, "programs"), os.path.join(work, "runtime")):
        os.makedirs(place, mode=0o700)
    with open(os.path.join(data, "User", "settings.json"), "w", encoding="utf-8") as file:
        json.dump(SETTINGS, file)
    with open(os.path.join(work, "programs", "pick.scol"), "w", encoding="ascii") as file:
        file.write(PICK)
    environment = with_node(folder, HOME=home, XDG_RUNTIME_DIR=os.path.join(work, "runtime"))
    command = [os.path.join(folder, "node_modules", ".bin", "code-server"), "--user-data-dir", data, "--extensions-dir", extensions]
    subprocess.run([*command, "--install-extension", package], env=environment, check=True, timeout=INSTALL_LIMIT, stdout=subprocess.DEVNULL)
    with tempfile.TemporaryFile("w+") as log:
        words = ["--auth", "none", "--bind-addr", "127.0.0.1:0", "--disable-telemetry", "--disable-update-check", "--disable-workspace-trust"]
        process = subprocess.Popen([*command, *words], env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log)

        def address():
            log.seek(0)
            words = log.read().split()
            return next((word.rstrip("/") for word in words if word.startswith("http://127.0.0.1:")), None)

        try:
            url = until("the workbench is ready", address, LIMIT / 1000)
            until("it is healthy", lambda: healthy(url), LIMIT / 1000)
            yield "%s/?folder=%s" % (url, os.path.join(work, "programs"))
        finally:
            process.terminate()
            process.wait(30)


def healthy(url):
    try:
        with urllib.request.urlopen(url + "/healthz", timeout=5) as answer:
            return answer.status == 200
    except OSError:
        return False


class Person:
    """Works the workbench by mouse and keys."""

    def __init__(self, page, pictures):
        self.page, self.pictures = page, pictures

    def press(self, keys):
        self.page.keyboard.press(keys)

    def put_cursor(self, text):
        """Clicks into the line with this text. Not by the box that commands and lines are typed into: it closes when something else
        takes the focus, and the keys go there."""
        self.page.locator(".editor-instance .view-line", has_text=text).click()

    def button(self, name):
        self.page.get_by_role("button", name=name).or_(self.page.get_by_role("checkbox", name=name)).first.click()

    def picture(self, name):
        if self.pictures:
            os.makedirs(self.pictures, exist_ok=True)
            self.page.screenshot(path=os.path.join(self.pictures, "vscode-%s.png" % name))


def opens_a_file(person, url):
    page = person.page
    page.goto(url)
    expect(page.locator(".monaco-workbench")).to_be_visible()
    page.locator(".explorer-folders-view").get_by_text("pick.scol").dblclick()
    expect(page.locator(".tab.active")).to_contain_text("pick.scol")
    lens = page.locator(".codelens-decoration")
    expect(lens).to_contain_text("Run")
    expect(lens).to_contain_text("Debug")
    # A word of the grammar has a colour of its own.
    first = page.locator(".view-line span span")
    until("words have colours", lambda: len({span.get_attribute("class") for span in first.all()}) > 2, LIMIT / 1000)
    ok("open a file: it is SCOL, with Run and Debug above PROGRAM")


def fixes_an_error(person):
    page = person.page
    expect(page.locator(".squiggly-error")).to_be_visible()
    person.put_cursor("MOVEL PART")
    # To the error: its beginning is the first word of the line.
    person.press("Home")
    person.press("Control+.")
    offered = page.locator(".action-widget").get_by_text("Replace MOVEL by MOVES")
    expect(offered).to_be_visible()
    person.picture("fix")
    person.press("Enter")
    expect(page.locator(".squiggly-error")).to_have_count(0)
    expect(page.locator(".view-line", has_text="MOVES PART")).to_be_visible()
    person.press("Control+s")
    expect(page.locator(".tab.active.dirty")).to_have_count(0)
    ok("see an error and take its fix: MOVEL has become MOVES")


def breaks(person):
    page = person.page
    person.put_cursor("MOVE HOME")
    person.press("F9")
    expect(page.locator(".codicon-debug-breakpoint").first).to_be_visible()
    person.press("F5")
    expect(page.locator(".debug-top-stack-frame-line").first).to_be_visible()
    expect(page.locator(".debug-call-stack")).to_contain_text("PICK")
    variables = page.locator(".debug-variables .monaco-list-row")
    expect(variables.filter(has_text="COUNT")).to_contain_text("0")
    variables.filter(has_text="Points").click()
    expect(variables.filter(has_text="PART")).to_contain_text("150")
    person.picture("stopped")
    ok("break at a MOVE and press F5: the program stops there")


def changes_a_variable(person):
    page = person.page
    for line in range(BREAK_AT + 1, AFTER_COUNT + 1):
        person.press("F10")
        expect(page.locator(".debug-call-stack")).to_contain_text("%d:1" % line)
    variables = page.locator(".debug-variables")
    count = variables.locator(".monaco-list-row", has_text="COUNT")
    expect(count).to_contain_text("1")

    def edited():
        # The view is drawn again some time after a step, which ends an editing: then it is begun again, as a person would.
        try:
            count.dblclick(timeout=AGAIN)
            variables.locator("input").fill("3", timeout=AGAIN)
            person.press("Enter")
            expect(count).to_contain_text("3", timeout=AGAIN)
        except (AssertionError, Error):
            return False
        return True

    until("the new value is taken", edited, LIMIT / 1000)
    person.picture("variable")
    ok("step and change a variable: COUNT is 3")


def resumes(person):
    page = person.page
    person.press("F5")
    expect(page.locator(".debug-top-stack-frame-line")).to_have_count(0)
    console = page.locator(".repl .monaco-list-rows")
    expect(console).to_contain_text("PART           3")
    expect(console).not_to_contain_text("PART           1")
    ok("resume: the changed variable decides how the program ends")


def opens_the_pendant(person):
    page = person.page
    for name, part in (("Toggle Panel", ".part.panel"), ("Toggle Primary Side Bar", ".part.sidebar")):
        person.button(name)
        expect(page.locator(part)).to_be_hidden()
    person.button("Open Pendant")
    view = page.frame_locator("iframe.webview.ready").frame_locator("iframe#active-frame").frame_locator("iframe")
    expect(view.locator("#link")).to_have_text("connected")
    expect(view.locator("body")).to_contain_text("PICK")
    person.picture("pendant")
    ok("open the pendant: the page of an emulator is shown beside the program")


def main():
    parser = serving(__doc__)
    parser.add_argument("--tools", metavar="DIR", default=os.path.join(ROOT, "target", "tools"), help="where tools are kept")
    parser.add_argument("--pictures", metavar="FOLDER", help="where pictures go")
    options = parser.parse_args()
    folder = installed(options.tools)
    with tempfile.TemporaryDirectory(prefix="ts3100-vscode-") as work:
        with open(options.serve, "rb") as file:
            content = file.read()
        found = vsix.kind_of(content)
        mine = next(one for one in vsix.PLATFORMS.values() if one[:2] == found)
        packages = vsix.pack("0.0.0", {mine: content}, os.path.join(work, "packages"), options.tools)
        package = next(path for path in packages if mine.npm in path)
        with workbench(folder, package, work) as url, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            page = browser.new_page(viewport=SIZE)
            page.set_default_timeout(LIMIT)
            expect.set_options(timeout=LIMIT)
            person = Person(page, options.pictures)
            try:
                opens_a_file(person, url)
                fixes_an_error(person)
                breaks(person)
                changes_a_variable(person)
                resumes(person)
                opens_the_pendant(person)
            except (AssertionError, Error, Failed) as error:
                person.pictures = person.pictures or tempfile.mkdtemp(prefix="ts3100-vscode-")
                person.picture("failed")
                raise Failed("%s\n     the picture is %s/vscode-failed.png" % (error, person.pictures)) from None
            finally:
                browser.close()


if __name__ == "__main__":
    sys.exit(program(main))
