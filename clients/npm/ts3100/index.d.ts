/// <reference lib="es2022" />
import type { ActiveAlarm, ArmPosture, Channel as ChannelState, Clock, Event, Fault, JogCoordinates, JogSpeed, KeyPosition, Operations,
  ProgramStatus, RightHolder, RunMode, State, Status as ExecutionStatus, Variable, WaitFor, WaitResult } from "./operations.js";
export type * from "./operations.js";

/** How bad a finding is. */
export type Severity = "note" | "warning" | "error";

/** A protocol mistake of a host; "caused-by" names the fault that has caused it, and is absent if the host has. */
export type Finding = Event & { rule: string; severity: Severity; port: string; message: string; remedy: string };

/** The emulator refused a call, with its sentence as the message; nothing has changed. */
export class ControlError extends Error {
  /** The HTTP status: 409 if the state forbids the call; 0 without an answer. */
  readonly status: number;
}

/** The host of a test has made protocol mistakes; the message names them and the last texts. */
export class FindingsError extends Error {
  readonly findings: Finding[];
}

/** The robot answered NG. */
export class Refused extends Error {
  readonly command: string;
}

/** The robot sent something that the protocol does not allow here. */
export class ProtocolError extends Error {}
/** The connection has ended. */
export class Disconnected extends Error {}
/** The robot sent nothing, or not the expected line, in time. */
export class NoReply extends Error {}
/** A condition was not met in time; the message says what is there instead. */
export class NotReached extends Error {}

/** Seconds, or a text with its unit: "500 ms". */
export type Duration = number | string;

/** Any number of these is left out when it is the default. */
export interface LinkOptions {
  /** Longest wait for an answer or a line, in seconds; default 5. */
  timeout?: number;
  /** What a message calls the connection. */
  name?: string;
  /** Adds to the message of NoReply. */
  describe?: () => string | Promise<string>;
}

export interface HostOptions extends LinkOptions {
  /** Pause after a text of the robot, in seconds; default the manual's 0.05. */
  pause?: number;
  /** Whether texts begin with STX; default true. */
  stx?: boolean;
}

/** The status that SU returns. */
export interface HostStatus {
  masterMode: string;
  operationMode: string;
  file: string;
  override: number;
  machineLock: boolean;
  status: ExecutionStatus;
}

/** The total status that SF returns. */
export interface TotalStatus {
  isScara: boolean;
  servoOn: boolean;
  emergencyStop: boolean;
  feedHold: boolean;
  /** The line that is executed. */
  line: number;
  status: ExecutionStatus;
  /** Active alarms, oldest first: 2-046. */
  alarms: string[];
  /** The lines that are on. */
  inputs: number[];
  outputs: number[];
  /** In degrees; axis 3 of a SCARA in mm. */
  joints: number[];
  /** The tool point: X Y Z A B C and axes 7, 8; of a SCARA X Y Z C T 0. */
  world: number[];
  work: number[];
}

/** A host of the simple protocol on IP0, for the emulator or a real robot. Make one call at a time. */
export class Host {
  private constructor();
  static connect(address: string, port: number, options?: HostOptions): Promise<Host>;
  pause: number;
  stx: boolean;
  /** A command that the robot answers with OK; NG is Refused. */
  command(text: string): Promise<void>;
  /** A command that the robot answers with a file or a status, without FL and EOF; a byte is a character. */
  query(text: string): Promise<string>;
  servoOn(): Promise<void>;
  servoOff(): Promise<void>;
  /** RN: starts the selected program, or continues it. */
  start(): Promise<void>;
  /** SP: stops the program after its statement. */
  stop(): Promise<void>;
  /** EC,BREAK: stops at once. */
  breakMotion(): Promise<void>;
  feedHold(): Promise<void>;
  select(name: string): Promise<void>;
  deselect(): Promise<void>;
  resetProgram(): Promise<void>;
  resetStep(): Promise<void>;
  resetCycle(): Promise<void>;
  resetSignals(): Promise<void>;
  resetAlarms(): Promise<void>;
  setOverride(percent: number): Promise<void>;
  /** EC,MODE: continuous is CONT. */
  setRunMode(mode: "cont" | "cycle" | "step" | "segment"): Promise<void>;
  /** DO: executes one statement. OK comes when it begins. */
  execute(statement: string): Promise<void>;
  /** IW: switches outputs, all of them or none: { 3: true }. */
  setOutputs(lines: Record<number, boolean>): Promise<void>;
  upload(name: string): Promise<string>;
  /** DL: stores a file on the RAM drive. The manual ends lines with CR; LF is accepted. */
  download(name: string, text: string): Promise<void>;
  erase(name: string): Promise<void>;
  /** Files and their sizes. */
  directory(): Promise<Record<string, number>>;
  version(): Promise<string>;
  status(): Promise<HostStatus>;
  totalStatus(): Promise<TotalStatus>;
  readVariable(name: string): Promise<number[]>;
  writeVariable(name: string, values: number | number[]): Promise<void>;
  /** Waits for the SP that the robot sends when a program has ended or was stopped. */
  waitForStop(timeout?: number): Promise<void>;
  close(): Promise<void>;
}

/** The peer of a SCOL channel: IP1 or IP2, or COM1 where it is served as bare TCP. */
export class Channel {
  private constructor();
  static connect(address: string, port: number, options?: LinkOptions): Promise<Channel>;
  /** Sends a line; INPUT expects commas between values. */
  sendLine(text: string): Promise<void>;
  /** The next line that the program prints, without its CR. */
  readLine(timeout?: number): Promise<string>;
  /** The next line with this text. Lines before it are dropped; if none comes in time, the message of NoReply has them. */
  waitForLine(text: string, timeout?: number): Promise<string>;
  close(): Promise<void>;
}

/** The control interface of an emulator. A call is done when its promise is fulfilled. */
export class Robot {
  /** @param url that of the ready line or of TS3100_CONTROL_URL; ends in /robots/NAME for one of several robots */
  constructor(url: string, token?: string);
  /** The robot that `ts3100 exec` has started around this process. */
  static fromEnvironment(): Robot;
  /** Makes a call by its operation in the OpenAPI document. The arguments are the parameters and the fields of the body. */
  call<K extends keyof Operations>(operation: K, ...values: {} extends Operations[K][0] ? [Operations[K][0]?] : [Operations[K][0]]): Promise<Operations[K][1]>;

  keySwitch(): Promise<KeyPosition>;
  setKeySwitch(position: KeyPosition): Promise<void>;
  controlRight(): Promise<RightHolder>;
  setControlRight(holder: RightHolder): Promise<void>;
  emergencyStop(): Promise<boolean>;
  setEmergencyStop(pressed: boolean): Promise<void>;
  safetySwitch(): Promise<boolean>;
  setSafetySwitch(open: boolean): Promise<void>;
  servo(): Promise<boolean>;
  setServo(on: boolean): Promise<void>;
  feedHold(): Promise<boolean>;
  setFeedHold(on: boolean): Promise<void>;
  machineLock(): Promise<boolean>;
  setMachineLock(on: boolean): Promise<void>;
  battery(): Promise<boolean>;
  setBattery(low: boolean): Promise<void>;
  override(): Promise<number>;
  setOverride(percent: number): Promise<void>;
  runMode(): Promise<RunMode>;
  setRunMode(mode: RunMode): Promise<void>;
  breakpoints(): Promise<number[]>;
  setBreakpoints(lines: number[]): Promise<void>;
  /** How time passes: real, x10, stepped or auto. */
  timeMode(): Promise<string>;
  setTimeMode(mode: string): Promise<void>;

  /** Everything at one moment. */
  state(): Promise<State>;
  /** Clock, program, alarms, outputs and the last printed lines in a sentence, for the message of a test that fails. */
  describe(): Promise<string>;
  /** Presses the button, which turns feed hold on or off. */
  pressFeedHold(): Promise<void>;
  /** Turns the power off: every port is closed. */
  powerOff(): Promise<void>;
  powerOn(): Promise<void>;
  powerCycle(): Promise<void>;
  /** As when the emulator was started: a fresh robot for the next test. Hosts are disconnected; findings begin again. */
  reset(mode?: string): Promise<void>;
  program(): Promise<ProgramStatus>;
  /** The execution status. */
  status(): Promise<ExecutionStatus>;
  selectFile(name: string): Promise<void>;
  /** Presses START. */
  startProgram(): Promise<void>;
  /** Presses STOP. */
  stopProgram(): Promise<void>;
  /** Goes back to the first step, with the initial values of the file. */
  resetProgram(): Promise<void>;
  stepProgram(): Promise<void>;
  /** Runs the program and stops before this line. */
  runProgramTo(line: number): Promise<void>;
  /** What programs have printed on the teach pendant. */
  pendant(): Promise<string>;
  /** Types at the teach pendant, for INPUT without a channel; \r ends a value. */
  pressKeys(keys: string): Promise<void>;
  /** Presses a key that moves the arm, until stopJog or for one step. */
  jog(axis: number, direction: "plus" | "minus", options?: { coordinates?: JogCoordinates; speed?: JogSpeed; inching?: boolean }): Promise<void>;
  stopJog(): Promise<void>;
  pose(): Promise<ArmPosture>;

  /** The active alarms, oldest first. */
  alarms(): Promise<ActiveAlarm[]>;
  /** The error history, newest first. */
  alarmHistory(): Promise<ActiveAlarm[]>;
  /** Raises an alarm: 2-046. */
  raiseAlarm(number: string, detail?: string): Promise<void>;
  resetAlarms(): Promise<void>;
  faults(): Promise<Fault[]>;
  /** Arms a fault: no-reply:command=SU. */
  armFault(spec: string): Promise<void>;
  disarmFault(id: number): Promise<void>;
  clearFaults(): Promise<void>;

  input(line: number): Promise<boolean>;
  /** The numbers of the inputs that are on. */
  inputs(): Promise<number[]>;
  setInput(line: number, on: boolean): Promise<void>;
  /** Sets a line and sets it back after this much virtual time. */
  pulseInput(line: number, duration: Duration, on?: boolean): Promise<void>;
  /** The line shows this state, whatever drives it, until it is released. */
  forceInput(line: number, on: boolean): Promise<void>;
  releaseInput(line: number): Promise<void>;
  output(line: number): Promise<boolean>;
  outputs(): Promise<number[]>;
  setOutput(line: number, on: boolean): Promise<void>;
  /** Turns a user output on, and off after this much virtual time. */
  pulseOutput(line: number, duration: Duration): Promise<void>;
  forceOutput(line: number, on: boolean): Promise<void>;
  releaseOutput(line: number): Promise<void>;
  /** The values of a variable of the selected file; absent if nothing was assigned yet. */
  variable(name: string): Promise<number[] | null | undefined>;
  variables(): Promise<Variable[]>;
  /** Sets a variable; with `restore` also in its file. */
  setVariable(name: string, value: number | number[], restore?: boolean): Promise<void>;
  position(name: string): Promise<number[] | null | undefined>;
  positions(): Promise<Variable[]>;
  setPosition(name: string, value: number[], restore?: boolean): Promise<void>;
  /** A position becomes the present one. */
  teachPosition(name: string, restore?: boolean): Promise<void>;
  /** The text of a file; absent if it is not UTF-8. */
  file(name: string): Promise<string | null | undefined>;
  /** The names of the files of the RAM drive. */
  files(): Promise<string[]>;
  putFile(name: string, text: string): Promise<void>;
  eraseFile(name: string): Promise<void>;

  /** Where ip0 to ip3, or a serial line that is served as bare TCP, accepts a connection; fits net.connect. */
  address(port?: string): Promise<{ host: string; port: number }>;
  /** A host that is connected to IP0. */
  host(options?: HostOptions): Promise<Host>;
  /** A peer that is connected to ip1 or ip2, or to com1 where it is served as bare TCP. */
  channel(name?: string, options?: LinkOptions): Promise<Channel>;
  /** A communication port (HOST, COM1, IP0 to IP3): its peer, its exchange, its buffer. */
  channelState(port: string): Promise<ChannelState>;
  /** Text as if the peer of a SCOL channel had sent it. */
  inject(port: string, text: string): Promise<void>;
  /** Closes the connection of the peer of a port. */
  dropPeer(port: string): Promise<void>;

  /** The virtual time, and how it passes. */
  clock(): Promise<Clock>;
  /** Advances a stopped clock. */
  advance(duration: Duration): Promise<void>;
  /** Advances a stopped clock until a condition is met, such as `output 5 on`; throws NotReached after this much virtual time, default 60 s. */
  advanceUntil(condition: WaitFor["condition"], within?: Duration): Promise<WaitResult>;
  /** Waits for a condition while time passes by itself; throws NotReached. */
  waitUntil(condition: WaitFor["condition"], within?: Duration): Promise<WaitResult>;
  snapshots(): Promise<string[]>;
  takeSnapshot(name: string): Promise<void>;
  /** Returns to a snapshot; hosts stay connected, findings and transcript continue. */
  restoreSnapshot(name: string): Promise<void>;
  deleteSnapshot(name: string): Promise<void>;
  findings(): Promise<Finding[]>;
  /** What went over the ports since the start or the last reset. */
  transcript(): Promise<string>;
  /**
   * Throws FindingsError where the host has made mistakes of this severity (default: warning) and worse. Keeps the run of a test that
   * fails: the transcript and a page that shows it. The command that opens the run at the failure is in the error; it is printed
   * if the test has failed otherwise.
   */
  checkFindings(options?: {
    deny?: Severity;
    allow?: string[];
    /** The test, for the name of its files: a name, or what a hook of `node:test` gets, which also tells whether it has failed. */
    test?: string | { readonly name: string; readonly passed?: boolean };
    /** Whether the test has failed already. */
    failed?: boolean;
    /** Which tests keep their run; default `retain-on-failure`. */
    trace?: "off" | "on" | "retain-on-failure";
    /** Directory for the files; default `ts3100-transcripts`. */
    artifacts?: string;
  }): Promise<void>;
}

/** An emulator that start() has started. */
export class StartedRobot extends Robot {
  private constructor();
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
