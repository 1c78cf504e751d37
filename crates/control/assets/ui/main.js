// Puts the page together: the bar, the arm, the tabs and the chosen view. A view is a module with `create(robot)`, which returns
// its element and what it wants to be told: `state(state)`, `pose(state)`, `tick()`, `event(event)`,
// `show(part)`, `hide()`.
//
// The arm is always there: beside the view from 700 pixels on, above it on a phone, unless it is hidden. Of a recorded run
// there is a timeline besides, and no Lab.

import {createBar} from "./bar.js";
import {EMBEDDED, LOCKED, make, say, mark, fixed, load, loadStyle} from "./dom.js";
import {Robot} from "./robot.js";
import {createSplit} from "./split.js";

const TITLES = {program: "Program", panel: "Panel", pendant: "Pendant", lines: "I/O", traffic: "Traffic", lab: "Lab"};
const VIEWS = Object.keys(TITLES).filter(name => !LOCKED || name !== "lab");
const TICK = 1000;   // after which a clock that runs is shown again, in ms

/** Puts together the page of a robot or of a recorded run. */
function begin(robot) {
  const views = new Map();
  const $ = id => document.getElementById(id);
  const bar = createBar(robot, $("bar"));

  /** The view, made when it is first looked at. */
  async function view(name, properties) {
    if (!views.has(name)) {
      const section = make("section", {id: "view-" + name, class: "view", ...properties});
      $("views").append(section);
      const styled = loadStyle(name + ".css");
      views.set(name, {section, told: {}, shown: false});
      const module = await load(name + ".js");
      const told = module.create(robot);
      await styled;
      section.append(told.element);
      views.get(name).told = told;
      if (robot.state) told.state?.(robot.state);
      if (views.get(name).shown) told.show?.(views.get(name).part);
    }
    return views.get(name);
  }

  async function setShown(name, shown, part, properties) {
    if (!shown && !views.has(name)) return;
    const made = views.has(name), found = await view(name, properties);
    if (found.shown === shown && (!shown || found.part === part)) return;
    Object.assign(found, {shown, part});
    found.section.hidden = !shown;
    if (shown && robot.state) found.told.state?.(robot.state);
    if (!shown) found.told.hide?.(); else if (made || found.told.show) found.told.show?.(part);
  }

  /** Shows the view of the address: `#traffic`, or `#traffic/findings` for a part of it. A moment of a recorded run may follow it. */
  function layout() {
    const [wanted, part] = location.hash.slice(1).split("?")[0].split("/"), chosen = VIEWS.includes(wanted) ? wanted : LOCKED && robot.view || VIEWS[0];
    robot.view = chosen;
    mark(document.body, "data-view", chosen);
    for (const name of VIEWS) {
      setShown(name, name === chosen, part, {role: "tabpanel", "aria-labelledby": "tab-" + name, tabindex: "0"});
      const tab = $("tab-" + name);
      mark(tab, "aria-selected", name === chosen);
      tab.tabIndex = name === chosen ? 0 : -1;
    }
  }

  /** Shows a view. Of a recorded run the address keeps its moment; it is shown at once, lest an event for it comes after another moment. */
  function choose(name) {
    if (!LOCKED) { location.hash = name; return; }
    history.pushState(null, "", "#" + name + robot.suffix);
    layout();
  }

  function tabs() {
    const made = VIEWS.map(name => make("button", {id: "tab-" + name, type: "button", role: "tab", "aria-controls": "view-" + name,
      onclick: () => choose(name)}, TITLES[name]));
    $("tabs").append(...made);
    $("tabs").addEventListener("keydown", event => {
      const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
      if (!step) return;
      const next = made[(made.indexOf(document.activeElement) + step + made.length) % made.length];
      next.focus();
      next.click();
      event.preventDefault();
    });
  }

  function clock() {
    if (robot.state && LOCKED) say($("clock"), fixed(robot.state.t, 3) + " s");
    else if (robot.state) say($("clock"), fixed(robot.runs ? Math.floor(robot.time()) : robot.state.t, robot.runs ? 0 : 2) + " s, " + robot.state.time_mode);
  }

  function linked(link) {
    const connected = link === "connected", token = link.endsWith("token");
    say($("link"), link === "token" ? "needs a token" : connected && LOCKED ? "recorded run" : link);
    mark($("link"), "data-kind", connected ? "ok" : "bad");
    mark(document.body, "data-link", connected);
    $("ask").hidden = !token;
    say($("told"), link === "wrong token" ? "The emulator refuses this token. Use the one of --control-token." : "The token of --control-token. It stays in this page.");
    $("gone").hidden = connected || token || link === "connecting";
    say($("gone"), LOCKED ? "ts3100 view does not answer. Start it again, and reload the page." : robot.state ? "The emulator does not answer. The page shows its last state, and connects again when the emulator is back."
      : "The emulator does not answer. The page connects when it does.");
    if (connected && !$("version").textContent) robot.get("version").then(found => say($("version"), found.version), () => {});
  }

  function told(kind, value) {
    for (const found of views.values()) if (found.shown) found.told[kind]?.(value);
  }

  robot.on("state", state => { bar.state(state); clock(); told("state", state); });
  robot.on("pose", state => { bar.state(state); clock(); told("pose", state); });
  robot.on("event", event => { for (const found of views.values()) found.told.event?.(event); });
  robot.on("text", file => told("text", file));
  robot.on("link", linked);
  setInterval(() => {
    if (document.hidden || !robot.state || !robot.runs) return;
    clock();
    told("tick");
  }, TICK);
  $("ask").addEventListener("submit", event => {
    event.preventDefault();
    robot.token = $("token").value;
    robot.link = "connecting";
    robot.look();
    robot.listen();
  });
  // A page in one file is without the documentation.
  if (EMBEDDED) document.querySelector("#top nav").hidden = true;
  const name = /\/robots\/([^/]+)\/$/.exec(location.pathname)?.[1];
  if (name) {
    say($("name"), decodeURIComponent(name));
    $("cell").href = "../../";
    $("cell").hidden = false;
    document.title = decodeURIComponent(name) + " - ts3100";
  }
  // What stays in sight below the bar is as high as the bar leaves room for.
  new ResizeObserver(() => document.documentElement.style.setProperty("--top", $("fixed").offsetHeight + "px")).observe($("fixed"));
  tabs();
  createSplit($("views"), on => setShown("arm", on, undefined, {"aria-label": "Robot"}));
  layout();
  addEventListener("hashchange", layout);
  // The view of the program takes files that are dropped anywhere on the page. It is loaded when one first comes.
  if (!LOCKED) addEventListener("dragenter", () => load("drop.js").then(module => module.takeDrops(robot)), {once: true});
  // The timeline listens to what the run tells when it starts.
  if (LOCKED) load("timeline.js").then(module => module.create(robot)).then(() => robot.start()); else robot.start();
}

if (LOCKED) load("recorded.js").then(module => module.open()).then(begin); else begin(new Robot());
