// The card of the first visit: it is there while no file is selected, and says what to do first.

import {LOCKED, load, make, button, say} from "./dom.js";

const PROGRAM = /^(?!.*\.PAR$)/;   // files that are no parameters

export function createWelcome(robot) {
  let example = "";
  const run = button("Run the example", async () => {
    const {state} = robot;
    if (!state.power) await robot.post("power/on");
    if (!state.servo) await robot.put("servo", {on: true});
    await robot.post("files/" + encodeURIComponent(example) + "/select");
    await robot.post("program/start");
  }, {class: "primary"});
  const file = make("input", {type: "file", "aria-label": "Program to load", hidden: true});
  const loader = button("Load a file", () => file.click());
  file.addEventListener("change", async () => {
    const {store} = await load("drop.js");
    for (const one of file.files) await store(robot, one);
    file.value = "";
  });
  const lines = make("pre", {tabindex: "0", "aria-label": "Lines to paste"}), about = make("p");
  const element = make("section", {class: "welcome", "aria-label": "First steps", hidden: true}, make("h2", {}, "No file is selected"),
    make("ul", {},
      make("li", {}, run.element, about),
      make("li", {}, loader.element, file, make("p", {}, "A program in SCOL. You can also drop it anywhere on the page, or select one of the RAM drive below.")),
      make("li", {}, make("h3", {}, "Connect a host"), make("p", {}, "Your program talks to IP0. To try it, paste this into a terminal:"), lines),
      make("li", {}, make("a", {href: "book/", target: "_blank"}, "Open the book"), make("p", {}, "Tutorial, how-to guides and reference of this version, with a search."))));
  return {element, state(state) {
    element.hidden = state.file !== "" || LOCKED !== "";
    if (element.hidden) return;
    const programs = state.files.files.map(one => one.name).filter(name => PROGRAM.test(name));
    example = programs.includes("DEMO") ? "DEMO" : programs[0] ?? "";
    run.element.hidden = !example;
    say(about, !example ? "The RAM drive has no program yet." : "Selects " + example + ", turns the servo on, and presses START."
      + (state.time_mode === "stepped" ? " The clock is stepped: advance it in Lab to see the arm move." : ""));
    const port = state.channels.find(one => one.port === "IP0")?.accepts;
    say(lines, port ? "ts3100 host " + location.hostname + ":" + port + " su" : "IP0 is closed: turn the power on.");
  }};
}
