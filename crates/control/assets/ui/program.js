// The program: its source with the lines that are executed and analysed, breakpoints, diagnostics, tasks and variables; an
// editor; and the files of the RAM drive, with files that are dropped on the page.

import {make, button, explained, list, mark, say} from "./dom.js";

const LINES = 3000;            // lines that are shown
const COLOURED = 200_000;      // characters of a file that is coloured
const VARIABLES = 200;         // rows of variables
const DIGITS = 7;              // digits of a real
const ELEMENTS = 16;           // elements of an array that are listed
const DIAGNOSTICS = 100;       // diagnostics that are shown
const DROPPED = 1_048_576;     // bytes of a file that is dropped: the size of the drive
const EOF = 0x1a;              // ends a file on its way
const NOTICES = 8;             // sentences about dropped files
const PAUSE = 300;             // ms without typing before the text is checked
const NOTICE = 8000;           // how long the sentences stay, in ms

const WORDS = new Set(("AND AS BCDOUT BREAK CLOSE1 CLOSE2 CLOSEI1 CLOSEI2 COM1 CR CRE DATA DELAY DIM DISABLE DO ELSE ENABLE END FOR FREELOAD GLOBAL GOTO IF "
  + "IGNORE INPUT IP1 IP2 KILL MOVE MOVEA MOVEC MOVEI MOVEJ MOVES NEXT NOT NOWAIT OPEN1 OPEN2 OPENI1 OPENI2 OR PAUSE PRINT PROGRAM PULOUT READY REMARK "
  + "RESTORE RESUME RETURN SETGAIN STEP STOP SWITCH TASK THEN TO TP WAIT WITH MOD POINT TRANS PAYLOAD WORK REAL INT ON OFF TRUE FALSE").split(" "));
const TOKENS = /('.*$|\bREMARK\b.*$)|("[^"]*"?)|([A-Za-z][A-Za-z0-9_]*)|([^'"A-Za-z]+)/gi;

const path = name => "files/" + encodeURIComponent(name);

/** A line of SCOL as text nodes and spans. */
function coloured(text) {
  const parts = [];
  const label = /^\s*[A-Za-z][A-Za-z0-9_]*:/.exec(text)?.[0] ?? "";
  if (label) parts.push(make("span", {class: "label"}, label));
  for (const [whole, comment, string, word] of text.slice(label.length).matchAll(TOKENS)) {
    if (comment) parts.push(make("span", {class: "comment"}, whole));
    else if (string) parts.push(make("span", {class: "string"}, whole));
    else if (word && WORDS.has(word.toUpperCase())) parts.push(make("span", {class: "word"}, whole));
    else parts.push(whole);
  }
  return parts;
}

const split = text => {
  const lines = text.split(/\r\n|\n|\r/);
  if (lines.length > 1 && lines.at(-1) === "") lines.pop();
  return lines;
};

/** What is wrong with a text or a file: `[{line, column, length, severity, code, message, help}]`. */
async function check(robot, body) {
  return (await robot.post("check", body)).slice(0, DIAGNOSTICS);
}

function diagnostic(found) {
  return [make("strong", {}, explained(found.code, found.severity + " " + found.code)), " line " + found.line + ", column " + found.column + ": " + found.message
    + (found.help ? "; " + found.help : "")];
}

/** The source: a row for each line. The gutter has one stop of the tab key; arrow keys move in it. */
function makeSource(robot) {
  const element = make("div", {class: "source", role: "region", "aria-label": "Source", tabindex: "0"});
  const reason = make("output", {class: "reason", role: "alert"});
  const cut = make("p", {class: "empty", hidden: true});
  let rows = [], breakpoints = new Set(), executed = 0, analysed = 0, chosen = 1, onChoose = () => {};

  function choose(line, focus) {
    if (rows[chosen - 1]) rows[chosen - 1].gutter.tabIndex = -1;
    chosen = Math.max(1, Math.min(rows.length, line));
    const row = rows[chosen - 1];
    if (!row) return;
    row.gutter.tabIndex = 0;
    if (focus) row.gutter.focus();
    onChoose(chosen);
  }

  async function flip(line) {
    say(reason, "");
    const next = new Set(breakpoints);
    if (!next.delete(line)) next.add(line);
    try { take(await robot.put("breakpoints", {lines: [...next].sort((a, b) => a - b)})); } catch (error) { say(reason, error.message); }
  }

  function take(found) {
    const next = new Set(found.lines);
    for (const line of new Set([...breakpoints, ...next])) if (rows[line - 1]) mark(rows[line - 1].gutter, "aria-pressed", next.has(line));
    breakpoints = next;
  }

  async function readBreakpoints() {
    try { take(await robot.get("breakpoints")); } catch (error) { say(reason, error.message); }
  }

  element.addEventListener("keydown", event => {
    if (!event.target.matches(".gutter")) return;
    const step = {ArrowDown: 1, ArrowUp: -1, PageDown: 15, PageUp: -15, Home: -Infinity, End: Infinity}[event.key];
    if (step === undefined) return;
    event.preventDefault();
    choose(Math.max(1, Math.min(rows.length, chosen + step)), true);
  });

  function inView(row) {
    const top = row.element.offsetTop, height = row.element.offsetHeight;
    if (top < element.scrollTop + height) element.scrollTop = Math.max(0, top - 3 * height);
    else if (top + height > element.scrollTop + element.clientHeight - height) element.scrollTop = top - element.clientHeight / 2;
  }

  function set(line, word, on) {
    const row = rows[line - 1];
    if (row) mark(row.element, word, on);
  }

  return {
    element: make("div", {}, element, cut, reason),
    get chosen() { return chosen; },
    set onChoose(call) { onChoose = call; },
    readBreakpoints,
    choose,
    text(text) {
      const lines = split(text), colour = text.length <= COLOURED;
      const top = element.scrollTop;
      rows = lines.slice(0, LINES).map((line, at) => {
        const number = at + 1;
        const gutter = make("button", {type: "button", class: "gutter", tabindex: "-1", "aria-label": "Breakpoint, line " + number,
          "aria-pressed": String(breakpoints.has(number)), onclick: () => { choose(number); flip(number); }}, String(number));
        return {gutter, line, element: make("div", {class: "codeline"}, gutter, make("code", {}, ...(colour ? coloured(line) : [line])))};
      });
      element.replaceChildren(...rows.map(row => row.element));
      element.scrollTop = top;
      cut.hidden = lines.length <= LINES;
      say(cut, lines.length - LINES + " more lines are not shown.");
      executed = analysed = 0;
      choose(Math.min(chosen, rows.length) || 1);
    },
    diagnostics(found) {
      for (const row of rows) if (row.notes) { row.notes.remove(); row.notes = undefined; mark(row.element, "data-severity", ""); }
      for (const one of found) {
        const row = rows[one.line - 1];
        if (!row) continue;
        if (!row.notes) { row.notes = make("div", {class: "notes"}); row.element.after(row.notes); }
        if (row.element.getAttribute("data-severity") !== "error") mark(row.element, "data-severity", one.severity);
        row.notes.append(make("p", {"data-severity": one.severity}, ...diagnostic(one)));
      }
    },
    lines(nextExecuted, nextAnalysed) {
      if (nextExecuted !== executed) {
        set(executed, "data-executed", false);
        executed = nextExecuted;
        set(executed, "data-executed", true);
        if (rows[executed - 1]) inView(rows[executed - 1]);
      }
      if (nextAnalysed !== analysed) {
        set(analysed, "data-analysed", false);
        analysed = nextAnalysed;
        set(analysed, "data-analysed", true);
      }
    },
  };
}

/** The editor: a text that is checked while it is typed. `done` is told when the text is stored or discarded. */
function makeEditor(robot, done) {
  const numbers = make("div", {class: "numbers", "aria-hidden": "true"});
  const text = make("textarea", {"aria-label": "Text of the file", spellcheck: "false", wrap: "off", autocomplete: "off"});
  const found = make("ul", {class: "notes", "aria-label": "Diagnostics"});
  const told = make("p", {class: "hint", role: "status"});
  let file = "", stored = "", ends = "\n", timer, asked = 0;

  function count() {
    const lines = text.value.split("\n").length;
    if (numbers.childElementCount === lines) return;
    numbers.replaceChildren(...Array.from({length: Math.min(lines, LINES)}, (_, at) => make("div", {}, String(at + 1))));
    numbers.scrollTop = text.scrollTop;
  }

  function jump(one) {
    const lines = text.value.split("\n");
    let from = 0;
    for (let at = 0; at < one.line - 1 && at < lines.length; at += 1) from += lines[at].length + 1;
    from += one.column - 1;
    text.focus();
    text.setSelectionRange(from, from + (one.length || 1));
    text.scrollTop = (one.line - 4) * parseFloat(getComputedStyle(text).lineHeight);
  }

  async function look() {
    const mine = asked += 1;
    try {
      const all = await check(robot, {text: text.value});
      if (mine !== asked) return;
      found.replaceChildren(...all.map(one => make("li", {}, make("button", {type: "button", "data-severity": one.severity, onclick: () => jump(one)}, ...diagnostic(one)))));
      for (const [at, row] of [...numbers.children].entries()) mark(row, "data-severity", all.find(one => one.line === at + 1)?.severity ?? "");
      say(told, all.length ? all.length + (all.length === 1 ? " diagnostic" : " diagnostics") : "No errors, no warnings.");
    } catch (error) {
      if (mine !== asked) return;
      say(told, error.message);
    }
  }

  text.addEventListener("input", () => { count(); clearTimeout(timer); timer = setTimeout(look, PAUSE); });
  text.addEventListener("scroll", () => { numbers.scrollTop = text.scrollTop; });
  const save = button("Download to the RAM drive", async () => {
    await robot.put(path(file), {text: text.value.replaceAll("\n", ends)});
    stored = text.value;
    close();
  }, {class: "start"});
  const discard = button("Discard", () => close());
  function close() {
    clearTimeout(timer);
    element.hidden = true;
    asked += 1;
    done(file);
  }
  const element = make("div", {class: "editor", hidden: true}, make("div", {class: "sheet"}, numbers, text),
    make("div", {class: "row"}, save.element, discard.element, told), found);
  return {
    element,
    get open() { return !element.hidden; },
    get dirty() { return !element.hidden && text.value !== stored; },
    edit(name, content) {
      file = name;
      // A textarea knows only LF. What the file has is put back when it is stored.
      ends = content.includes("\r\n") ? "\r\n" : content.includes("\n") ? "\n" : content.includes("\r") ? "\r" : "\n";
      text.value = content;
      stored = text.value;
      found.replaceChildren();
      say(told, "");
      element.hidden = false;
      count();
      look();
      text.focus();
      text.setSelectionRange(0, 0);
    },
  };
}

/** Coordinates with the four decimals that matter, a single number with all the digits that it has. */
const shownValue = values => values.map(value => Number(values.length > 1 ? value.toFixed(4) : Number.isInteger(value) ? value : value.toPrecision(DIGITS))).join(", ");

/** The variables as rows. Arrays have a row for each of their first elements; variables of programs, `PICK.COUNT`, are only read. */
function rowsOf(variables) {
  const rows = [];
  for (const one of variables) {
    const kind = (one.kind ?? "") + (one.bounds.length ? " (" + one.bounds.join(",") + ")" : "");
    if (one.elements) one.elements.slice(0, ELEMENTS).forEach((value, at) => rows.push({name: one.name + "(" + at + ")", kind, values: value, fixed: one.name.includes(".")}));
    else rows.push({name: one.name, kind, values: one.value, fixed: one.bounds.length > 0 || one.name.includes(".")});
  }
  return rows;
}

function makeVariables(robot) {
  const rows = make("tbody");
  const search = make("input", {type: "search", "aria-label": "Find a variable", placeholder: "find", autocomplete: "off"});
  const more = make("p", {class: "empty", hidden: true});
  const table = make("table", {}, make("thead", {}, make("tr", {}, make("th", {scope: "col"}, "Name"), make("th", {scope: "col"}, "Kind"), make("th", {scope: "col"}, "Value"))), rows);
  let last = [];

  function build(row) {
    const input = make("input", {"aria-label": "Value of " + row.name, autocomplete: "off", spellcheck: "false"});
    const reason = make("output", {class: "reason", role: "alert"});
    const back = () => { input.value = input.dataset.live ?? ""; };
    input.addEventListener("keydown", async event => {
      if (event.key === "Escape") { back(); say(reason, ""); input.blur(); }
      if (event.key !== "Enter") return;
      say(reason, "");
      // What is shown is rounded: it is not written back.
      if (input.value === input.dataset.live) return input.blur();
      const values = input.value.split(",").map(text => text.trim());
      if (values.some(text => text === "" || !Number.isFinite(Number(text)))) return say(reason, "expected a number, or numbers separated by commas");
      try {
        const value = values.map(Number);
        await robot.put("variables/" + encodeURIComponent(row.name), {value: value.length === 1 ? value[0] : value});
        input.dataset.live = input.value;
        input.blur();
      } catch (error) { say(reason, error.message); }
    });
    input.addEventListener("blur", back);
    return make("tr", {}, make("th", {scope: "row", class: "mono"}, row.name), make("td", {}), make("td", {}, input, reason));
  }

  function draw() {
    const wanted = search.value.trim().toUpperCase(), fits = last.filter(row => row.name.toUpperCase().includes(wanted));
    list(rows, fits.slice(0, VARIABLES), row => row.name, build, (element, row) => {
      const input = element.querySelector("input"), value = row.values ? shownValue(row.values) : "";
      say(element.children[1], row.kind);
      input.disabled = row.fixed === true;
      input.placeholder = row.fixed && row.kind.endsWith(")") ? "array" : "no value";
      if (input.dataset.live === value) return;
      input.dataset.live = value;
      if (document.activeElement !== input) input.value = value;
    });
    more.hidden = fits.length <= VARIABLES;
    say(more, fits.length - VARIABLES + " more are not listed.");
  }
  search.addEventListener("input", draw);
  return {
    element: make("section", {class: "variables", "aria-label": "Variables"}, make("div", {class: "head"}, make("h3", {}, "Variables"), search),
      make("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": "List of variables"}, table), more,
      make("p", {class: "hint"}, "Enter saves, Escape cancels.")),
    state(state) { last = rowsOf(state.variables); draw(); },
  };
}

export function create(robot) {
  takeDrops(robot);
  let open = "", follow = true, shown = false, reading = 0, lastText = "", seenFiles = "";
  const title = make("h3", {class: "mono"}), told = make("p", {class: "empty", hidden: true});
  const source = makeSource(robot);
  const editor = makeEditor(robot, name => { work.hidden = false; read(name, true); });
  const variables = makeVariables(robot);

  const start = button("START", () => robot.post("program/start"), {class: "start"});
  const stop = button("STOP", () => robot.post("program/stop"));
  const step = button("Step", () => robot.post("program/step"));
  const line = make("input", {id: "program-line", type: "number", min: "1", max: "99999", value: "1", inputmode: "numeric"});
  const runTo = button("Run to line", () => robot.post("program/run-to", {line: Number(line.value)}));
  source.onChoose = number => { line.value = number; };
  const edit = button("Edit", async () => {
    const found = await robot.get(path(open));
    if (typeof found.text !== "string") throw new Error("cannot edit " + open + ": it is a binary file");
    work.hidden = true;
    editor.edit(open, found.text);
  });
  const status = make("p", {class: "mono", role: "status"});
  const tasks = make("tbody");
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
    if (editor.open) { editor.element.hidden = true; work.hidden = false; }
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
      source.text(lastText);
      here();
      files(robot.state);
      source.readBreakpoints();
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
    source.lines(selected ? state.executed_line : 0, selected ? state.analysed_line : 0);
  }

  function files(state) {
    const key = JSON.stringify([state.files, open]);
    if (key === seenFiles) return;
    seenFiles = key;
    list(rows, state.files.files, file => file.name, file => {
      const show = button(file.name, async () => { guard(); follow = file.name === robot.state.file; await read(file.name); }, {class: "mono name"});
      const select = button("Select", async () => { guard(); await robot.post(path(file.name) + "/select"); follow = true; }, {"aria-label": "Select " + file.name});
      const erase = button("Erase", async () => {
        if (!confirm("Erase " + file.name + " from the RAM drive?")) return;
        await robot.remove(path(file.name));
        if (open === file.name) follow = true;
      }, {"aria-label": "Erase " + file.name});
      return make("li", {}, show.element, make("span", {class: "size"}), select.element, erase.element);
    }, (row, file) => {
      const [show] = row.querySelectorAll("button");
      mark(row, "data-selected", file.name === state.files.selected);
      mark(show, "aria-current", file.name === open);
      say(row.querySelector(".size"), file.size + " bytes" + (file.name === state.files.selected ? ", selected" : ""));
    });
    const total = state.files.files.reduce((sum, file) => sum + file.size, 0);
    say(used, total + " of " + state.files.capacity + " bytes used. Drop a file anywhere on the page to put it onto the drive.");
  }

  const element = make("div", {class: "program"},
    make("div", {class: "row run"}, start.element, stop.element, step.element, runTo.element, make("label", {for: "program-line", class: "sr"}, "Line"), line, status),
    make("div", {class: "columns"},
      make("section", {class: "code", "aria-label": "Program"}, make("div", {class: "head"}, title, edit.element), told, work, editor.element,
        make("p", {class: "hint"}, "\u25b6 executed, \u203a analysed. Click a line number to set a breakpoint; arrow keys move.")),
      make("aside", {class: "side", "aria-label": "Drive, tasks and variables"},
        make("section", {"aria-label": "RAM drive"}, make("h3", {}, "RAM drive"), make("div", {class: "scroll"}, rows), make("div", {class: "row new"},
          make("label", {for: "program-new"}, "New file"), name, fresh.element), used),
        make("section", {"aria-label": "Tasks"}, make("h3", {}, "Tasks"), make("table", {}, make("thead", {}, make("tr", {}, make("th", {scope: "col"}, "Task"),
          make("th", {scope: "col"}, "Line"), make("th", {scope: "col"}, "Doing"))), tasks)),
        variables.element)));

  return {
    element,
    state(state) {
      if (!shown) return;
      if (!editor.open && (follow || !open)) read(state.file);
      if (!open && !state.file) say(title, "no file selected");
      edit.button.disabled = !open || editor.open;
      here();
      files(state);
      say(status, state.file ? state.file + ", line " + state.line + ": " + state.status : "no file selected");
      list(tasks, state.tasks, task => task.id, () => make("tr", {}, make("td"), make("td"), make("td")), (row, task) => {
        say(row.children[0], task.id === 0 ? "DO" : String(task.id));
        say(row.children[1], String(task.line));
        say(row.children[2], task.doing + (task.reads ? " from " + task.reads : ""));
      });
      variables.state(state);
    },
    event(event) {
      if (!shown || editor.open) return;
      if (event.event === "stored" && event.file === open) read(open, true);
      if (event.event === "erased" && event.file === open) { open = ""; follow = true; lastText = ""; source.text(""); say(title, "no file selected"); }
      if (event.event === "selected") follow = true;
    },
    show() {
      shown = true;
      if (open && !editor.open) read(open, true);
      if (robot.state) this.state(robot.state);
    },
    hide() { shown = false; },
  };
}

/** The name on the drive: as `ctl dl` makes it, pick.scol is PICK and user.par is USER.PAR. */
function driveName(name) {
  const upper = name.toUpperCase(), dot = upper.lastIndexOf(".");
  return upper.endsWith(".PAR") || dot < 1 ? upper : upper.slice(0, dot);
}

function bytes(data) {
  try { return {text: new TextDecoder("utf-8", {fatal: true, ignoreBOM: true}).decode(data)}; }
  catch { return {hex: [...data].map(byte => byte.toString(16).padStart(2, "0")).join(" ")}; }
}

let takes = false;

/** Takes files that are dropped anywhere on the page and writes them onto the RAM drive. */
export function takeDrops(robot) {
  if (takes) return;
  takes = true;
  const target = make("div", {class: "drop", hidden: true}, "Drop here to write onto the RAM drive");
  const said = make("ul", {}), notices = make("div", {class: "dropped", role: "status", hidden: true}, said);
  document.body.append(target, notices);
  let timer;
  const files = event => event.dataTransfer?.types.includes("Files");
  const notice = (text, refused) => {
    said.append(make("li", {class: refused ? "refused" : ""}, text));
    while (said.childElementCount > NOTICES) said.firstChild.remove();
    notices.hidden = false;
    clearTimeout(timer);
    timer = setTimeout(() => { notices.hidden = true; said.replaceChildren(); }, NOTICE);
  };
  addEventListener("dragenter", event => { if (files(event)) { event.preventDefault(); target.hidden = false; } });
  addEventListener("dragover", event => { if (files(event)) { event.preventDefault(); event.dataTransfer.dropEffect = "copy"; target.hidden = false; } });
  addEventListener("dragleave", event => { if (!event.relatedTarget) target.hidden = true; });
  addEventListener("drop", async event => {
    if (!files(event)) return;
    event.preventDefault();
    target.hidden = true;
    for (const file of event.dataTransfer.files) {
      const name = driveName(file.name);
      try {
        if (file.size > DROPPED) throw new Error("it is larger than the RAM drive");
        const data = new Uint8Array(await file.arrayBuffer());
        // Files that were uploaded from a robot often still have their EOF.
        const stored = await robot.put(path(name), bytes(data.at(-1) === EOF ? data.subarray(0, -1) : data));
        notice(file.name + " is on the RAM drive as " + stored.name + ", " + stored.size + " bytes.");
      } catch (error) { notice("cannot write " + file.name + " to the RAM drive: " + error.message, true); }
    }
  });
}
