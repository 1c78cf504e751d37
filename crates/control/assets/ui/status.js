// What the robot does, in the words of the manual: one sentence for the bar, the pages of the pendant, and the cards of a cell.

const WAITS = ["wait", "input", "delay", "held", "queued", "resting"];

/** The statement of a line, without its label and comment. */
const statement = line => (line ?? "").replace(/^\s*[A-Za-z][A-Za-z0-9_]*:/, "").replace(/'(?=[^"]*(?:"[^"]*"[^"]*)*$).*$/, "").trim();

/** The condition of a WAIT: `DIN(5)` is an input, everything else is shown as written. */
function condition(text) {
  const [, sign, number] = /^DIN\(\s*(-?)(\d+)\s*\)$/i.exec(text) ?? [];
  return number ? "input " + number + (sign ? " off" : "") : text;
}

/** The last line that PRINT has shown: the question of an INPUT. */
const question = text => text.split(/[\r\n]+/).filter(line => line.trim()).at(-1)?.trim();

/** What a task waits for. */
function awaited(task, state, lines) {
  const written = statement(lines[task.line - 1]);
  if (task.doing === "input") {
    if (!task.reads) {
      const asked = question(state.pendant);
      return asked ? "asks: " + asked : "waits for a value at the pendant";
    }
    const port = state.channels.find(one => one.port === task.reads);
    return port?.peer ? "waits for a value from " + task.reads : "waits for a peer on " + task.reads;
  }
  if (task.doing === "wait") return "waits for " + (condition(/^WAIT\s+(.+)$/i.exec(written)?.[1] ?? "") || "its condition");
  if (task.doing === "delay") return "waits: " + (written || "DELAY");
  return task.doing === "held" ? "waits for the end of the feed hold" : "waits for the arm";
}

/** The line that an alarm names, of the selected file. */
export function failingLine(state) {
  for (const alarm of state.alarms) {
    const line = /: line (\d+)\b/.exec(alarm.text);
    if (line) return Number(line[1]);
  }
  return 0;
}

/** `[kind, words]` for the present state. Kinds are ok (it runs), warn (it waits), bad and off. */
export function status(state, lines = []) {
  if (!state.power) return ["bad", "power off"];
  if (state.emergency_stop) return ["bad", "emergency stop"];
  if (state.safety_open) return ["bad", "safety switch open"];
  const program = state.tasks.filter(task => task.id > 0);
  if (state.status === "running") {
    if (state.feed_hold) return ["warn", "feed hold"];
    const waiting = program.filter(task => WAITS.includes(task.doing));
    if (!waiting.length || waiting.length < program.length || state.arm.moving) return ["ok", "running"];
    return ["warn", waiting.map(task => (task.id > 1 ? "task " + task.id + " " : "") + awaited(task, state, lines)).join(", ")];
  }
  if (state.arm.moving) return ["ok", "moving"];
  if (state.status !== "stop (reset)" && !state.alarms.length && state.breakpoints.includes(state.line)) return ["warn", "breakpoint, line " + state.line];
  return ["off", state.status];
}

/** Where START begins: the file, and the line unless it is the first. */
export const place = state => !state.file ? "" : state.status === "stop (reset)" ? state.file : state.file + " line " + (state.executed_line || state.line);
