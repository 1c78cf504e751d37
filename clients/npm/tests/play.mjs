// Plays the calls of a file at a URL by Robot.call, and prints an answer a line: tests/system/lib/recorded_calls.py compares them.
import { readFileSync } from "node:fs";
import { ControlError, Robot } from "ts3100";

const robot = new Robot(process.argv[3]);
for (const { operation, arguments: values } of JSON.parse(readFileSync(process.argv[2], "utf8"))) {
  const answer = await robot.call(operation, values).catch((error) => {
    if (error instanceof ControlError) return { error: error.message };
    throw error;
  });
  console.log(JSON.stringify(answer));
}
