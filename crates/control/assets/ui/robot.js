// The robot as the page knows it: calls, the stream of events, and the state that is read again after events.
//
// There is one stream of events for the whole page. It goes on where it was cut, and nothing is read while the page is
// hidden.

const PAUSE = 2000;      // before the stream of events is opened again, in ms
const IDLE = 1000;       // between two readings of the state while nothing happens
const BUSY = 100;        // the same after an event and while the robot moves
const SILENCE = 10_000;  // after which a reading without an answer is given up, in ms
const KEPT = 5000;       // events kept for views that are opened later
const KNOWN = 2000;      // within which a stream that goes on repeats the last event, in ms

/** Why a call was refused: the words of the emulator. */
export class Refusal extends Error {
  constructor(status, problem) {
    super(problem.error ?? problem.detail ?? ("refused: " + status));
    this.status = status;
    this.problem = problem;
  }
}

export class Robot {
  constructor(base = new URL("./", location.href)) {
    this.base = base;
    this.state = null;
    this.events = [];
    this.first = 1;      // number of the first event that is kept
    this.next = 1;       // number of the next event
    this.token = "";
    this.listeners = {state: [], event: [], link: [], reset: []};
    this.link = "connecting";
  }

  on(kind, listener) { this.listeners[kind].push(listener); }

  /** Tells everybody; the defect of one view does not stop the others. */
  emit(kind, value) {
    for (const listener of this.listeners[kind]) try { listener(value); } catch (error) { reportError(error); }
  }

  setLink(link) { if (link !== this.link) { this.link = link; this.emit("link", link); } }

  headers(more = {}) { return this.token ? {...more, Authorization: "Bearer " + this.token} : more; }

  /** The response of a call; a refusal is thrown. */
  async fetch(method, path, body, options = {}) {
    const headers = this.headers(body === undefined ? {} : {"Content-Type": "application/json"});
    const text = body === undefined ? undefined : JSON.stringify(body);
    const response = await fetch(new URL(path.replace(/^\//, ""), this.base), {method, headers, body: text, ...options});
    if (response.status === 401) this.setLink("token");
    if (!response.ok) throw new Refusal(response.status, await response.json().catch(() => ({})));
    return response;
  }

  /** The document that a call answers; the state is read again after everything but GET. */
  async call(method, path, body, options) {
    const response = await this.fetch(method, path, body, options);
    const text = await response.text();
    if (method !== "GET") this.lookSoon();
    return text && (response.headers.get("Content-Type") ?? "").includes("json") ? JSON.parse(text) : text;
  }

  get(path) { return this.call("GET", path, undefined, {signal: AbortSignal.timeout(SILENCE)}); }
  put(path, body) { return this.call("PUT", path, body); }
  post(path, body = {}) { return this.call("POST", path, body); }
  remove(path) { return this.call("DELETE", path); }

  /** Begins to read; ends never. */
  start() {
    document.addEventListener("visibilitychange", () => { if (!document.hidden) { this.look(); this.listen(); } });
    this.look();
    this.listen();
  }

  lookSoon() {
    if (this.timer !== undefined && this.due > performance.now() + BUSY) this.lookIn(BUSY);
  }

  lookIn(pause) {
    clearTimeout(this.timer);
    this.due = performance.now() + pause;
    this.timer = setTimeout(() => this.look(), pause);
  }

  async look() {
    if (document.hidden || this.looking) return;
    this.looking = true;
    let state;
    try {
      state = await this.get("state");
      this.setLink("connected");
    } catch (error) {
      if (error.status !== 401) this.setLink(error instanceof Refusal ? "refused: " + error.message : "not connected");
    }
    this.looking = false;
    this.state = state ?? this.state;
    const moves = state && (state.arm.moving || state.status === "running");
    this.lookIn(moves ? BUSY : IDLE);
    if (state) this.emit("state", state);
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
    let due;
    if (last) this.next = last.seq;
    try {
      const response = await this.fetch("GET", "events?since=" + this.next, undefined, {signal: abort.signal});
      if (last) due = setTimeout(anew, KNOWN);
      const reader = response.body.getReader(), decoder = new TextDecoder();
      let rest = "";
      for (;;) {
        const {done, value} = await reader.read();
        if (done) break;
        const blocks = (rest + decoder.decode(value, {stream: true})).split("\n\n");
        rest = blocks.pop();
        for (const block of blocks) {
          const event = last && this.read(block);
          if (!event) { this.take(this.read(block)); continue; }
          clearTimeout(due);
          if (event.seq === undefined) this.take(event);
          else if (event.t === last.t && event.event === last.event) this.next = event.seq + 1;
          else { anew(); break; }
          last = undefined;
        }
      }
    } catch { /* opened again below */ }
    clearTimeout(due);
    document.removeEventListener("visibilitychange", hide);
    this.listening = false;
    if (!document.hidden) setTimeout(() => this.listen(), PAUSE);
  }

  /** The event of a block of the stream; none of a comment. */
  read(block) {
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
    this.emit("event", event);
    this.lookSoon();
  }
}
