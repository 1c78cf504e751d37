// The operator panel: the key switch, the buttons and the lamps of the cabinet. What a call refuses stands beside its button.

import {make, button, explained, list, mark, say} from "./dom.js";

/** Several of which one is on: `[word, label]`. */
export function choice(label, words, call) {
  const buttons = words.map(([word, text]) => ({word, ...button(text, () => call(word), {role: "radio", "aria-checked": "false"})}));
  const group = make("div", {class: "choice", role: "radiogroup", "aria-label": label}, ...buttons.map(one => one.button));
  const element = make("div", {class: "field"}, label, group, ...buttons.map(one => one.reason));
  return {element, show: found => { for (const one of buttons) mark(one.button, "aria-checked", one.word === found); }};
}

/** Something that is on or off. */
export function toggle(label, call, properties) {
  const made = button(label, () => call(made.button.getAttribute("aria-pressed") !== "true"), {"aria-pressed": "false", ...properties});
  return {...made, show: on => mark(made.button, "aria-pressed", on)};
}

/** The override as a slider. It is sent when the slider is let go, so that a drag is one call. */
function override(robot) {
  const slider = make("input", {id: "override", type: "range", min: "1", max: "100", step: "1"});
  const shown = make("output", {for: "override", class: "mono"}), reason = make("output", {class: "reason", role: "alert"});
  const element = make("div", {class: "field"}, make("label", {for: "override"}, "Override"), make("div", {class: "override"}, slider, shown), reason);
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
  return {element, show};
}

function alarm(item) {
  return make("li", {}, make("strong", {}, explained(item.number, item.number + " " + item.text)), make("p", {}, item.cause), make("p", {}, "Remedy: " + item.remedy));
}

export function create(robot) {
  const emergency = toggle("EMERGENCY STOP", pressed => robot.put("emergency-stop", {pressed}), {class: "emergency"});
  const key = choice("Key switch", [["teaching", "TEACHING"], ["internal", "INTERNAL"], ["ext", "EXT"]],
    position => robot.put("key-switch", {position}));
  const right = choice("Control right in EXT", [["ether", "Ethernet"], ["rs232c", "Serial"], ["sig", "Signals"]],
    holder => robot.put("control-right", {holder}));
  const mode = choice("Run mode", [["continuous", "Continuous"], ["cycle", "Cycle"], ["step", "Step"], ["segment", "Segment"]],
    mode => robot.put("run-mode", {mode}));
  const speed = override(robot);
  const servo = toggle("SERVO", on => robot.put("servo", {on}), {class: "lit ok"});
  const start = button("START", () => robot.post("program/start"), {class: "start"});
  const stop = button("STOP", () => robot.post("program/stop"), {class: "stop"});
  const hold = toggle("FEED HOLD", on => robot.put("feed-hold", {on}), {class: "lit warn"});
  const reset = button("ALARM RESET", () => robot.post("alarms/reset"));
  const restart = button("PROGRAM RESET", () => robot.post("program/reset"));
  const lock = toggle("MACHINE LOCK", on => robot.put("machine-lock", {on}), {class: "lit warn"});
  const safety = toggle("SAFETY OPEN", open => robot.put("safety-switch", {open}), {class: "lit bad"});
  const power = toggle("POWER", on => robot.post(on ? "power/on" : "power/off"), {class: "lit ok"});
  const file = make("p", {class: "mono"});
  const alarms = make("ul", {class: "alarms", "aria-label": "Active alarms"});
  const keys = [start, stop, servo, hold, restart, reset, power, lock, safety].map(one => one.element);
  const element = make("div", {class: "panel"},
    make("div", {class: "deck"}, emergency.element, make("div", {class: "keys"}, ...keys)), alarms,
    make("div", {class: "settings"}, key.element, right.element, mode.element, speed.element), file);
  return {
    element,
    state(state) {
      emergency.show(state.emergency_stop);
      say(emergency.button, state.emergency_stop ? "Release EMERGENCY STOP" : "EMERGENCY STOP");
      key.show(state.key_switch);
      right.show(state.control_right);
      mode.show(state.run_mode);
      speed.show(state.override_percent);
      servo.show(state.servo);
      hold.show(state.feed_hold);
      lock.show(state.machine_lock);
      safety.show(state.safety_open);
      power.show(state.power);
      list(alarms, state.alarms, item => item.number, alarm);
      alarms.hidden = !state.alarms.length;
      say(file, state.file ? state.file + ", line " + state.line + ": " + state.status : "no file selected");
    },
  };
}
