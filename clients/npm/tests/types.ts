// What TypeScript has to accept of index.d.ts, and what it has to refuse.
import { binary, ControlError, FindingsError, Host, Robot, start, type Finding, type State } from "ts3100";

export async function cell(): Promise<number> {
  const robot = await start({ args: ["--servo-on"] });
  const port: number = robot.ports.ip0;
  const findings: Finding[] = await robot.findings();
  await robot.checkFindings({ deny: "note", allow: findings.map((finding) => finding.rule) });
  const other: Robot = new Robot(robot.controlUrl);
  const reached: number = (await other.advanceUntil("output 5 on", 10)).now;
  const on: boolean = (await other.call("put_input", { line: 5, on: true })).on;
  const state: State = await other.call("get_state");
  const host: Host = await other.host({ pause: 0 });
  const line: string = await (await other.channel("ip1")).waitForLine(state.file);
  try {
    await robot.stop();
  } catch (error) {
    if (error instanceof FindingsError) throw new Error(error.findings[0]?.rule);
    if (error instanceof ControlError && error.status === 0) throw new Error(binary());
  }
  await robot.checkFindings({ test: { name: "cell", passed: false }, trace: "on", artifacts: "traces" });
  // @ts-expect-error: no such mode
  await robot.checkFindings({ trace: "always" });
  // @ts-expect-error: no such severity
  await robot.checkFindings({ deny: "fatal" });
  // @ts-expect-error: only start() makes one
  new (await import("ts3100")).StartedRobot();
  // @ts-expect-error: no such operation
  await other.call("get_inputt");
  // @ts-expect-error: an argument is missing
  await other.call("put_input", { line: 5 });
  // @ts-expect-error: no such position
  await other.setKeySwitch("off");
  await host.writeVariable("N", on ? line.length : reached);
  return port;
}
