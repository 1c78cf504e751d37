// The operator panel: the switches of the cabinet that are not in the bar.

import {LOCKED, ifKnown, make, button, choice, toggle} from "./dom.js";

export function create(robot) {
  const key = choice("Key switch", [["teaching", "TEACHING"], ["internal", "INTERNAL"], ["ext", "EXT"]],
    position => robot.put("key-switch", {position}));
  const right = choice("Control right in EXT", [["ether", "Ethernet"], ["rs232c", "Serial"], ["sig", "Signals"]],
    holder => robot.put("control-right", {holder}));
  const mode = choice("Operation mode", [["continuous", "Continuous"], ["cycle", "Cycle"], ["step", "Step"], ["segment", "Segment"]],
    mode => robot.put("run-mode", {mode}));
  const power = toggle("POWER", on => robot.post(on ? "power/on" : "power/off"), {class: "lit on", title: "Power of the controller"});
  const reset = button("ALARM RESET", () => robot.post("alarms/reset"), {title: "Reset the alarms whose cause has gone"});
  const restart = button("PROGRAM RESET", () => robot.post("program/reset"), {title: "Back to the first line of the program"});
  const lock = toggle("MACHINE LOCK", on => robot.put("machine-lock", {on}), {class: "lit attention", title: "Programs run, the arm does not move"});
  const safety = toggle("SAFETY SWITCH", open => robot.put("safety-switch", {open}), {class: "lit stopped", title: "Lit while it is open: servo power is off"});
  const battery = toggle("BATTERY LOW", low => robot.put("battery", {low}), {class: "lit attention", title: "The battery of the RAM drive"});
  const known = (field, made, label) => ifKnown(robot, [field], made.element, label);
  return {
    element: make("div", {class: "panel"}, LOCKED ? make("p", {class: "hint"}, "The panel as it was. Its keys cannot be pressed: " + LOCKED + ".") : "",
      make("div", {class: "keys"}, known("power", power, "POWER"), ...(LOCKED ? [] : [reset.element, restart.element]), known("machine_lock", lock, "MACHINE LOCK"),
        known("safety_open", safety, "SAFETY SWITCH"), known("battery_low", battery, "BATTERY LOW")),
      make("div", {class: "settings"}, known("key_switch", key, "Key switch"), known("control_right", right, "Control right in EXT"), known("run_mode", mode, "Operation mode"))),
    state(state) {
      key.show(state.key_switch);
      right.show(state.control_right);
      mode.show(state.run_mode);
      lock.show(state.machine_lock);
      safety.show(state.safety_open);
      battery.show(state.battery_low);
      power.show(state.power);
    },
  };
}
