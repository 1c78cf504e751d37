/// <reference lib="es2022" />

/** How bad a finding is. */
export type Severity = "note" | "warning" | "error";

/** A protocol mistake of a host. */
export interface Finding {
  rule: string;
  severity: Severity;
  port: string;
  message: string;
  remedy: string;
  /** When, in seconds of virtual time. */
  t: number;
  /** The fault that has caused it; absent if the host has. */
  "caused-by"?: string;
}

/** The emulator refused a call, with its sentence as the message; nothing has changed. */
export class ControlError extends Error {
  /** The HTTP status: 409 if the state forbids the call; 0 if nobody answered. */
  readonly status: number;
}

/** The host of a test has made protocol mistakes; the message names them and the last texts. */
export class FindingsError extends Error {
  readonly findings: Finding[];
}

/** The control interface of an emulator. A call is done when its promise is fulfilled. */
export class Robot {
  /** @param url that of the ready line or of TS3100_CONTROL_URL; ends in /robots/NAME for one of several robots */
  constructor(url: string, token?: string);
  /** Any call of the control interface. */
  call(method: "GET" | "PUT" | "POST" | "DELETE", path: string, body?: unknown): Promise<any>;
  /** Everything at one moment. */
  state(): Promise<any>;
  pressEmergencyStop(): Promise<void>;
  releaseEmergencyStop(): Promise<void>;
  turnKeySwitch(position: "teaching" | "internal" | "ext"): Promise<void>;
  setControlRight(holder: "sig" | "rs232c" | "ether"): Promise<void>;
  setServo(on: boolean): Promise<void>;
  setFeedHold(on: boolean): Promise<void>;
  setOverride(percent: number): Promise<void>;
  /** Presses START. */
  startProgram(): Promise<void>;
  /** Presses STOP. */
  stopProgram(): Promise<void>;
  /** The numbers of the active alarms, oldest first: 2-046. */
  alarms(): Promise<string[]>;
  raiseAlarm(number: string): Promise<void>;
  resetAlarms(): Promise<void>;
  input(line: number): Promise<boolean>;
  setInput(line: number, on: boolean): Promise<void>;
  output(line: number): Promise<boolean>;
  /** The values of a variable of the selected file. */
  variable(name: string): Promise<number[]>;
  setVariable(name: string, value: number | number[]): Promise<void>;
  file(name: string): Promise<string>;
  putFile(name: string, text: string): Promise<void>;
  select(name: string): Promise<void>;
  /** Virtual time in seconds. */
  now(): Promise<number>;
  /** How time passes: real, x10, stepped or auto. */
  setTime(mode: string): Promise<void>;
  advance(seconds: number): Promise<void>;
  /** Advances virtual time until a condition is met, such as `output 5 on`; whether it was, within so many seconds. */
  advanceUntil(condition: string, within: number): Promise<boolean>;
  /** Waits, without moving time, until a condition is met. */
  waitUntil(condition: string, within: number): Promise<boolean>;
  powerOff(): Promise<void>;
  powerOn(): Promise<void>;
  /** Arms a fault: no-reply:command=SU. */
  armFault(spec: string): Promise<void>;
  /** Closes the connection of the peer of a port: IP1. */
  dropPeer(port: string): Promise<void>;
  takeSnapshot(name: string): Promise<void>;
  restore(name: string): Promise<void>;
  /** As when the emulator was started: a fresh robot for the next test. Hosts are disconnected; findings begin anew. */
  reset(): Promise<void>;
  findings(): Promise<Finding[]>;
  /** What went over the ports since the start or the last reset. */
  transcript(): Promise<string>;
  /** Throws FindingsError where the host has made mistakes of this severity (default: warning) and worse. */
  checkFindings(options?: { deny?: Severity; allow?: string[] }): Promise<void>;
}

/** An emulator that start() has started. */
export class StartedRobot extends Robot {
  private constructor();
  /** Where to connect. */
  readonly address: string;
  /** The TCP ports of the channels. */
  readonly ports: { ip0: number; ip1: number; ip2: number; ip3: number };
  readonly controlUrl: string;
  /** The last lines of its log. */
  log(): string;
  /** Ends it; it writes its reports first, except on Windows. */
  stop(): Promise<void>;
}

/**
 * Starts `ts3100 serve` on free ports and waits until it is ready. It ends with this process at the latest; on Windows not if this
 * process is killed.
 */
export function start(options?: {
  /** Options of `ts3100 serve`; variables that set options have no effect. */
  args?: string[];
}): Promise<StartedRobot>;

/** The path of the binary of this platform; TS3100_BINARY names another one. */
export function binary(): string;
