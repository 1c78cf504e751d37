// The operator panel: the key switch, the buttons and the lamps of the cabinet. What a call refuses stands beside its button.

import {make, button, mark, say} from "./dom.js";

/** Several of which one is on: `[word, label]`. */
function choice(label, words, call) {
  const buttons = words.map(([word, text]) => ({word, ...button(text, () => call(word), {role: "radio", "aria-checked": "false"})}));
  const group = make("div", {class: "row", role: "radiogroup", "aria-label": label}, ...buttons.map(one => one.element));
  const element = make("div", {class: "field"}, label, group);
  return {element, show: found => { for (const one of buttons) mark(one.button, "aria-checked", one.word === found); }};
}

/** Something that is on or off. */
function toggle(label, call, properties) {
  const made = button(label, () => call(made.button.getAttribute("aria-pressed") !== "true"), {"aria-pressed": "false", ...properties});
  return {...made, show: on => mark(made.button, "aria-pressed", on)};
}

export function create(robot) {
  const emergency = toggle("EMERGENCY STOP", pressed => robot.put("emergency-stop", {pressed}), {class: "emergency"});
  const key = choice("Key switch", [["teaching", "TEACHING"], ["internal", "INTERNAL"], ["ext", "EXT"]],
    position => robot.put("key-switch", {position}));
  const right = choice("Control right in EXT", [["ether", "Ethernet"], ["serial", "Serial"], ["signal", "Signals"]],
    holder => robot.put("control-right", {holder}));
  const servo = toggle("SERVO", on => robot.put("servo", {on}));
  const start = button("START", () => robot.post("program/start"), {class: "start"});
  const stop = button("STOP", () => robot.post("program/stop"), {class: "stop"});
  const hold = toggle("FEED HOLD", on => robot.put("feed-hold", {on}));
  const reset = button("ALARM RESET", () => robot.post("alarms/reset"));
  const lock = toggle("MACHINE LOCK", on => robot.put("machine-lock", {on}));
  const safety = toggle("Safety switch open", open => robot.put("safety-switch", {open}));
  const power = toggle("POWER", on => robot.post(on ? "power/on" : "power/off"));
  const file = make("p", {class: "mono"});
  const alarms = make("ul", {class: "alarms", "aria-label": "Active alarms"});
  const element = make("div", {class: "panel"},
    make("div", {class: "row"}, emergency.element, start.element, stop.element, servo.element),
    make("div", {class: "row"}, hold.element, reset.element, lock.element, safety.element, power.element),
    key.element, right.element, file, alarms);
  return {
    element,
    state(state) {
      emergency.show(state.emergency_stop);
      say(emergency.button, state.emergency_stop ? "Release EMERGENCY STOP" : "EMERGENCY STOP");
      key.show(state.key_switch);
      right.show(state.control_right);
      servo.show(state.servo);
      hold.show(state.feed_hold);
      lock.show(state.machine_lock);
      safety.show(state.safety_open);
      power.show(state.power);
      say(file, state.file ? state.file + ", line " + state.line + ": " + state.status : "no file selected");
    },
  };
}
