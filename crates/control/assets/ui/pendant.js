// The teach pendant: its display with pages and keys, jogging by hand, and teaching of positions.
//
// Jogging is hold to move. The call that moves an axis stays open while the key is held; ending the call stops the arm, and
// `jog/stop` is sent as well. Whatever makes it doubtful that somebody still holds the key ends the call.

import {LOCKED, ifKnown, make, button, choice, fixed, list, mark, say, toggle} from "./dom.js";
import {status} from "./status.js";

const COLUMNS = 40, ROWS = 14;     // the display, without its first and last line
const POSITIONS = 200;             // positions that are listed
const HISTORY = 99;                // alarms that are listed
const TYPED = 60;                  // characters of a value that is being typed
const TAUGHT = 1500;               // how long a taught position is highlighted, in ms
const GRACE = 60;                  // how long a call may still answer after its key was let go, in ms
const PAGES = [["status", "STATUS"], ["ether", "ETHER"], ["alarms", "ERROR"], ["files", "FILES"], ["tp", "TP"]];
const NAMES = {status: "STATUS", alarms: "ERROR HISTORY", files: "DIRECTORY", tp: "TP OUTPUT"};
const CARTESIAN = {4: ["X", "Y", "Z", "C"], 5: ["X", "Y", "Z", "C", "T"], 6: ["X", "Y", "Z", "A", "B", "C"]};

/** The text in rows of the display's width, broken between words where that is possible. */
function wrap(text, indent = 0) {
  const rows = [];
  let rest = text;
  while (rest.length > COLUMNS - (rows.length ? indent : 0)) {
    const width = COLUMNS - (rows.length ? indent : 0), blank = rest.lastIndexOf(" ", width), cut = blank > width / 2 ? blank : width;
    rows.push(" ".repeat(rows.length ? indent : 0) + rest.slice(0, cut));
    rest = rest.slice(cut).trimStart();
  }
  rows.push(" ".repeat(rows.length ? indent : 0) + rest);
  return rows;
}

/** What PRINT has shown, in rows. Output keeps its blanks: numbers are aligned with them. */
function printed(text) {
  const rows = [];
  for (const line of text.replaceAll("\n", "").split("\r"))
    for (let at = 0; at === 0 || at < line.length; at += COLUMNS) rows.push(line.slice(at, at + COLUMNS));
  if (rows.at(-1) === "") rows.pop();
  return rows;
}

/** A position as DATA writes it: coordinates, then the configuration. */
const position = values => values.slice(0, -1).map(value => fixed(value, 2)).join("  ") + "  /" + values.at(-1);

/** The axes in a table: a row each, with its joint and the coordinates in world and work. */
function axisRows({joints, world, work}) {
  const cell = value => (value === undefined ? "" : fixed(value, 2)).padStart(11), names = CARTESIAN[Math.max(joints.length, Math.min(6, world.length))] ?? CARTESIAN[6];
  return ["         JOINT        WORLD       WORK", ...names.map((name, at) => (joints[at] === undefined ? "" : "J" + (at + 1)).padEnd(3) + cell(joints[at]) + "  " + name + cell(world[at]) + cell(work[at]))];
}

function statusRows(state, lines) {
  const alarm = state.alarms[0];
  return [
    "MODE  " + state.master_mode.padEnd(17) + "KEY " + state.key_switch.toUpperCase(),
    "SERVO " + (state.servo ? "ON" : "OFF").padEnd(6) + state.run_mode.padEnd(11) + "SPEED " + state.override_percent + " %" + (state.machine_lock ? "  LOCK" : ""),
    "FILE  " + (state.file ? state.file + "  LINE " + (state.executed_line || state.line) : "none"),
    ...wrap(status(state, lines)[1], 2).slice(0, 2),
    ...axisRows(state.arm),
    "WORK  " + (state.arm.work_name || "none"), ...wrap("ALARM " + (alarm ? alarm.number + " " + alarm.text : "none"), 6).slice(0, 2),
  ];
}

/** Whether an INPUT waits for a value at the pendant. */
const asks = state => state.tasks.some(task => task.doing === "input" && !task.reads);

/** The display and its keys. */
function makeDisplay(robot) {
  let page = "status", ether = 0, chosen = 0, back = 0, typed = "", history = [], asked = false, opened = false;
  const rows = Array.from({length: ROWS + 2}, () => make("div", {}));
  rows[0].className = rows[ROWS + 1].className = "bar";
  const screen = make("div", {class: "screen", role: "region", "aria-label": "Display", tabindex: "0"}, ...rows);
  const reason = make("output", {class: "reason", role: "alert"});

  const pages = PAGES.map(([name, label]) => make("button", {type: "button", "aria-pressed": "false", onclick: () => turn(name)}, label));

  function turn(name) {
    page = name;
    ether = chosen = back = 0;
    say(reason, "");
    if (name === "alarms") readHistory();
    draw();
  }

  async function readHistory() {
    try { history = (await robot.get("alarms")).history.slice(0, HISTORY); } catch (error) { say(reason, error.message); }
    draw();
  }

  const count = () => page === "alarms" ? history.length : page === "files" ? robot.state?.files.files.length ?? 0 : 0;

  /** One row, or one page, up or down. */
  function move(rowsDown, whole) {
    if (page === "ether") ether = (ether + Math.sign(rowsDown) + robot.state.ether_pages.length) % robot.state.ether_pages.length;
    else if (page === "tp") back = Math.max(0, back - rowsDown * (whole ? ROWS - 1 : 1));
    else chosen = Math.max(0, Math.min(count() - 1, chosen + rowsDown * (whole ? (page === "alarms" ? 6 : ROWS) : 1)));
    draw();
  }

  async function run(call) {
    say(reason, "");
    try { await call(); } catch (error) { say(reason, error.message); }
    draw();
  }

  const select = () => run(async () => {
    const file = page === "files" && robot.state.files.files[chosen];
    if (!file) throw new Error("choose a file on the page FILES first");
    await robot.post("files/" + encodeURIComponent(file.name) + "/select");
  });

  /** A key of the keypad. Keys are kept until ENTER: CLEAR can then take them back. */
  function type(key) {
    if (key === "ENTER" && page === "files") return select();
    if (page !== "tp") turn("tp");
    back = 0;
    if (key === "CLEAR") typed = "";
    else if (key === "BACK") typed = typed.slice(0, -1);
    else if (key === "ENTER") {
      const keys = typed + "\r";
      return run(async () => { await robot.post("pendant/keys", {keys}); typed = ""; });
    } else if (typed.length < TYPED) typed += key;
    draw();
  }

  screen.addEventListener("keydown", event => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const key = event.key;
    const typing = LOCKED ? undefined : /^[0-9.,-]$/.test(key) ? key : {Enter: "ENTER", Backspace: "BACK", Delete: "CLEAR", Escape: "CLEAR"}[key];
    if (typing) type(typing);
    else if (key === "ArrowUp") move(-1);
    else if (key === "ArrowDown") move(1);
    else if (key === "PageUp") move(-1, true);
    else if (key === "PageDown") move(1, true);
    else if (key === "ArrowLeft" || key === "ArrowRight") {
      const at = PAGES.findIndex(([name]) => name === page), step = key === "ArrowRight" ? 1 : -1;
      turn(PAGES[(at + step + PAGES.length) % PAGES.length][0]);
    } else return;
    event.preventDefault();
  });

  function body(state) {
    if (page === "ether") {
      const found = state.ether_pages[ether];
      return {title: found?.heading ?? "ETHERNET", rows: found?.lines ?? [], hint: "\u25b2 \u25bc  page " + (ether + 1) + " of " + state.ether_pages.length};
    }
    if (page === "alarms") {
      chosen = Math.max(0, Math.min(chosen, history.length - 1));
      if (!history.length) return {rows: ["no alarm in the history"], hint: ""};
      const from = Math.max(0, Math.min(chosen - 2, history.length - 6)), one = history[chosen];
      const top = history.slice(from, from + 6).map((alarm, at) => ({text: (alarm.number + " " + alarm.at.slice(11) + " " + alarm.text).slice(0, COLUMNS), on: from + at === chosen}));
      while (top.length < 6) top.push("");
      const more = [...wrap(one.number + " " + one.text, 6), ...wrap("CAUSE  " + one.cause, 7), ...wrap("REMEDY " + one.remedy, 7)];
      return {rows: [...top, "-".repeat(COLUMNS), ...more], hint: "\u25b2 \u25bc  " + (chosen + 1) + " of " + history.length + "  " + one.at};
    }
    if (page === "files") {
      const files = state.files.files;
      chosen = Math.max(0, Math.min(chosen, files.length - 1));
      const from = Math.floor(chosen / ROWS) * ROWS;
      return {hint: (LOCKED ? "\u25b2 \u25bc" : "\u25b2 \u25bc  SELECT") + "   * is selected", rows: files.slice(from, from + ROWS).map((file, at) => ({on: from + at === chosen,
        text: (file.name === state.files.selected ? "* " : "  ") + file.name.padEnd(14) + String(file.size).padStart(8) + " bytes"}))};
    }
    if (page === "tp") {
      const all = printed(state.pendant);
      asked = asks(state);
      const shown = ROWS - 1;
      back = Math.max(0, Math.min(back, all.length - shown));
      const end = all.length - back, rows = all.slice(Math.max(0, end - shown), end);
      while (rows.length < shown) rows.push("");
      rows.push(asked || typed ? "? " + typed.slice(2 - COLUMNS + 1) + "_" : "");
      return {rows, hint: asked ? LOCKED ? "INPUT waits for a value" : "INPUT waits: type a value, then ENTER" : back ? back + " rows below" : "\u25b2 \u25bc  earlier output"};
    }
    return {rows: statusRows(state, robot.lines), hint: state.calendar};
  }

  function draw() {
    const state = robot.state;
    if (!state) return;
    // Whoever opens the pendant while a program asks is going to answer.
    if (opened) {
      opened = false;
      if (asks(state)) return turn("tp");
    }
    pages.forEach((key, at) => mark(key, "aria-pressed", PAGES[at][0] === page));
    const found = body(state);
    say(rows[0], " " + (found.title ?? NAMES[page]).padEnd(24).slice(0, 24) + " " + (state.file || "").slice(0, 12).padStart(13) + " ");
    for (let at = 0; at < ROWS; at += 1) {
      const row = found.rows[at] ?? "";
      say(rows[at + 1], (row.text ?? row) || "\u00a0");
      mark(rows[at + 1], "data-on", row.on === true);
    }
    say(rows[ROWS + 1], " " + found.hint);
  }

  const key = (label, word, name) => make("button", {type: "button", "aria-label": name, onclick: () => type(word ?? label)}, label);
  const pad = make("div", {class: "pad", role: "group", "aria-label": "Keys for INPUT"},
    ..."789".split("").map(one => key(one)), key("CLEAR"),
    ..."456".split("").map(one => key(one)), key("\u232b", "BACK", "Delete the last character"),
    ..."123".split("").map(one => key(one)), key(",", ",", "Comma"),
    key("\u2212", "-", "Minus"), key("0"), key(".", ".", "Decimal point"), key("ENTER"));
  const paging = make("div", {class: "row", role: "group", "aria-label": "Paging keys"},
    make("button", {type: "button", "aria-label": "Up", onclick: () => move(-1)}, "\u25b2"),
    make("button", {type: "button", "aria-label": "Down", onclick: () => move(1)}, "\u25bc"),
    make("button", {type: "button", onclick: () => move(-1, true)}, "PAGE \u25b2"),
    make("button", {type: "button", onclick: () => move(1, true)}, "PAGE \u25bc"),
    LOCKED ? "" : make("button", {type: "button", onclick: select}, "SELECT"));
  const element = make("div", {class: "device"}, screen,
    make("div", {class: "pages", role: "group", "aria-label": "Pages of the display"}, ...pages), paging, reason, LOCKED ? "" : pad,
    make("p", {class: "hint"}, LOCKED ? "While the display has the focus, the arrow keys turn its pages. Its other keys are not there: " + LOCKED + "."
      : "While the display has the focus, type digits, Enter and the arrow keys."));
  return {
    element, draw,
    settled() { if (page === "alarms") readHistory(); },
    event(event) { if (page === "alarms" && (event.event === "alarm" || event.event === "alarms-reset")) readHistory(); },
    show() {
      opened = true;
      if (page === "alarms") readHistory();
      draw();
    },
  };
}

/** Moving the arm by hand. */
function makeJog(robot) {
  let coordinates = "joint", speed = "slow", inching = false, held = null, axes = 0, shown = false;
  const reason = make("output", {class: "reason", role: "alert"});
  const moving = make("p", {class: "moving", role: "status"});
  const frame = choice("Coordinates", [["joint", "Joint"], ["tool", "Tool"], ["work", "Work"], ["world", "World"]], word => { coordinates = word; end(); draw(); });
  const rate = choice("Speed", [["slow", "Slow"], ["mid", "Mid"], ["fast", "Fast"]], word => { speed = word; end(); draw(); });
  const inch = toggle("Inching", on => { inching = on; end(); draw(); });
  const keys = make("div", {class: "axes", role: "group", "aria-label": "Axis keys"});
  const turn = button("Turn it to TEACHING", () => robot.put("key-switch", {position: "teaching"}));
  const locked = make("p", {});
  const notice = make("div", {class: "notice", hidden: true}, locked, turn.element);
  const rowsOf = [];

  /**
   * Ends the motion with two calls: `jog/stop`, and the end of the call that moves. When a key is let go, the latter has
   * `grace` ms, so that a refusal of a short press still arrives.
   */
  function end(word, grace = 0) {
    if (!held) return;
    const last = held;
    held = null;
    if (grace) setTimeout(() => last.abort.abort(), grace); else last.abort.abort();
    mark(last.key, "data-held", false);
    say(moving, word ?? "");
    robot.fetch("POST", "jog/stop", {}, {keepalive: true}).catch(() => {});
  }

  async function begin(key, axis, direction, name) {
    if (held) return end("Stopped: two keys were held at once.");
    say(reason, "");
    if (robot.state?.key_switch !== "teaching") return say(reason, "Turn the key switch to TEACHING to jog.");
    if (robot.link !== "connected") return say(reason, "The page is not connected to the robot. Wait until it is connected again.");
    const mine = held = {key, abort: new AbortController()};
    mark(key, "data-held", true);
    say(moving, name + (inching ? ": one step" : " moves"));
    robot.lookSoon();   // the call is answered when the motion ends: until then the pictures of the arm are to follow it
    try {
      await robot.fetch("POST", "jog", {axis, direction, coordinates, speed, inching, hold: !inching}, {signal: mine.abort.signal});
      if (held === mine) say(moving, inching ? "" : name + " has stopped.");
    } catch (error) {
      if (held !== mine && !error.status) return;
      if (held === mine) say(moving, "");
      say(reason, error.message);
    } finally {
      robot.lookSoon();
    }
    if (held === mine) held = null;
    mark(key, "data-held", false);
  }

  // A step of inching is finished even when the key is let go early: it is bounded.
  const letGo = () => { if (!inching) end("", GRACE); };

  function axisKey(row, direction) {
    const key = make("button", {type: "button", class: "jog"});
    const go = () => begin(key, row.axis, direction, row.name + (direction === "plus" ? " +" : " \u2212"));
    key.addEventListener("pointerdown", event => {
      if (event.button !== 0 || !event.isPrimary) return end();
      // Without this a finger would keep the key after it has slipped off.
      if (key.hasPointerCapture(event.pointerId)) key.releasePointerCapture(event.pointerId);
      go();
    });
    for (const kind of ["pointerup", "pointercancel", "pointerleave"]) key.addEventListener(kind, () => { if (held?.key === key) letGo(); });
    key.addEventListener("keydown", event => {
      if (event.key !== " " && event.key !== "Enter") { if (event.key === "Escape") end(); return; }
      event.preventDefault();
      if (!event.repeat) go();
    });
    key.addEventListener("keyup", event => { if (event.key === " " || event.key === "Enter") { event.preventDefault(); letGo(); } });
    key.addEventListener("blur", () => { if (held?.key === key) end(); });
    key.addEventListener("contextmenu", event => event.preventDefault());
    return key;
  }

  function build(count) {
    axes = count;
    rowsOf.length = 0;
    for (let axis = 1; axis <= count; axis += 1) {
      const row = {axis, name: "", label: make("span", {class: "axis"}), value: make("span", {class: "mono value"})};
      row.minus = axisKey(row, "minus");
      row.plus = axisKey(row, "plus");
      rowsOf.push(row);
    }
    keys.replaceChildren(...rowsOf.flatMap(row => [row.minus, make("span", {class: "between"}, row.label, row.value), row.plus]));
  }

  function draw() {
    const state = robot.state;
    if (!state || !shown) return;
    if (state.arm.joints.length !== axes) build(state.arm.joints.length);
    const values = {joint: state.arm.joints, world: state.arm.world, work: state.arm.work}[coordinates];
    rowsOf.forEach((row, at) => {
      row.name = coordinates === "joint" ? "J" + row.axis : CARTESIAN[axes]?.[at] ?? "J" + row.axis;
      say(row.label, row.name);
      say(row.value, values?.[at] === undefined ? "" : fixed(values[at], 2));
      for (const [key, sign, word] of [[row.minus, "\u2212", "minus"], [row.plus, "+", "plus"]]) {
        say(key, sign);
        mark(key, "aria-label", row.name + " " + word);
      }
    });
    frame.show(coordinates);
    rate.show(speed);
    inch.show(inching);
    const ready = state.key_switch === "teaching";
    if (!ready) end("Stopped: the key switch is no longer in TEACHING.");
    say(locked, "Turn the key switch to TEACHING to jog. It is in " + state.key_switch.toUpperCase() + ".");
    notice.hidden = ready;
    for (const row of rowsOf) for (const key of [row.minus, row.plus]) mark(key, "aria-disabled", !ready);
  }

  const stop = () => end("Stopped: the page lost the focus.");
  addEventListener("blur", stop);
  addEventListener("pagehide", stop);
  document.addEventListener("visibilitychange", () => { if (document.hidden) stop(); });
  robot.on("link", link => { if (link !== "connected") end("Stopped: the page is not connected."); });

  return {
    element: make("section", {class: "jogging", "aria-label": "Jogging"}, make("h3", {}, "Jog, at most 250 mm/s"), notice,
      make("div", {class: "row"}, frame.element), make("div", {class: "row"}, rate.element, make("div", {class: "field"}, "Step", inch.element)),
      keys, reason, moving, make("p", {class: "hint"}, "Hold a key to move: with the pointer, Space or Enter. Inching moves one step for each press.")),
    draw,
    show() { shown = true; draw(); },
    hide() { shown = false; end(); },
  };
}

/** The text of a program with one more point in its DATA. */
function withPoint(text, name, values) {
  const end = text.includes("\r\n") ? "\r\n" : text.includes("\n") ? "\n" : text.includes("\r") ? "\r" : "\n";
  const lines = text.split(end), line = "  POINT " + name + " = " + values.map(value => fixed(value)).join(",");
  const data = lines.findIndex(one => /^\s*DATA\b/i.test(one));
  if (data < 0) {
    while (lines.length && lines.at(-1) === "") lines.pop();
    return [...lines, "DATA", line, "END", ""].join(end);
  }
  const last = lines.findIndex((one, at) => at > data && /^\s*END\b/i.test(one));
  lines.splice(last < 0 ? lines.length : last, 0, line);
  return lines.join(end);
}

/** The positions of the selected file. */
function makeTeach(robot) {
  let positions = [], shown = false, file, unread = "";
  const rows = make("tbody");
  const table = make("table", {}, make("thead", {}, make("tr", {}, make("th", {scope: "col"}, "Name"), make("th", {scope: "col"}, "Values"),
    LOCKED ? "" : make("th", {scope: "col"}, "Teach"))), rows);
  const none = make("p", {class: "empty", hidden: true}), more = make("p", {class: "empty", hidden: true});
  const told = make("p", {role: "status", class: "hint"});
  const name = make("input", {id: "pendant-point", size: "10", maxlength: "32", autocomplete: "off", spellcheck: "false"});

  async function read() {
    if (!shown) return;
    unread = "";
    try { positions = await robot.get("positions"); } catch (error) { [positions, unread] = [[], LOCKED && error.message]; }
    draw();
  }

  async function teach(which) {
    const found = await robot.post("positions/" + encodeURIComponent(which) + "/teach", {restore: true});
    say(told, which + " is taught and stored in DATA of " + robot.state.file + ".");
    positions = positions.map(one => one.name === which ? found : one);
    draw();
    const row = [...rows.children].find(one => one.dataset.key === which);
    mark(row, "data-taught", true);
    setTimeout(() => mark(row, "data-taught", false), TAUGHT);
  }

  const add = button("Add here", async () => {
    const wanted = name.value.trim().toUpperCase(), selected = robot.state.file;
    if (!selected) throw new Error("cannot add a position: select a file first");
    if (!/^[A-Z][A-Z0-9_]*$/.test(wanted)) throw new Error("cannot add a position: its name must begin with a letter and contain only letters, digits and _");
    if (positions.some(one => one.name === wanted)) throw new Error("cannot add " + wanted + ": it already exists; press TEACH next to it");
    if (robot.state.status !== "stop (reset)") throw new Error("cannot add a position: the program is not reset; press PROGRAM RESET");
    const path = "files/" + encodeURIComponent(selected), stored = await robot.get(path);
    if (stored.text === undefined || stored.text === null) throw new Error("cannot add a position: " + selected + " is a binary file");
    await robot.put(path, {text: withPoint(stored.text, wanted, robot.state.arm.work)});
    await robot.post(path + "/select");
    await robot.get("positions").then(found => { positions = found; });
    draw();
    await teach(wanted);
    name.value = "";
  });
  name.addEventListener("keydown", event => { if (event.key === "Enter") add.button.click(); });

  function draw() {
    list(rows, positions.slice(0, POSITIONS), one => one.name, one => {
      const made = button("TEACH", () => teach(one.name), {"aria-label": "Teach " + one.name});
      return make("tr", {}, make("th", {scope: "row", class: "mono"}, one.name), make("td", {class: "mono"}), LOCKED ? "" : make("td", {}, made.element));
    }, (row, one) => say(row.children[1], one.value ? position(one.value) : "not taught"));
    table.hidden = !positions.length;
    none.hidden = positions.length > 0;
    say(none, unread ? unread : file ? file + " has no positions." : "No file is selected.");
    more.hidden = positions.length <= POSITIONS;
    say(more, positions.length - POSITIONS + " more are not listed.");
  }

  return {
    element: make("section", {class: "teach", "aria-label": "Positions"}, make("h3", {}, "Positions of the selected file"),
      table, none, more,
      LOCKED ? "" : make("div", {class: "row add"}, make("label", {for: "pendant-point"}, "New position"), name, add.element), told),
    settled: read,
    state(state) { if (state.file !== file && !robot.busy) { file = state.file; read(); } },
    event(event) { if (shown && ["stored", "selected", "status"].includes(event.event)) read(); },
    show() { shown = true; read(); },
    hide() { shown = false; },
  };
}

export function create(robot) {
  const display = makeDisplay(robot), jog = makeJog(robot), teach = makeTeach(robot);
  let shown = false;
  robot.on("settled", () => { if (shown) for (const part of [display, teach]) part.settled(); });
  return {
    element: make("div", {class: "pendant"}, ifKnown(robot, ["pendant"], display.element, "Display"),
      make("div", {class: "hand"}, LOCKED ? "" : jog.element, ifKnown(robot, ["variables"], teach.element, "Positions of the selected file"))),
    state(state) {
      if (!shown) return;
      display.draw();
      jog.draw();
      teach.state(state);
    },
    pose() {
      display.draw();
      jog.draw();
    },
    event(event) {
      if (!shown) return;
      display.event(event);
      teach.event(event);
    },
    show() {
      shown = true;
      for (const part of [display, jog, teach]) part.show();
      if (robot.state) this.state(robot.state);
    },
    hide() { shown = false; jog.hide(); teach.hide(); },
  };
}
