// A recorded run that is in the page: its events, its states and the courses of the arm between them. It answers what
// `ts3100 view` would, as far as the page has it; the rest says where to find it.
//
// The other side is crates/view/src/data.rs: one line of JSON and bytes after it, compressed. Everything is told as the
// difference from what came before.

import {Refusal} from "./feed.js";
import {firstOf} from "./lanes.js";

const KEPT = 200;        // states from one that is kept whole to the next
const CONTROLS = {2: "STX", 3: "ETX", 10: "LF", 13: "CR", 26: "EOF"};
const ELSEWHERE = "not in this file; open the recording with ts3100 view";

const hexOf = byte => byte.toString(16).padStart(2, "0");

/** Bytes as the emulator writes them for people: control codes by name. */
const readable = bytes => Array.from(bytes, byte => CONTROLS[byte] ? "<" + CONTROLS[byte] + ">"
  : byte >= 32 && byte < 127 ? String.fromCharCode(byte) : "<" + hexOf(byte).toUpperCase() + ">").join("");

function join(...parts) {
  const found = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    found.set(part, at);
    at += part.length;
  }
  return found;
}

/**
 * The bytes of all events. `b` of an event is how many of `raw` are taken, in order; or it tells them by those of the event so
 * many places `back`: with others around them, a part of them, or their begin and end around others.
 */
function bytesOf(events, raw) {
  const found = [];
  let taken = 0;
  const take = count => raw.subarray(taken, taken += count);
  events.forEach(({b}, place) => {
    if (b === undefined) return;
    if (!Array.isArray(b)) { found[place] = take(b); return; }
    const [back, ...more] = b, old = found[place - back];
    if (more.length === 2) found[place] = join(take(more[0]), old, take(more[1]));
    else if (more.length === 3) found[place] = old.slice(more[0], more[0] + more[1]);
    else found[place] = join(old.subarray(0, more[0]), take(more[2]), old.subarray(old.length - more[1]));
  });
  return found;
}

/** A JSON merge patch (RFC 7396); an object patches an array by places. Nothing of `target` is changed. */
function merge(target, patch) {
  if (patch === null || typeof patch !== "object" || Array.isArray(patch)) return patch;
  const found = Array.isArray(target) ? [...target] : target !== null && typeof target === "object" ? {...target} : {};
  for (const [key, value] of Object.entries(patch)) if (value === null) delete found[key]; else found[key] = merge(found[key], value);
  return found;
}

/** The values of a course at a time: a cubic curve between two knots, of which each has values and velocities. */
function along(course, passed) {
  const next = firstOf(course.length, at => course[at][0] > passed), [from, values, leaving] = course[Math.max(0, next - 1)];
  if (next >= course.length) return values;
  const [to, others, coming] = course[next], span = (to - from) / 1e6, part = (passed - from) / (to - from), square = part * part, cube = square * part;
  return values.map((value, at) => (2 * cube - 3 * square + 1) * value + (cube - 2 * square + part) * span * leaving[at]
    + (3 * square - 2 * cube) * others[at] + (cube - square) * span * coming[at]);
}

class Embedded {
  constructor({info, lanes, arm, rules, events, states, courses, motions, files}, raw) {
    Object.assign(this, {run: info, arm, rules, list: events, courses, motions, files, bytes: bytesOf(events, raw)});
    let t = 0, event = 0;
    this.times = events.map(({d}) => t += d ?? 0);
    t = 0;
    this.states = states.map(([passed, since, patch]) => [event += passed, t += since, patch]);
    this.whole = new Map([[0, states[0][2]]]);   // states that are kept, by number
    const numbers = kinds => events.flatMap((one, place) => kinds.includes(one.event) ? [place + 1] : []);
    this.begins = numbers(["reset", "restored"]);
    this.findings = numbers(["finding"]);
    this.all = lanes.map(lane => ({...lane, items: this.expand(lane.items)}));
  }

  /** The time of an event; before the first it is 0. */
  time(event) { return this.times[event - 1] ?? 0; }

  expand(items) {
    let last = 0;
    return items.map(([since, t, level, label, ...end]) => {
      const event = last += since;
      return [event, this.time(event) + t, level, label, ...(end.length ? [event + end[0], this.time(event + end[0]) + end[1]] : [])];
    });
  }

  async info() { return this.run; }
  async lanes() { return this.all; }

  /** The events as the control interface streams them. */
  async events(since, count) {
    return this.list.slice(since - 1, since - 1 + count).map(({d, b, ...event}, at) => {
      const place = since - 1 + at, bytes = this.bytes[place];
      return {seq: place + 1, t: this.times[place] / 1e6, ...this.rules[event.rule], ...event,
        ...(b === undefined ? {} : {text: readable(bytes), hex: Array.from(bytes, hexOf).join(""), bytes: bytes.length})};
    });
  }

  stateOf(number) {
    let from = number - number % KEPT;
    while (!this.whole.has(from)) from -= KEPT;
    let state = this.whole.get(from);
    for (let at = from + 1; at <= number; at += 1) {
      state = merge(state, this.states[at][2]);
      if (at % KEPT === 0) this.whole.set(at, state);
    }
    return state;
  }

  /** The number of the first event of the count of time that a moment is in. */
  begin({e}) { return this.begins[firstOf(this.begins.length, at => this.begins[at] > e) - 1] ?? 0; }

  /** Where the arm is, if it moves. */
  pose(moment, {arm}) {
    let at = firstOf(this.motions.length, one => this.motions[one][0] > moment.e) - 1;
    while (at >= 0 && this.motions[at][1] > moment.t) at -= 1;
    const [event, from, to, course] = this.motions[at] ?? [];
    if (event === undefined || event < this.begin(moment) || moment.t > to) return arm;
    const values = along(this.courses[course], moment.t - from), axes = arm.joints.length, places = axes + arm.world.length;
    const world = values.slice(axes, places), own = values.slice(places, -1);
    return {...arm, joints: values.slice(0, axes), world, work: own.length ? own : world, percent: values.at(-1)};
  }

  state(moment) {
    let at = firstOf(this.states.length, one => this.states[one][0] > moment.e) - 1;
    while (at > 0 && this.states[at][0] === moment.e && this.states[at][1] > moment.t) at -= 1;
    const state = this.stateOf(Math.max(0, at)), findings = {}, begin = this.begin(moment);
    for (const number of this.findings) {
      if (number > moment.e) break;
      const {rule, "caused-by": cause} = this.list[number - 1];
      if (number > begin && !cause) findings[rule] = (findings[rule] ?? 0) + 1;
    }
    return {...state, t: moment.t / 1e6, time_mode: "recorded", findings, arm: this.pose(moment, state)};
  }

  async read(moment, path) {
    const state = this.state(moment), [kind, name] = path.split("/");
    if (path === "state") return state;
    if (path === "arm" || path === "arm/pose") {
      const {arm, executed_line: executed, analysed_line: analysed, t} = state;
      return {...this.arm, ...arm, t, executed_line: executed, analysed_line: analysed, model: this.arm.model, path: []};
    }
    if (kind === "files" && name) {
      const wanted = decodeURIComponent(name), version = this.files.findLast(([event, of]) => of === wanted && event <= moment.e);
      if (typeof version?.[2] === "string") return {name: wanted, size: version[2].length, text: version[2]};
    }
    throw new Refusal(404, {error: ELSEWHERE});
  }

  /** Diagnostics are of the program that is written, not of the run; the fields of a text are elsewhere. */
  async compute(moment, path) {
    if (path === "check") return [];
    throw new Refusal(404, {error: ELSEWHERE});
  }

  /** The places at which a value of the state is another one than before. */
  places(value) {
    const found = [];
    let state = this.states[0][2], before = JSON.stringify(value(state));
    for (const [event, t, patch] of this.states.slice(1)) {
      state = merge(state, patch);
      const now = JSON.stringify(value(state));
      if (now !== before) found.push([event, t, now]);
      before = now;
    }
    return found;
  }

  async hits(line, file) {
    const found = this.places(state => state.executed_line === line && state.file === file && state.status === "running");
    return {hits: found.filter(([, , is]) => is === "true").map(([event, t]) => [event, t]), more: 0};
  }

  async changes(of) {
    const [, kind, name] = /^(\w+)[:.]?(.*)$/.exec(of), [, variable, element] = /^(.*?)(?:\((\d+)\))?$/.exec(name), number = Number(name);
    const isOn = ({on, forced}) => forced.find(one => one.line === number)?.on ?? on.includes(number);
    const valueOf = found => found && (element === undefined ? found.value : found.elements?.[Number(element)]);
    const value = {variable: state => valueOf(state.variables.find(one => one.name === variable)), din: state => isOn(state.inputs), dout: state => isOn(state.outputs),
      override: state => state.override_percent, mode: state => state.master_mode, servo: state => state.servo}[kind];
    const shown = text => ({true: "on", false: "off"})[text] ?? (text ?? "").replace(/^["[]|["\]]$/g, "");
    return {changes: this.places(value).map(([event, t, now]) => [event, t, shown(now)]), more: 0};
  }
}

/** Unpacks the recording of the page. */
export async function open() {
  const packed = Uint8Array.from(atob(document.getElementById("trace").textContent.trim()), sign => sign.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const all = new Uint8Array(await new Response(stream).arrayBuffer()), end = all.indexOf(10);
  return new Embedded(JSON.parse(new TextDecoder().decode(all.subarray(0, end))), all.subarray(end + 1));
}
