// A recorded run as the page knows it: the moment that is shown, with its state, the events around it and its calls. It feeds
// the views as `Robot` does, but nothing can be changed.
//
// `go` moves to another moment. One reading is under way at a time; if there were several wishes meanwhile, the newest is read
// next. Nothing is asked for while nothing moves. Where the recording comes from is left to a source: `Served` asks
// `ts3100 view`, `Embedded` has it in the page.

import {EMBEDDED, LOCKED, load} from "./dom.js";
import {Feed, Refusal, splitLines} from "./feed.js";
import {Axis, Lane, momentOf} from "./lanes.js";

const BLOCK = 400;       // events that are read at a time
const BLOCKS = 100;      // blocks that are kept
const AROUND = 2;        // blocks of events on each side of that of the moment
const AGAIN = 250;       // until a recording that is still being opened is looked at again, in ms
const TAIL = 3;          // seconds of the path of the tool that are drawn
const NEAR = 5e5;        // microseconds to a moment that follows from the one before, unless it is played
const STEPS = 1500;      // within which steps are one entry of the history of the browser, in ms
const WRITTEN = 1000;    // between two addresses while it is played, in ms

const micros = seconds => Math.round(seconds * 1e6);
/** Seconds with as many decimals as the time has. */
export const seconds = t => (t / 1e6).toFixed(6).replace(/\.?0+$/, "");
const keyOf = ({e, t}) => (e || "") + "@" + seconds(t);

/** The recording as `ts3100 view` serves it. */
class Served {
  constructor() { this.feed = new Feed(); }
  ask(path) { return this.feed.get(path); }
  info() { return this.ask("trace"); }
  lanes() { return this.ask("trace/lanes"); }
  async events(since, count) { return (await this.ask("trace/events?since=" + since + "&count=" + count)).events; }
  read(moment, path) { return this.ask("moments/" + keyOf(moment) + "/" + path); }
  compute(moment, path, body) { return this.feed.post("moments/" + keyOf(moment) + "/" + path, body); }
  hits(line, file, until) { return this.ask("trace/hits?line=" + line + "&file=" + encodeURIComponent(file) + (until ? "&until=" + keyOf(until) : "")); }
  changes(of, until) { return this.ask("trace/changes?of=" + encodeURIComponent(of) + (until ? "&until=" + keyOf(until) : "")); }
}

export class Recorded extends Feed {
  constructor(source) {
    super();
    this.listeners.trace = [];
    this.source = source ?? new Served();
    this.blocks = new Map();
    this.lanes = [];
    this.wantsEvents = false;
    this.first = 0;           // number of the first event of `events`
    this.moment = undefined;  // what is shown
    this.busy = false;        // the moment moves, by a drag or by playing
    this.playing = false;
    this.factor = 1;
    this.continues = false;   // whether the moment follows from the one before without a jump
    this.pushed = -Infinity;
  }

  /** Shows the moment of the address. */
  async start() {
    this.setLink("connected");
    await Promise.all([this.fromAddress(), this.readLanes()]);
  }

  async readInfo() {
    const info = await this.source.info();
    for (const epoch of info.epochs.slice(1)) {
      // What begins an epoch belongs to it.
      const [begins] = await this.source.events(epoch.event - 1, 1);
      if (begins?.seq === epoch.event - 1 && ["reset", "restored"].includes(begins.event)) epoch.event -= 1;
    }
    Object.assign(this, {info, axis: new Axis(info.epochs)});
  }

  /** The lanes; while the recording is still being opened they grow. */
  async readLanes() {
    try {
      const {complete} = this.info;
      this.lanes = (await this.source.lanes()).map(lane => new Lane(lane, this.axis));
      this.emit("trace");
      if (complete) return;
      await this.readInfo();
    } catch { return this.setLink("not connected"); }
    setTimeout(() => this.readLanes(), AGAIN);
  }

  known(...fields) {
    const unknown = this.state?.unknown ?? this.info.unknown ?? [];
    return !fields.some(field => unknown.includes(field));
  }

  get runs() { return false; }
  time() { return this.state.t; }
  /** How much of the path of the tool is drawn, in s of virtual time. */
  get tail() { return TAIL * Math.max(1, this.playing ? this.factor : 1); }

  // Calls are those of the moment. What would change something is refused.

  async fetch(method) { throw new Refusal(409, {error: "cannot " + method + " anything: " + LOCKED}); }
  get(path) { return this.moment ? this.source.read(this.moment, path) : Promise.reject(new Refusal(0)); }
  async call(method, path, body) {
    if (method === "GET") return this.get(path);
    if (method === "POST" && ["check", "decode"].includes(path)) return this.source.compute(this.moment, path, body);
    throw new Refusal(409, {error: "cannot change this: " + LOCKED});
  }

  // Events. They are read in blocks of one size, so that none is read twice.

  block(number) {
    let block = this.blocks.get(number);
    if (!block) {
      block = this.source.events(number * BLOCK + 1, BLOCK).then(events => {
        if (events.length < BLOCK && !this.info.complete) this.blocks.delete(number);
        return events;
      }, error => { this.blocks.delete(number); throw error; });
      this.blocks.set(number, block);
      if (this.blocks.size > BLOCKS) this.blocks.delete(this.blocks.keys().next().value);
    }
    return block;
  }

  /** The event of a number, if there is one. */
  async event(number) {
    if (number < 1 || number > this.info.events) return undefined;
    return (await this.block(Math.floor((number - 1) / BLOCK)))[(number - 1) % BLOCK];
  }

  /** The last event at a time of an epoch. */
  async lastBy(epoch, t) {
    const place = this.axis.place(epoch, t), bounds = this.lanes.map(lane => lane.bounds(place)), {epochs} = this.axis;
    let low = Math.max(epochs[epoch].event - (epoch ? 0 : 1), ...bounds.map(([last]) => last));
    let high = Math.min((epochs[epoch + 1]?.event ?? this.info.events + 1), ...bounds.map(([, next]) => next + 1));
    while (high - low > 1) {
      const middle = (low + high) >> 1, event = await this.event(middle);
      if (event && micros(event.t) <= t) low = middle; else high = middle;
    }
    return low;
  }

  /** Reads the events around the moment, if they are not there yet; whether they are others now. */
  async readEvents({e}) {
    const middle = Math.floor(Math.max(0, e - 1) / BLOCK), last = Math.floor(Math.max(0, this.info.events - 1) / BLOCK);
    const isIn = block => this.first && this.first <= block * BLOCK + 1 && (this.events.at(-1)?.seq ?? 0) >= Math.min(this.info.events, (block + 1) * BLOCK);
    if (isIn(middle) && isIn(Math.max(0, middle - 1)) && isIn(Math.min(last, middle + 1))) return false;
    const from = Math.max(0, middle - AROUND), blocks = [];
    for (let block = from; block <= Math.min(last, middle + AROUND); block += 1) blocks.push(this.block(block));
    this.events = (await Promise.all(blocks)).flat();
    this.first = from * BLOCK + 1;
    return true;
  }

  // Moments.

  /** Shows another moment: `{epoch, t}` or `{epoch, t, e}`. `step` joins an entry of the history, `address` makes none. */
  go(wanted, {step = false, address = false, moving = false} = {}) {
    if (!moving) {
      this.playing = this.busy = false;
      const now = performance.now();
      this.entry = address ? "" : step && now - this.pushed < STEPS ? "replace" : "push";
      if (this.entry) this.pushed = now;
    }
    this.wanted = this.target = wanted;
    this.emit("moment", wanted);
    this.reading ??= this.readMoments();
    return this.reading;
  }

  async readMoments() {
    while (this.wanted) {
      const wanted = this.wanted;
      this.wanted = undefined;
      try {
        const moment = {...wanted, e: wanted.e ?? await this.lastBy(wanted.epoch, wanted.t)};
        const [state, others] = [await this.source.read(moment, "state"), this.wantsEvents && await this.readEvents(moment)];
        this.show(moment, state, others);
        this.setLink("connected");
      } catch (error) {
        this.setLink(error.status ? "refused: " + error.message : "not connected");
        this.playing = this.busy = false;
        this.emit("moment", this.moment);
      }
    }
    // A wish that comes from now on begins another reading.
    this.reading = undefined;
    if (!this.busy) await this.settle();
  }

  show(moment, state, others) {
    const before = this.moment, passed = before && moment.epoch === before.epoch ? moment.t - before.t : -1;
    this.continues = passed >= 0 && (this.playing || passed <= NEAR);
    // The robot says which time it is: a key may be beyond the next event.
    this.moment = {...moment, t: micros(state.t)};
    if (!this.wanted) this.target = this.moment;
    this.state = state;
    if (others) this.emit("reset");
    this.emit("moment", this.wanted ?? this.moment);
    this.emit("state", state);
    this.readSource();
  }

  /** The moment stays for a while: what is not read while it moves is read now. */
  async settle() {
    if (!this.moment) return;
    this.writeAddress();
    this.emit("settled", this.moment);
    if (!this.file || !this.known("files")) return;
    const {file, moment} = this, {text} = await this.get("files/" + encodeURIComponent(file)).catch(() => ({}));
    if (moment !== this.moment || file !== this.file || text === undefined || text === null) return;
    const lines = splitLines(text);
    if (lines.join("\n") === this.lines.join("\n")) return;
    this.lines = lines;
    this.emit("text", file);
    this.emit("state", this.state);
  }

  /** The moment moves with a pointer: it settles at the end. */
  drag(wanted) {
    this.playing = false;
    this.busy = true;
    this.go(wanted, {moving: true});
  }

  drop() {
    if (!this.busy) return;
    this.busy = false;
    this.entry = "push";
    if (!this.reading) this.settle();
  }

  /** Goes to the event before or after. */
  async step(forward) {
    const {e, t, epoch} = this.target?.e === undefined ? this.moment : this.target, own = await this.event(e);
    // Between two events the one before is that of the moment itself.
    const number = forward ? e + 1 : own && micros(own.t) < t && this.axis.epochOf(e) === epoch ? e : e - 1, event = await this.event(number);
    if (event) this.go({e: number, t: micros(event.t), epoch: this.axis.epochOf(number)}, {step: true});
    else if (!forward) this.toStart();
  }

  toStart() { this.go({epoch: 0, t: this.axis.epochs[0].begins, e: 0}, {step: true}); }
  toEnd() {
    const epoch = this.axis.epochs.length - 1;
    this.go({epoch, t: this.axis.epochs[epoch].ends}, {step: true});
  }

  /** Goes to an event. */
  async goToEvent(number) {
    const event = await this.event(number);
    if (event) this.go({e: number, t: micros(event.t), epoch: this.axis.epochOf(number)});
  }

  /** Whether somebody looks at the events around the moment. */
  async wantEvents(on) {
    this.wantsEvents = on;
    if (on && this.moment && await this.readEvents(this.moment)) this.emit("reset");
  }

  /** Goes to an item of a lane or of a list. */
  goTo(item, options) { this.go(momentOf(item, this.axis), options); }

  play() {
    if (this.playing || !this.moment) return;
    let place = this.axis.place(this.moment.epoch, this.moment.t), last = performance.now(), written = last;
    if (place >= this.axis.total) place = 0;
    this.playing = this.busy = true;
    this.emit("moment", this.moment);
    const frame = now => {
      if (!this.playing) return;
      const {epoch} = this.axis.at(place);
      place += Math.max(0, now - last) * 1000 * this.factor;
      last = now;
      // The gap between two epochs takes no time.
      if (place > this.axis.starts[epoch] + this.axis.lengths[epoch] && epoch + 1 < this.axis.starts.length) place = Math.max(place, this.axis.starts[epoch + 1]);
      this.go(this.axis.at(place), {moving: true});
      if (place >= this.axis.total) { this.entry = "replace"; return this.pause(); }
      if (now - written > WRITTEN) { written = now; this.entry = "replace"; this.writeAddress(); }
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  pause() {
    if (!this.busy) return;
    this.playing = this.busy = false;
    this.entry ||= "replace";
    this.emit("moment", this.wanted ?? this.moment);
    if (!this.reading) this.settle();
  }

  // The address: `#traffic?t=12.4&e=118`, or `#t=12.4&e=118`.

  get suffix() { return this.moment ? "?t=" + seconds(this.moment.t) + "&e=" + this.moment.e : ""; }

  writeAddress() {
    const wanted = "#" + this.view + this.suffix, entry = this.entry;
    this.entry = "";
    if (!entry || wanted === location.hash) return;
    // A page from a disk may not be allowed to.
    try { history[entry === "push" ? "pushState" : "replaceState"](null, "", wanted); } catch { /* the address stays */ }
  }

  /** Goes to the moment of the address; without one it stays, at first at the start. */
  async fromAddress() {
    const words = new URLSearchParams(location.hash.replace(/^#([^?=]*\?)?/, ""));
    const number = name => words.has(name) && /^\d+(\.\d+)?$/.test(words.get(name)) ? Number(words.get(name)) : undefined;
    let e = number("e"), t = number("t") === undefined ? undefined : micros(number("t"));
    if (e === undefined && t === undefined) {
      // A link to a view alone: the moment stays, and the address has it.
      if (this.moment) { this.entry = "replace"; return this.writeAddress(); }
      [e, t] = [0, this.axis.epochs[0].begins];
    }
    // A link can be to what has not been read yet.
    while (!this.info.complete && (e ?? Infinity) > this.info.events) await new Promise(done => setTimeout(done, AGAIN));
    if (e !== undefined) e = Math.min(Math.floor(e), this.info.events);
    const event = e && await this.event(e);
    if (event) t = Math.max(t ?? 0, micros(event.t));
    const {epochs} = this.axis, has = ({begins, ends}) => begins <= t && t <= ends;
    const epoch = e ? this.axis.epochOf(e) : Math.max(0, epochs.findIndex(has));
    t = Math.min(t ?? 0, e === undefined ? epochs[epoch].ends : Infinity);
    const now = this.target;
    if (now && e !== undefined && now.e === e && now.t === t) return;
    await this.go({epoch, t, ...(e === undefined ? {} : {e})}, {address: true});
  }
}

/** The recording of this page. */
export async function open() {
  const run = new Recorded(EMBEDDED ? await (await load("embedded.js")).open() : undefined);
  await run.readInfo();
  return run;
}
