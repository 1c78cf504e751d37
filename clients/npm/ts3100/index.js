"use strict";

const { spawn } = require("node:child_process");
const readline = require("node:readline");
const { binary, environment } = require("./binary.js");

// It is up in milliseconds; a machine under load takes longer.
const START_LIMIT_MS = 20_000;
const END_LIMIT_MS = 5_000;
// A call may wait 30 s for virtual time unless it says otherwise.
const LONGEST_CALL_MS = 60_000;
const LOG_LINES = 100;
const LAST_TEXTS = 6;
const LONGEST_SHOWN = 120;
const SEVERITIES = ["note", "warning", "error"];

/** The emulator refused a call; nothing has changed. */
class ControlError extends Error {
  constructor(status, message) {
    super(message);
    this.name = "ControlError";
    this.status = status;
  }
}

/** The host of a test has made protocol mistakes. */
class FindingsError extends Error {
  constructor(findings, message) {
    super(message);
    this.name = "FindingsError";
    this.findings = findings;
  }
}

/** The control interface of an emulator. A call is done when its promise is fulfilled. */
class Robot {
  #url;
  #headers;

  constructor(url, token) {
    this.#url = url.replace(/\/+$/, "");
    this.#headers = token ? { authorization: `Bearer ${token}` } : {};
  }

  async call(method, path, body) {
    return JSON.parse(await this.#request(method, path, body));
  }

  state() { return this.call("GET", "/state"); }
  async pressEmergencyStop() { await this.call("PUT", "/emergency-stop", { pressed: true }); }
  async releaseEmergencyStop() { await this.call("PUT", "/emergency-stop", { pressed: false }); }
  async turnKeySwitch(position) { await this.call("PUT", "/key-switch", { position }); }
  async setControlRight(holder) { await this.call("PUT", "/control-right", { holder }); }
  async setServo(on) { await this.call("PUT", "/servo", { on }); }
  async setFeedHold(on) { await this.call("PUT", "/feed-hold", { on }); }
  async setOverride(percent) { await this.call("PUT", "/override", { percent }); }
  async startProgram() { await this.call("POST", "/program/start", {}); }
  async stopProgram() { await this.call("POST", "/program/stop", {}); }
  async alarms() { return (await this.call("GET", "/alarms")).active.map((alarm) => alarm.number); }
  async raiseAlarm(number) { await this.call("POST", "/alarms", { number }); }
  async resetAlarms() { await this.call("POST", "/alarms/reset", {}); }
  async input(line) { return (await this.call("GET", `/inputs/${line}`)).on; }
  async setInput(line, on) { await this.call("PUT", `/inputs/${line}`, { on }); }
  async output(line) { return (await this.call("GET", `/outputs/${line}`)).on; }
  async variable(name) { return (await this.call("GET", `/variables/${encodeURIComponent(name)}`)).value; }
  async setVariable(name, value) { await this.call("PUT", `/variables/${encodeURIComponent(name)}`, { value }); }
  async file(name) { return (await this.call("GET", `/files/${encodeURIComponent(name)}`)).text; }
  async putFile(name, text) { await this.call("PUT", `/files/${encodeURIComponent(name)}`, { text }); }
  async select(name) { await this.call("POST", `/files/${encodeURIComponent(name)}/select`, {}); }
  async now() { return (await this.call("GET", "/clock")).now; }
  async setTime(mode) { await this.call("PUT", "/clock", { mode }); }
  async advance(seconds) { await this.call("POST", "/clock/advance", { seconds }); }
  async advanceUntil(condition, within) { return (await this.call("POST", "/clock/advance-until", { condition, within })).reached; }
  async waitUntil(condition, within) { return (await this.call("POST", "/wait", { condition, within })).reached; }
  async powerOff() { await this.call("POST", "/power/off", {}); }
  async powerOn() { await this.call("POST", "/power/on", {}); }
  async armFault(spec) { await this.call("POST", "/faults", { spec }); }
  async dropPeer(port) { await this.call("POST", `/channels/${port}/drop`, {}); }
  async takeSnapshot(name) { await this.call("PUT", `/snapshots/${encodeURIComponent(name)}`, {}); }
  async restore(name) { await this.call("POST", `/snapshots/${encodeURIComponent(name)}/restore`, {}); }
  async reset() { await this.call("POST", "/reset", {}); }
  findings() { return this.call("GET", "/findings"); }
  transcript() { return this.#request("GET", "/transcript?format=text"); }

  async checkFindings({ deny = "warning", allow = [] } = {}) {
    const limit = SEVERITIES.indexOf(deny);
    if (limit < 0) throw new RangeError(`deny: expected ${SEVERITIES.join(", ")}, found ${deny}`);
    const found = (await this.findings()).filter(
      (one) => !one["caused-by"] && SEVERITIES.indexOf(one.severity) >= limit && !allow.includes(one.rule));
    if (found.length === 0) return;
    const texts = (await this.transcript()).split("\n").filter((line) => /^[<>] /.test(line)).slice(-LAST_TEXTS)
      .map((line) => (line.length > LONGEST_SHOWN ? line.slice(0, LONGEST_SHOWN) + "..." : line));
    throw new FindingsError(found, ["protocol mistakes of the host:",
      ...found.map((one) => `  ${one.port}: ${one.message} (${one.rule}, ${one.severity}). ${one.remedy}`),
      "last texts:", ...texts.map((line) => `  ${line}`)].join("\n"));
  }

  async #request(method, path, body) {
    const request = { method, headers: { ...this.#headers }, signal: AbortSignal.timeout(LONGEST_CALL_MS) };
    if (body !== undefined) {
      request.headers["content-type"] = "application/json";
      request.body = JSON.stringify(body);
    }
    let answer, text;
    try {
      answer = await fetch(this.#url + path, request);
      text = await answer.text();
    } catch (error) {
      throw new ControlError(0, `cannot reach ${this.#url}: ${(error.cause || error).message}`);
    }
    if (answer.ok) return text;
    let reason = `${method} ${path}: HTTP status ${answer.status}`;
    try {
      reason = JSON.parse(text).error || reason;
    } catch {
      // Not the emulator's own answer: the status has to do.
    }
    throw new ControlError(answer.status, reason);
  }
}

/** An emulator that start() has started. */
class StartedRobot extends Robot {
  #child;
  #log;

  constructor(child, ready, log) {
    super(ready.control);
    this.#child = child;
    this.#log = log;
    this.address = "127.0.0.1";
    this.ports = ready.ports;
    this.controlUrl = ready.control;
  }

  /** The last lines of its log. */
  log() { return this.#log.join("\n"); }

  /** Ends it; it writes its reports first, except on Windows. */
  stop() { return end(this.#child); }
}

function end(child) {
  if (child.exitCode !== null || child.signalCode !== null) return Promise.resolve();
  return new Promise((done) => {
    const timer = setTimeout(() => child.kill("SIGKILL"), END_LIMIT_MS);
    child.once("exit", () => {
      clearTimeout(timer);
      done();
    });
    child.ref();
    child.kill();
  });
}

/** Node ends without waiting for its children: the emulator ends with it. */
function endWithUs(child) {
  if (!child.pid) return;
  if (process.platform === "win32") {
    const kill = () => child.kill();
    process.once("exit", kill);
    child.once("exit", () => process.off("exit", kill));
    return;
  }
  // However this process ends, also if it is killed: `read` ends with the pipe from here.
  const shell = spawn("/bin/sh", ["-c", 'read -r _; kill "$0"', String(child.pid)], { stdio: ["pipe", "ignore", "ignore"], detached: true });
  shell.once("error", () => {}); // a container may have no shell
  child.once("exit", () => shell.kill("SIGKILL"));
  shell.unref();
  shell.stdin?.unref();
}

/** Starts `ts3100 serve` on free ports and waits until it is ready. */
async function start({ args = [] } = {}) {
  const child = spawn(binary(), ["serve", "--ports", "auto", "--ready-json", ...args],
    // A variable such as TS3100_DRIVE is a setting too; tests say their settings here.
    { stdio: ["ignore", "pipe", "pipe"], env: environment(/^TS3100_/) });
  const log = [];
  readline.createInterface({ input: child.stderr }).on("line", (line) => {
    log.push(line);
    if (log.length > LOG_LINES) log.shift();
  });
  endWithUs(child);
  const first = readline.createInterface({ input: child.stdout });
  let timer;
  try {
    const line = await new Promise((done, fail) => {
      timer = setTimeout(() => fail(new Error(`ts3100 serve did not become ready within ${START_LIMIT_MS} ms:\n${log.join("\n")}`)), START_LIMIT_MS);
      first.once("line", done);
      child.once("error", (error) => fail(new Error(`cannot run ${binary()}: ${error.message}; install ts3100, or set TS3100_BINARY to its path`)));
      child.once("close", (code) => fail(new Error(`ts3100 serve ended with exit code ${code} before it was ready:\n${log.join("\n")}`)));
    });
    // A test that forgets stop() must not keep Node from ending.
    child.unref();
    child.stdout.unref();
    child.stderr.unref();
    const ready = JSON.parse(line);
    if (!ready.control) throw new Error("cannot control the emulator: its options turn the control interface off");
    return new StartedRobot(child, ready, log);
  } catch (error) {
    child.kill();
    throw error;
  } finally {
    clearTimeout(timer);
  }
}

module.exports = { start, binary, Robot, StartedRobot, ControlError, FindingsError };
