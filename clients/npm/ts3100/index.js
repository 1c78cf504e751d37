"use strict";

const { spawn } = require("node:child_process");
const readline = require("node:readline");
const { binary, environment } = require("./binary.js");
const { Refused, ControlError, FindingsError, ProtocolError, Disconnected, NoReply, NotReached } = require("./errors.js");
const { Host, Channel } = require("./host.js");
const OPERATIONS = require("./operations.js");
const { isKept, keep } = require("./trace.js");

// It is up in milliseconds; a machine under load takes longer.
const START_LIMIT_MS = 20_000;
const END_LIMIT_MS = 5_000;
const LONGEST_CALL_MS = 60_000;
// Of a wait: virtual and wall-clock seconds, and the HTTP status when it took longer.
const WITHIN_S = 60, WALL_S = 30, TOO_LONG = 408;
const LOG_LINES = 100;
const LAST_TEXTS = 6;
const LONGEST_SHOWN = 120;
const SEVERITIES = ["note", "warning", "error"];

const UNITS = { us: 1e-6, ms: 1e-3, s: 1, min: 60 };

/** The seconds of a number, or of a text as the command line reads it. */
function seconds(duration) {
  if (typeof duration === "number") return duration;
  const [, number, unit = "s"] = /^(\d+\.?\d*|\.\d+) *(us|ms|s|min)?$/.exec(String(duration).trim()) || [];
  if (!number) throw new TypeError(`cannot read \`${duration}\` as a duration: expected seconds, or e.g. \`5s\`, \`500 ms\`, \`1.5 s\``);
  return number * UNITS[unit];
}

/** The control interface of an emulator. A call is done when its promise is fulfilled. */
class Robot {
  #url;
  #headers;

  constructor(url, token) {
    this.#url = url.replace(/\/+$/, "");
    this.#headers = token ? { authorization: `Bearer ${token}` } : {};
    // `robot.servo = true` would replace the method and set nothing. A class derived from this one has fields of its own.
    if (new.target === Robot) Object.preventExtensions(this);
  }

  static fromEnvironment() {
    const { TS3100_CONTROL_URL: url, TS3100_CONTROL_TOKEN: token } = process.env;
    if (!url) throw new ControlError(0, "TS3100_CONTROL_URL is not set: run the tests by `ts3100 exec -- npm test`");
    return new Robot(url, token);
  }

  // The path and the query take their arguments, the body has the others.
  async call(operation, values = {}) {
    if (!Object.hasOwn(OPERATIONS, operation)) throw new TypeError(`unknown operation ${operation}`);
    const [method, template] = OPERATIONS[operation].split(" "), [place, query = ""] = template.split("{?"), rest = { ...values };
    const take = (name) => {
      const value = rest[name];
      delete rest[name];
      return value;
    };
    let path = place.replace(/\{(\w+)\}/g, (_, name) => {
      if (!(name in rest)) throw new TypeError(`${operation} needs the argument ${name}`);
      return encodeURIComponent(take(name));
    });
    const given = query.replace("}", "").split(",").filter((name) => name in rest).map((name) => [name, take(name)]);
    if (given.length > 0) path += `?${new URLSearchParams(given)}`;
    const hasBody = method === "PUT" || method === "POST", [unknown] = Object.keys(rest);
    if (!hasBody && unknown) throw new TypeError(`${operation} has no argument ${unknown}`);
    return this.#request(method, path, hasBody ? rest : undefined);
  }

  // Settings
  async keySwitch() { return (await this.call("get_key_switch")).position; }
  async setKeySwitch(position) { await this.call("put_key_switch", { position }); }
  async controlRight() { return (await this.call("get_control_right")).holder; }
  async setControlRight(holder) { await this.call("put_control_right", { holder }); }
  async emergencyStop() { return (await this.call("get_emergency_stop")).pressed; }
  async setEmergencyStop(pressed) { await this.call("put_emergency_stop", { pressed }); }
  async safetySwitch() { return (await this.call("get_safety_switch")).open; }
  async setSafetySwitch(open) { await this.call("put_safety_switch", { open }); }
  async servo() { return (await this.call("get_servo")).on; }
  async setServo(on) { await this.call("put_servo", { on }); }
  async feedHold() { return (await this.call("get_feed_hold")).on; }
  async setFeedHold(on) { await this.call("put_feed_hold", { on }); }
  async machineLock() { return (await this.call("get_machine_lock")).on; }
  async setMachineLock(on) { await this.call("put_machine_lock", { on }); }
  async battery() { return (await this.call("get_battery")).low; }
  async setBattery(low) { await this.call("put_battery", { low }); }
  async override() { return (await this.call("get_override")).percent; }
  async setOverride(percent) { await this.call("put_override", { percent }); }
  async runMode() { return (await this.call("get_run_mode")).mode; }
  async setRunMode(mode) { await this.call("put_run_mode", { mode }); }
  async breakpoints() { return (await this.call("get_breakpoints")).lines; }
  async setBreakpoints(lines) { await this.call("put_breakpoints", { lines }); }
  async timeMode() { return (await this.clock()).mode; }
  async setTimeMode(mode) { await this.call("put_clock", { mode }); }

  // Panel, program, arm
  state() { return this.call("get_state"); }
  async pressFeedHold() { await this.call("press_feed_hold"); }
  async powerOff() { await this.call("power_off"); }
  async powerOn() { await this.call("power_on"); }
  async powerCycle() { await this.call("power_cycle"); }
  async reset(mode) { await this.call("reset_emulator", mode ? { mode } : {}); }
  program() { return this.call("get_program"); }
  async status() { return (await this.program()).status; }
  async selectFile(name) { await this.call("select_file", { name }); }
  async startProgram() { await this.call("start_program"); }
  async stopProgram() { await this.call("stop_program"); }
  async resetProgram() { await this.call("reset_program"); }
  async stepProgram() { await this.call("step_program"); }
  async runProgramTo(line) { await this.call("run_program_to", { line }); }
  async pendant() { return (await this.call("get_pendant")).text; }
  async pressKeys(keys) { await this.call("press_keys", { keys }); }
  async jog(axis, direction, options) { await this.call("jog_arm", { axis, direction, coordinates: "joint", speed: "slow", ...options }); }
  async stopJog() { await this.call("stop_jog"); }
  pose() { return this.call("get_pose"); }

  // Alarms and faults
  async alarms() { return (await this.call("get_alarms")).active; }
  async alarmHistory() { return (await this.call("get_alarms")).history; }
  async raiseAlarm(number, detail) { await this.call("raise_alarm", { number, detail }); }
  async resetAlarms() { await this.call("reset_alarms"); }
  async faults() { return (await this.call("get_faults")).faults; }
  async armFault(spec) { await this.call("arm_fault", { spec }); }
  async disarmFault(number) { await this.call("disarm_fault", { number }); }
  async clearFaults() { await this.call("clear_faults"); }

  // Lines, variables, files
  async input(line) { return (await this.call("get_input", { line })).on; }
  async inputs() { return (await this.call("get_inputs")).on; }
  async setInput(line, on) { await this.call("put_input", { line, on }); }
  async pulseInput(line, duration, on = true) { await this.call("pulse_input", { line, seconds: seconds(duration), on }); }
  async forceInput(line, on) { await this.call("force_input", { line, on }); }
  async releaseInput(line) { await this.call("release_input", { line }); }
  async output(line) { return (await this.call("get_output", { line })).on; }
  async outputs() { return (await this.call("get_outputs")).on; }
  async setOutput(line, on) { await this.call("put_output", { line, on }); }
  async pulseOutput(line, duration) { await this.call("pulse_output", { line, seconds: seconds(duration) }); }
  async forceOutput(line, on) { await this.call("force_output", { line, on }); }
  async releaseOutput(line) { await this.call("release_output", { line }); }
  async variable(name) { return (await this.call("get_variable", { name })).value; }
  variables() { return this.call("get_variables"); }
  async setVariable(name, value, restore = false) { await this.call("put_variable", { name, value, restore }); }
  async position(name) { return (await this.call("get_position", { name })).value; }
  positions() { return this.call("get_positions"); }
  async setPosition(name, value, restore = false) { await this.call("put_position", { name, value, restore }); }
  async teachPosition(name, restore = false) { await this.call("teach_position", { name, restore }); }
  async file(name) { return (await this.call("get_file", { name })).text; }
  async files() { return (await this.call("get_files")).files.map((file) => file.name); }
  async putFile(name, text) { await this.call("put_file", { name, text }); }
  async eraseFile(name) { await this.call("delete_file", { name }); }

  // Ports
  async address(port = "ip0") {
    const { robots } = await this.call("get_robots"), [, name] = /\/robots\/([^/]+)$/.exec(this.#url) || [];
    const row = robots.find((one) => one.name === decodeURIComponent(name)) || robots[0], serial = row.serial?.[port];
    const [, host, number] = /^(?:socket:\/\/)?(.*):(\d+)$/.exec(row.ports[port] || serial || "") || [];
    if (!host) throw new TypeError(`${port} has no TCP address`);
    // An address of all interfaces is reached where the control interface is.
    return { host: /^(0\.0\.0\.0|\[::\])$/.test(host) ? new URL(this.#url).hostname : host.replace(/[[\]]/g, ""), port: Number(number) };
  }
  async host(options) {
    const { host, port } = await this.address();
    return Host.connect(host, port, { ...options, describe: () => this.describe() });
  }
  async channel(name = "ip1", options) {
    const { host, port } = await this.address(name);
    return Channel.connect(host, port, { ...options, name: name.toUpperCase(), describe: () => this.describe() });
  }
  channelState(port) { return this.call("get_channel", { port: port.toUpperCase() }); }
  async inject(port, text) { await this.call("inject_bytes", { port: port.toUpperCase(), text }); }
  async dropPeer(port) { await this.call("drop_peer", { port: port.toUpperCase() }); }

  // Time, snapshots, records
  clock() { return this.call("get_clock"); }
  async advance(duration) { await this.call("advance_time", { seconds: seconds(duration), wall: WALL_S }); }
  advanceUntil(condition, within = WITHIN_S) { return this.#await("advance_time_until", condition, within); }
  waitUntil(condition, within = WITHIN_S) { return this.#await("wait_until", condition, within); }
  async snapshots() { return (await this.call("get_snapshots")).snapshots.map((one) => one.name); }
  async takeSnapshot(name) { await this.call("put_snapshot", { name }); }
  async restoreSnapshot(name) { await this.call("restore_snapshot", { name }); }
  async deleteSnapshot(name) { await this.call("delete_snapshot", { name }); }
  findings() { return this.call("get_findings"); }
  transcript() { return this.call("get_transcript", { format: "text" }); }

  async describe() {
    const state = await this.state(), reads = state.tasks.find((task) => task.reads)?.reads;
    const clock = state.time_mode === "stepped" ? "is stepped and stopped at" : `runs (${state.time_mode}) and is at`;
    const program = state.file ? `${state.file} is ${state.status}, line ${state.line}${reads ? `, an INPUT waits for ${reads}` : ""}` : "no file is selected";
    const last = {};
    for (const [, port, text] of (await this.transcript()).matchAll(/^<:? (COM1|IP1|IP2) (.*)/gm)) last[port] = text;
    const printed = Object.entries(last).map(([port, text]) => `${port} printed ${text}, `).join("");
    const pendant = state.pendant.trim().split("\n").pop().trim() || "nothing";
    return `the clock ${clock} ${state.t} s; ${program}; alarms: ${state.alarms.map((alarm) => alarm.number).join(" ") || "none"}; `
      + `outputs on: ${state.outputs.on.join(" ") || "none"}; ${printed}the pendant ${printed ? "" : "printed "}${pendant}`;
  }

  async checkFindings({ deny = "warning", allow = [], test = "test", failed = test.passed === false, trace = "retain-on-failure",
    artifacts = "ts3100-transcripts" } = {}) {
    const limit = SEVERITIES.indexOf(deny);
    if (limit < 0) throw new RangeError(`deny: expected ${SEVERITIES.join(", ")}, found ${deny}`);
    const found = (await this.findings()).filter(
      (one) => !one["caused-by"] && SEVERITIES.indexOf(one.severity) >= limit && !allow.includes(one.rule));
    const denied = found.length > 0, traced = isKept(trace, failed || denied);
    if (!denied && !traced) return;
    const transcript = await this.transcript();
    const shown = traced ? await keep(artifacts, test.name ?? test, transcript, found[0]?.rule) : "";
    if (!denied) {
      if (failed) console.log(shown);
      return;
    }
    const texts = transcript.split("\n").filter((line) => /^[<>] /.test(line)).slice(-LAST_TEXTS)
      .map((line) => (line.length > LONGEST_SHOWN ? line.slice(0, LONGEST_SHOWN) + "..." : line));
    throw new FindingsError(found, ["protocol mistakes of the host:",
      ...found.map((one) => `  ${one.port}: ${one.message} (${one.rule}, ${one.severity}). ${one.remedy}`),
      "last texts:", ...texts.map((line) => `  ${line}`), ...(traced ? [shown] : [])].join("\n"));
  }

  async #await(operation, condition, duration) {
    const within = seconds(duration);
    let limit = `${within} s of virtual time`;
    try {
      const result = await this.call(operation, { condition, within, wall: WALL_S });
      if (result.reached) return result;
    } catch (error) {
      if (error.status !== TOO_LONG) throw error;
      limit = `${WALL_S} s of wall-clock time`;
    }
    const wanted = typeof condition === "string" ? condition : JSON.stringify(condition);
    throw new NotReached(`\`${wanted}\` was not met within ${limit}: ${await this.describe()}`);
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
    if (answer.ok) return /^application\/json/.test(answer.headers.get("content-type")) ? JSON.parse(text) : text;
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
    this.ports = ready.ports;
    this.controlUrl = ready.control;
    Object.preventExtensions(this);
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

// Each by its name: `import { start } from "ts3100"` finds no others.
module.exports = {
  start, binary, Robot, StartedRobot, Host, Channel, Refused, ControlError, FindingsError, ProtocolError, Disconnected, NoReply, NotReached,
};
