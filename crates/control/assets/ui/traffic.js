// The traffic: every text of every port with what it means and what was wrong with it; details with bytes and fields.
//
// A text, a finding or another event is a row. The rows of one exchange (a command, its answer and what follows) have a
// common bar. All rows have the same height, so that only those in sight are in the page. New events are taken once a
// frame. While the view is hidden or paused nothing is kept: it is built again from the events of `robot`.
//
// Of a recorded run the rows are those around the moment; a row leads to its moment.

import {LOCKED, copy, make, say, mark, button, explained} from "./dom.js";

const ROWS = 2000;          // rows kept
const GROUP_ROWS = 100;     // rows kept for the file of one exchange: a download may have thousands
const PENDING = 4096;       // bytes of a port that wait for the rest of their text
const LONGEST = 300;        // characters of a text in its row; the details have all
const DUMP = 1024;          // bytes in the details
const COMMANDS = 60;        // commands to choose from
const FRAMED = ["HOST", "IP0"];
const PORTS = ["HOST", "COM1", "IP0", "IP1", "IP2", "IP3"];
const NAMES = Object.fromEntries(("SU status;SF total status;CA directory;VR version;EU error history;UL upload;DL download;ER erase;SL select;"
  + "RN run;SP stop;SO servo on;BR servo off;RS reset;MR read variable;MW write variable;IW force inputs;DO statement;EC internal command;"
  + "FD feed hold;SM quick status;WD watchdog;AC alarms;AH alarm history;IO lines;HI inputs;HO outputs;PR position;VL speed;"
  + "ZS coordinate system;MN maintenance;RM maintenance reset;PS current position;MP move;EM control right;ZC origin change;MD guide mode;RT guide rate;SC guide coordinates;JG guide").split(";").map(one => [one.slice(0, 2), one.slice(3)]));
const LETTERS = /^(?:<STX>)?([A-Z]{2})(?![A-Za-z])/;
const CONTROLS = {"02": "STX", "03": "ETX", "0d": "CR", "0a": "LF", "1a": "EOF"};
/** The value of a field; codes of the framing as everywhere on the page. */
const fieldValue = ({name, value}) => Object.values(CONTROLS).includes(name) ? "<" + name + ">" : String(value);
const ARROWS = {in: "host \u2192 robot", out: "robot \u2192 host"};
const WORST = ["", "note", "warning", "error"];

/** Other events that have a row: what it says. */
const OTHERS = {
  "connected": event => event.peer,
  "disconnected": () => "",
  "closed": () => "the robot closed the connection",
  "stalled": () => "the robot no longer reads",
  "dropped": event => event.bytes + " bytes skipped: " + event.reason,
  "fault-armed": event => event.message.replace("armed: ", ""),
  "fault": event => event.kind + ": " + event.message,
  "alarm": event => event.number + " " + event.text,
  "power-off": () => "", "power-on": () => "",
  "reset": () => "the robot was reset",
  "restored": () => "a snapshot was restored",
};

const bytesOf = hex => hex.match(/../g) ?? [];

/** Bytes as a text, control codes by name. */
const readable = hex => bytesOf(hex).map(byte => {
  const code = parseInt(byte, 16);
  return code >= 32 && code < 127 ? String.fromCharCode(code) : "<" + (CONTROLS[byte] ?? byte.toUpperCase()) + ">";
}).join("");

/** A span of time in ms, as short as it can be said. */
const span = seconds => Number((seconds * 1000).toPrecision(3)) + " ms";

/** Turns events into rows and groups of rows. */
class Reader {
  constructor() {
    this.rows = [];
    this.next = 1;        // number of the next event
    this.ports = {};
    this.commands = new Set();
    this.failure = undefined;
  }

  /** A row. `group` is the exchange or the data that it belongs to. */
  add(event, kind, more) {
    const row = {seq: event.seq, t: event.t, port: event.port, kind, letters: "", rest: "", text: event.text, ...more}, group = row.group;
    if (group && group.rows.length < GROUP_ROWS) group.rows.push(row);
    else if (group) group.more += 1;
    this.rows.push(row);
    if (this.rows.length > ROWS * 1.1) for (const old of this.rows.splice(0, this.rows.length - ROWS)) old.gone = true;
    return row;
  }

  group() { return {rows: [], more: 0, worst: 0, findings: 0}; }

  take(event) {
    if (event.seq === undefined) return;   // `missed`: the gap in the numbers says the same, also after a rebuild
    if (event.seq > this.next) {
      const lost = event.seq - this.next;
      this.add(event, "remark", {text: this.next > 1 ? lost + " events are missing here: the page could not keep up."
        : lost + (LOCKED ? " earlier events are further from this moment." : " earlier events are not in this page. The downloads have more.")});
    }
    this.next = event.seq + 1;
    const port = this.ports[event.port] ??= {pending: ""}, framed = FRAMED.includes(event.port);
    switch (event.event) {
      case "received": if (framed) { port.pending = (port.pending + event.hex).slice(-2 * PENDING); port.came = event; } else this.data(port, event, "in"); return;
      case "text-in": return this.textIn(port, event);
      case "text-out": return this.textOut(port, event);
      case "sent": return framed ? this.sent(port, event) : this.data(port, event, "out");
      case "answered": case "refused": return this.answered(port, event);
      case "finding": return this.finding(port, event);
      case "dropped": if (port.pending) return this.skipped(port, event); break;
      case "connected": port.group = undefined; break;
      case "disconnected": this.settle(); port.pending = ""; port.part = undefined; break;
      case "reset": case "restored": case "power-on": this.ports = {}; break;
    }
    const text = OTHERS[event.event]?.(event);
    if (text !== undefined) this.add(event, "event", {rest: event.event.replace("-", " "), text, event, worry: /alarm|fault/.test(event.event),
      group: event.event === "fault" ? port.group : undefined});
  }

  data(port, event, kind) {
    port.group = this.group();
    port.text = this.add(event, kind, {hex: event.hex, rest: "data", group: port.group});
  }

  /** After each batch: bytes of an incomplete text get their own row. */
  settle() {
    for (const port of Object.values(this.ports)) {
      if ((port.part?.hex ?? "") === port.pending) continue;
      this.unsettle(port);
      if (port.pending) port.part = this.add(port.came, "in", {hex: port.pending, text: readable(port.pending), rest: "no complete text yet", worry: true});
    }
  }

  unsettle(port) {
    const at = port.part ? this.rows.lastIndexOf(port.part) : -1;
    if (at >= 0) this.rows.splice(at, 1)[0].gone = true;
    port.part = undefined;
  }

  skipped(port, event) {
    const hex = port.pending.slice(0, 2 * event.bytes), t = port.part?.t ?? event.t;
    this.unsettle(port);
    port.pending = port.pending.slice(hex.length);
    this.add(event, "in", {t, hex, text: readable(hex), rest: "skipped: " + event.reason, worry: true});
  }

  textIn(port, event) {
    const data = event.hex + "03";
    let at = port.pending.indexOf(data), {hex, text} = event;
    while (at % 2 === 1) at = port.pending.indexOf(data, at + 1);
    if (at >= 0) {
      const framed = port.pending.slice(0, at).endsWith("02");
      hex = (framed ? "02" : "") + data;
      text = (framed ? "<STX>" : "") + text + "<ETX>";
      this.unsettle(port);
    }
    // Bytes before the text were skipped, and an event said so.
    port.pending = at < 0 ? "" : port.pending.slice(at + data.length);
    const reply = /^(OK|NG|FL)\b/.exec(event.text)?.[0], follows = port.group && (reply || port.group.open), group = follows ? port.group : this.group();
    port.text = port.asked = this.add(event, "in", {hex, text, body: event.text, group, letters: reply ?? "", rest: follows ? (reply ? "after " : "data, after ") + span(event.t - group.last) : ""});
    port.group = group;
    group.last = event.t;
    if (event.text.endsWith("<EOF>")) group.open = false;
  }

  /** The last text was a command. */
  answered(port, event) {
    const text = port.asked, command = event.command.slice(0, 8);
    if (!text) return;
    if (text.group.rows[0] !== text) port.group = text.group = {...this.group(), rows: [text], last: text.t};
    const group = text.group;
    group.command = text.letters = command;
    if (this.commands.size < COMMANDS) this.commands.add(command);
    if (event.mode) {
      group.mode = event.mode;
      group.outcome = event.outcome;
      group.open = command === "DL" && event.outcome === "served";   // its data follows
    } else group.reason = event.reason;
    text.rest = (NAMES[command] ? NAMES[command] + ", " : "") + (group.outcome === "not-valid" ? "not valid in " + group.mode : group.outcome ?? "refused");
    text.words = undefined;
    // A finding says why, and more. Without one the reason has its own row.
    if (event.reason && !group.rows.some(row => row.kind === "finding" && row.text.includes(event.reason)))
      this.add(event, "event", {rest: "refused", text: event.reason, group, event, worry: true});
  }

  textOut(port, event) {
    const letters = LETTERS.exec(event.text)?.[1] ?? "";
    const follows = port.group && port.group.rows.at(-1)?.kind !== "out", group = port.group = follows ? port.group : this.group();
    port.unsent = this.add(event, "out", {hex: event.hex, body: event.text, letters, group, rest: "not sent", full: 2 * event.bytes + 2});
    port.piece = undefined;
    if (letters === "SP" && !follows) group.command = "SP";
    if (letters === "NG") { group.ng = true; group.open = false; this.failure = group; }
  }

  sent(port, event) {
    const row = port.unsent ?? port.piece, group = row?.group;
    if (!row) { this.add(event, "out", {hex: event.hex, rest: "more bytes", group: port.group}); return; }
    if (row === port.piece) {
      Object.assign(row, {hex: row.hex + event.hex, text: row.text + event.text, pieces: row.pieces + 1, words: undefined});
      row.rest = "in " + row.pieces + " pieces";
    } else {
      row.rest = group.last === undefined ? row.letters === "SP" ? "the program stopped" : "" : "after " + span(event.t - group.last);
      // A fault may have sent something else than the answer.
      Object.assign(row, {t: event.t, hex: event.hex, text: event.text, letters: LETTERS.exec(event.text)?.[1] ?? row.letters, pieces: 1, words: undefined});
      // A delayed text comes after what happened meanwhile.
      if (this.rows.at(-1) !== row && !row.gone) this.rows.push(...this.rows.splice(this.rows.lastIndexOf(row), 1));
    }
    port.unsent = undefined;
    port.piece = row.hex.length < row.full ? row : undefined;
    group.last = event.t;
    port.text = row;
  }

  finding(port, event) {
    const belongs = port.group && event.rule !== "second-connection" && (!event.hex || port.text?.hex.includes(event.hex));
    const group = belongs ? port.group : this.group(), worst = WORST.indexOf(event.severity);
    group.findings += 1;
    group.worst = Math.max(group.worst, worst);
    if (worst > 1) this.failure = group;
    this.add(event, "finding", {letters: event.rule, text: event.message, hex: event.hex, group, event});
  }
}

/** What is looked for in a row, in lower case. */
function words(row) {
  return row.words ??= [row.port, row.letters, row.rest, row.text, row.event?.remedy].join(" ").toLowerCase();
}

/** The fault that has caused a finding: then the host has nothing to change. */
const cause = found => found.event["caused-by"] ? "caused-by: " + found.event["caused-by"] : "";

/** How bad a group is: the colour of its bar. */
const level = group => !group ? undefined : group.ng || group.worst === 3 ? "error" : WORST[group.worst] || "fine";

function save(name, blob) {
  const link = make("a", {href: URL.createObjectURL(blob), download: name});
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** Rows in the form of `--transcript`. */
function transcript(rows) {
  const lines = ["# copied from the page of ts3100; times are differences"];
  let last;
  for (const row of rows) {
    if (row.kind === "finding" || row.kind === "remark") { lines.push("# " + (row.letters ? row.event.severity + " " + row.letters + ": " : "") + row.text + (row.kind === "finding" && cause(row) ? " (" + cause(row) + ")" : "")); continue; }
    const sign = {in: ">", out: "<"}[row.kind];
    if (!sign && !["connected", "disconnected"].includes(row.event.event)) { lines.push("# " + row.rest + ": " + row.text); continue; }
    if (last !== undefined && row.t > last) lines.push("@+" + Math.round((row.t - last) * 1e6) + "us");
    last = row.t;
    if (!sign) lines.push("! " + row.rest.slice(0, -2) + " " + row.port + (row.text ? " " + row.text.replace(/:\d+$/, "") : ""));
    else if (row.body !== undefined && row.hex.startsWith("02")) lines.push(sign + " " + row.port + " " + row.body);
    else lines.push(sign + (FRAMED.includes(row.port) ? ": " : " ") + row.port + " " + row.text);
  }
  return lines.join("\n") + "\n";
}

/** Bytes in lines of sixteen, with a function that marks some of them. */
function dump(hex) {
  const bytes = bytesOf(hex).slice(0, DUMP), cells = [];
  const element = make("pre", {class: "dump", tabindex: "0", "aria-label": "Bytes"});
  for (let at = 0; at < bytes.length; at += 16) {
    const line = bytes.slice(at, at + 16);
    const digits = line.map(byte => make("i", {}, byte));
    const signs = line.map(byte => make("i", {}, /^[2-7]/.test(byte) && byte !== "7f" ? String.fromCharCode(parseInt(byte, 16)) : "."));
    line.forEach((byte, column) => cells.push([digits[column], signs[column]]));
    element.append(at.toString(16).padStart(4, "0"), "  ", ...digits.flatMap(one => [one, " "]), " ".repeat(3 * (16 - line.length) + 1), ...signs, "\n");
  }
  if (2 * DUMP < hex.length) element.append(hex.length / 2 - DUMP + " more bytes\n");
  return {element, mark(start, end) {
    cells.forEach((pair, at) => pair.forEach(cell => mark(cell, "class", at >= start && at < end ? "on" : "")));
  }};
}

export function create(robot) {
  let reader = new Reader(), shown = [], queue = [], frame = 0, visible = false, paused = false, waiting = 0;
  // Of a recorded run: the number of the last event by the moment, and its row.
  let seen = LOCKED ? robot.target?.e ?? 0 : Infinity, current;
  let follow = true, selected, height = 0, row = 28, head = 0, top = 0, resized = true, decodes = true;

  // Filters.
  const choose = (id, label, first, values) => {
    const select = make("select", {id}, make("option", {value: ""}, first), ...values.map(([value, text]) => make("option", {value}, text)));
    select.addEventListener("change", changed);
    return {select, element: make("span", {class: "filter"}, make("label", {for: id}, label), select)};
  };
  const port = choose("traffic-port", "Port", "all", PORTS.map(name => [name, name]));
  const command = choose("traffic-command", "Command", "all", []);
  const kind = choose("traffic-kind", "Show", "everything", [["ng", "only NG"], ["findings", "only findings"], ["texts", "only texts"]]);
  const search = make("input", {id: "traffic-search", type: "search", placeholder: "text, rule, reason", autocomplete: "off"});
  search.addEventListener("input", changed);
  const count = make("p", {class: "count"});

  const pause = button("Pause", () => {
    paused = !paused;
    say(pause.button, paused ? "Resume" : "Pause");
    if (!paused) rebuild();
    ask();
  });
  const end = button(LOCKED ? "To the moment" : "To the end", () => { follow = true; ask(); }, {reads: true});
  const copied = make("output", {class: "count"});
  const copier = button("Copy rows", async () => {
    await copy(transcript(shown));
    say(copied, shown.length + " rows copied");
    setTimeout(() => say(copied, ""), 4000);
  }, {reads: true});
  const failure = button("Save last failure", () => share(reader.failure), {disabled: true, title: "The last exchange with NG or a finding, as a text file for an issue"});
  const downloads = [["text", "Text", "txt"], ["jsonl", "JSON lines", "jsonl"], ["pcapng", "pcapng", "pcapng"]].map(([format, label, ending]) =>
    button(label, async () => save("transcript." + ending, await (await robot.fetch("GET", "transcript?format=" + format)).blob()), {"aria-label": "Download transcript as " + label}).element);

  // The rows in sight.
  const heading = make("div", {role: "row", class: "head"}, ...["Time (s)", "Port", "Direction", "Meaning", "Text"].map(text => make("span", {role: "columnheader"}, text)));
  const pool = make("div", {class: "pool", role: "none"}), space = make("div", {class: "space", role: "rowgroup"}, pool);
  const grid = make("div", {class: "grid", role: "grid", tabindex: "0", "aria-label": "Traffic"}, make("div", {role: "rowgroup", class: "heading"}, heading), space);
  const none = make("p", {class: "empty"}, "");
  const details = make("section", {class: "details", "aria-label": "Details", tabindex: "0", hidden: true});
  const element = make("div", {class: "traffic"},
    make("div", {class: "row tools"}, port.element, command.element, kind.element, make("span", {class: "filter"}, make("label", {for: search.id}, "Search"), search)),
    make("div", {class: "row tools"}, LOCKED ? "" : pause.element, copier.element, ...(LOCKED ? [] : [failure.element,
      make("span", {class: "downloads", role: "group", "aria-label": "Download transcript"}, "Download", ...downloads)]), count, copied),
    none, make("div", {class: "list"}, grid, end.element), details);

  function changed() { follow = true; ask(); }
  function ask() { if (!frame && visible) frame = requestAnimationFrame(draw); }

  function fits(found) {
    if (port.select.value && found.port !== port.select.value) return false;
    if (command.select.value && found.group?.command !== command.select.value) return false;
    if (kind.select.value === "ng" && !found.group?.ng) return false;
    if (kind.select.value === "findings" && !found.group?.findings) return false;
    if (kind.select.value === "texts" && !ARROWS[found.kind]) return false;
    return !wanted || words(found).includes(wanted) || hits.has(found.group);
  }
  let wanted = "", hits = new Set();

  function rebuild() {
    const old = reader.failure, seq = selected?.seq;
    reader = new Reader();
    queue = [];
    waiting = 0;
    for (const event of robot.events) reader.take(event);
    reader.settle();
    reader.failure ??= old;
    selected = selected && (reader.rows.find(one => one.seq === seq && one.kind === selected.kind) ?? selected);
    top = 0;
  }

  function draw() {
    frame = 0;
    if (!visible) return;
    // Read before anything is written: one layout a frame.
    const before = grid.scrollTop;
    if (resized) {
      height = grid.clientHeight;
      head = heading.offsetHeight;
      row = parseFloat(getComputedStyle(grid).getPropertyValue("--row")) || row;
      space.dataset.rows = "";
      resized = false;
    }
    for (const event of queue) reader.take(event);
    if (queue.length) reader.settle();
    queue = [];
    wanted = search.value.trim().toLowerCase();
    // A text that is found brings its whole exchange.
    hits = new Set(wanted ? reader.rows.filter(one => one.group && words(one).includes(wanted)).map(one => one.group) : []);
    let lost = 0;
    while (lost < shown.length && shown[lost].gone) lost += 1;
    const filtered = port.select.value || command.select.value || kind.select.value || wanted;
    shown = filtered ? reader.rows.filter(fits) : reader.rows.slice();
    const total = shown.length * row, room = Math.max(height - head, row), most = Math.max(0, total - room);
    current = LOCKED ? Math.max(0, shown.findLastIndex(one => one.seq <= seen)) : undefined;
    top = follow && LOCKED ? nearTop(before, room, most) : follow ? most : Math.min(most, Math.max(0, before - lost * row));
    if (space.dataset.rows !== String(shown.length)) {
      space.dataset.rows = shown.length;
      space.style.height = total + "px";
      mark(grid, "aria-rowcount", shown.length + 1);
    }
    if (top !== before) grid.scrollTop = top;
    render();
    none.hidden = shown.length > 0;
    say(none, reader.rows.length ? "No row matches the filters." : "No traffic yet. Connect a host program to one of the ports.");
    say(count, (paused ? "Paused, " + waiting + " new events. " : "") + (filtered ? shown.length + " of " : "") + reader.rows.length + " rows");
    end.element.hidden = follow || !shown.length;
    if (LOCKED) say(count, shown.length + " rows around this moment");
    failure.button.disabled = !reader.failure;
    if (command.select.length - 1 !== reader.commands.size) {
      const value = command.select.value;
      command.select.replaceChildren(command.select.options[0], ...[...reader.commands].sort().map(name => make("option", {value: name}, name + " " + (NAMES[name] ?? ""))));
      command.select.value = value;
      if (command.select.selectedIndex < 0) command.select.selectedIndex = 0;
    }
  }

  /** Where the list is scrolled to so that the row of the moment is in sight: it moves as little as it can. */
  function nearTop(before, room, most) {
    const at = current * row;
    if (at >= before + row && at + 2 * row <= before + room) return Math.min(most, before);
    return Math.min(most, Math.max(0, at - room / 2));
  }

  function slot() {
    const cells = ["time", "port", "way", "what", "text"].map(name => make("span", {role: "gridcell", class: name}));
    const letters = make("b"), rest = make("span");
    cells[3].append(letters, " ", rest);
    return Object.assign(make("div", {role: "row", id: "traffic-" + pool.children.length}, ...cells), {cells, letters, rest});
  }

  function render() {
    const first = Math.max(0, Math.floor(top / row) - 2), needed = Math.min(shown.length - first, Math.ceil((height - head) / row) + 5);
    while (pool.children.length < needed) pool.append(slot());
    let active;
    [...pool.children].forEach((line, at) => {
      const found = at < needed ? shown[first + at] : undefined;
      line.hidden = !found;
      line.shows = found;
      mark(line, "aria-selected", !!found && found === selected);
      if (LOCKED) mark(line, "data-now", first + at === current);
      if (!found) return;
      const severity = found.kind === "finding" ? found.event.severity : "", previous = shown[first + at - 1];
      say(line.cells[0], found.t.toFixed(3));
      say(line.cells[1], found.port ?? "");
      say(line.cells[2], ARROWS[found.kind] ?? severity);
      say(line.letters, found.letters);
      say(line.rest, found.rest);
      say(line.cells[4], found.text.length > LONGEST ? found.text.slice(0, LONGEST) + "\u2026" : found.text);
      mark(line, "aria-rowindex", first + at + 2);
      mark(line, "class", [found.kind, severity, found.worry && "worry", found.letters === "NG" && "ng", found.group && found.group === previous?.group && "on", found.seq > seen && "later"].filter(Boolean).join(" "));
      mark(line, "data-bar", level(found.group) ?? "none");
      if (found === selected) active = line.id;
    });
    const move = "translateY(" + first * row + "px)";
    if (pool.style.transform !== move) pool.style.transform = move;
    if (active) mark(grid, "aria-activedescendant", active); else grid.removeAttribute("aria-activedescendant");
  }

  grid.addEventListener("scroll", () => {
    const at = grid.scrollTop;
    // A change of the layout scrolls too; it is no reason to follow no longer.
    if (Math.abs(at - top) < 1 || resized || grid.clientHeight !== height) return;
    top = at;
    follow = !LOCKED && at + (height - head) >= shown.length * row - row;
    ask();
  }, {passive: true});
  grid.addEventListener("wheel", event => { if (event.deltaY < 0) follow = false; }, {passive: true});

  // Rows move while they are pressed, so what was pressed counts, not what is there at the release.
  let pressed;
  const rowAt = target => target.closest?.("[role=row]")?.shows;
  grid.addEventListener("pointerdown", event => { pressed = rowAt(event.target); });
  grid.addEventListener("click", event => {
    const found = pressed ?? rowAt(event.target);
    pressed = undefined;
    if (found) select(found, true);
  });
  grid.addEventListener("keydown", event => {
    const at = shown.indexOf(selected), page = Math.max(1, Math.floor((height - head) / row) - 1);
    const next = {ArrowDown: at + 1, ArrowUp: at < 0 ? shown.length - 1 : at - 1, PageDown: at + page, PageUp: at - page, Home: 0, End: shown.length - 1}[event.key];
    if (event.key === "Escape") close();
    if (next === undefined || event.ctrlKey || event.altKey || event.metaKey || !shown.length) return;
    event.preventDefault();
    const to = Math.min(shown.length - 1, Math.max(0, next));
    follow = LOCKED !== "" || to === shown.length - 1;
    if (to * row < top) top = to * row;
    else if ((to + 1) * row > top + height - head) top = (to + 1) * row - height + head;
    grid.scrollTop = top;
    select(shown[to]);
  });

  function close() {
    details.hidden = true;
    selected = undefined;
    mark(element, "data-open", false);
    ask();
  }

  function select(found, clicked) {
    selected = found;
    show(found);
    details.hidden = false;
    mark(element, "data-open", true);
    if (clicked) details.scrollIntoView({block: "nearest"});
    if (LOCKED && found.seq) robot.goToEvent(found.seq);
    ask();
  }

  /** A finding with what to do about it. */
  function advice(found) {
    return make("li", {class: found.event.severity}, make("strong", {}, explained(found.letters, found.event.severity + ": " + found.letters)), make("p", {}, found.text),
      make("p", {}, cause(found) || "Remedy: " + found.event.remedy), make("p", {class: "source"}, "Manual, section " + found.event.source));
  }

  function facts(found) {
    const group = found.group, text = ARROWS[found.kind];
    return [
      ["Time", found.t.toFixed(6) + " s"], ["Port", found.port], ["Direction", text],
      ["Command", found.kind === "in" && group?.command && group.rows[0] === found && group.command + " " + (NAMES[group.command] ?? "")],
      ["Operands", found.kind === "in" && group?.rows[0] === found && found.body?.replace(/^[A-Za-z]{2},?/, "").replace(/<CR>$/, "")],
      ["Outcome", text && group?.command && (group.outcome ?? (group.reason ? "refused" : "")) + (group.mode ? " in " + group.mode : "") + (group.findings ? ", with " + group.findings + (group.findings === 1 ? " finding" : " findings") : "")],
      ["Reason", text && !group?.findings && group?.reason],
      ["Answer to", found.kind === "out" && group?.rows[0] !== found && group?.command],
      ["Length", found.hex && found.hex.length / 2 + " bytes"],
      ["Event", found.kind === "event" && found.rest + (found.text ? ": " + found.text : "")],
    ].filter(([, value]) => value);
  }

  async function decode(found) {
    if (!decodes || !found.hex || !ARROWS[found.kind] || !FRAMED.includes(found.port)) return [];
    try {
      return (await robot.post("decode", {direction: found.kind === "in" ? "host" : "controller", command: found.group?.command, hex: found.hex})).fields ?? [];
    } catch (error) {
      if (error.status === 404) decodes = false;
      return [];
    }
  }

  async function show(found) {
    const group = found.group, findings = group?.rows.filter(one => one.kind === "finding").sort((one, other) => (other === found) - (one === found)) ?? [];
    const fields = make("tbody"), table = make("table", {hidden: true}, make("caption", {}, "Fields"), make("thead", {}, make("tr", {},
      ...["Field", "Value", "Bytes"].map(text => make("th", {scope: "col"}, text)))), fields);
    const bytes = found.hex && dump(found.hex), whole = make("p", {class: "whole mono"}, found.text);
    const remedies = findings.length ? [make("ul", {class: "findings", "aria-label": "Findings"}, ...findings.map(advice))] : [];
    const first = found.kind === "finding" || group?.ng;   // what is wrong with it matters more than what it says
    details.replaceChildren(
      make("div", {class: "row"}, make("h3", {}, (found.letters || found.rest || "Remark") + (found.port ? " on " + found.port : "")),
        ...(group ? [button("Save this exchange", () => share(group), {reads: true}).element] : []), button("Close details", () => { close(); grid.focus({preventScroll: true}); }, {reads: true}).element),
      ...(first ? remedies : []), make("dl", {}, ...facts(found).flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)])),
      ARROWS[found.kind] ? whole : "",
      bytes ? bytes.element : "", table, ...(first ? [] : remedies));
    const all = await decode(found);
    if (selected !== found || !all.length) return;
    fields.append(...all.map(field => {
      const line = make("tr", {tabindex: "0"}, make("th", {scope: "row", title: field.key}, field.name), make("td", {}, fieldValue(field)),
        make("td", {class: "number"}, field.end - field.start > 1 ? field.start + "\u2013" + (field.end - 1) : String(field.start)));
      for (const name of ["mouseenter", "focus"]) line.addEventListener(name, () => bytes.mark(field.start, field.end));
      for (const name of ["mouseleave", "blur"]) line.addEventListener(name, () => bytes.mark(0, 0));
      return line;
    }));
    whole.hidden = true;   // its fields say more
    table.hidden = false;
  }

  /** An exchange as a file that needs nothing else: texts, bytes, findings, fields, the robot's state and the version. */
  async function share(group) {
    const [version, state] = await Promise.all([robot.get("version"), robot.get("state")]);
    const lines = ["An exchange between a host program and a robot controller", "",
      "Saved from " + version.name + " " + version.version + ", which emulates a " + version.controller + " (" + version.model + ").",
      "Times are in seconds since the start of the robot.", "",
      ...facts(group.rows[0]).map(([name, value]) => name + ": " + value)];
    lines.push("", "PROBLEMS", "");
    for (const found of group.rows) {
      if (found.kind === "event") lines.push(found.rest + ": " + found.text);
      if (found.kind === "finding") lines.push(found.event.severity + ": " + found.letters + " (manual, section " + found.event.source + ")", "    " + found.text, "    " + (cause(found) || "Remedy: " + found.event.remedy));
    }
    if (!group.findings) lines.push(group.ng ? "The answer is NG." : "Nothing.");
    lines.push("", "TRAFFIC", "");
    for (const found of group.rows) {
      if (!ARROWS[found.kind]) continue;
      lines.push(found.t.toFixed(6) + "  " + ARROWS[found.kind].replace("\u2192", "->") + "  " + found.text);
      for (let at = 0; at < Math.min(found.hex.length, 2 * DUMP); at += 64) lines.push("    " + bytesOf(found.hex.slice(at, at + 64)).join(" "));
      for (const field of await decode(found)) lines.push("    " + field.name + ": " + fieldValue(field));
    }
    if (group.more) lines.push(group.more + " more rows are omitted");
    lines.push("", "STATE OF THE ROBOT", "",
      ...Object.entries(state).filter(([, value]) => typeof value !== "object").map(([key, value]) => key.replaceAll("_", " ") + ": " + value),
      "alarms: " + (state.alarms.map(alarm => alarm.number + " " + alarm.text).join("; ") || "none"), "");
    save("exchange-" + (group.command ?? "text") + "-" + group.rows[0].t.toFixed(3) + ".txt", new Blob([lines.join("\n")], {type: "text/plain"}));
  }

  new ResizeObserver(() => {
    resized = true;
    ask();
  }).observe(grid);
  if (LOCKED) {
    robot.on("reset", () => { if (visible) { rebuild(); ask(); } });
    robot.on("moment", moment => {
      if (moment?.e === undefined) return;
      seen = moment.e;
      follow = true;
      ask();
    });
  } else robot.on("reset", () => {
    queue = [];
    reader = new Reader();
    reader.add({seq: 0, t: 0}, "remark", {text: "The emulator was restarted. Earlier events are gone."});
    ask();
  });

  return {
    element,
    event(event) {
      if (!visible) return;
      if (paused) waiting += 1; else queue.push(event);
      ask();
    },
    show(part) {
      visible = true;
      if (part === "findings") {
        kind.select.value = "findings";
        for (const one of [port.select, command.select, search]) one.value = "";
        follow = true;
      }
      if (LOCKED) robot.wantEvents(true);
      if (!paused) rebuild();
      ask();
    },
    hide() {
      visible = false;
      if (LOCKED) robot.wantEvents(false);
      queue = [];
    },
  };
}
