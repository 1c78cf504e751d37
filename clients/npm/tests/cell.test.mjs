// A test of a cell with Node's own test runner: one robot for the file, a fresh one for each test.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtemp, readdir, readFile, rm } from "node:fs/promises";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, afterEach, before, beforeEach, test } from "node:test";
import { binary, Robot, start } from "ts3100";

process.env.TS3100_KEY_SWITCH = "teaching"; // has no effect

const ASK = 'GLOBAL\nCOUNT = 3\nRATE = 0.5\nEND\nPROGRAM ASK\nPRINT IP1, "HOW FAR?", CR\nINPUT IP1, X\nPRINT IP1, "THAT IS", X, CR\nEND\n';

let robot;
before(async () => { robot = await start(); });
beforeEach(() => robot.reset("real"));
afterEach(() => robot.checkFindings({ allow: ["refused-by-state"] }));
after(() => robot.stop());

test("the robot places a part", async () => {
  await robot.setTimeMode("stepped");
  const host = await robot.host();
  await host.servoOn();
  await host.download("PICK", "PROGRAM PICK\nWAIT DIN(1)\nDELAY 2\nDOUT(5)\nEND\n");
  await host.select("PICK");
  await host.start();
  await robot.setInput(1, true);
  const { now } = await robot.advanceUntil("output 5 on", 10);
  assert.ok(now >= 2);
  assert.deepEqual((await host.totalStatus()).outputs.filter((line) => line < 200), [5]);
  await host.close();
});

test("the next test finds a fresh robot", async () => {
  const { servo, files } = await robot.state();
  assert.equal(servo, false);
  assert.ok(!files.files.some((file) => file.name === "PICK"));
});

test("the emergency stop refuses a start", async () => {
  await robot.setEmergencyStop(true);
  const host = await robot.host();
  await assert.rejects(host.servoOn(), { name: "Refused", command: "SO" });
  await host.close();
  await assert.rejects(robot.setServo(true), { name: "ControlError", status: 409, message: "cannot turn the servo on: the emergency stop is pressed" });
});

test("a wrong host is named", async () => {
  const host = await robot.host();
  await assert.rejects(host.command("XX"), { name: "Refused" });
  await assert.rejects(robot.checkFindings({ trace: "off" }), (error) => {
    assert.equal(error.name, "FindingsError");
    assert.match(error.message, /IP0: unknown command "XX" \(unknown-command, error\)\. Use a command that/);
    assert.match(error.message, /> IP0 XX<CR>\n {2}< IP0 NG<CR>$/);
    return true;
  });
  await host.close();
  await robot.reset();
});

test("a failed test keeps its run", async (context) => {
  const artifacts = await mkdtemp(join(tmpdir(), "it's a trace-")), kept = async () => (await readdir(artifacts)).map((name) => name.replace(/^.*?mjs-/, ""));
  context.after(() => rm(artifacts, { recursive: true }));
  const printed = context.mock.method(console, "log", () => {});
  const host = await robot.host();
  await host.status();
  await robot.checkFindings({ artifacts, test: "passed" });
  await robot.checkFindings({ artifacts, test: { name: "off", passed: false }, trace: "off" });
  assert.deepEqual(await kept(), []);
  await robot.checkFindings({ artifacts, test: { name: "failed otherwise", passed: false } });
  assert.match(printed.mock.calls[0].arguments[0], /^ts3100 view '.*it'\\''s a trace-.*\/\S+-failed-otherwise-1\.txt' --last received\npage: .*-1\.html$/);
  await robot.checkFindings({ artifacts, test: "passed", trace: "on" });
  assert.equal(printed.mock.callCount(), 1);
  await assert.rejects(host.select("NOFILE"), { name: "Refused" });
  await robot.checkFindings({ artifacts, allow: ["refused-by-state"], failed: true });
  assert.match(printed.mock.calls[1].arguments[0], / --first ng\npage: /);
  await assert.rejects(host.command("XX"), { name: "Refused" });
  await assert.rejects(robot.checkFindings({ artifacts, deny: "error" }), { message: /\nts3100 view .* --first unknown-command\npage: .*-4\.html$/ });
  assert.deepEqual((await kept()).sort(), ["failed-otherwise-1", "passed-2", "test-3", "test-4"].flatMap((name) => [`${name}.html`, `${name}.txt`]));
  const page = await readFile(join(artifacts, (await readdir(artifacts)).find((name) => name.endsWith("4.html"))), "utf8");
  assert.match(page, /unknown command/);
  await assert.rejects(robot.checkFindings({ trace: "always" }), RangeError);
  const program = process.env.TS3100_BINARY;
  process.env.TS3100_BINARY = join(artifacts, "none");
  try {
    await assert.rejects(robot.checkFindings({ artifacts, deny: "error" }), { message: /\nno page: .*ENOENT\nmake it with ts3100 view .* --html / });
  } finally {
    if (program) process.env.TS3100_BINARY = program;
    else delete process.env.TS3100_BINARY;
  }
  await host.close();
  await robot.reset();
});

test("files, variables and status of a host", async () => {
  const host = await robot.host();
  const long = "' A remark that makes the file long.\n".repeat(20) + ASK;
  await host.download("ASK", long);
  assert.equal(await host.upload("ASK"), long);
  assert.equal((await host.directory()).ASK, long.length);
  assert.match(await host.version(), /^TS3100/);
  await host.select("ASK");
  await host.setOverride(40);
  await host.writeVariable("COUNT", 12);
  await host.writeVariable("RATE", 0.25);
  assert.deepEqual([await host.readVariable("COUNT"), await host.readVariable("RATE")], [[12], [0.25]]);
  const { file, override, operationMode, status } = await host.status();
  assert.deepEqual([file, override, operationMode, status], ["ASK", 40, "cycle", "stop (reset)"]);
  await host.setOutputs({ 3: true, 4: false });
  await robot.setInput(201, true);
  await robot.raiseAlarm("1-200");
  const total = await host.totalStatus();
  assert.deepEqual([total.isScara, total.alarms, total.inputs, total.outputs.includes(3)], [false, ["1-200"], [201], true]);
  assert.deepEqual(total.world.map(Math.fround), (await robot.state()).arm.world.map(Math.fround));
  host.stx = false;
  assert.equal((await host.status()).file, "ASK");
  await host.close();
  const scara = await start({ args: ["--model", "tsl3000-thl400", "--servo-on"] }), other = await scara.host();
  const { isScara, servoOn, joints } = await other.totalStatus();
  assert.deepEqual([isScara, servoOn, joints.length, (await other.status()).status], [true, true, 6, "stop (reset)"]);
  await other.close();
  await scara.stop();
});

test("an answer that comes too late is not that of the next command", async () => {
  const host = await robot.host({ timeout: 0.2 });
  await robot.armFault("late-reply:command=SU,delay=400");
  await assert.rejects(host.status(), { name: "NoReply", message: /^the robot did not send an answer to SU within 0.2 s: the clock runs / });
  await new Promise((done) => setTimeout(done, 300));
  assert.match(await host.version(), /^TS3100/);
  await host.close();
  await robot.reset();
});

test("a wait that times out says what is there instead", async () => {
  await robot.reset("stepped");
  await robot.setServo(true);
  await robot.putFile("ASK", ASK);
  await robot.selectFile("ASK");
  const channel = await robot.channel("ip1", { timeout: 0.1 });
  await robot.startProgram();
  const stopped = "the clock is stepped and stopped at 0 s; ASK is running, line 7, an INPUT waits for IP1; alarms: none; outputs on: ";
  await assert.rejects(robot.advanceUntil("output 9 on", 0), ({ name, message }) => name === "NotReached" && message.startsWith(
    `\`output 9 on\` was not met within 0 s of virtual time: ${stopped}`) && message.endsWith("; IP1 printed HOW FAR?<CR>, the pendant nothing"));
  await assert.rejects(channel.waitForLine("EVER"), ({ name, message }) => name === "NoReply"
    && message.startsWith(`IP1: expected a line with \`EVER\` within 0.1 s, found \`HOW FAR?\`: ${stopped}`));
  await channel.sendLine("2.5");
  assert.equal(await channel.waitForLine("THAT IS"), "THAT IS       2.500");
  await robot.putFile("ASK", 'PROGRAM ASK\nPRINT IP1, "HALF"\nDELAY 1\nPRINT IP1, "DONE", CR\nEND\n');
  await robot.selectFile("ASK");
  await robot.startProgram();
  await assert.rejects(channel.readLine(), ({ message }) => message.startsWith("IP1: expected a line within 0.1 s, found `HALF`: "));
  await robot.advance(1);
  assert.equal(await channel.readLine(), "HALFDONE");
  await robot.dropPeer("ip1");
  await assert.rejects(channel.readLine(), { name: "Disconnected" });
  await channel.close();
  await robot.reset("real");
});

test("a wait that takes too long in wall-clock time", async () => {
  const busy = createServer((call, answer) => {
    const documents = { "/wait": [408, { error: "too long" }], "/state": [200, { time_mode: "stepped", t: 1, file: "", tasks: [], alarms: [], outputs: { on: [] }, pendant: "" }] };
    const [status, document] = documents[call.url] || [200, ""];
    answer.writeHead(status, { "content-type": "application/json" }).end(JSON.stringify(document));
  }).listen(0, "127.0.0.1");
  await once(busy, "listening");
  await assert.rejects(new Robot(`http://127.0.0.1:${busy.address().port}`).waitUntil("idle"), { name: "NotReached", message: "`idle` was not met within 30 s "
    + "of wall-clock time: the clock is stepped and stopped at 1 s; no file is selected; alarms: none; outputs on: none; the pendant printed nothing" });
  busy.close();
});

test("what a robot, a host or a channel does not have cannot be set", async () => {
  const [host, channel] = [await robot.host(), await robot.channel()];
  for (const [one, name] of [[robot, "servo"], [new Robot(robot.controlUrl), "srvo"], [host, "puase"], [channel, "timeout"]]) {
    assert.throws(() => { one[name] = true; }, { name: "TypeError", message: `Cannot add property ${name}, object is not extensible` });
  }
  host.pause = 0;
  await host.close();
  await channel.close();
});

test("a duration has the form of the command line", async () => {
  await robot.reset("stepped");
  for (const duration of [0.5, "0.5", "0.5 s", "500ms", "500000 us"]) {
    const { now } = await robot.clock();
    await robot.advance(duration);
    assert.equal((await robot.clock()).now, now + 0.5);
  }
  await robot.pulseInput(5, "250 ms");
  assert.equal((await robot.advanceUntil("input 5 off", "1 min")).passed, 0.25);
  await assert.rejects(robot.waitUntil("idle", "soon"), { name: "TypeError",
    message: "cannot read `soon` as a duration: expected seconds, or e.g. `5s`, `500 ms`, `1.5 s`" });
  await robot.reset("real");
});

test("any operation is called by its name", async () => {
  assert.equal((await robot.call("put_input", { line: 5, on: true })).on, true);
  assert.match(await robot.call("get_events", { since: 1, count: 1 }), /^event:/);
  await assert.rejects(robot.call("get_inputt"), { message: "unknown operation get_inputt" });
  await assert.rejects(robot.call("get_input"), { message: "get_input needs the argument line" });
  await assert.rejects(robot.call("get_input", { line: 5, on: true }), { message: "get_input has no argument on" });
});

test("the robot of exec", async () => {
  assert.throws(() => Robot.fromEnvironment(), { name: "ControlError", message: "TS3100_CONTROL_URL is not set: run the tests by `ts3100 exec -- npm test`" });
  const code = 'import { Robot } from "ts3100"; console.log(await Robot.fromEnvironment().override());';
  const exec = spawn(binary(), ["exec", "--", process.execPath, "--input-type=module", "-e", code], { stdio: ["ignore", "pipe", "ignore"] });
  assert.equal(String((await once(exec.stdout, "data"))[0]), "100\n");
  assert.deepEqual(await once(exec, "exit"), [0, null]);
});

test("one of several robots, and COM1 as bare TCP", async () => {
  const cell = await start({ args: ["--robots", "2", "--serial-com1-tcp", "127.0.0.1:0"] });
  const [one, two] = ["robot-1", "robot-2"].map((name) => new Robot(`${cell.controlUrl}/robots/${name}`));
  assert.notEqual((await one.address()).port, (await two.address()).port);
  await two.setServo(true);
  await two.putFile("ASK", ASK.replaceAll("IP1", "COM1"));
  await two.selectFile("ASK");
  const channel = await two.channel("com1");
  await two.startProgram();
  assert.equal(await channel.readLine(), "HOW FAR?");
  assert.equal(await one.status(), "stop (reset)");
  await channel.close();
  await cell.stop();
});

test("variables, alarms, snapshots, the log", async () => {
  await robot.putFile("ASK", "GLOBAL\nCOUNT = 3\nEND\nPROGRAM ASK\nEND\n");
  await robot.selectFile("ASK");
  await robot.setVariable("COUNT", 7);
  await robot.takeSnapshot("seven");
  await robot.setVariable("COUNT", 8);
  await robot.restoreSnapshot("seven");
  assert.deepEqual(await robot.variable("COUNT"), [7]);
  await robot.raiseAlarm("2-046");
  assert.deepEqual((await robot.alarms()).map((alarm) => alarm.number), ["2-046"]);
  assert.match(robot.log(), /reset/);
});

test("what cannot start says why", async () => {
  await assert.rejects(start({ args: ["--no-such-option"] }), /exit code 2 before it was ready:\n.*--no-such-option/s);
  await assert.rejects(start({ args: ["--control", "off"] }), /its options turn the control interface off/);
});

test("many robots", async () => {
  const warnings = [], warned = (warning) => warnings.push(warning.name);
  process.on("warning", warned);
  const robots = await Promise.all(Array.from({ length: 11 }, () => start()));
  await Promise.all(robots.map((one) => one.stop()));
  process.off("warning", warned);
  assert.deepEqual(warnings, []);
});

test("an answer that breaks off is an error of the control interface", async (context) => {
  const broken = createServer((_, answer) => { answer.write("{"); setTimeout(() => answer.destroy(), 50); }).listen(0, "127.0.0.1");
  context.after(() => broken.close());
  await once(broken, "listening");
  const url = `http://127.0.0.1:${broken.address().port}`;
  await assert.rejects(new Robot(url).state(), (error) => error.name === "ControlError" && error.message.startsWith(`cannot reach ${url}: `));
});

test("a robot ends with its test, also when that is killed", { skip: process.platform === "win32" }, async () => {
  for (const signal of ["SIGTERM", "SIGKILL", "its own end"]) {
    const rest = signal.startsWith("SIG") ? "setTimeout(() => {}, 60000);" : "setTimeout(() => process.exit(), 500);";
    const code = `import { start } from "ts3100"; console.log((await start()).controlUrl); ${rest}`;
    const killed = spawn(process.execPath, ["--input-type=module", "-e", code], { stdio: ["ignore", "pipe", "inherit"] });
    const url = String((await once(killed.stdout, "data"))[0]).trim();
    assert.ok((await fetch(url + "/health")).ok);
    if (signal.startsWith("SIG")) killed.kill(signal);
    const limit = performance.now() + 10_000;
    await assert.rejects(async () => {
      while (performance.now() < limit) await fetch(url + "/health");
    });
  }
});

test("a fresh robot costs little", async (context) => {
  const robots = 500, begun = performance.now();
  for (let count = 0; count < robots; count++) {
    await robot.reset();
    await robot.checkFindings();
  }
  context.diagnostic(`${((performance.now() - begun) / robots).toFixed(2)} ms for a fresh robot and its findings`);
});
