// What the views of a robot are fed with: its state, its events, the lines of its selected file, and the calls it answers.
// `Robot` feeds them from an emulator that runs, `Recorded` from a recorded run.

/** Why a call was refused: the words of the emulator. */
export class Refusal extends Error {
  constructor(status, problem = {}) {
    super(problem.error ?? problem.detail ?? (status ? "refused: " + status : "the emulator does not answer; is it still running?"));
    this.status = status;
    this.problem = problem;
  }
}

/** A function that does `call` now, or as soon as `pause` ms have gone since the last time. */
export function atMost(pause, call) {
  let last = -Infinity, timer;
  return () => {
    if (timer !== undefined) return;
    timer = setTimeout(() => {
      timer = undefined;
      last = performance.now();
      call();
    }, Math.max(0, last + pause - performance.now()));
  };
}

/** The lines of a text, as the robot counts them. */
export function splitLines(text) {
  const lines = text.split(/\r\n|\n|\r/);
  if (lines.length > 1 && lines.at(-1) === "") lines.pop();
  return lines;
}

export class Feed {
  constructor(base = new URL("./", location.href)) {
    this.base = base;
    this.state = null;
    this.events = [];
    this.token = "";
    this.listeners = {state: [], pose: [], event: [], link: [], reset: [], moment: [], settled: [], text: []};
    this.link = "connecting";
    this.lines = [];     // of the selected file
    this.file = "";
    this.view = "";      // that is chosen
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
    let response;
    try {
      response = await fetch(new URL(path.replace(/^\//, ""), this.base), {method, headers, body: text, ...options});
    } catch (error) {
      // The words of a browser differ, and say nothing of the emulator.
      throw options.signal?.aborted && options.signal.reason?.name !== "TimeoutError" ? error : new Refusal(0);
    }
    if (response.status === 401) this.setLink(this.token ? "wrong token" : "token");
    if (!response.ok) throw new Refusal(response.status, await response.json().catch(() => ({})));
    return response;
  }

  /** The document that a call answers. */
  async call(method, path, body, options) {
    const response = await this.fetch(method, path, body, options);
    const text = await response.text();
    return text && (response.headers.get("Content-Type") ?? "").includes("json") ? JSON.parse(text) : text;
  }

  get(path) { return this.call("GET", path); }
  put(path, body) { return this.call("PUT", path, body); }
  post(path, body = {}) { return this.call("POST", path, body); }
  remove(path) { return this.call("DELETE", path); }

  /** Whether these fields of the state are known. */
  known() { return true; }

  /** What follows the view in the address. */
  get suffix() { return ""; }

  /** The lines of the selected file, read again when it was selected or stored. */
  async readSource() {
    const {file} = this.state;
    if (file === this.file) return;
    this.file = file;
    this.lines = [];
    if (!file) return;
    try {
      const {text} = await this.get("files/" + encodeURIComponent(file));
      if (this.file !== file) return;
      this.lines = splitLines(text ?? "");
    } catch { return; }
    this.emit("state", this.state);
  }
}
