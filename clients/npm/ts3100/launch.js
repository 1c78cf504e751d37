#!/usr/bin/env node
"use strict";
// `npx ts3100 ...`: runs the binary of this platform with the same arguments, streams, signals and exit code.

const { spawn } = require("node:child_process");
const os = require("node:os");
const { binary, environment } = require("./binary.js");

// 128 + N is how a shell reports signal N.
const SIGNALLED = 128, CANNOT_RUN = 126;

function fail(error) {
  console.error(`error: ${error.message}`);
  process.exit(CANNOT_RUN);
}

try {
  let child;
  // Before the child is there: it may be ready, and be told to end, before the next line here runs.
  // Ctrl-C reaches the child by itself, being in the same group; the launcher only waits for its end.
  process.on("SIGINT", () => {});
  for (const signal of ["SIGTERM", "SIGHUP"]) process.on(signal, () => child.kill(signal));
  // The emulator warns of variables with its prefix that it does not know.
  child = spawn(binary(), process.argv.slice(2), { stdio: "inherit", env: environment(/^TS3100_BINARY$/) });
  child.on("error", fail);
  child.on("exit", (code, signal) => process.exit(signal ? SIGNALLED + os.constants.signals[signal] : code));
} catch (error) {
  fail(error);
}
