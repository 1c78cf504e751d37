// The lab: what nobody can do to a real robot. The clock, faults on purpose, snapshots, a scenario, and what hosts have reached.

import {make, button, choice, explained, fixed, list, mark, say} from "./dom.js";
import {atMost} from "./feed.js";

const LOOK = 1000;          // between two readings of the scenario and of the coverage, in ms
const DIFFERENCES = 300;    // differences of two snapshots that are listed
const DEPTH = 12;           // levels of a snapshot that are compared
const SHOWN = 80;           // characters of a value in a difference
const FINDINGS = 100;       // rules that are listed
const STEPS = 500;          // steps of a scenario that are listed
const WITHIN = 3600;        // longest virtual time of "until", in s
const CONDITIONS = ["idle", "alarm", "status running", "status stop (reset)", "output 5 on", "input 5 on", "printed DONE", "command RN", "refused RN", "connected IP0", "line 12"];
const PORTS = ["HOST", "COM1", "IP0", "IP1", "IP2", "IP3"];
const OUTCOMES = {served: "served", "not-valid": "NG by the table", refused: "NG"};

/** A labelled input. */
function field(label, input) {
  return make("label", {class: "field"}, label, input);
}

const text = properties => make("input", {autocomplete: "off", spellcheck: "false", ...properties});
const select = (words, properties = {}) => make("select", properties, ...words.map(([value, label]) => make("option", {value}, label)));
const card = (title, ...children) => make("section", {class: "card", "aria-label": title}, make("h3", {}, title), ...children);

/** How time passes, and moving it. */
function makeClock(robot) {
  const modes = choice("Time", [["real", "Real"], ["stepped", "Stepped"], ["auto", "Auto"]], mode => robot.put("clock", {mode}));
  const factor = text({type: "number", min: "1", max: "100000", value: "10", inputmode: "numeric"});
  const times = button("Set speed", () => robot.put("clock", {mode: "x" + factor.value}));
  const by = text({type: "number", min: "0", step: "any", value: "1", inputmode: "decimal"});
  const advance = button("Advance", () => robot.post("clock/advance", {seconds: Number(by.value)}), {class: "primary"});
  const until = text({list: "lab-conditions", placeholder: "output 5 on", size: "16"});
  const ended = make("p", {class: "hint", role: "status"});
  const jump = button("Advance until", async () => {
    say(ended, "");
    const found = await robot.post("clock/advance-until", {condition: until.value, within: WITHIN});
    say(ended, until.value + (found.reached ? ": after " : ": not within ") + fixed(found.passed, 3) + " s.");
  });
  const now = make("p", {class: "time mono"}), calendar = make("p", {class: "hint"});
  return {
    element: card("Clock", now, calendar, modes.element, make("div", {class: "row"}, field("Factor", factor), times.element),
      make("div", {class: "row"}, field("Seconds", by), advance.element),
      make("div", {class: "row"}, field("Condition", until), jump.element),
      make("datalist", {id: "lab-conditions"}, ...CONDITIONS.map(value => make("option", {value}))), ended),
    tick() { say(now, fixed(Math.floor(robot.time()), 0) + " s"); },
    state(state) {
      say(now, robot.runs ? fixed(Math.floor(robot.time()), 0) + " s" : fixed(state.t, 3) + " s");
      say(calendar, state.calendar + ", " + (state.time_mode === "stepped" ? "the clock is stopped until you advance it" : "time passes: " + state.time_mode));
      modes.show(state.time_mode);
    },
  };
}

/** Faults on purpose: a kind, its parameters, and those that are armed. */
function makeFaults(robot) {
  let kinds = [], chosen = "";
  const buttons = make("div", {class: "kinds", role: "radiogroup", "aria-label": "Kinds of faults"});
  const what = make("p", {}), remedy = make("p", {class: "hint"}), form = make("div", {class: "row"});
  const armed = make("ul", {class: "armed", "aria-label": "Faults"}), none = make("p", {class: "empty"}, "No fault is armed.");
  const command = text({size: "6", placeholder: "any"}), channel = select([["", "any"], ...PORTS.slice(0, 5).map(port => [port, port])]);
  const times = text({type: "number", min: "0", value: "1"}), after = text({type: "number", min: "0", value: "0"});
  const arm = button("Arm", () => {
    const parameters = {};
    for (const input of form.querySelectorAll("[data-parameter]")) if (input.value) parameters[input.dataset.parameter] = input.value;
    const on = {};
    if (command.value.trim()) on.command = command.value.trim().toUpperCase();
    if (channel.value) on.channel = channel.value;
    return robot.post("faults", {kind: chosen, on, times: Number(times.value), after: Number(after.value), parameters});
  }, {class: "primary"});
  const clear = button("Remove all", () => robot.remove("faults"));
  const sheet = make("div", {class: "sheet", hidden: true}, what, remedy, make("div", {class: "row"}, field("Command", command), field("Port", channel),
    field("Times (0: no limit)", times), field("Skip the first", after)), form, arm.element);

  function choose(kind) {
    chosen = kind.kind;
    for (const one of buttons.children) mark(one, "aria-checked", one.textContent === chosen);
    sheet.hidden = false;
    say(what, kind.what);
    say(remedy, "A robust host: " + kind.remedy);
    command.value = kind.command ?? "";
    form.replaceChildren(...kind.parameters.map(one => field(one.name + ": " + one.takes,
      text({"data-parameter": one.name, placeholder: one.default ?? "", title: one.what}))));
  }

  async function read() {
    kinds = await robot.get("faults/kinds");
    buttons.replaceChildren(...kinds.map(kind => make("button", {type: "button", role: "radio", "aria-checked": "false", onclick: () => choose(kind)}, kind.kind)));
  }

  return {
    element: card("Faults", buttons, sheet, none, armed, clear.element),
    show() { if (!kinds.length) read().catch(() => { /* again when it is shown the next time */ }); },
    state(state) {
      const {faults} = state.faults;
      none.hidden = faults.length > 0;
      clear.element.hidden = !faults.length;
      list(armed, faults, one => one.id, one => make("li", {}, make("code", {}, one.spec), make("span", {}),
        button("Disarm", () => robot.remove("faults/" + one.id), {"aria-label": "Disarm " + one.spec}).element), (row, one) => {
        say(row.children[1], (one.armed ? "armed" : "used up") + ", fired " + one.fired + (one.times ? " of " + one.times : "") + " times");
        mark(row, "data-armed", one.armed);
        row.children[2].hidden = !one.armed;
      });
    },
  };
}

const CODES = {r: "\r", n: "\n", t: "\t"};

/** The bytes of a text in which `\r`, `\n`, `\t` and `<1A>` are codes, as hexadecimal digits. */
const hexOf = text => [...text.matchAll(/\\([rnt])|<([0-9A-Fa-f]{2})>|[^]/gu)].map(([letter, code, hex]) =>
  hex ?? [...new TextEncoder().encode(CODES[code] ?? letter)].map(byte => byte.toString(16).padStart(2, "0")).join("")).join("");

/** Bytes as if they had come from a peer, and cutting a connection. */
function makeLinks(robot) {
  const port = select(PORTS.map(name => [name, name])), bytes = text({placeholder: "4\\r", size: "14"});
  port.value = "IP1";
  const inject = button("Inject", () => robot.post("channels/" + port.value + "/inject", {hex: hexOf(bytes.value)}));
  const drop = button("Cut the connection", () => robot.post("channels/" + port.value + "/drop"));
  const reset = button("Reset the robot", async () => {
    if (confirm("Reset the robot to its initial state? Its files, variables and alarms are lost.")) await robot.post("reset");
  }, {class: "danger"});
  return card("Connections", make("div", {class: "row"}, field("Port", port), field("Bytes (escapes: \\r, <1A>)", bytes)),
    make("div", {class: "row"}, inject.element, drop.element), make("h4", {}, "Start over"), reset.element);
}

/** What differs between two documents: `[path, left, right]`. */
function differences(left, right, path = "", depth = 0, found = []) {
  if (found.length > DIFFERENCES || left === right) return found;
  const both = [left, right].every(one => one !== null && typeof one === "object");
  if (!both || depth === DEPTH || Array.isArray(left) !== Array.isArray(right)) {
    if (JSON.stringify(left) !== JSON.stringify(right)) found.push([path, left, right]);
    return found;
  }
  for (const key of new Set([...Object.keys(left), ...Object.keys(right)]))
    differences(left[key], right[key], path + (Array.isArray(left) ? "[" + key + "]" : (path && ".") + key), depth + 1, found);
  return found;
}

function shownValue(value) {
  if (value === undefined) return "missing";
  const words = JSON.stringify(value);
  return words.length > SHOWN ? words.slice(0, SHOWN) + "\u2026" : words;
}

/** Snapshots: take, restore, compare, save as files. */
function makeSnapshots(robot) {
  let names = [];
  const path = name => "snapshots/" + encodeURIComponent(name);
  const name = text({size: "12", placeholder: "before"});
  const rows = make("ul", {class: "snapshots", "aria-label": "Snapshots"}), none = make("p", {class: "empty"}, "No snapshots.");
  const left = select([]), right = select([]);
  const table = make("tbody"), heading = make("p", {role: "status"});
  const shown = make("div", {class: "scroll", hidden: true, tabindex: "0", role: "region", "aria-label": "Differences"}, make("table", {},
    make("thead", {}, make("tr", {}, ...["Field", "First", "Second"].map(word => make("th", {scope: "col"}, word)))), table));

  async function read() {
    const found = (await robot.get("snapshots")).snapshots;
    names = found.map(one => one.name);
    none.hidden = names.length > 0;
    list(rows, found, one => one.name, one => make("li", {}, make("strong", {}, one.name), make("span", {class: "mono"}),
      button("Restore", async () => { await robot.post(path(one.name) + "/restore"); }, {"aria-label": "Restore " + one.name}).element,
      button("Save", () => save(one.name), {"aria-label": "Save " + one.name + " as a file"}).element,
      button("Delete", async () => { await robot.remove(path(one.name)); await read(); }, {"aria-label": "Delete " + one.name}).element),
    (row, one) => say(row.children[1], fixed(one.t, 3) + " s"));
    for (const [input, at] of [[left, 0], [right, 1]]) {
      const options = [...names.map(one => [one, one]), ["", "now"]], old = input.value;
      input.replaceChildren(...options.map(([value, label]) => make("option", {value}, label)));
      input.value = names.includes(old) ? old : at ? "" : names[0] ?? "";
    }
  }

  async function save(one) {
    const response = await robot.fetch("GET", one ? path(one) : "snapshot");
    const link = make("a", {href: URL.createObjectURL(await response.blob()), download: (one || "now") + ".json"});
    link.click();
    URL.revokeObjectURL(link.href);
  }

  const take = button("Take", async () => {
    if (!name.value.trim()) throw new Error("type a name for the snapshot first");
    await robot.put(path(name.value.trim()));
    name.value = "";
    await read();
  }, {class: "primary"});
  name.addEventListener("keydown", event => { if (event.key === "Enter") take.button.click(); });
  const file = make("input", {type: "file", accept: ".json,application/json", "aria-label": "Snapshot file", hidden: true});
  const load = button("Load a file", () => file.click());
  file.addEventListener("change", async () => {
    say(load.reason, "");
    try { await robot.call("PUT", "snapshot", JSON.parse(await file.files[0].text())); }
    catch (error) { say(load.reason, error instanceof SyntaxError ? "cannot load " + file.files[0].name + ": it is not a snapshot file" : error.message); }
    file.value = "";
  });
  const compare = button("Compare", async () => {
    const documents = await Promise.all([left, right].map(input => robot.get(input.value ? path(input.value) : "snapshot")));
    const found = differences(...documents.map(one => typeof one === "string" ? JSON.parse(one) : one));
    const more = found.length > DIFFERENCES ? ", the first " + DIFFERENCES + " of more" : "";
    say(heading, found.length ? Math.min(found.length, DIFFERENCES) + (found.length === 1 ? " difference" : " differences") + more : "No difference.");
    shown.hidden = !found.length;
    table.replaceChildren(...found.slice(0, DIFFERENCES).map(([where, one, two]) => make("tr", {}, make("th", {scope: "row", class: "mono"}, where),
      make("td", {class: "mono"}, shownValue(one)), make("td", {class: "mono"}, shownValue(two)))));
  });
  return {
    element: card("Snapshots", make("div", {class: "row"}, field("Name", name), take.element, button("Save now", () => save("")).element, load.element, file), none, rows,
      make("div", {class: "row"}, field("First", left), field("Second", right), compare.element), heading, shown),
    show() { read().catch(() => { /* again when it is shown the next time */ }); },
  };
}

/** The scenario that is played, step by step. */
function makeScenario(robot) {
  const heading = make("p", {role: "status"}), steps = make("ol", {class: "steps", "aria-label": "Steps of the scenario"});
  let played = false;
  say(heading, "No scenario is running. Start one with: ts3100 serve --scenario FILE");
  return {
    element: card("Scenario", heading, steps),
    state(state) {
      if (state.scenario && !played) this.read();
      played = state.scenario;
    },
    async read() {
      if (!robot.state?.scenario) return;
      let found;
      try { found = await robot.get("scenario"); } catch (error) {
        say(heading, error.message);
        return;
      }
      say(heading, found.file + ": " + found.state);
      mark(heading, "data-state", found.state);
      list(steps, found.steps.slice(0, STEPS).map((step, at) => ({...step, at})), step => step.at, () => make("li", {}, make("strong", {}), make("span", {}), make("p", {})),
        (row, step) => {
          mark(row, "data-state", step.state);
          say(row.children[0], step.name);
          say(row.children[1], step.state + (step.t === undefined ? "" : " at " + fixed(step.t, 3) + " s"));
          say(row.children[2], step.message ?? "");
        });
    },
  };
}

/** What hosts have reached of the permission tables: a row for each command, a column for each master mode. */
function makeCoverage(robot) {
  const heading = make("p", {role: "status"}), tables = make("div", {class: "coverage"});
  let last = "";

  /** The outcomes of one command in one mode as one cell. */
  function cell(found) {
    const reached = found.filter(one => one.count), needed = found.filter(one => one.reachable);
    if (!found.length) return make("td", {class: "never"}, make("span", {class: "sr"}, "not reachable"));
    const state = needed.length && needed.every(one => one.count) ? "all" : reached.length ? "some" : "none";
    const words = found.map(one => OUTCOMES[one.outcome] + ": " + one.count).join(", ");
    const total = reached.reduce((sum, one) => sum + one.count, 0);
    const sign = reached.length ? reached.map(one => one.outcome === "served" ? "\u2713" : "NG").join(" ") + " " + total : "";
    return make("td", {"data-state": state, title: words}, make("span", {"aria-hidden": "true"}, sign || "\u00b7"), make("span", {class: "sr"}, words));
  }

  function draw(found) {
    say(heading, found.percent + " %: " + found.reached + " of " + found.reachable + " outcomes that a host can reach.");
    const ports = Map.groupBy ? Map.groupBy(found.cells, one => one.port) : new Map([["", found.cells]]);
    tables.replaceChildren(...[...ports].map(([port, cells]) => {
      const modes = [...new Set(cells.map(one => one.mode))], commands = [...new Set(cells.map(one => one.command))];
      const at = new Map();
      for (const one of cells) {
        const key = one.command + "\n" + one.mode;
        at.set(key, [...at.get(key) ?? [], one]);
      }
      return make("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": "Coverage of " + port}, make("table", {}, make("caption", {}, port),
        make("thead", {}, make("tr", {}, make("th", {scope: "col"}, "Command"), ...modes.map(mode => make("th", {scope: "col"}, mode)))),
        make("tbody", {}, ...commands.map(command => make("tr", {}, make("th", {scope: "row", class: "mono"}, command),
          ...modes.map(mode => cell(at.get(command + "\n" + mode) ?? [])))))));
    }));
  }

  return {
    element: card("Coverage of the permission tables", heading, make("p", {class: "hint"}, "\u2713 n accepted, NG n refused, \u00b7 not tried."), tables),
    async read() {
      let found;
      try { found = await robot.get("coverage"); } catch (error) { return say(heading, error.message); }
      const key = JSON.stringify(found);
      if (key === last) return;
      last = key;
      draw(found);
    },
  };
}

/** Which rules hosts have broken, how often, and what to do. */
function makeFindings(robot) {
  const rows = make("ul", {class: "rules", "aria-label": "Findings"}), none = make("p", {class: "empty"}, "No findings.");
  return {
    element: card("Findings", none, rows),
    async read() {
      let found;
      try { found = await robot.get("findings"); } catch { return; }
      const rules = new Map();
      for (const one of found) {
        const key = one.rule + (one["caused-by"] ? " by fault" : "");   // what a fault has caused is no mistake of the host
        rules.set(key, {...one, key, count: (rules.get(key)?.count ?? 0) + 1});
      }
      none.hidden = found.some(one => !one["caused-by"]);
      list(rows, [...rules.values()].slice(0, FINDINGS), one => one.key,
        one => make("li", {"data-severity": one.severity}, make("strong", {}, explained(one.rule)), make("span", {}), make("p", {}), make("p", {class: "hint"})), (row, one) => {
          say(row.children[1], one.severity + ", " + one.count + (one.count === 1 ? " time" : " times") + ", last at " + fixed(one.t, 3) + " s" + (one["caused-by"] ? ", caused-by: " + one["caused-by"] : ""));
          say(row.children[2], one.message);
          say(row.children[3], one.remedy + " (" + one.source + ")");
        });
    },
  };
}

export function create(robot) {
  const clock = makeClock(robot), faults = makeFaults(robot), snapshots = makeSnapshots(robot);
  const read = [makeScenario(robot), makeCoverage(robot), makeFindings(robot)];
  const [scenario, coverage, findings] = read;
  let shown = false;

  /** Reads what has no place in the state, upon events. */
  const look = atMost(LOOK, () => { if (shown) for (const one of read) one.read(); });

  return {
    element: make("div", {class: "lab"}, clock.element, faults.element, snapshots.element, makeLinks(robot), scenario.element, findings.element, coverage.element),
    state(state) {
      if (!shown) return;
      clock.state(state);
      faults.state(state);
      scenario.state(state);
    },
    tick() { clock.tick(); },
    event() { if (shown) look(); },
    show() {
      shown = true;
      look();
      faults.show();
      snapshots.show();
      if (robot.state) this.state(robot.state);
    },
    hide() { shown = false; },
  };
}
