// Puts the page together: the header, the tabs and the views. A view is a module with `title` and `create(robot)`, which
// returns its element and what it wants to be told: `state(state)`, `event(event)`, `show()`, `hide()`.
//
// On a wide screen the robot and the operator panel stay beside the chosen view; elsewhere they are views like the others.

import {make, say, mark, list, fixed} from "./dom.js";
import {Robot} from "./robot.js";

const VIEWS = ["arm", "panel", "pendant", "program", "lines", "traffic", "lab"];
const PINNED = ["arm", "panel"];
const TITLES = {arm: "Robot", panel: "Panel", pendant: "Pendant", program: "Program", lines: "I/O", traffic: "Traffic", lab: "Lab"};
const WIDE = matchMedia("(min-width: 1100px)");

const robot = new Robot();
const views = new Map();
const $ = id => document.getElementById(id);
let chosen = "";

/** The view, made when it is first looked at. */
async function view(name) {
  if (!views.has(name)) {
    const section = make("section", {id: "view-" + name, class: "view", role: "tabpanel", "aria-labelledby": "tab-" + name, tabindex: "0"},
      make("h2", {}, TITLES[name]));
    $("views").append(section);
    document.head.append(make("link", {rel: "stylesheet", href: "ui/" + name + ".css"}));
    views.set(name, {section, told: {}, shown: false});
    const module = await import("./" + name + ".js");
    const told = module.create(robot);
    section.append(told.element);
    views.get(name).told = told;
    if (robot.state) told.state?.(robot.state);
    if (views.get(name).shown) told.show?.();
  }
  return views.get(name);
}

async function setShown(name, shown) {
  if (!shown && !views.has(name)) return;
  const found = await view(name);
  if (found.shown === shown) return;
  found.shown = shown;
  found.section.hidden = !shown;
  if (shown && robot.state) found.told.state?.(robot.state);
  if (shown) found.told.show?.(); else found.told.hide?.();
}

/** Shows the view of the address, and those that stay. */
function layout() {
  const wanted = location.hash.slice(1), wide = WIDE.matches;
  const choices = VIEWS.filter(name => !wide || !PINNED.includes(name));
  chosen = choices.includes(wanted) ? wanted : choices[0];
  mark(document.body, "data-wide", wide);
  for (const name of VIEWS) {
    setShown(name, name === chosen || (wide && PINNED.includes(name)));
    const tab = $("tab-" + name);
    tab.hidden = !choices.includes(name);
    mark(tab, "aria-selected", name === chosen);
    tab.tabIndex = name === chosen ? 0 : -1;
  }
}

function tabs() {
  const made = VIEWS.map(name => make("button", {id: "tab-" + name, type: "button", role: "tab", "aria-controls": "view-" + name,
    onclick: () => { location.hash = name; }}, TITLES[name]));
  $("tabs").append(...made);
  $("tabs").addEventListener("keydown", event => {
    const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
    if (!step) return;
    const open = made.filter(tab => !tab.hidden), at = open.indexOf(document.activeElement);
    const next = open[(at + step + open.length) % open.length];
    next.focus();
    next.click();
    event.preventDefault();
  });
}

/** The lamps in the header: [word, kind]. Kinds are ok, warn, bad and off. */
function lamps(state) {
  const found = [];
  if (!state.power) found.push(["power off", "bad"]);
  if (state.emergency_stop) found.push(["EMERGENCY STOP", "bad"]);
  if (state.safety_open) found.push(["safety switch open", "bad"]);
  for (const alarm of state.alarms) found.push([alarm.number + " " + alarm.text, "bad"]);
  if (state.battery_low) found.push(["battery low", "warn"]);
  if (state.feed_hold) found.push(["feed hold", "warn"]);
  if (state.machine_lock) found.push(["machine lock", "warn"]);
  found.push([state.servo ? "servo on" : "servo off", state.servo ? "ok" : "off"]);
  found.push([state.status, state.status === "running" ? "ok" : "off"]);
  found.push([state.master_mode, "off"]);
  found.push([state.run_mode, "off"]);
  return found;
}

function header(state) {
  list($("lamps"), lamps(state), lamp => lamp[0], () => make("li", {class: "lamp"}), (item, [word, kind]) => {
    say(item, word);
    mark(item, "data-kind", kind);
  });
  say($("clock"), fixed(state.t, 2) + " s, " + state.time_mode);
}

function linked(link) {
  say($("link"), link === "connected" ? "connected" : link === "token" ? "needs a token" : link);
  mark($("link"), "data-kind", link === "connected" ? "ok" : "bad");
  mark(document.body, "data-link", link === "connected");
  $("ask").hidden = link !== "token";
}

robot.on("state", header);
robot.on("link", linked);
robot.on("state", state => { for (const found of views.values()) if (found.shown) found.told.state?.(state); });
robot.on("event", event => { for (const found of views.values()) found.told.event?.(event); });
$("ask").addEventListener("submit", event => {
  event.preventDefault();
  robot.token = $("token").value;
  robot.look();
  robot.listen();
});
const name = /\/robots\/([^/]+)\/$/.exec(location.pathname)?.[1];
if (name) {
  say($("name"), decodeURIComponent(name));
  $("cell").href = "../../";
  $("cell").hidden = false;
  document.title = decodeURIComponent(name) + " - ts3100";
}
tabs();
layout();
addEventListener("hashchange", layout);
WIDE.addEventListener("change", layout);
// The view of the program takes files that are dropped anywhere on the page. It is loaded when one first comes.
addEventListener("dragenter", () => import("./program.js").then(module => module.takeDrops(robot)), {once: true});
robot.start();
