// The source of a file: its lines in colours, breakpoints, diagnostics, and the lines that are executed and that failed.

import {LOCKED, load, make, mark, say} from "./dom.js";
import {diagnostic} from "./editor.js";
import {splitLines} from "./feed.js";
import {coloured} from "./scol.js";

const LINES = 3000;            // lines that are shown
const COLOURED = 200_000;      // characters of a file that is coloured
// The arm is beside the source, and stays there. On a phone it is above: the page does not go away from it by itself.
const BESIDE = matchMedia("(min-width: 700px)");

/** The source: a row for each line. The gutter has one stop of the tab key; arrow keys move in it. */
export function makeSource(robot) {
  const element = make("div", {class: "source", role: "region", "aria-label": "Source", tabindex: "0"});
  const reason = make("output", {class: "reason", role: "alert"});
  const cut = make("p", {class: "empty", hidden: true});
  let rows = [], breakpoints = new Set(), executed = 0, analysed = 0, failed = 0, chosen = 1, onChoose = () => {};

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
    try {
      // A condition that a debugger has set is none of this page.
      const {rules = []} = await robot.get("breakpoints");
      take(await robot.put("breakpoints", {lines: [...next].sort((a, b) => a - b), rules: rules.filter(rule => next.has(rule.line))}));
    } catch (error) { say(reason, error.message); }
  }

  function take(found) {
    const next = new Set(found.lines);
    for (const line of new Set([...breakpoints, ...next])) if (!LOCKED && rows[line - 1]) mark(rows[line - 1].gutter, "aria-pressed", next.has(line));
    breakpoints = next;
  }

  element.addEventListener("keydown", event => {
    if (!event.target.matches(".gutter")) return;
    const step = {ArrowDown: 1, ArrowUp: -1, PageDown: 15, PageUp: -15, Home: -Infinity, End: Infinity}[event.key];
    if (step === undefined) return;
    event.preventDefault();
    choose(Math.max(1, Math.min(rows.length, chosen + step)), true);
  });

  /** Whether a row is in sight, below what is fixed. */
  function isSeen(row) {
    const {top, bottom} = row.element.getBoundingClientRect();
    return bottom > 0 && top < innerHeight;
  }

  function set(line, word, on) {
    const row = rows[line - 1];
    if (row) mark(row.element, word, on);
  }

  return {
    element: make("div", {}, element, cut, reason),
    get chosen() { return chosen; },
    set onChoose(call) { onChoose = call; },
    breakpoints: lines => take({lines}),
    choose,
    text(text, file) {
      const lines = splitLines(text), colour = text.length <= COLOURED;
      rows = lines.slice(0, LINES).map((line, at) => {
        const number = at + 1;
        const gutter = LOCKED ? make("button", {type: "button", class: "gutter", tabindex: "-1", "aria-label": "Line " + number + ", when it was executed", "aria-haspopup": "dialog",
          title: "When this line was executed", onclick: () => { choose(number); load("jumps.js").then(module => module.openHits(robot, gutter, number, file)); }}, String(number))
          : make("button", {type: "button", class: "gutter", tabindex: "-1", "aria-label": "Breakpoint, line " + number,
            "aria-pressed": String(breakpoints.has(number)), onclick: () => { choose(number); flip(number); }}, String(number));
        return {gutter, line, element: make("div", {class: "codeline"}, gutter, make("code", {}, ...(colour ? coloured(line) : [line])))};
      });
      element.replaceChildren(...rows.map(row => row.element));
      cut.hidden = lines.length <= LINES;
      say(cut, lines.length - LINES + " more lines are not shown.");
      executed = analysed = failed = 0;
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
    /** How the executed line looks: it runs, it waits, or a start continues there. */
    kind: kind => mark(element, "data-kind", kind),
    /** Marks the lines that are executed and analysed, and the one that has failed. What was in sight stays so. */
    lines(nextExecuted, nextAnalysed, nextFailed) {
      if (nextExecuted !== executed) {
        const old = rows[executed - 1], next = rows[nextExecuted - 1];
        set(executed, "data-executed", false);
        if (next && (old ? isSeen(old) : BESIDE.matches)) next.element.scrollIntoView({block: "nearest"});
        executed = nextExecuted;
        set(executed, "data-executed", true);
      }
      if (nextAnalysed !== analysed) {
        set(analysed, "data-analysed", false);
        analysed = nextAnalysed;
        set(analysed, "data-analysed", true);
      }
      if (nextFailed !== failed) {
        set(failed, "data-failed", false);
        failed = nextFailed;
        set(failed, "data-failed", true);
        if (BESIDE.matches) rows[failed - 1]?.element.scrollIntoView({block: "nearest"});
      }
    },
  };
}
