"use strict";
// The host's side of the simple protocol on IP0, and the peer of a SCOL channel.

const net = require("node:net");
const { setTimeout: sleep } = require("node:timers/promises");
const { Refused, NoReply, ProtocolError, Disconnected } = require("./errors.js");

const STX = "\x02", ETX = "\x03", CR = "\r", EOF = "\x1a";
// Data bytes of a text of the host, between STX and ETX.
const LONGEST_TEXT = 253;
// The directory of a full drive is longer than any file.
const LONGEST_ANSWER = 128 * 1024;
const SIX_AXIS_BYTES = 276, SCARA_BYTES = 250, NO_ALARM = 0xffff;
// Level, first and last word, first code.
const ALARM_WORDS = [[8, 0, 367, 1], [4, 368, 511, 1], [2, 512, 735, 1], [1, 736, 959, 1],
  [8, 960, 1471, 369], [4, 1472, 1727, 145], [2, 1728, 1983, 225], [1, 1984, 2239, 225]];
const LINES_SHOWN = 5;

/** A TCP connection. TCP divides texts as it likes, so unread bytes are kept, a character each. */
class Link {
  #socket;
  #received = "";
  #ended = "";
  #wake = () => {};
  #describe;
  #name;

  static async open(address, port, { timeout = 5, name = `port ${port}`, describe = () => "" } = {}) {
    const socket = net.connect({ host: address, port, noDelay: true });
    await new Promise((done, fail) => socket.once("connect", done)
      .once("error", (error) => fail(new Disconnected(`cannot connect to ${address}:${port}: ${error.message}`))));
    return new Link(socket, timeout, name, describe);
  }

  constructor(socket, timeout, name, describe) {
    Object.assign(this, { timeout });
    this.#socket = socket;
    this.#name = name;
    this.#describe = describe;
    socket.setEncoding("latin1");
    socket.on("data", (text) => { this.#received += text; this.#wake(); });
    socket.on("error", (error) => { this.#ended = `the connection to ${name} has ended: ${error.message}`; this.#wake(); });
    socket.on("end", () => { this.#ended ||= `the robot closed the connection to ${name}; does another host have it?`; this.#wake(); });
  }

  get name() { return this.#name; }
  get received() { return this.#received; }

  send(text) {
    if (this.#ended) throw new Disconnected(this.#ended);
    this.#socket.write(text, "latin1");
  }

  /** Takes what `find` returns the length of, as soon as it is not negative. `what` is for the message of NoReply. */
  async take(find, what, timeout = this.timeout) {
    const until = performance.now() + 1000 * timeout;
    for (;;) {
      const length = find(this.#received);
      if (length >= 0) {
        const taken = this.#received.slice(0, length);
        this.#received = this.#received.slice(length);
        return taken;
      }
      if (this.#ended) throw new Disconnected(this.#ended);
      const left = until - performance.now();
      if (left <= 0) {
        const described = await this.#describe();
        throw new NoReply(`${what()} within ${timeout} s${this.#instead()}${described && `: ${described}`}`);
      }
      await new Promise((done) => {
        const timer = setTimeout(done, left);
        this.#wake = () => { clearTimeout(timer); done(); };
      });
    }
  }

  /** What a wait has met that it did not wait for. */
  others = null;
  #instead() {
    if (!this.others) return "";
    const found = this.#received ? [...this.others, this.#received] : this.others;
    return ", found " + (found.slice(-LINES_SHOWN).map((line) => `\`${line}\``).join(", ") || "nothing");
  }

  close() {
    return new Promise((done) => {
      if (this.#socket.destroyed) return done();
      this.#socket.once("close", done).end(() => this.#socket.destroy());
    });
  }
}

/** The peer of a SCOL channel: reads what PRINT writes, and writes what INPUT reads, line by line. */
class Channel {
  #link;
  constructor(link) {
    this.#link = link;
    Object.preventExtensions(this);
  }
  static async connect(address, port, options) { return new Channel(await Link.open(address, port, options)); }

  async sendLine(text) { this.#link.send(text + CR); }
  readLine(timeout) { return this.waitForLine("", timeout); }

  async waitForLine(text, timeout) {
    const link = this.#link, wanted = text ? `line with \`${text}\`` : "line";
    link.others = [];
    for (;;) {
      const line = (await link.take((received) => received.indexOf(CR) + 1 || -1, () => `${link.name}: expected a ${wanted}`, timeout)).slice(0, -1);
      if (line.includes(text)) return line;
      link.others.push(line);
    }
  }

  close() { return this.#link.close(); }
}

/** The status that SU returns, of either layout. */
function parseStatus(text) {
  // The six records have blanks inside their items: "stop (reset)".
  const items = Object.fromEntries(text.split(text.includes(CR) ? CR : " ").filter((item) => item.includes(":"))
    .map((item) => item.replace(/ /g, "").split(/:(.*)/)));
  const mode = (items.MODE || "").split("/");
  if (!items.STATUS || mode.length < 2) throw new ProtocolError(`SU: cannot read "${text}"`);
  return { masterMode: mode[0], operationMode: mode[1], file: items.FILE || "", override: parseInt(items.OVRD, 10), machineLock: items.MACHINE === "lock",
    status: items.STATUS.replace("(", " (") };
}

/** The total status that SF returns, of a six-axis or a SCARA arm. */
function parseTotalStatus(data) {
  const word = (at) => data.readUInt16BE(at), scara = data.length === SCARA_BYTES, axes = scara ? 6 : 8;
  const lines = (from) => Array.from({ length: 256 }, (_, bit) => bit).filter((bit) => word(from + 2 * (bit >> 4)) >> (bit & 15) & 1)
    .map((bit) => 100 * (bit >> 6) + bit % 64 + 1);
  const group = (which) => Array.from({ length: axes }, (_, axis) => data.readFloatBE(116 + 4 * (which * axes + axis)));
  const alarm = (number) => {
    const [level, from, , code] = ALARM_WORDS.find(([, first, last]) => number >= first && number <= last) || ["?", 0, 0, 0];
    return `${level}-${String(number - from + code).padStart(3, "0")}`;
  };
  return { isScara: scara, servoOn: data[0] === 1, emergencyStop: data[1] === 1, line: word(24), feedHold: word(32) === 1,
    status: ["stop (reset)", "running", "stop (retry)", "stop (continue)"][data[2] & 3],
    alarms: Array.from({ length: 10 }, (_, at) => word(4 + 2 * at)).filter((number) => number !== NO_ALARM).map(alarm),
    inputs: lines(52), outputs: lines(84), joints: group(0), world: group(1), work: group(2) };
}

/** A host of the simple protocol: one text out, one answer or one file back. */
class Host {
  #link;
  #last = -Infinity;
  #stops = 0;
  #sent = "";

  constructor(link, { pause = 0.05, stx = true } = {}) {
    this.#link = link;
    Object.preventExtensions(Object.assign(this, { pause, stx }));
  }
  static async connect(address, port, options = {}) { return new Host(await Link.open(address, port, options), options); }

  servoOn() { return this.command("SO"); }
  servoOff() { return this.command("BR"); }
  start() { return this.command("RN"); }
  stop() { return this.command("SP"); }
  breakMotion() { return this.command("EC,BREAK"); }
  feedHold() { return this.command("FD"); }
  select(name) { return this.command(`SL,${name}`); }
  deselect() { return this.command("RS,SEL"); }
  resetProgram() { return this.command("RS,PRG"); }
  resetStep() { return this.command("RS,STP"); }
  resetCycle() { return this.command("RS,CYC"); }
  resetSignals() { return this.command("RS,SIG"); }
  resetAlarms() { return this.command("RS,ERR"); }
  setOverride(percent) { return this.command(`EC,OVRD ${percent}`); }
  setRunMode(mode) { return this.command(`EC,MODE ${mode.toUpperCase()}`); }
  execute(statement) { return this.command(`DO,${statement}`); }
  setOutputs(lines) { return this.command("IW," + Object.entries(lines).map(([line, on]) => `${line} ${on ? 1 : 0}`).join(" ")); }
  erase(name) { return this.command(`ER,${name}`); }
  upload(name) { return this.query(`UL,${name}`); }
  async version() { return (await this.query("VR")).trimEnd(); }
  async status() { return parseStatus(await this.query("SU")); }
  async readVariable(name) { return (await this.query(`MR,${name} -1`)).trim().split(/\s+/).map(Number); }

  async writeVariable(name, values) {
    // An exponent is not a number to the robot, and an integer has no point.
    const words = [values].flat().map((value) => (Number.isInteger(value) ? String(value) : value.toFixed(6)));
    await this.command(`MW,0 ${name} -1 ${words.join(" ")}`);
  }

  async directory() {
    const records = (await this.query("CA")).split(CR).map((record) => record.split(/ +/)).filter((words) => words.length > 1);
    return Object.fromEntries(records.map(([name, size]) => [name, Number(size)]));
  }

  /** DL: stores a file on the RAM drive. */
  async download(name, text) {
    await this.command(`DL,${name}`);
    const whole = `FL,${text}${EOF}`;
    for (let at = 0; at < whole.length; at += LONGEST_TEXT) {
      await this.#send(whole.slice(at, at + LONGEST_TEXT));
      await this.#expectOk(`a text of DL,${name}`);
    }
  }

  /** SF. Its data may contain ETX, so its length decides where it ends. */
  async totalStatus() {
    await this.#ask("SF");
    const stx = this.stx ? 1 : 0;
    for (;; this.#stops++) {
      const head = (await this.#bytes(stx + 3)).slice(stx);
      if (head === "FL,") break;
      await this.#bytes(1);
      this.#last = performance.now();
      if (head !== "SP\r") this.#unexpected("SF", head);
    }
    let data = await this.#bytes(SCARA_BYTES + 1);
    if (data.endsWith(ETX)) data = data.slice(0, -1);
    else {
      data += await this.#bytes(SIX_AXIS_BYTES + 2 - data.length);
      if (!data.endsWith(EOF + ETX)) throw new ProtocolError("SF: expected 250 or 276 bytes, found more");
      data = data.slice(0, -2);
    }
    this.#last = performance.now();
    await this.#send("OK\r");
    return parseTotalStatus(Buffer.from(data, "latin1"));
  }

  /** A command that the robot answers with OK. */
  async command(text) {
    await this.#ask(text);
    await this.#expectOk(text);
  }

  /** A command that the robot answers with a file or a status, without FL and EOF. */
  async query(text) {
    await this.#ask(text);
    let part = await this.#answer();
    if (!part.startsWith("FL,")) this.#unexpected(text, part);
    let content = "";
    for (part = part.slice(3);; part = await this.#answer()) {
      await this.#send("OK\r");
      const end = part.indexOf(EOF);
      content += end < 0 ? part : part.slice(0, end);
      if (end >= 0) return content;
      if (content.length > LONGEST_ANSWER) throw new ProtocolError(`${text}: no EOF in ${content.length} bytes`);
    }
  }

  /** Waits for the SP that the robot sends when a program has ended or was stopped. */
  async waitForStop(timeout) {
    await this.#discard();
    if (this.#stops > 0) {
      this.#stops--;
      return;
    }
    this.#sent = "the SP of a stop";
    const text = await this.#text(timeout);
    if (text !== "SP\r") this.#unexpected("waiting for a stop", text);
  }

  close() { return this.#link.close(); }

  async #rest() {
    // A timer may fire early by less than a millisecond.
    for (let left; (left = this.#last + 1000 * this.pause - performance.now()) > 0;) await sleep(Math.ceil(left));
  }
  async #send(data) {
    await this.#rest();
    this.#link.send((this.stx ? STX : "") + data + ETX); // in one piece
  }
  /** Sends a command: bytes received earlier are not its answer. */
  async #ask(text) {
    await this.#rest();
    await this.#discard();
    this.#sent = `an answer to ${text}`;
    await this.#send(text + CR);
  }
  /** Drops answers that came too late. An SP among them counts, and half an SP is kept. */
  async #discard() {
    const stop = (this.stx ? STX : "") + "SP\r" + ETX;
    await this.#link.take((late) => {
      const half = late.slice(late.lastIndexOf(ETX) + 1);
      this.#stops += late.split(stop).length - 1;
      return late.length - (stop.startsWith(half) ? half.length : 0);
    });
  }
  #unexpected(command, text) {
    if (text === "NG\r") throw new Refused(command);
    throw new ProtocolError(`${command}: the robot answered ${JSON.stringify(text)}`);
  }
  async #expectOk(command) {
    const text = await this.#answer();
    if (text !== "OK\r") this.#unexpected(command, text);
  }
  async #answer() {
    for (;; this.#stops++) {
      const text = await this.#text();
      if (text !== "SP\r") return text;
    }
  }
  #late = () => `the robot did not send ${this.#sent}`;
  #bytes(count) { return this.#link.take((received) => (received.length < count ? -1 : count), this.#late); }
  async #text(timeout) {
    const text = await this.#link.take((received) => received.indexOf(ETX) + 1 || -1, this.#late, timeout);
    this.#last = performance.now();
    if (this.stx && !text.startsWith(STX)) throw new ProtocolError(`expected STX, found ${JSON.stringify(text[0])}`);
    return text.slice(this.stx ? 1 : 0, -1);
  }
}

module.exports = { Host, Channel };
