// A host with a mistake: this test has to fail, and to say why.
import { connect } from "node:net";
import { test } from "node:test";
import { start } from "ts3100";

test("sends a command that no robot knows", async () => {
  const robot = await start();
  const socket = connect(robot.ports.ip0, robot.address);
  socket.write("\x02XX\r\x03");
  await new Promise((done) => socket.once("data", done));
  socket.destroy();
  await robot.checkFindings();
});
