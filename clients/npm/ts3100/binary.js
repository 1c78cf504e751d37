"use strict";
// Finds the binary of this platform: npm installs the one of the optional dependencies whose os and cpu fit.

const SUPPORTED = Object.keys(require("./package.json").optionalDependencies || {});

/** The path of the binary. TS3100_BINARY names another one. */
function binary() {
  if (process.env.TS3100_BINARY) return process.env.TS3100_BINARY;
  const name = `@ts3100/${process.platform}-${process.arch}`;
  const program = process.platform === "win32" ? "ts3100.exe" : "ts3100";
  try {
    return require.resolve(`${name}/${program}`);
  } catch {
    const reason = SUPPORTED.includes(name)
      ? `the package ${name} is not installed; install without --omit=optional`
      : `there is no binary for ${process.platform}-${process.arch}, only ${SUPPORTED.join(", ")}`;
    throw new Error(`cannot find ts3100: ${reason}, or set TS3100_BINARY to its path`);
  }
}

/** The environment without the variables that `drop` names. */
function environment(drop) {
  return Object.fromEntries(Object.entries(process.env).filter(([name]) => !drop.test(name)));
}

module.exports = { binary, environment };
