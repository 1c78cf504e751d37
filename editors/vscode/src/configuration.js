// Command lines and debug configurations, made of settings and of the file in front. Nothing here needs an editor.

const path = require("node:path");

/** Name of the language, and of the debugger. */
const SCOL = "scol";

/** @typedef {{ model: string, points: string }} Settings */

/**
 * @typedef {object} Front the file in front
 * @property {string} languageId
 * @property {boolean} isUntitled
 */

/**
 * The flags of the settings, which are the same for every subcommand that reads programs.
 * @param {Settings} settings
 */
function flags({ model, points }) {
  return [...(model ? ["--model", model] : []), ...(points ? ["--points", points] : [])];
}

/**
 * The command line of a task.
 * @param {{ command: string, file?: string, args?: string[] }} task
 * @param {Settings} settings
 */
function taskArguments(task, settings) {
  return [task.command, ...flags(settings), ...(task.args ?? []), task.file ?? "${file}"];
}

/**
 * The flags that put a program on the RAM drive and select it. On the controller it has the name of the file, in capitals and
 * without the ending.
 * @param {string} file
 */
function loadArguments(file) {
  return ["--load", file, "--select", path.parse(file).name.toUpperCase()];
}

/**
 * A debug configuration with what it leaves to defaults. An empty one comes from F5 without a launch file.
 * @param {Record<string, any>} given
 * @param {Front | undefined} front
 * @param {Settings} settings
 * @returns {{ configuration: Record<string, any> } | { problem: string }}
 */
function debugConfiguration(given, front, settings) {
  /** @type {Record<string, any>} */
  const ofFront = { type: SCOL, request: "launch", name: "Run this file" };
  const isEmpty = !given.type && !given.request && !given.name;
  const configuration = isEmpty ? ofFront : { ...given };
  if (configuration.request === "attach" || configuration.recording) return { configuration };
  configuration.program ||= "${file}";
  if (configuration.program === "${file}") {
    // Before the editor puts a name there: that of another file would be told as a program full of errors.
    if (front?.languageId !== SCOL) {
      return { problem: "cannot debug: no SCOL file is in front; open one, or name `program` in launch.json" };
    }
    if (front.isUntitled) {
      return { problem: "cannot debug: this program has no file yet; save it first" };
    }
  }
  for (const name of /** @type {const} */ (["model", "points"])) {
    if (settings[name]) configuration[name] ??= settings[name];
  }
  return { configuration };
}

/**
 * The line, from 0, of the first PROGRAM: the main program, at which a start begins.
 * @param {string} text
 */
function mainProgram(text) {
  const line = text.split(/\r\n|\r|\n/).findIndex(line => /^\s*PROGRAM\s+[A-Z]/i.test(line));
  return line < 0 ? undefined : line;
}

module.exports = { SCOL, debugConfiguration, flags, loadArguments, mainProgram, taskArguments };
