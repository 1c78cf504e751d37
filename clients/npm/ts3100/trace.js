"use strict";
// The run of a test as files: the transcript, and a page that shows it in a browser.

const { execFile } = require("node:child_process");
const { mkdir, writeFile } = require("node:fs/promises");
const path = require("node:path");
const { promisify } = require("node:util");
const { binary, environment } = require("./binary.js");

const MODES = ["off", "on", "retain-on-failure"];
// A page is written in less than a second; a machine under load takes longer.
const PAGE_LIMIT_MS = 60_000;
const LONGEST_NAME = 100;

let kept = 0;

/** Whether the run of a test is kept. */
function isKept(mode, failed) {
  if (!MODES.includes(mode)) throw new RangeError(`trace: expected ${MODES.join(", ")}, found ${mode}`);
  return mode === "on" || (mode === "retain-on-failure" && failed);
}

/** Writes both. Returns the command that shows the moment of the failure, and where the page is. */
async function keep(folder, test, transcript, rule) {
  const program = path.basename(process.argv[1] || "test"), number = ++kept;
  const name = `${program}-${test}`.replace(/[^\p{L}\p{N}_.-]+/gu, "-").slice(-LONGEST_NAME);
  const file = path.resolve(folder, `${name}-${number}.txt`), page = file.replace(/txt$/, "html");
  await mkdir(path.dirname(file), { recursive: true });
  await writeFile(file, transcript);
  const view = `ts3100 view ${quoted(shown(file))}`, lines = [view + moment(transcript, rule)];
  try {
    await promisify(execFile)(binary(), ["view", file, "--html", page], { env: environment(/^TS3100_/), timeout: PAGE_LIMIT_MS, windowsHide: true });
    lines.push(`page: ${shown(page)}`);
  } catch (error) {
    // The failure of the test is reported all the same.
    lines.push(`no page: ${(error.stderr || error.message).trim()}`, `make it with ${view} --html ${quoted(shown(page))}`);
  }
  return lines.join("\n");
}

/** The finding that failed the test, otherwise the first NG, otherwise the last that a host sent. */
function moment(transcript, rule) {
  if (rule) return ` --first ${rule}`;
  if (/^<:? \S+ NG<CR>/m.test(transcript)) return " --first ng";
  return /^>:? /m.test(transcript) ? " --last received" : "";
}

/** A path, relative to the working directory if it is below. */
function shown(file) {
  const near = path.relative(process.cwd(), file);
  return near.startsWith("..") || path.isAbsolute(near) ? file : near;
}

/** A word for a shell. */
function quoted(word) {
  if (/^[\p{L}\p{N}_./\\:-]+$/u.test(word)) return word;
  return process.platform === "win32" ? `"${word}"` : `'${word.replaceAll("'", "'\\''")}'`;
}

module.exports = { isKept, keep };
