// A host with a mistake: this test has to fail, and to say why.
import { test } from "node:test";
import { start } from "ts3100";

test("sends a command that no robot knows", async () => {
  const robot = await start();
  const host = await robot.host();
  await host.command("XX").catch(() => {}); // this host does not look at the answer
  await host.close();
  await robot.checkFindings();
});
