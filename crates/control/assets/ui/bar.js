// The bar that is always in sight: the keys that start and stop the robot, what it does now, its alarms and the findings.

import {LOCKED, ifKnown, load, make, button, explained, list, mark, say, toggle} from "./dom.js";
import {place, status} from "./status.js";

/** The speed override. It is sent when the slider is let go, so that a drag is one call. */
function speed(robot) {
  const slider = make("input", {id: "speed", type: "range", min: "1", max: "100", step: "1", title: LOCKED ? "Not possible: " + LOCKED : "Speed override in percent", disabled: LOCKED !== ""});
  const shown = make("output", {for: "speed", class: "mono"}), reason = make("output", {class: "reason", role: "alert"});
  let dragged = false;
  slider.addEventListener("input", () => { dragged = true; say(shown, slider.value + " %"); });
  slider.addEventListener("change", async () => {
    say(reason, "");
    try { await robot.put("override", {percent: Number(slider.value)}); } catch (error) { say(reason, error.message); }
    dragged = false;
    if (robot.state) show(robot.state.override_percent);
  });
  function show(percent) {
    if (dragged) return;
    if (slider.value !== String(percent)) slider.value = percent;
    say(shown, percent + " %");
  }
  return {element: make("div", {class: "speed action"}, make("label", {for: "speed"}, "Speed"), slider, shown, reason), show};
}

const alarm = item => make("li", {}, make("strong", {}, explained(item.number, item.number + " " + item.text)), make("p", {}, item.cause), make("p", {}, "Remedy: " + item.remedy));

/** The alarms: the first in the bar, all with cause and remedy on a click. */
function alarms(robot) {
  const rows = make("ul", {"aria-label": "Active alarms"});
  const reset = button("ALARM RESET", async () => { await robot.post("alarms/reset"); }, {title: "Reset the alarms whose cause has gone"});
  const sheet = make("div", {id: "alarms", class: "sheet", hidden: true}, rows, reset.element);
  const opener = make("button", {type: "button", class: "alarm", hidden: true, "aria-expanded": "false", "aria-controls": "alarms", title: "Cause and remedy", onclick: () => open(sheet.hidden)});
  function open(on) {
    sheet.hidden = !on;
    mark(opener, "aria-expanded", on);
  }
  document.addEventListener("keydown", event => { if (event.key === "Escape" && !sheet.hidden) { open(false); opener.focus(); } });
  document.addEventListener("pointerdown", event => { if (!sheet.hidden && !sheet.contains(event.target) && !opener.contains(event.target)) open(false); });
  return {opener, sheet, show(found) {
    opener.hidden = !found.length;
    if (!found.length) return open(false);
    say(opener, found[0].number + " " + found[0].text + (found.length > 1 ? " and " + (found.length - 1) + " more" : ""));
    list(rows, found, item => item.number + item.text, alarm);
  }};
}

/** What else a glance has to show: [word, kind, tool tip]. */
function lamps(state, robot) {
  const mode = (field, title) => robot.known(field) ? [state[field], "off", title] : ["not known", "off", title + ": not known"];
  const found = [mode("master_mode", "Master mode: the column of the permission tables"), mode("run_mode", "Operation mode")];
  if (state.machine_lock) found.push(["machine lock", "warn", "Programs run, the arm does not move"]);
  if (state.battery_low) found.push(["battery low", "warn", "The battery of the RAM drive"]);
  return found;
}

export function createBar(robot, element) {
  const emergency = toggle("EMERGENCY STOP", pressed => robot.put("emergency-stop", {pressed}), {class: "emergency"});
  const file = make("small");
  const start = button("START", () => robot.post("program/start"), {class: "start"});
  start.button.append(" ", file);
  const stop = button("STOP", () => robot.post("program/stop"), {class: "stop", title: "Stop the program after its step"});
  const servo = toggle("SERVO", on => robot.put("servo", {on}), {class: "lit", title: "Servo power"});
  const hold = toggle("FEED HOLD", on => robot.put("feed-hold", {on}), {class: "lit hold", title: "Hold the motion under way"});
  const override = speed(robot), active = alarms(robot);
  const now = make("strong", {id: "now"}), where = make("span", {id: "where", class: "mono"}), shown = make("ul", {id: "lamps", "aria-label": "Modes"});
  const findings = make("a", {id: "findings", href: "#traffic/findings", hidden: true, title: "Mistakes of the host: show them in its traffic"});
  const known = (field, one, label) => ifKnown(robot, [field], one.element, label);
  element.append(known("emergency_stop", emergency, "EMERGENCY STOP"), start.element, stop.element, known("servo", servo, "SERVO"), known("feed_hold", hold, "FEED HOLD"),
    known("override_percent", override, "Speed"),
    make("div", {class: "told"}, make("p", {role: "status"}, now), make("div", {class: "more"}, where, shown)), active.opener, findings, active.sheet);
  // Of a recorded run: what has changed them.
  if (LOCKED) load("jumps.js").then(module => {
    const why = (of, title) => robot.info.kind === "robot" ? "" : module.whyButton(robot, of, title);
    servo.element.after(why("servo", "servo power"));
    override.element.append(why("override", "the speed override"));
    shown.after(why("mode", "the mode"));
  });

  return {
    state(state) {
      const [kind, words] = robot.known("status") ? status(state, robot.lines) : ["off", "status not known"];
      say(now, words);
      mark(now, "data-kind", kind);
      const at = robot.known("file") ? place(state) : "file not known", ready = !LOCKED && state.power && state.servo && !state.emergency_stop && !state.alarms.length && state.file && state.status !== "running";
      say(where, !robot.known("file") ? "" : state.file ? state.file + (state.executed_line || state.line ? " line " + (state.executed_line || state.line) : "") : "no file selected");
      say(file, at || "no file");
      mark(start.button, "data-ready", !!ready);
      if (!LOCKED) mark(start.button, "title", at ? "Start " + at : "Select a file first");
      emergency.show(state.emergency_stop);
      say(emergency.button, state.emergency_stop && !LOCKED ? "Release EMERGENCY STOP" : "EMERGENCY STOP");
      servo.show(state.servo);
      hold.show(state.feed_hold);
      override.show(state.override_percent);
      active.show(state.alarms);
      list(shown, lamps(state, robot), lamp => lamp[2], ([, , title]) => make("li", {class: "lamp", title}), (item, [word, lampKind]) => {
        say(item, word);
        mark(item, "data-kind", lampKind);
      });
      const count = Object.values(state.findings).reduce((sum, one) => sum + one, 0);
      findings.hidden = !count;
      say(findings, count + (count === 1 ? " finding" : " findings"));
    },
  };
}
