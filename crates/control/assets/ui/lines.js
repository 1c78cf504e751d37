// The digital lines: all inputs and outputs as lamps, and beside them what a host reads in the status frame.
//
// A click sets or clears a line. The menu of a line pulses, forces and releases it. Only lines that changed are touched. Of a
// recorded run a click lists what has changed the line.

import {LOCKED, ifKnown, load, make, list, mark, say} from "./dom.js";
import {atMost} from "./feed.js";

const GROUPS = [["General", 1, 64], ["System signals", 249, 264], ["Extension", 101, 164], ["System", 201, 248]];
const FRAME_EVERY = 500;   // ms between two readings of the status frame
const PULSE = 0.5;         // seconds of a pulse

/** What the menu of a line offers: [label, method, path after the line, body]. */
function choices(line) {
  return [
    [line.on ? "Clear" : "Set", "PUT", "", {on: !line.on}],
    ["Pulse " + PULSE + " s", "POST", "/pulse", {seconds: PULSE}],
    ["Force on", "PUT", "/force", {on: true}],
    ["Force off", "PUT", "/force", {on: false}],
    ["Release", "DELETE", "/force", undefined],
  ];
}

/** The inputs or the outputs. `kind` is the path: `inputs` or `outputs`. */
function side(robot, kind, title, menu) {
  const word = kind === "inputs" ? "Input" : "Output";
  const lines = new Map();   // number -> line
  const groups = [];
  const reason = make("output", {class: "reason", role: "alert"});
  const grid = make("div", {class: "lines"});
  const none = make("p", {class: "empty", hidden: true}, "No line matches.");

  async function call(line, method, path, body) {
    say(reason, "");
    try { await robot.call(method, kind + "/" + line.number + path, body); }
    catch (error) { say(reason, word + " " + line.number + ": " + error.message); throw error; }
  }

  /** What has changed a line of a recorded run. */
  const why = line => load("jumps.js").then(module => module.openChanges(robot, line.lamp, (kind === "inputs" ? "din." : "dout.") + line.number, word + " " + line.number));

  for (const [name, first, last] of GROUPS) {
    const cells = make("div", {class: "cells"});
    for (let number = first; number <= last; number += 1) {
      const line = {number, name: "", on: false, forced: false, call};
      line.text = make("span", {class: "name"});
      line.lamp = make("button", {type: "button", class: "line", tabindex: "-1",
        ...(LOCKED ? {"aria-pressed": "false", "aria-haspopup": "dialog", title: "Why? What has changed it, and when"} : {role: "switch", "aria-checked": "false", title: "Set or clear"})},
        make("i", {"aria-hidden": "true"}), String(number), line.text);
      line.more = make("button", {type: "button", class: "more", "aria-haspopup": "menu", tabindex: "-1", title: "Pulse, force, release"}, "\u22ee");
      line.cell = make("span", {class: "cell"}, line.lamp, LOCKED ? "" : line.more);
      line.lamp.addEventListener("click", () => { if (LOCKED) why(line); else call(line, "PUT", "", {on: !line.on}).catch(() => {}); });
      if (!LOCKED) line.lamp.addEventListener("contextmenu", event => { event.preventDefault(); menu.open(line, line.lamp); });
      line.more.addEventListener("click", () => menu.open(line, line.more));
      named(line);
      cells.append(line.cell);
      lines.set(number, line);
    }
    const group = make("div", {role: "group", "aria-label": title + ", " + name}, make("h4", {}, name + " " + first + "-" + last), cells);
    groups.push({element: group, cells});
    grid.append(group);
  }

  function named(line) {
    const label = word + " " + line.number + (line.name ? " " + line.name : "");
    mark(line.lamp, "aria-label", label + (line.forced ? ", forced" : ""));
    mark(line.more, "aria-label", "More for " + label);
  }

  // One stop of the tab key for the whole side; arrow keys go from line to line, Home and End to the first and last.
  let stop = lines.get(GROUPS[0][1]).lamp;
  stop.tabIndex = 0;
  function go(button) {
    stop.tabIndex = -1;
    stop = button;
    stop.tabIndex = 0;
  }
  grid.addEventListener("focusin", event => { if (event.target.matches("button")) go(event.target); });
  grid.addEventListener("keydown", event => {
    const buttons = [...grid.querySelectorAll("button")].filter(one => one.offsetParent);
    const at = buttons.indexOf(event.target);
    let next;
    if (event.key === "ArrowRight") next = buttons[at + 1];
    else if (event.key === "ArrowLeft") next = buttons[at - 1];
    else if (event.key === "Home") next = buttons[0];
    else if (event.key === "End") next = buttons.at(LOCKED ? -1 : -2);
    else if (event.key === "ArrowDown" || event.key === "ArrowUp") next = nextRow(buttons, event.target, event.key === "ArrowDown");
    else return;
    event.preventDefault();
    next?.focus();
  });

  /** The button of the same kind in the next row whose middle is nearest. */
  function nextRow(buttons, from, down) {
    const box = from.getBoundingClientRect();
    let best, least = Infinity;
    for (const button of buttons) {
      if (button.className !== from.className) continue;
      const other = button.getBoundingClientRect(), rows = (other.top - box.top) * (down ? 1 : -1);
      if (rows < box.height / 2) continue;
      const far = rows * 1000 + Math.abs(other.left - box.left);
      if (far < least) { least = far; best = button; }
    }
    return best;
  }

  return {
    element: make("section", {class: "side", "aria-label": title}, make("h3", {}, title), reason, none, grid),
    names(found) {
      for (const {line: number, name} of found) {
        const line = lines.get(number);
        if (!line || line.name === (name ?? "")) continue;
        line.name = name ?? "";
        say(line.text, line.name);
        mark(line.cell, "data-named", line.name !== "");
        named(line);
      }
    },
    state(found) {
      const on = new Set(found.on), forced = new Map(found.forced.map(one => [one.line, one.on]));
      for (const line of lines.values()) {
        const isForced = forced.has(line.number), isOn = isForced ? forced.get(line.number) : on.has(line.number);
        if (isOn === line.on && isForced === line.forced) continue;
        line.on = isOn;
        line.forced = isForced;
        mark(line.lamp, LOCKED ? "aria-pressed" : "aria-checked", isOn);
        mark(line.cell, "data-forced", isForced);
        named(line);
        menu.changed(line);
      }
    },
    filter(text, only) {
      let shown = 0;
      const wanted = text.trim().toLowerCase();
      for (const line of lines.values()) {
        const fits = (!wanted || String(line.number).startsWith(wanted) || line.name.toLowerCase().includes(wanted))
          && (!only || line.on || line.forced);
        line.cell.hidden = !fits;
        if (fits) shown += 1;
      }
      for (const group of groups) group.element.hidden = ![...group.cells.children].some(cell => !cell.hidden);
      none.hidden = shown > 0;
      if (!stop.offsetParent && shown) {
        const first = [...lines.values()].find(line => !line.cell.hidden);
        go(first.lamp);
      }
    },
  };
}

/** The menu of one line at a time. What is refused is said in it. */
function makeMenu() {
  const items = make("div", {role: "menu"}), reason = make("output", {class: "reason", role: "alert"});
  const element = make("div", {class: "menu", hidden: true}, items, reason);
  let line, from, at = 0;   // where the button was when the menu was opened
  function build() {
    items.replaceChildren(...choices(line).map(([label, method, path, body]) => make("button", {type: "button", role: "menuitem", tabindex: "-1",
      disabled: label === "Release" && !line.forced, onclick: async () => {
        say(reason, "");
        try { await line.call(line, method, path, body); close(true); } catch (error) { say(reason, error.message); }
      }}, label)));
  }
  function close(back) {
    if (element.hidden) return;
    element.hidden = true;
    if (back) from.focus();
    line = undefined;
  }
  element.addEventListener("keydown", event => {
    const all = [...items.children].filter(one => !one.disabled), at = all.indexOf(document.activeElement);
    if (event.key === "Escape" || event.key === "Tab") close(true);
    else if (event.key === "ArrowDown") all[(at + 1) % all.length].focus();
    else if (event.key === "ArrowUp") all[(at + all.length - 1) % all.length].focus();
    else return;
    if (event.key !== "Tab") event.preventDefault();
  });
  element.addEventListener("focusout", event => { if (event.relatedTarget && !element.contains(event.relatedTarget)) close(false); });
  document.addEventListener("pointerdown", event => { if (!element.hidden && !element.contains(event.target)) close(false); });
  // The event of a scroll that ended before the menu was opened may come after it.
  document.addEventListener("scroll", event => { if (line && !element.contains(event.target) && Math.abs(from.getBoundingClientRect().top - at) > 2) close(false); }, {capture: true, passive: true});
  return {
    element,
    close,
    changed(one) { if (one === line && !items.contains(document.activeElement)) build(); },
    open(one, button) {
      line = one;
      from = button;
      say(reason, "");
      build();
      mark(items, "aria-label", button.getAttribute("aria-label"));
      element.hidden = false;
      const box = button.getBoundingClientRect(), own = element.getBoundingClientRect();
      at = box.top;
      element.style.left = Math.max(4, Math.min(box.left, innerWidth - own.width - 4)) + "px";
      element.style.top = (box.bottom + own.height + 4 > innerHeight ? Math.max(4, box.top - own.height - 4) : box.bottom + 4) + "px";
      items.querySelector("button:enabled").focus({preventScroll: true});
    },
  };
}

export function create(robot) {
  const menu = makeMenu();
  const inputs = side(robot, "inputs", "Inputs", menu), outputs = side(robot, "outputs", "Outputs", menu);
  const search = make("input", {id: "lines-search", type: "search", placeholder: "number or name", autocomplete: "off"});
  const only = make("input", {id: "lines-only", type: "checkbox"});
  const rows = make("tbody");
  const table = make("table", {}, make("thead", {}, make("tr", {}, make("th", {scope: "col"}, "Field"), make("th", {scope: "col"}, "Value"),
    make("th", {scope: "col"}, "Meaning"))), rows);
  const frame = make("section", {class: "frame", "aria-label": "What the host sees"}, make("h3", {}, "What the host sees (status frame SF)"), table);
  const element = make("div", {class: "io"},
    make("div", {class: "row tools"}, make("label", {for: "lines-search"}, "Search"), search, make("label", {}, only, " only on or forced")),
    make("p", {class: "hint"}, LOCKED ? "Click a line, or press Enter, to list what has changed it. Arrow keys move."
      : "Click or press Space to set or clear. \u22ee pulses, forces and releases. Arrow keys move."),
    make("div", {class: "both"}, ifKnown(robot, ["inputs"], inputs.element, "Inputs"), ifKnown(robot, ["outputs"], outputs.element, "Outputs"), frame), menu.element);

  const filter = () => { inputs.filter(search.value, only.checked); outputs.filter(search.value, only.checked); };
  search.addEventListener("input", filter);
  only.addEventListener("change", filter);

  let shown = false, named = false;

  // Both are read again if a call fails: the token may be missing yet.
  async function names() {
    try {
      const found = await robot.get("lines");
      inputs.names(found.inputs);
      outputs.names(found.outputs);
      named = true;
      filter();
    } catch { /* at the next state */ }
  }
  const readFrame = atMost(FRAME_EVERY, async () => {
    if (!shown) return;
    try {
      const fields = await robot.get("status-frame");
      list(rows, fields, field => field.name, () => make("tr", {}, make("th", {scope: "row"}), make("td", {class: "mono"}), make("td")), (row, field) => {
        [field.name, field.value, field.meaning].forEach((text, at) => say(row.children[at], String(text ?? "")));
      });
    } catch (error) {
      // At the next state; of a recorded run it may not be known.
      if (LOCKED) list(rows, [error.message], words => words, words => make("tr", {}, make("td", {colspan: "3"}, words)));
    }
  });
  robot.on("settled", readFrame);
  return {
    element,
    state(state) {
      if (!shown) return;
      inputs.state(state.inputs);
      outputs.state(state.outputs);
      if (only.checked) filter();
      if (robot.busy) return;
      if (!named) names();
      readFrame();
    },
    show() {
      shown = true;
      if (robot.state) this.state(robot.state);
    },
    hide() { shown = false; menu.close(false); },
  };
}
