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
  // The emulator warns of variables with its prefix that it does not know.
  const child = spawn(binary(), process.argv.slice(2), { stdio: "inherit", env: environment(/^TS3100_BINARY$/) });
  // Ctrl-C reaches the child by itself, being in the same group; the launcher only waits for its end.
  process.on("SIGINT", () => {});
  for (const signal of ["SIGTERM", "SIGHUP"]) process.on(signal, () => child.kill(signal));
  child.on("error", fail);
  child.on("exit", (code, signal) => process.exit(signal ? SIGNALLED + os.constants.signals[signal] : code));
} catch (error) {
  fail(error);
}
