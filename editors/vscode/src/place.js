// Where the program ts3100 is: named by the setting, in the package, or on PATH. The package has it compressed, since a zip
// file leaves it too large; it is unpacked once into the storage of the extension. Nothing here needs an editor.

const crypto = require("node:crypto");
const fs = require("node:fs");
const path = require("node:path");
const zlib = require("node:zlib");

/**
 * @typedef {object} Places
 * @property {string} setting the setting `ts3100.path`; empty by default
 * @property {string} packaged the compressed program of the package, whether it is there or not
 * @property {string} storage the folder for the unpacked program
 * @property {Record<string, string | undefined>} environment
 * @property {NodeJS.Platform} platform
 */

/**
 * Finds the program, and unpacks it if it comes with the extension.
 * @param {Places} places
 * @returns {{ program: string } | { problem: string }}
 */
function findProgram({ setting, packaged, storage, environment, platform }) {
  const name = platform === "win32" ? "ts3100.exe" : "ts3100";
  const named = setting.trim();
  if (named) {
    const home = environment.HOME ?? environment.USERPROFILE ?? "";
    const program = named.replace(/^~(?=[\\/])/, () => home);
    if (isFile(program)) return { program };
    return { problem: `cannot find ts3100: the setting ts3100.path names ${program}, which is not a file` };
  }
  if (isFile(packaged)) return { program: unpacked(packaged, storage, name) };
  // Windows spells the name of the variable in several ways.
  const search = Object.entries(environment).find(([key]) => key.toUpperCase() === "PATH")?.[1] ?? "";
  for (const folder of search.split(platform === "win32" ? ";" : ":")) {
    const program = path.join(folder, name);
    if (path.isAbsolute(folder) && isFile(program)) return { program };
  }
  return { problem: "cannot find ts3100: this package of the extension has no program, and none is on PATH; install ts3100, or name it in the setting ts3100.path" };
}

/**
 * The program of a compressed file. Its folder has the hash of that file, so another version does not replace a program that runs.
 * @param {string} packaged
 * @param {string} storage
 * @param {string} name
 */
function unpacked(packaged, storage, name) {
  const compressed = fs.readFileSync(packaged);
  const hash = crypto.createHash("sha256").update(compressed).digest("hex").slice(0, 16);
  const folder = path.join(storage, hash);
  const program = path.join(folder, name);
  if (isFile(program)) return program;
  fs.mkdirSync(folder, { recursive: true });
  // Another window may do the same now: a program appears whole or not at all.
  const part = path.join(folder, `${name}.${process.pid}`);
  fs.writeFileSync(part, zlib.brotliDecompressSync(compressed), { mode: 0o755 });
  fs.renameSync(part, program);
  for (const other of fs.readdirSync(storage)) {
    if (other === hash) continue;
    try {
      fs.rmSync(path.join(storage, other), { recursive: true, force: true });
    } catch {
      // Windows keeps a program that runs.
    }
  }
  return program;
}

/** @param {string} file */
function isFile(file) {
  return fs.statSync(file, { throwIfNoEntry: false })?.isFile() ?? false;
}

module.exports = { findProgram };
