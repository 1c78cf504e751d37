// Files from the computer: dropped anywhere on the page or chosen, written onto the RAM drive, with what is wrong with them.

import {make, explained} from "./dom.js";

const LARGEST = 1_048_576;     // bytes of a file: the size of the drive
const EOF = 0x1a;              // ends a file on its way
const NOTICES = 4;             // files of which something is said
const NOTICE = 10_000;         // how long it is said, in ms

const said = make("ul"), close = make("button", {type: "button", "aria-label": "Close", onclick: () => hide()}, "\u00d7");
const notices = make("div", {class: "dropped", role: "status", hidden: true}, said, close);
let timer;

function hide() {
  notices.hidden = true;
  said.replaceChildren();
}

function notice(refused, ...words) {
  if (!notices.isConnected) document.body.append(notices);
  said.append(make("li", {class: refused ? "refused" : ""}, ...words));
  while (said.childElementCount > NOTICES) said.firstChild.remove();
  notices.hidden = false;
  clearTimeout(timer);
  timer = setTimeout(hide, NOTICE);
}

/** The name on the drive: as `ctl dl` makes it, pick.scol is PICK and user.par is USER.PAR. */
function driveName(name) {
  const upper = name.toUpperCase(), dot = upper.lastIndexOf(".");
  return upper.endsWith(".PAR") || dot < 1 ? upper : upper.slice(0, dot);
}

function bytes(data) {
  try { return {text: new TextDecoder("utf-8", {fatal: true, ignoreBOM: true}).decode(data)}; }
  catch { return {hex: [...data].map(byte => byte.toString(16).padStart(2, "0")).join(" ")}; }
}

const count = (number, word) => number + " " + word + (number === 1 ? "" : "s");

/** Writes a file onto the RAM drive, and says so with the number of its errors. */
export async function store(robot, file) {
  const name = driveName(file.name);
  try {
    if (file.size > LARGEST) throw new Error("it is larger than the RAM drive");
    const data = new Uint8Array(await file.arrayBuffer());
    // Files that were uploaded from a robot often still have their EOF.
    const stored = await robot.put("files/" + encodeURIComponent(name), bytes(data.at(-1) === EOF ? data.subarray(0, -1) : data));
    const found = name.endsWith(".PAR") ? [] : await robot.post("check", {file: name}), errors = found.filter(one => one.severity === "error");
    const words = [file.name + " is on the RAM drive as " + stored.name + ", " + stored.size + " bytes."];
    if (errors.length) words.push(" It has " + count(errors.length, "error") + ", the first in line " + errors[0].line + ": ", explained(errors[0].code), " " + errors[0].message + ".");
    notice(errors.length > 0, ...words);
  } catch (error) { notice(true, "cannot write " + file.name + " to the RAM drive: " + error.message); }
}

let takes = false;

/** Takes files that are dropped anywhere on the page. */
export function takeDrops(robot) {
  if (takes) return;
  takes = true;
  const target = make("div", {class: "drop", hidden: true}, "Drop here to write onto the RAM drive");
  document.body.append(target, notices);
  const files = event => event.dataTransfer?.types.includes("Files");
  addEventListener("dragenter", event => { if (files(event)) { event.preventDefault(); target.hidden = false; } });
  addEventListener("dragover", event => { if (files(event)) { event.preventDefault(); event.dataTransfer.dropEffect = "copy"; target.hidden = false; } });
  addEventListener("dragleave", event => { if (!event.relatedTarget) target.hidden = true; });
  addEventListener("drop", event => {
    if (!files(event)) return;
    event.preventDefault();
    target.hidden = true;
    for (const file of event.dataTransfer.files) store(robot, file);
  });
}
