// The start page of several robots: a card for each with its arm, program, alarms and findings, and what acts on all of them.
//
// One call tells which robots have alarms. The state is read of cards that are in view only, and never of a robot that has not
// started: a call would start it.

import {make, makeSvg, button, list, mark, say} from "./dom.js";
import {chain, floor, place, reach} from "./links.js";
import {Robot} from "./robot.js";
import {status} from "./status.js";

const PAUSE = 1000;       // between two readings of all lamps, in ms
const PER_ROBOT = 2;      // what each robot adds to it, in ms
const LIST = 10_000;      // between two readings of the list of robots, in ms
const CARDS = 1000;       // cards that are shown
const IN_FLIGHT = 4;      // postures that are read at a time
const FRESH = 1000;       // how long a posture counts as the present one, in ms
const AZIMUTH = 0.9, ELEVATION = 0.35;   // where the arms in small are seen from, in radians

const cell = new Robot();
const $ = id => document.getElementById(id);
const cards = new Map();      // name -> card
let robots = [], wired = new Set(), lamps = new Map(), listed = -Infinity, flying = 0, timer;

/** The arm in small, as lines that are as wide as its links. */
function silhouette(arm) {
  const size = reach(arm.model), low = floor(arm.model, arm.tool), c = Math.cos(AZIMUTH), s = Math.sin(AZIMUTH);
  const seen = ([x, y, z]) => [x * s + y * c, -(z - low) * Math.cos(ELEVATION) + (x * c - y * s) * Math.sin(ELEVATION)].map(one => one.toFixed(0));
  const parts = chain(arm.model, arm.joints, arm.tool).parts.filter(part => part.kind !== "hub" || part.axis < 0);
  const lines = parts.map(part => {
    const [[x1, y1], [x2, y2]] = [part.from, part.to].map(point => seen(place(part.matrix, point)));
    return makeSvg("line", {x1, y1, x2, y2, "stroke-width": (part.r[0] + part.r[1]).toFixed(0), class: part.kind});
  });
  const high = arm.model.kind === "scara" ? arm.model.axes[2].max - low + size * .6 : size;
  return makeSvg("svg", {viewBox: [-.72 * size, -high, 1.44 * size, high + size * .27].map(one => one.toFixed(0)).join(" "), "aria-hidden": "true"},
    makeSvg("ellipse", {cx: 0, cy: 0, rx: (size * .7).toFixed(0), ry: (size * .7 * Math.sin(ELEVATION)).toFixed(0)}), ...lines);
}

const path = name => "robots/" + encodeURIComponent(name) + "/";

/** Tells which cards are in view. */
const views = new IntersectionObserver(entries => {
  for (const entry of entries) cards.get(entry.target.dataset.key).inView = entry.isIntersecting;
  readPostures();
});

function build(robot) {
  const picture = make("span", {class: "picture"}), now = make("p", {class: "now"}), more = make("p", {class: "more mono"}), words = make("ul", {class: "lamps"});
  const element = make("li", {}, make("a", {href: path(robot.name)}, make("strong", {}, robot.name)), picture, now, more, words);
  cards.set(robot.name, {element, picture, now, more, words, name: robot.name, inView: false, read: -Infinity});
  views.observe(element);
  return element;
}

/** What else the card of a robot has to show: [word, kind]. */
function shownLamps(found, state) {
  const words = state.alarms.map(alarm => [alarm.number + " " + alarm.text, "bad"]);
  const findings = Object.values(state.findings).reduce((sum, one) => sum + one, 0);
  if (findings) words.push([findings + (findings === 1 ? " finding" : " findings"), "warn"]);
  words.push([state.servo ? "servo on" : "servo off", state.servo ? "ok" : "off"], [state.master_mode, "off"]);
  if (found?.peers) words.push([found.peers + (found.peers === 1 ? " peer" : " peers"), "off"]);
  return words;
}

function drawCard(card, robot) {
  const {state} = card, [kind, words] = state ? status(state) : ["off", robot.started ? "" : "starts when first used"];
  say(card.now, words);
  mark(card.now, "data-kind", kind);
  say(card.more, (state?.file ? state.file + " line " + (state.executed_line || state.line) + ", " : state ? "no file selected, " : "") + "IP0 " + (robot.ports.ip0 ?? "closed"));
  list(card.words, state ? shownLamps(lamps.get(robot.name), state) : [], lamp => lamp[0], () => make("li", {class: "lamp"}), (item, [word, lampKind]) => {
    say(item, word);
    mark(item, "data-kind", lampKind);
  });
}

function draw() {
  const wanted = $("find").value.trim().toLowerCase();
  const fits = robots.filter(robot => !wanted || robot.name.toLowerCase().includes(wanted) || Object.values(robot.ports).some(address => address.includes(wanted)));
  const alarms = robot => lamps.get(robot.name)?.alarms_active ? 0 : 1;
  if ($("alarms-first").checked) fits.sort((a, b) => alarms(a) - alarms(b));
  list($("robots"), fits.slice(0, CARDS), robot => robot.name, build, (element, robot) => {
    drawCard(cards.get(robot.name), robot);
    mark(element, "data-started", robot.started);
  });
  for (const [name, card] of cards) if (!card.element.isConnected) { views.unobserve(card.element); cards.delete(name); }
  const started = robots.filter(robot => robot.started).length, bad = [...lamps.values()].filter(one => one.alarms_active).length;
  say($("count"), robots.length + (robots.length === 1 ? " robot, " : " robots, ") + started + " started" + (bad ? ", " + bad + " with alarms" : ""));
  $("more").hidden = fits.length <= CARDS;
  say($("more"), fits.length - CARDS + " more are not shown; find them by their name.");
}

/** Reads the posture of cards in view, the oldest first. */
function readPostures() {
  const started = new Set(robots.filter(robot => robot.started).map(robot => robot.name)), now = performance.now();
  const due = [...cards.values()].filter(card => card.inView && !card.busy && started.has(card.name) && now - card.read > FRESH);
  due.sort((a, b) => a.read - b.read);
  for (const card of due.slice(0, IN_FLIGHT - flying)) readPosture(card);
}

async function readPosture(card) {
  flying += 1;
  card.busy = true;
  try {
    card.arm ??= await cell.get(path(card.name) + "arm");
    card.state = await cell.get(path(card.name) + "state");
    drawCard(card, robots.find(robot => robot.name === card.name));
    const joints = card.state.arm.joints, shown = joints.join();
    if (shown !== card.shown) {
      card.shown = shown;
      card.picture.replaceChildren(silhouette({...card.arm, joints: card.arm.joints.map((old, at) => joints[at] ?? old)}));
    }
  } catch { /* again later */ }
  card.read = performance.now();
  card.busy = false;
  flying -= 1;
  if (!document.hidden) readPostures();
}

/** The gauges of the metrics by robot: `ts3100_servo{robot="a"} 1`. */
function gauges(text) {
  const found = new Map();
  for (const [, name, robot, value] of text.matchAll(/^ts3100_(power|servo|running|alarms_active|peers)\{robot="([^"]*)"\} (\S+)/gm))
    found.set(robot, {...found.get(robot), [name]: Number(value)});
  return found;
}

async function look() {
  clearTimeout(timer);
  if (document.hidden) return;
  try {
    if (performance.now() - listed > LIST) {
      ({robots} = await cell.get("robots"));
      listed = performance.now();
    }
    lamps = gauges(await cell.get("metrics"));
    // A robot that has metrics has started.
    for (const robot of robots) robot.started ||= lamps.has(robot.name);
    await readWires();
    cell.setLink("connected");
    draw();
    readPostures();
  } catch (error) {
    if (error.status !== 401) cell.setLink(error.status ? "refused: " + error.message : "not connected");
  }
  timer = setTimeout(look, PAUSE + PER_ROBOT * robots.length);
}

async function readWires() {
  const {wires} = await cell.get("wires");
  $("wires").hidden = !wires.length;
  wired = new Set(wires.flatMap(wire => [wire.from, wire.to]).map(end => end.split(".")[0]));
  list($("levels"), wires, wire => wire.from + " " + wire.to, wire => {
    const outside = wire.from.startsWith("outside.") ? wire.from.slice("outside.".length) : undefined;
    const level = outside ? button("", () => cell.put("wires/outside/" + encodeURIComponent(outside), {on: level.button.getAttribute("aria-pressed") !== "true"}).then(look),
      {"aria-label": wire.from}) : undefined;
    return make("tr", {}, make("th", {scope: "row", class: "mono"}, wire.from), make("td", {class: "mono"}, wire.to), make("td", {}, level?.element ?? make("span", {class: "lamp"})));
  }, (row, wire) => {
    const level = row.querySelector("button") ?? row.querySelector(".lamp");
    say(level, wire.on ? "on" : "off");
    if (level.tagName === "BUTTON") mark(level, "aria-pressed", wire.on); else mark(level, "data-kind", wire.on ? "ok" : "off");
  });
}

/** Does the same to every robot that has started, or to those of `some`. Those that refuse it are named. */
async function toAll(call, some = robots) {
  const refused = [];
  await Promise.all(some.filter(robot => robot.started).map(robot => call(path(robot.name)).catch(error => refused.push(robot.name + ": " + error.message))));
  for (const card of cards.values()) card.read = -Infinity;
  look();
  if (refused.length) throw new Error(refused.join("; "));
}

/** Robots with wires have one time: it is advanced at the first of them. */
const clocks = () => {
  const first = robots.find(robot => wired.has(robot.name));
  return robots.filter(robot => robot === first || !wired.has(robot.name));
};

const all = [
  button("STOP ALL", () => toAll(robot => cell.post(robot + "program/stop")), {class: "stop", title: "Press STOP at every robot that has started"}),
  button("RESET ALL", () => toAll(async robot => { await cell.post(robot + "alarms/reset"); await cell.post(robot + "program/reset"); }), {title: "Reset the alarms and the program of every robot that has started"}),
  button("Stop the clock", () => toAll(robot => cell.put(robot + "clock", {mode: "stepped"})), {title: "Time passes only when it is advanced"}),
  button("Let time pass", () => toAll(robot => cell.put(robot + "clock", {mode: "real"})), {title: "As wall-clock time"}),
  button("Advance 1 s", () => toAll(robot => cell.post(robot + "clock/advance", {seconds: 1}), clocks()), {title: "Advance the time of every robot"}),
];
$("all").append(...all.map(one => one.element));
cell.on("link", link => {
  say($("link"), link === "token" ? "needs a token" : link);
  mark($("link"), "data-kind", link === "connected" ? "ok" : "bad");
  $("ask").hidden = !link.endsWith("token");
  say($("told"), link === "wrong token" ? "The emulator refuses this token. Use the one of --control-token." : "The token of --control-token. It stays in this page.");
  if (link === "connected" && !$("version").textContent) cell.get("version").then(found => say($("version"), found.version), () => {});
});
$("ask").addEventListener("submit", event => {
  event.preventDefault();
  cell.token = $("token").value;
  cell.link = "connecting";
  look();
});
$("choose").addEventListener("submit", event => event.preventDefault());
$("find").addEventListener("input", draw);
$("alarms-first").addEventListener("change", draw);
document.addEventListener("visibilitychange", look);
look();
