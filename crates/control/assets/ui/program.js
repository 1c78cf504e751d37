// The view of the program: its source or the editor, steps and breakpoints, tasks with their calls, variables, and the RAM drive.

import {LOCKED, ifKnown, make, button, list, mark, say} from "./dom.js";
import {check, makeEditor} from "./editor.js";
import {makeSource} from "./source.js";
import {failingLine, status} from "./status.js";
import {makeVariables, shownValue} from "./variables.js";
import {createWelcome} from "./welcome.js";

const path = name => "files/" + encodeURIComponent(name);

export function create(robot) {
  let open = "", follow = true, shown = false, reading = 0, lastText = "", seenFiles = "", seenStack = "", stack = new Map();
  const title = make("h3", {class: "mono"}), told = make("p", {class: "empty", hidden: true});
  const source = makeSource(robot);
  const editor = makeEditor(robot, name => { work.hidden = false; read(name, true); });
  const variables = makeVariables(robot);

  const welcome = createWelcome(robot);
  const selectFile = name => robot.post(path(name) + "/select");
  const run = button("RUN", async () => {
    guard();
    if (open !== robot.state.file) await selectFile(open);
    await robot.post("program/start");
  }, {title: "Select the file that is shown, and start it"});
  const step = button("STEP", () => robot.post("program/step"), {title: "Run one step"});
  const restart = button("PROGRAM RESET", () => robot.post("program/reset"), {title: "Back to the first line of the program"});
  const line = make("input", {id: "program-line", type: "number", min: "1", max: "99999", value: "1", inputmode: "numeric"});
  const runTo = button("RUN TO LINE", () => robot.post("program/run-to", {line: Number(line.value)}), {title: "Start, and stop before this line"});
  source.onChoose = number => { line.value = number; };
  const edit = button("Edit", async () => {
    const found = await robot.get(path(open));
    if (typeof found.text !== "string") throw new Error("cannot edit " + open + ": it is a binary file");
    work.hidden = true;
    editor.edit(open, found.text);
  });
  const tasks = make("tbody"), noTask = make("p", {class: "empty"}, "No program is open.");
  const work = make("div", {class: "work"}, source.element);

  const rows = make("ul", {class: "files", "aria-label": "Files of the RAM drive"});
  const used = make("p", {class: "hint"});
  const name = make("input", {id: "program-new", size: "10", maxlength: "16", autocomplete: "off", spellcheck: "false"});
  const fresh = button("New", async () => {
    const wanted = name.value.trim().toUpperCase();
    if (!wanted) throw new Error("cannot create a file: type its name first");
    if (robot.state.files.files.some(file => file.name === wanted)) throw new Error("cannot create " + wanted + ": it exists already; choose another name");
    guard();
    await robot.put(path(wanted), {text: "PROGRAM " + wanted.split(".")[0] + "\n\nEND\n"});
    name.value = "";
    follow = false;
    await read(wanted, true);
    edit.button.click();
  });
  name.addEventListener("keydown", event => { if (event.key === "Enter") fresh.button.click(); });

  function guard() {
    if (editor.dirty) throw new Error("download or discard the changed text of " + open + " first");
    if (editor.open) { editor.close(); work.hidden = false; }
  }

  /** Reads a file and shows it. */
  async function read(wanted, again) {
    if (!wanted || (wanted === open && !again)) return;
    const mine = reading += 1;
    open = wanted;
    mark(title, "data-file", wanted);
    say(title, wanted);
    try {
      const found = await robot.get(path(wanted));
      if (mine !== reading) return;
      lastText = typeof found.text === "string" ? found.text : "";
      told.hidden = typeof found.text === "string";
      say(told, wanted + " is a binary file: " + found.size + " bytes.");
      source.text(lastText, wanted);
      here();
      files(robot.state);
    } catch (error) {
      if (mine !== reading) return;
      told.hidden = false;
      say(told, error.message);
      return;
    }
    if (!lastText || wanted.endsWith(".PAR")) return;
    try {
      const all = await check(robot, {file: wanted});
      if (mine === reading) source.diagnostics(all);
    } catch (error) {
      if (mine === reading) source.diagnostics([]);
      told.hidden = false;
      say(told, error.message);
    }
  }

  /** The marks are those of the selected file. */
  function here() {
    const state = robot.state, selected = state && open === state.file;
    if (state) source.kind(status(state, robot.lines)[0]);
    source.breakpoints(selected ? state.breakpoints : []);
    source.lines(selected ? state.executed_line : 0, selected ? state.analysed_line : 0, selected ? failingLine(state) : 0);
  }

  function files(state) {
    const key = JSON.stringify([state.files, open]);
    if (key === seenFiles) return;
    seenFiles = key;
    list(rows, state.files.files, file => file.name, file => {
      const show = button(file.name, async () => { guard(); follow = file.name === robot.state.file; await read(file.name); }, {class: "mono name", reads: true});
      const select = button("Select", async () => { guard(); await selectFile(file.name); follow = true; }, {"aria-label": "Select " + file.name});
      const erase = button("Erase", async () => {
        if (!confirm("Erase " + file.name + " from the RAM drive?")) return;
        await robot.remove(path(file.name));
        if (open === file.name) follow = true;
      }, {"aria-label": "Erase " + file.name});
      return make("li", {}, show.element, make("span", {class: "size"}), ...(LOCKED ? [] : [select.element, erase.element]));
    }, (row, file) => {
      const [show] = row.querySelectorAll("button");
      mark(row, "data-selected", file.name === state.files.selected);
      mark(show, "aria-current", file.name === open);
      say(row.querySelector(".size"), file.size + " bytes" + (file.name === state.files.selected ? ", selected" : ""));
    });
    const total = state.files.files.reduce((sum, file) => sum + file.size, 0);
    say(used, total + " of " + state.files.capacity + " bytes used." + (LOCKED ? "" : " Drop a file anywhere on the page to put it onto the drive."));
  }

  const element = make("div", {class: "program"}, welcome.element,
    LOCKED ? "" : make("div", {class: "row run"}, run.element, step.element, runTo.element, make("label", {for: "program-line", class: "sr"}, "Line"), line, restart.element),
    make("div", {class: "columns"},
      ifKnown(robot, ["files"], make("section", {class: "code", "aria-label": "Program"}, make("div", {class: "head"}, title, LOCKED ? "" : edit.element), told, work, editor.element,
        make("p", {class: "hint"}, "\u25b6 executed, \u203a analysed, \u2716 failed. Click a line number to " + (LOCKED ? "list when it was executed" : "set a breakpoint") + "; arrow keys move.")), "Program"),
      make("aside", {class: "side", "aria-label": "Drive, tasks and variables"},
        ifKnown(robot, ["tasks"], make("section", {"aria-label": "Tasks"}, make("h3", {}, "Tasks and their calls"), noTask, make("table", {class: "tasks"}, tasks)), "Tasks and their calls"),
        ifKnown(robot, ["files"], make("section", {"aria-label": "RAM drive"}, make("h3", {}, "RAM drive"), rows, LOCKED ? "" : make("div", {class: "row new"},
          make("label", {for: "program-new"}, "New file"), name, fresh.element), used), "RAM drive"),
        ifKnown(robot, ["variables"], variables.element, "Variables"))));

  /** Variables in one line. */
  const shownAll = variables => variables.filter(one => one.value).map(one => one.name + " = " + shownValue(one.value)).join(", ");
  /** The local variables of a program while it runs: of its last call. */
  const locals = (state, program) => shownAll(state.variables.filter(one => one.name.startsWith(program + "."))
    .map(one => ({name: one.name.slice(program.length + 1), value: one.value})));

  /** Reads the variables of each open call once the program has stopped, and again when something has changed. */
  async function readStack(state) {
    const isStopped = state.status !== "running" && state.status !== "stop (reset)";
    const key = isStopped ? JSON.stringify([state.file, state.status, state.tasks, state.variables]) : "";
    if (key === seenStack) return;
    seenStack = key;
    stack = new Map();
    if (!key) return;
    try {
      const {tasks: found} = await robot.get("program/stack");
      if (key !== seenStack) return;
      stack = new Map(found.flatMap(task => task.calls.map((call, at) => [task.id + " " + (task.calls.length - 1 - at), shownAll(call.locals)])));
    } catch {
      // A recorded run in one page is without them: those of the last call of a program are shown.
      return;
    }
    if (shown) drawTasks(robot.state);
  }

  /** The tasks with what each does, and below it its open calls, innermost first, with their variables. */
  function drawTasks(state) {
    noTask.hidden = state.tasks.length > 0;
    const found = state.tasks.flatMap(task => [{key: task.id, head: task.id === 0 ? "DO" : "Task " + task.id, line: task.line, words: task.doing + (task.reads ? " from " + task.reads : "")},
      ...[...task.calls].reverse().map((call, at) => ({key: task.id + " " + at, head: call.program, line: call.line, words: stack.get(task.id + " " + at) ?? locals(state, call.program)}))]);
    list(tasks, found, one => one.key, () => make("tr", {}, make("th", {scope: "row"}), make("td"), make("td")), (row, one) => {
      mark(row, "class", String(one.key).includes(" ") ? "call" : "");
      [one.head, "line " + one.line, one.words].forEach((words, at) => say(row.children[at], words));
    });
  }

  return {
    element,
    state(state) {
      if (!shown) return;
      if (!editor.open && (follow || !open)) read(state.file);
      if (!open && !state.file) say(title, "no file selected");
      edit.button.disabled = !open || editor.open;
      here();
      files(state);
      welcome.state(state);
      mark(element, "data-open", open !== "");
      say(run.button, open ? "RUN " + open : "RUN");
      run.button.disabled = !open || open.endsWith(".PAR");
      drawTasks(state);
      readStack(state);
      variables.state(state);
    },
    pose: here,
    event(event) {
      if (!shown || editor.open) return;
      if (event.event === "stored" && event.file === open) read(open, true);
      if (event.event === "erased" && event.file === open) { open = ""; follow = true; lastText = ""; source.text(""); say(title, "no file selected"); }
      if (event.event === "selected") follow = true;
    },
    /** Another text of the selected file, at a moment of a recorded run. */
    text(file) { if (shown && file === open) read(open, true); },
    show() {
      shown = true;
      if (open && !editor.open) read(open, true);
      if (robot.state) this.state(robot.state);
    },
    hide() { shown = false; },
  };
}
