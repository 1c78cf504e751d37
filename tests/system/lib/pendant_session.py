"""A person's whole session at the page, on one kind of arm: power, servo, a program dropped on the page, a run with an INPUT,
an emergency stop, jogging, teaching, a forced line, a fault and its finding. The clock of the robot is stepped."""

import re
import socket
import sys

from playwright.sync_api import expect

POINTS = {
    "six-axis": ("300.,0.,400.,0.,0.,0.,0.,0.", "350.,150.,300.,0.,0.,0.,0.,0."),
    "scara": ("250.,150.,50.,0.,0.", "200.,-200.,80.,90.,0."),
}
PROGRAM = """GLOBAL
  N = 0
END
PROGRAM PART
  PRINT "HOW MANY?",CR
  INPUT N
ARATIO:
  MOVES P1
  DOUT(5)
  MOVES P2
  DOUT(-5)
  N = N - 1
  IF N > 0 THEN GOTO ARATIO
  PRINT "DONE",CR
END
DATA
  POINT P1 = %s
  POINT P2 = %s
END
"""
MOVES_P1, MOVES_P2 = 8, 10


def said(condition, words):
    """Ends the test with these words unless the condition holds."""
    if not condition:
        sys.exit("the session failed: " + words)


class Session:
    """One page and its robot."""

    def __init__(self, page, robot, kind):
        self.page, self.robot, self.kind = page, robot, kind

    def view(self, name):
        """Opens a view by its tab."""
        self.page.get_by_role("tab", name=name, exact=True).click()
        return self.page.get_by_role("tabpanel", name=name, exact=True)

    @property
    def arm(self):
        """The arm, which stays beside every view."""
        return self.page.get_by_role("region", name="Robot", exact=True)

    @property
    def bar(self):
        return self.page.get_by_role("region", name="Operation", exact=True)

    def key(self, name):
        """A key of the bar."""
        return self.bar.get_by_role("button", name=name, exact=True)

    def start(self):
        """Presses START, which says what it starts."""
        self.press(self.bar.get_by_role("button", name="START"), "program/start")

    def is_servo(self, on):
        expect(self.key("SERVO")).to_have_attribute("aria-pressed", str(on).lower())

    def told(self, words):
        """The bar says this of the robot."""
        expect(self.page.locator("#now")).to_have_text(words)

    def answered(self, call):
        """Within it, a call that changes something is made and answered."""
        return self.page.expect_response(lambda answer: answer.request.method != "GET" and answer.url.endswith("/" + call))

    def press(self, button, call):
        """Presses a button and waits until its call has been answered."""
        with self.answered(call):
            button.click()

    def advance_until(self, holds, words, step=0.1, most=600):
        for _ in range(most):
            if holds():
                return
            self.robot.advance(step)
        said(False, words)

    # The steps.

    def power_and_servo(self):
        power = self.view("Panel").get_by_role("button", name="POWER", exact=True)
        power.click()
        self.told("power off")
        self.start()
        expect(self.bar).to_contain_text("the power is off")
        power.click()
        self.told("stop (reset)")
        self.is_servo(False)
        self.key("SERVO").click()
        self.is_servo(True)

    def drop_and_select(self):
        text = PROGRAM % POINTS[self.kind]
        self.page.evaluate("""text => {
            const data = new DataTransfer();
            data.items.add(new File([text + "\x1a"], "part.scol"));
            window.drag = kind => document.body.dispatchEvent(new DragEvent(kind, {bubbles: true, cancelable: true, dataTransfer: data}));
            window.drag("dragenter");
        }""", text)
        # A browser repeats this as long as the pointer is over the page.
        self.page.wait_for_function("""() => {
            window.drag("dragover");
            return [...document.querySelectorAll(".drop")].some(one => !one.hidden);
        }""")
        expect(self.page.get_by_text("Drop here to write onto the RAM drive")).to_be_visible()
        self.page.evaluate("window.drag('drop')")
        expect(self.page.get_by_text("part.scol is on the RAM drive as PART")).to_be_visible()
        said(self.robot.files["PART"] == text, "the file is not on the drive as it is, without its EOF")
        program = self.view("Program")
        program.get_by_role("button", name="Select PART").click()
        expect(program.get_by_role("region", name="Source")).to_contain_text("MOVES P1")
        expect(program.get_by_role("heading", name="PART", exact=True)).to_be_visible()

    def picture(self):
        """What the picture in 3D says of the arm, in words."""
        return self.arm.get_by_role("application").get_attribute("aria-label")

    def is_drawn(self):
        """The picture in 3D shows the arm: many colours, and others in the middle than at the edge."""
        canvas = self.arm.locator("canvas")
        expect(canvas).to_have_attribute("data-frames", re.compile("[1-9]"))
        colours = canvas.evaluate("""canvas => {
            const copy = document.createElement("canvas"), {width, height} = canvas;
            [copy.width, copy.height] = [width, height];
            const context = copy.getContext("2d");
            context.drawImage(canvas, 0, 0);
            const count = (x, y, w, h) => new Set(new Uint32Array(context.getImageData(x, y, w, h).data.buffer)).size;
            return [count(0, 0, width, height), count(width * .3, height * .3, width * .4, height * .5), count(0, 0, width, 4)];
        }""")
        said(colours[0] > 200 and colours[1] > 100 > colours[2], "the picture in 3D is empty: %s" % colours)

    def line_is(self, number):
        """The line that is executed is marked in the source."""
        row = self.page.locator(".codeline[data-executed=true] .gutter")
        expect(row).to_have_text(str(number))

    def run_and_answer(self):
        self.view("Program")
        self.start()
        self.told("asks: HOW MANY?")
        self.line_is(6)
        # Opened while the program asks, the pendant shows the question.
        display = self.view("Pendant").get_by_role("region", name="Display")
        expect(display).to_contain_text("HOW MANY?")
        expect(display).to_contain_text("INPUT waits")
        display.focus()
        self.page.keyboard.press("2")
        with self.answered("pendant/keys"):
            self.page.keyboard.press("Enter")
        expect(display).not_to_contain_text("INPUT waits")
        self.told("running")
        said(self.robot.state["tasks"][0]["doing"] == "moving", "the answer did not let the program go on")
        self.view("Program")
        self.line_is(MOVES_P1)
        before, shown = self.robot.pose.world, self.picture()
        self.is_drawn()
        self.advance_until(lambda: self.robot.state["executed_line"] == MOVES_P2, "the first motion did not end")
        said(self.robot.pose.world != before, "the arm has not moved")
        expect(self.arm.get_by_role("application")).not_to_have_attribute("aria-label", shown)
        self.arm.get_by_role("button", name="3D", exact=True).click()
        for side in "Top:", "Side:":
            expect(self.arm.get_by_role("img", name=side)).to_be_visible()
        self.arm.get_by_role("button", name="3D", exact=True).click()
        self.is_drawn()
        self.line_is(MOVES_P2)

    def emergency_stop(self):
        self.robot.advance(0.1)
        panel = self.view("Panel")
        self.press(self.key("EMERGENCY STOP"), "emergency-stop")
        self.told("emergency stop")
        self.is_servo(False)
        self.bar.get_by_role("button", name="8-014").click()
        expect(self.bar).to_contain_text("Remedy:")
        self.page.keyboard.press("Escape")
        self.robot.advance(1)
        there = self.robot.pose.joints
        self.robot.advance(1)
        said(self.robot.pose.joints == there, "the arm moves in an emergency stop")
        self.key("SERVO").click()
        expect(self.bar).to_contain_text("cannot turn the servo on: the emergency stop is pressed")
        self.press(self.key("Release EMERGENCY STOP"), "emergency-stop")
        panel.get_by_role("button", name="ALARM RESET").click()
        expect(self.bar.get_by_role("button", name="8-014")).to_be_hidden()
        self.key("SERVO").click()
        self.is_servo(True)
        self.start()
        self.told("running")
        self.advance_until(lambda: self.robot.state["status"] != "running", "the program did not end after it was resumed")
        self.told("stop (reset)")
        pendant = self.view("Pendant")
        pendant.get_by_role("button", name="TP", exact=True).click()
        expect(pendant.get_by_role("region", name="Display")).to_contain_text("DONE")
        pendant.get_by_role("button", name="ERROR", exact=True).click()
        expect(pendant.get_by_role("region", name="Display")).to_contain_text("REMEDY")

    def breakpoint_and_step(self):
        program = self.view("Program")
        program.get_by_role("button", name="Breakpoint, line %d" % (MOVES_P1 - 1)).click()
        mark = program.get_by_role("button", name="Breakpoint, line %d" % MOVES_P1)
        expect(mark).to_have_attribute("aria-pressed", "true")
        self.start()
        self.robot.press_keys("1\r")
        self.advance_until(lambda: self.robot.state["status"] != "running", "the breakpoint did not stop the program")
        self.told("breakpoint, line %d" % MOVES_P1)
        self.line_is(MOVES_P1)
        self.press(program.get_by_role("button", name="STEP", exact=True), "program/step")
        self.advance_until(lambda: self.robot.state["status"] != "running", "the step did not end")
        self.line_is(MOVES_P1 + 1)
        self.press(mark, "breakpoints")
        expect(mark).to_have_attribute("aria-pressed", "false")
        program.get_by_role("spinbutton", name="Line").fill("12")
        self.press(program.get_by_role("button", name="RUN TO LINE"), "program/run-to")
        self.advance_until(lambda: self.robot.state["status"] != "running", "the program did not come to line 12")
        self.line_is(12)
        self.robot.start_program()
        self.advance_until(lambda: self.robot.state["status"] != "running", "the program did not end")

    def jog_and_teach(self):
        pendant = self.view("Pendant")
        pendant.get_by_role("button", name="Turn it to TEACHING").click()
        expect(self.page.locator("#lamps")).to_contain_text("TEACHING")
        key = pendant.get_by_role("button", name="J1 plus")
        before = self.robot.pose.joints[0]
        key.hover()
        self.page.mouse.down()
        self.advance_until(lambda: self.robot.pose.moving, "the key did not move the arm", step=0.001)
        self.robot.advance(1)
        self.page.mouse.up()
        self.advance_until(lambda: not self.robot.pose.moving, "the arm did not stop when the key was let go")
        there = self.robot.pose.joints[0]
        said(there > before + 1, "axis 1 was not jogged: %s, %s" % (before, there))
        self.robot.advance(1)
        said(self.robot.pose.joints[0] == there, "the arm goes on after the key was let go")
        key.focus()
        self.page.keyboard.down("Space")
        self.advance_until(lambda: self.robot.pose.moving, "Space did not move the arm", step=0.001)
        self.page.keyboard.up("Space")
        self.advance_until(lambda: not self.robot.pose.moving, "the arm did not stop when Space was let go")
        old = self.robot.files["PART"]
        self.press(pendant.get_by_role("button", name="Teach P1"), "positions/P1/teach")
        expect(pendant).to_contain_text("P1 is taught and stored in DATA of PART.")
        said(self.robot.files["PART"] != old, "the file has not the point that was taught")
        self.robot.key_switch = "ext"

    def force_an_input(self):
        lines = self.view("I/O")
        lines.get_by_role("button", name="More for Input 7", exact=False).first.click()
        self.press(self.page.get_by_role("menuitem", name="Force on"), "inputs/7/force")
        expect(lines.get_by_role("switch", name="Input 7", exact=False).first).to_have_accessible_name("Input 7, forced")
        said(self.robot.inputs[7], "input 7 is not forced on")
        lines.get_by_role("button", name="More for Input 7", exact=False).first.click()
        self.page.get_by_role("menuitem", name="Release").click()
        expect(lines.get_by_role("switch", name="Input 7", exact=True)).to_be_visible()

    def edit_and_check(self):
        program = self.view("Program")
        program.get_by_role("button", name="Edit", exact=True).click()
        text = program.get_by_role("textbox", name="Text of the file")
        good = text.input_value()
        text.fill(good.replace("MOVES P1", "MOVES P9"))
        expect(program.get_by_role("list", name="Diagnostics")).to_contain_text("P9")
        text.fill(good.replace("DONE", "FINISHED"))
        expect(program).to_contain_text("No errors, no warnings.")
        program.get_by_role("button", name="Download to the RAM drive").click()
        expect(program.get_by_role("region", name="Source")).to_contain_text("FINISHED")
        said("FINISHED" in self.robot.files["PART"], "the edited text is not on the drive")

    def ask(self, *texts):
        """A host: what the robot answers to each text."""
        with socket.create_connection(self.robot.address("ip0"), timeout=10) as host:
            answers = []
            for text in texts:
                host.sendall(b"\x02" + text + b"\r\x03")
                answer = b""
                while not answer.endswith(b"\x03"):
                    answer += host.recv(4096)
                answers.append(answer.strip(b"\x02\x03"))
            return answers

    def fault_and_finding(self):
        lab = self.view("Lab")
        lab.get_by_role("radio", name="ng", exact=True).click()
        lab.get_by_role("textbox", name="Command").fill("SU")
        lab.get_by_label("Times").fill("3")
        self.press(lab.get_by_role("button", name="Arm", exact=True), "faults")
        expect(lab.get_by_role("list", name="Faults")).to_contain_text("ng:command=SU,times=3")
        said(self.ask(b"SU", b"SU", b"SU", b"SU")[:3] == [b"NG\r"] * 3, "the fault did not refuse SU three times")
        expect(lab.get_by_role("list", name="Faults")).to_contain_text("fired 3 of 3 times")
        self.ask(b"su")
        expect(lab.get_by_role("list", name="Findings")).to_contain_text("lower-case")
        traffic = self.view("Traffic")
        rows = traffic.get_by_role("grid", name="Traffic")
        expect(rows).to_contain_text("lower-case")
        traffic.get_by_label("Show").select_option(label="only findings")
        traffic.get_by_role("searchbox", name="Search").fill("lower-case")
        # The rows of one exchange are left.
        expect(traffic).to_contain_text(re.compile(r"\D[1-5] of \d+ rows"))
        rows.get_by_role("row").filter(has_text="lower-case", visible=True).last.click()
        expect(traffic.get_by_role("region", name="Details")).to_contain_text("Remedy: Send command letters in upper case")
        with self.page.expect_download() as saved:
            traffic.get_by_role("button", name="Save last failure").click()
        said("lower-case" in saved.value.path().read_text(), "the saved failure does not name the finding")

    def snapshot_and_time(self):
        lab = self.view("Lab")
        lab.get_by_role("textbox", name="Name").fill("before")
        self.press(lab.get_by_role("button", name="Take"), "snapshots/before")
        before = self.robot.state["t"]
        lab.get_by_role("spinbutton", name="Seconds").fill("2.5")
        self.press(lab.get_by_role("button", name="Advance", exact=True), "clock/advance")
        said(abs(self.robot.state["t"] - before - 2.5) < 1e-6, "the clock was not advanced by 2.5 s")
        lab.get_by_role("button", name="Compare").click()
        expect(lab.get_by_role("region", name="Differences")).to_contain_text("now")
        self.press(lab.get_by_role("button", name="Restore before"), "snapshots/before/restore")
        said(self.robot.state["t"] == before, "the snapshot was not put back")

    def set_a_variable(self):
        self.robot.files["TUNED"] = "GLOBAL\n  RATIO = 0.00001234\nEND\nPROGRAM TUNED\nEND\n"
        self.robot.select_file("TUNED")
        self.view("Program")
        field = self.page.get_by_label("Value of RATIO")
        expect(field).to_have_value("0.00001234")
        before = self.robot.variables["RATIO"]
        field.press("Enter")
        expect(field).not_to_be_focused()
        said(self.robot.variables["RATIO"] == before, "Enter without a change has changed a variable")
        field.fill("2.5e-7")
        with self.answered("variables/RATIO"):
            field.press("Enter")
        expect(field).to_have_value("2.5e-7")

    def inject(self):
        lab = self.view("Lab")
        lab.get_by_label("Bytes (escapes: \\r, <1A>)").fill("<E9>\u00e94\\r")
        self.press(lab.get_by_role("button", name="Inject"), "channels/IP1/inject")
        found = self.robot.channel_state("IP1")["buffer_hex"]
        said(found == "e9c3a9340d", "the bytes were injected as " + found)


def session(page, robot, kind):
    """Everything, in the order of a working day."""
    steps = Session(page, robot, kind)
    steps.power_and_servo()
    steps.drop_and_select()
    steps.run_and_answer()
    steps.emergency_stop()
    steps.breakpoint_and_step()
    steps.jog_and_teach()
    steps.force_an_input()
    steps.edit_and_check()
    steps.fault_and_finding()
    steps.snapshot_and_time()
    steps.set_a_variable()
    steps.inject()
