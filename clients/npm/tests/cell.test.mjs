// A test of a cell with Node's own test runner: one robot for the file, a fresh one for each test.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { createServer } from "node:http";
import { connect } from "node:net";
import { after, afterEach, before, beforeEach, test } from "node:test";
import { Robot, start } from "ts3100";

process.env.TS3100_KEY_SWITCH = "teaching"; // has no effect

let robot;
before(async () => { robot = await start(); });
beforeEach(() => robot.reset());
afterEach(() => robot.checkFindings({ allow: ["refused-by-state"] }));
after(() => robot.stop());

/** Your host program: here it sends commands, 50 ms after each answer, and returns the answers. */
async function host(...commands) {
  const socket = connect(robot.ports.ip0, robot.address);
  const answers = [];
  try {
    for (const command of commands) {
      socket.write(`\x02${command}\r\x03`);
      answers.push(await new Promise((done, fail) => socket.once("data", done).once("error", fail)));
      await new Promise((done) => setTimeout(done, 51));
    }
  } finally {
    await new Promise((done) => socket.end(done));
  }
  return answers.map((answer) => answer.toString().replace(/[\x02\x03\r]/g, ""));
}

test("the robot places a part", async () => {
  await robot.setTime("stepped");
  await robot.putFile("PICK", "PROGRAM PICK\nWAIT DIN(1)\nDELAY 2\nDOUT(5)\nEND\n");
  assert.deepEqual(await host("SO", "SL,PICK", "RN"), ["OK", "OK", "OK"]);
  await robot.setInput(1, true);
  assert.ok(await robot.advanceUntil("output 5 on", 10));
  assert.ok((await robot.now()) >= 2);
});

test("the next test finds a fresh robot", async () => {
  const { servo, files } = await robot.state();
  assert.equal(servo, false);
  assert.ok(!files.files.some((file) => file.name === "PICK"));
});

test("the emergency stop refuses a start", async () => {
  await robot.pressEmergencyStop();
  assert.deepEqual(await host("SO"), ["NG"]);
  await assert.rejects(robot.setServo(true), { name: "ControlError", status: 409, message: "cannot turn the servo on: the emergency stop is pressed" });
});

test("a wrong host is named", async () => {
  await host("XX");
  await assert.rejects(robot.checkFindings(), (error) => {
    assert.equal(error.name, "FindingsError");
    assert.match(error.message, /IP0: unknown command "XX" \(unknown-command, error\)\. Begin a message/);
    assert.match(error.message, /> IP0 XX<CR>\n {2}< IP0 NG<CR>/);
    return true;
  });
  await robot.reset();
});

test("variables, alarms, snapshots, the log", async () => {
  await robot.putFile("ASK", "GLOBAL\nCOUNT = 3\nEND\nPROGRAM ASK\nEND\n");
  await robot.select("ASK");
  await robot.setVariable("COUNT", 7);
  await robot.takeSnapshot("seven");
  await robot.setVariable("COUNT", 8);
  await robot.restore("seven");
  assert.deepEqual(await robot.variable("COUNT"), [7]);
  await robot.raiseAlarm("2-046");
  assert.deepEqual(await robot.alarms(), ["2-046"]);
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
