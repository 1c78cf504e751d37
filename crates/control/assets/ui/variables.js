// The variables of the selected file, with those that are local to its programs.

import {LOCKED, list, load, make, say} from "./dom.js";

const VARIABLES = 200;         // rows of variables
const DIGITS = 7;              // digits of a real
const ELEMENTS = 16;           // elements of an array that are listed

/** Coordinates with the four decimals that matter, a single number with all the digits that it has. */
export const shownValue = values => values.map(value => Number(values.length > 1 ? value.toFixed(4) : Number.isInteger(value) ? value : value.toPrecision(DIGITS))).join(", ");

/** The variables as rows: those of the programs under way first. Arrays have a row for each of their first elements; variables of programs, `PICK.COUNT`, are only read. */
function rowsOf({variables, tasks}) {
  const rows = [], open = new Set(tasks.flatMap(task => task.calls.map(call => call.program)));
  const owner = one => one.name.includes(".") ? one.name.split(".")[0] : "";
  const rank = one => open.has(owner(one)) ? 0 : owner(one) ? 2 : 1;
  for (const one of [...variables].sort((one, other) => rank(one) - rank(other))) {
    const kind = (one.kind ?? "") + (one.bounds.length ? " (" + one.bounds.map(bound => "0 to " + bound).join(", ") + ")" : "");
    if (one.elements) one.elements.slice(0, ELEMENTS).forEach((value, at) => rows.push({name: one.name + "(" + at + ")", kind, values: value, fixed: one.name.includes(".")}));
    else rows.push({name: one.name, kind, values: one.value, fixed: one.bounds.length > 0 || one.name.includes(".")});
  }
  return rows;
}

export function makeVariables(robot) {
  const rows = make("tbody");
  const search = make("input", {type: "search", "aria-label": "Find a variable", placeholder: "find", autocomplete: "off"});
  const more = make("p", {class: "empty", hidden: true});
  const table = make("table", {}, make("thead", {}, make("tr", {}, make("th", {scope: "col"}, "Name"), make("th", {scope: "col"}, "Value"))), rows);
  let last = [];

  function build(row) {
    // It grows with its value, so that a position is seen whole.
    const input = make("textarea", {"aria-label": "Value of " + row.name, rows: "1", autocomplete: "off", spellcheck: "false", readonly: LOCKED ? "" : undefined, title: LOCKED ? "Not possible to change: " + LOCKED : undefined});
    const reason = make("output", {class: "reason", role: "alert"});
    const back = () => { input.value = input.dataset.live ?? ""; };
    input.addEventListener("keydown", async event => {
      if (LOCKED) return;
      if (event.key === "Escape") { back(); say(reason, ""); input.blur(); }
      if (event.key !== "Enter") return;
      event.preventDefault();
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
    const name = make("th", {scope: "row", class: "mono"}, row.name, make("small"));
    if (LOCKED) load("jumps.js").then(module => name.append(module.whyButton(robot, "variable:" + row.name, row.name)));
    return make("tr", {}, name, make("td", {}, input, reason));
  }

  function draw() {
    const wanted = search.value.trim().toUpperCase(), fits = last.filter(row => row.name.toUpperCase().includes(wanted));
    list(rows, fits.slice(0, VARIABLES), row => row.name, build, (element, row) => {
      const input = element.querySelector("textarea"), value = row.values ? shownValue(row.values) : "";
      say(element.querySelector("small"), row.kind);
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
      table, more, LOCKED ? "" : make("p", {class: "hint"}, "Enter saves, Escape cancels. Variables of a program (PICK.I) can only be read.")),
    state(state) { last = rowsOf(state); draw(); },
  };
}
