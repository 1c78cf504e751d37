// The robot as the page knows it: calls, the stream of events, and one state for everything that is shown.
//
// The stream says when the state may have changed, so nothing is asked for while nothing happens. While the arm moves, its
// pose is read once a frame and put into the state: every number on the page is of the same moment. Nothing is read while the
// page is hidden.

import {Feed} from "./feed.js";

const PAUSE = 2000;      // before the stream of events is opened again, in ms
const BUSY = 100;        // between two readings of the whole state, in ms
const LINGER = 400;      // how long the pose is still read after the arm has come to rest, in ms
const SILENCE = 8000;    // after which a stream or a reading without a byte is given up, in ms; the stream has one each 5 s
const KEPT = 5000;       // events kept for views that are opened later
const KNOWN = 2000;      // within which a stream that goes on repeats the last event, in ms

/** Where a motion is held, and what may hold it: while this is the same, the arm rests. */
const heldAt = ({arm, feed_hold: hold, status}) => String([arm.joints, hold, status]);

export class Robot extends Feed {
  constructor(base) {
    super(base);
    this.next = 1;       // number of the next event
    this.started = false;
    this.read = -BUSY;   // when the state was read
  }

  /** As of every feed; the state is read again after everything but GET. */
  async call(method, path, body, options) {
    const found = await super.call(method, path, body, options);
    if (method !== "GET" && this.started) this.lookSoon();
    return found;
  }

  get(path) { return this.call("GET", path, undefined, {signal: AbortSignal.timeout(SILENCE)}); }

  /** Begins to read; ends never. */
  start() {
    this.started = true;
    document.addEventListener("visibilitychange", () => { if (!document.hidden) { this.look(); this.listen(); } });
    this.look();
    this.listen();
  }

  /** Virtual time now. It continues between two readings of the state: nothing is asked for to show it. */
  time() {
    const {t, time_mode: mode} = this.state, factor = mode === "real" ? 1 : Number(/^x(\d+)/.exec(mode)?.[1] ?? 0);
    return this.link === "connected" ? t + factor * (performance.now() - this.shown) / 1000 : t;
  }

  /** Whether time passes by itself. */
  get runs() { return /^(real|x)/.test(this.state.time_mode); }

  /** The state is read again, at most ten times a second. */
  lookSoon() {
    if (this.timer === undefined) this.timer = setTimeout(() => this.look(), Math.max(0, this.read + BUSY - performance.now()));
  }

  async look() {
    clearTimeout(this.timer);
    this.timer = undefined;
    if (document.hidden) return;
    if (this.looking) { this.again = true; return; }
    this.looking = true;
    this.again = false;
    this.read = performance.now();
    let state;
    try {
      state = await this.get("state");
      this.setLink("connected");
    } catch (error) {
      // With a token the form asks again.
      if (error.status === 401) { this.looking = false; return; }
      this.setLink(error.status ? "refused: " + error.message : "not connected");
    }
    this.looking = false;
    if (state) {
      this.state = state;
      this.shown = performance.now();
      this.emit("state", state);
      this.readSource();
      if (!state.arm.moving) this.rest = "";
      else if (this.rest !== heldAt(state)) this.follow();
    } else setTimeout(() => this.lookSoon(), PAUSE);
    if (this.again) this.lookSoon();
  }

  /** Reads the pose once a frame until the arm rests. A motion that is held, or whose time stands still, rests. */
  async follow() {
    if (this.following) return;
    this.following = true;
    this.rest = "";
    let moved = performance.now(), last = "";
    while (!document.hidden && this.link === "connected" && performance.now() - moved < LINGER) {
      await new Promise(requestAnimationFrame);
      if (this.looking) continue;
      if (performance.now() - this.read > BUSY && this.timer === undefined) this.look();
      else await this.readPose();
      const shown = String(this.state.arm.joints);
      if (last !== (last = shown)) moved = performance.now();
    }
    this.rest = heldAt(this.state);
    this.following = false;
  }

  async readPose() {
    const before = this.state;
    let pose;
    try { pose = await this.get("arm/pose"); } catch { return; }
    // A whole state that was read meanwhile is newer.
    if (this.state !== before) return;
    const {joints, world, work, moving, percent} = pose;
    this.state = {...before, t: pose.t, executed_line: pose.executed_line, analysed_line: pose.analysed_line,
      arm: {...before.arm, joints: joints.slice(0, before.arm.joints.length), world, work, moving, percent}};
    this.shown = performance.now();
    this.emit("pose", this.state);
  }

  async listen() {
    if (this.listening || document.hidden) return;
    this.listening = true;
    const abort = new AbortController();
    const hide = () => { if (document.hidden) abort.abort(); };
    document.addEventListener("visibilitychange", hide);
    // The last event is asked for again. If it does not come, or is another one, the process was started anew.
    let last = this.events.at(-1);
    const anew = () => { this.events = []; this.next = 1; this.emit("reset"); abort.abort(); };
    let due, silence;
    const heard = () => {
      clearTimeout(silence);
      silence = setTimeout(() => abort.abort(), SILENCE);
    };
    if (last) this.next = last.seq;
    try {
      heard();
      const response = await this.fetch("GET", "events?state=true&since=" + this.next, undefined, {signal: abort.signal});
      this.lookSoon();
      if (last) due = setTimeout(anew, KNOWN);
      const reader = response.body.getReader(), decoder = new TextDecoder();
      let rest = "";
      for (;;) {
        const {done, value} = await reader.read();
        if (done) break;
        heard();
        const blocks = (rest + decoder.decode(value, {stream: true})).split("\n\n");
        rest = blocks.pop();
        for (const block of blocks) {
          if (block.startsWith("event: changed\n")) { this.lookSoon(); continue; }
          const event = last && this.eventOf(block);
          if (!event) { this.take(this.eventOf(block)); continue; }
          clearTimeout(due);
          if (event.seq === undefined) this.take(event);
          else if (event.t === last.t && event.event === last.event) this.next = event.seq + 1;
          else { anew(); break; }
          last = undefined;
        }
      }
    } catch { /* opened again below */ }
    clearTimeout(due);
    clearTimeout(silence);
    document.removeEventListener("visibilitychange", hide);
    this.listening = false;
    if (document.hidden || this.link.endsWith("token")) return;
    this.lookSoon();
    setTimeout(() => this.listen(), PAUSE);
  }

  /** The event of a block of the stream; none of a comment. */
  eventOf(block) {
    const line = block.split("\n").find(line => line.startsWith("data: "));
    return line && JSON.parse(line.slice(6));
  }

  take(event) {
    if (!event) return;
    if (event.seq === undefined) {
      this.next += event.missed;
      this.emit("event", {event: "missed", missed: event.missed, t: this.state?.t ?? 0});
      return;
    }
    // After a reset of the process the numbers begin anew.
    if (event.seq < this.next) { this.events = []; this.emit("reset"); }
    this.next = event.seq + 1;
    this.events.push(event);
    if (this.events.length > KEPT) this.events.splice(0, this.events.length - KEPT);
    if (event.event === "selected" || (event.event === "stored" || event.event === "erased") && event.file === this.file) {
      this.file = undefined;
      this.lookSoon();
    }
    this.emit("event", event);
  }
}
