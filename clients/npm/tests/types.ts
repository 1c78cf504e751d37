// What TypeScript has to accept of index.d.ts, and what it has to refuse.
import { binary, ControlError, FindingsError, Robot, start, type Finding } from "ts3100";

export async function cell(): Promise<number> {
  const robot = await start({ args: ["--servo-on"] });
  const port: number = robot.ports.ip0;
  const findings: Finding[] = await robot.findings();
  await robot.checkFindings({ deny: "note", allow: findings.map((finding) => finding.rule) });
  const other: Robot = new Robot(robot.controlUrl);
  const reached: boolean = await other.advanceUntil("output 5 on", 10);
  try {
    await robot.stop();
  } catch (error) {
    if (error instanceof FindingsError) throw new Error(error.findings[0]?.rule);
    if (error instanceof ControlError && error.status === 0) throw new Error(binary());
  }
  // @ts-expect-error: no such severity
  await robot.checkFindings({ deny: "fatal" });
  // @ts-expect-error: only start() makes one
  new (await import("ts3100")).StartedRobot();
  return reached ? port : 0;
}
