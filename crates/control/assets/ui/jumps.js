// The moments of a recorded run at which something happened to one thing: a line of the program was executed, a variable or a
// digital line changed and what changed it. They appear beside what was asked about, and lead there.

import {make, mark, say} from "./dom.js";
import {seconds} from "./recorded.js";

const NEAR = 4;          // moments that are listed on each side
const COUNTS = ["never", "once", "twice"];
const times = count => COUNTS[count] ?? count + " times";

/** Of each thing that was asked about, its moments: they are read once. */
const known = new Map();
let shown;

/** How many of the items were by the moment. */
const place = (items, {e, t, epoch}, axis) => items.filter(one => {
  const at = axis.epochOf(one[0]);
  return at < epoch || at === epoch && (one[1] < t || one[1] === t && one[0] <= e);
}).length;

function build() {
  const title = make("h3", {}), told = make("p"), list = make("ol"), reason = make("output", {class: "reason", role: "alert"});
  const key = (label, step) => make("button", {type: "button", onclick: () => step()}, label);
  const jump = item => { if (item) shown.robot.goTo(item); };
  const previous = key("\u25c0 Previous", () => jump(shown.items[shown.at - 1 - (shown.isOn ? 1 : 0)]));
  const next = key("Next \u25b6", () => jump(shown.items[shown.at]));
  const close = key("Close", () => hide(true));
  const element = make("section", {class: "jumps", hidden: true}, title, told, make("div", {class: "row"}, previous, next, close), list, reason);
  document.body.append(element);

  function hide(back) {
    if (element.hidden) return;
    element.hidden = true;
    mark(shown.from, "aria-expanded", false);
    if (back) shown.from.focus();
    shown = undefined;
  }

  /** Which count of time it is, where there are several. */
  const part = ([event]) => shown.robot.axis.epochs.length > 1 ? ", part " + (shown.robot.axis.epochOf(event) + 1) : "";

  function draw() {
    if (!shown?.items) return;
    const {items, robot, words} = shown, moment = robot.target ?? robot.moment, at = shown.at = place(items, moment, robot.axis), last = items[at - 1];
    shown.isOn = last?.[0] === moment.e && last?.[1] === moment.t;
    say(told, words(items, at, shown.more));
    previous.disabled = at - 1 - (shown.isOn ? 1 : 0) < 0;
    next.disabled = at >= items.length;
    // A key at its end gives the focus on.
    if (document.activeElement?.disabled) (next.disabled ? previous.disabled ? close : previous : next).focus({preventScroll: true});
    const from = Math.max(0, at - NEAR);
    list.replaceChildren(...items.slice(from, at + NEAR).map((item, number) => make("li", {"data-now": String(from + number === at - 1)},
      make("button", {type: "button", onclick: () => jump(item)}, seconds(item[1]) + " s" + part(item)), " ", item.slice(2).filter(Boolean).join(", "))));
  }

  function put() {
    const box = shown.from.getBoundingClientRect(), own = element.getBoundingClientRect(), high = innerHeight - (document.getElementById("timeline")?.offsetHeight ?? 0);
    element.style.left = Math.max(4, Math.min(box.left, innerWidth - own.width - 4)) + "px";
    element.style.top = Math.max(4, box.bottom + own.height + 4 > high ? Math.min(box.top, high) - own.height - 4 : box.bottom + 4) + "px";
  }

  document.addEventListener("keydown", event => { if (event.key === "Escape") hide(true); });
  document.addEventListener("pointerdown", event => {
    if (shown && !element.contains(event.target) && !shown.from.contains(event.target) && !document.getElementById("timeline")?.contains(event.target)) hide(false);
  });
  /** Of a thing that has more moments than can be read, those around another moment. */
  async function again() {
    if (!shown?.more) return;
    const asked = shown, found = await asked.read(asked.robot.moment).catch(() => undefined);
    if (asked !== shown || !found) return;
    Object.assign(shown, found, {more: true});
    draw();
  }

  return {hide, draw, again, async open(wanted) {
    const same = shown?.from === wanted.from;
    hide(same);
    if (same) return;
    shown = wanted;
    mark(wanted.from, "aria-expanded", true);
    mark(element, "aria-label", wanted.title);
    say(title, wanted.title);
    say(told, "reading");
    say(reason, "");
    list.replaceChildren();
    previous.disabled = next.disabled = true;
    element.hidden = false;
    put();
    try {
      const found = await (known.get(wanted.key) ?? read(wanted));
      if (shown !== wanted) return;
      Object.assign(wanted, found);
      draw();
      await again();
    } catch (error) {
      if (shown !== wanted) return;
      say(told, "");
      say(reason, error.message);
    }
    put();
    (previous.disabled ? close : previous).focus({preventScroll: true});
  }};
}

function read(next) {
  const found = next.read();
  if (next.robot.info.complete) {
    known.set(next.key, found);
    found.catch(() => known.delete(next.key));
  }
  return found;
}

let popover;

function open(robot, next) {
  if (!popover) {
    popover = build();
    robot.on("moment", () => popover.draw());
    robot.on("settled", () => popover.again());
  }
  return popover.open({robot, ...next});
}

/** The items of an answer and what is beyond them: all, or the last until a moment with the next after it. */
const taken = (items, {next, more}) => ({items: next ? [...items, next] : items, more});

/** When a line of a file was executed. */
export function openHits(robot, from, line, file) {
  return open(robot, {from, key: "line " + line + " " + file, title: "Line " + line, read: async until => {
    const found = await robot.source.hits(line, file, until);
    // A line of the main program is the usual: no word needed.
    return taken(found.hits.map(([event, t, , task]) => [event, t, task === "the main program" ? "" : task]), found);
  }, words: (items, at, more) => more ? "Executed very often: the times around this moment." : "Executed " + times(items.length) + (items.length ? ", until now " + times(at) : "") + "."});
}

/** The changes of a thing, `variable:N` or `din.3`, and what has changed it. */
export function openChanges(robot, from, of, title) {
  return open(robot, {from, key: of, title, read: async until => {
    const found = await robot.source.changes(of, until);
    return taken(found.changes, found);
  }, words: (items, at) => {
    if (!items.length) return "Not changed in this run.";
    if (!at) return "Not changed until now. It changes " + times(items.length) + ".";
    const [, t, value, cause] = items[at - 1];
    return "Last changed at " + seconds(t) + " s, to " + value + (cause ? ", by " + cause : "") + ".";
  }});
}

/** A small button that says why something is as it is. */
export function whyButton(robot, of, title) {
  const why = make("button", {type: "button", class: "why", "aria-haspopup": "dialog", "aria-expanded": "false", title: "Why? What has changed " + title + ", and when",
    "aria-label": "Why? Changes of " + title, onclick: () => openChanges(robot, why, of, title)}, "why?");
  return why;
}
