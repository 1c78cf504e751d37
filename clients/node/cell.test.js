// The emulator in a container of the image ts3100 (or TS3100_IMAGE). Where `ts3100 exec -- npm test` has started one
// around the tests, that one is used, for machines without a container engine. Without containers: `npm install ts3100`.
import assert from "node:assert/strict";
import { once } from "node:events";
import { connect } from "node:net";
import { after, before, beforeEach, test } from "node:test";
import { setTimeout as sleep } from "node:timers/promises";
import { GenericContainer, Wait } from "testcontainers";

const IP0 = 1000, CONTROL = 3100;
let container, address, ip0, control;

before(async () => {
  if (process.env.TS3100_CONTROL_URL) {
    [address, ip0, control] = [process.env.TS3100_HOST, Number(process.env.TS3100_IP0_PORT), process.env.TS3100_CONTROL_URL];
    return;
  }
  container = await new GenericContainer(process.env.TS3100_IMAGE ?? "ts3100")
    .withExposedPorts(IP0, 1001, 1002, CONTROL)
    // The network of the container is the test's own, so the control interface needs no token.
    .withEnvironment({ TS3100_CONTROL_OPEN: "1" })
    .withWaitStrategy(Wait.forHttp("/health", CONTROL))
    .start();
  [address, ip0] = [container.getHost(), container.getMappedPort(IP0)];
  control = `http://${address}:${container.getMappedPort(CONTROL)}`;
});
beforeEach(() => call("POST", "/reset", {}));
after(() => container?.stop());

async function call(method, path, body) {
  const answer = await fetch(control + path, {
    method, headers: body && { "content-type": "application/json" }, body: body && JSON.stringify(body),
  });
  const result = await answer.json();
  assert.ok(answer.ok, result.error);
  return result;
}

/** Your host program: here it sends commands, 50 ms after each answer, and returns the answers. */
async function host(...commands) {
  const socket = connect(ip0, address).setNoDelay().setEncoding("ascii");
  const answers = [];
  for (const command of commands) {
    socket.write(`\x02${command}\r\x03`);
    answers.push((await once(socket, "data"))[0].slice(1, -2));
    await sleep(51);
  }
  socket.end();
  return answers;
}

test("the robot places a part", async () => {
  await call("PUT", "/clock", { mode: "stepped" });
  await call("PUT", "/files/PICK", { text: "PROGRAM PICK\nWAIT DIN(1)\nDELAY 2\nDOUT(5)\nEND\n" });
  assert.deepEqual(await host("SO", "SL,PICK", "RN"), ["OK", "OK", "OK"]);
  await call("PUT", "/inputs/1", { on: true });
  assert.ok((await call("POST", "/clock/advance-until", { condition: "output 5 on", within: 10 })).reached);
});

test("the emergency stop refuses a start", async () => {
  await call("PUT", "/emergency-stop", { pressed: true });
  assert.deepEqual(await host("SO"), ["NG"]);
});

test("a wrong host is named", async () => {
  await host("XX");
  assert.deepEqual((await call("GET", "/findings")).map((finding) => finding.rule), ["unknown-command"]);
});
