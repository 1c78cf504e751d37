import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";
import { start } from "ts3100";

const ASK = `PROGRAM ASK
PRINT IP1, "HOW FAR?", CR
INPUT IP1, X
PRINT IP1, "GOING", CR
MOVE POINT(400, X, 200)
END
`;
let robot;
before(async () => { robot = await start(); });
beforeEach(() => robot.reset("stepped"));
afterEach(() => robot.checkFindings({ allow: ["refused-by-state"] }));
after(() => robot.stop());

test("the emergency stop ends the motion", async () => {
  const host = await robot.host();
  const channel = await robot.channel("ip1");
  await host.servoOn();
  await host.download("ASK", ASK);
  await host.select("ASK");
  await host.start();
  await channel.waitForLine("HOW FAR?");
  await channel.sendLine("62.5");
  await channel.waitForLine("GOING");
  await robot.advance(0.2);
  await robot.setEmergencyStop(true);
  assert.equal(await robot.status(), "stop (retry)");
  await assert.rejects(host.start(), { name: "Refused" });
  assert.equal((await robot.alarms())[0].number, "8-014");
  assert.equal((await robot.findings()).at(-1).rule, "refused-by-state");
  await host.close();
  await channel.close();
});
