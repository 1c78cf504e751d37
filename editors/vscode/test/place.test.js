// Where the program is found, in which order, and what is said without one.

const assert = require("node:assert");
const fs = require("node:fs");
const os = require("node:os");
const path = require("node:path");
const test = require("node:test");
const zlib = require("node:zlib");
const { findProgram } = require("../src/place");

/** A folder with these files, and the places in it. */
function folder(t, files) {
  const root = fs.mkdtempSync(path.join(os.tmpdir(), "ts3100-place-"));
  t.after(() => fs.rmSync(root, { recursive: true }));
  for (const [name, content] of Object.entries(files)) {
    fs.mkdirSync(path.dirname(path.join(root, name)), { recursive: true });
    fs.writeFileSync(path.join(root, name), content);
  }
  const places = {
    setting: "",
    packaged: path.join(root, "package/bin/ts3100.br"),
    storage: path.join(root, "storage"),
    environment: { HOME: root, PATH: [path.join(root, "empty"), path.join(root, "bin")].join(":") },
    platform: "linux",
  };
  return { root, places };
}

const ON_PATH = { "bin/ts3100": "on PATH" };
const PACKAGED = { "package/bin/ts3100.br": zlib.brotliCompressSync("in the package") };

test("the setting wins over the package, and the package over PATH", t => {
  const { root, places } = folder(t, { ...ON_PATH, ...PACKAGED, "own/ts3100": "" });
  assert.deepStrictEqual(findProgram({ ...places, setting: " ~/own/ts3100 " }), { program: path.join(root, "own/ts3100") });
  const { program } = findProgram(places);
  assert.strictEqual(fs.readFileSync(program, "utf8"), "in the package");
  assert.strictEqual(fs.statSync(program).mode & 0o777, 0o755);
  fs.rmSync(places.packaged);
  assert.deepStrictEqual(findProgram(places), { program: path.join(root, "bin/ts3100") });
});

test("a setting that names no file is told, and nothing else is taken", t => {
  const { places } = folder(t, ON_PATH);
  const { problem } = findProgram({ ...places, setting: "/nowhere/ts3100" });
  assert.match(problem, /setting ts3100.path names \/nowhere\/ts3100, which is not a file/);
});

test("without a program the message says what to do", t => {
  const { places } = folder(t, {});
  assert.match(findProgram(places).problem, /install ts3100, or name it in the setting ts3100.path/);
});

test("a program is unpacked once, and the one of another version goes", t => {
  const { places } = folder(t, PACKAGED);
  const { program } = findProgram(places);
  fs.writeFileSync(program, "not written again");
  assert.strictEqual(fs.readFileSync(findProgram(places).program, "utf8"), "not written again");
  fs.writeFileSync(places.packaged, zlib.brotliCompressSync("newer"));
  const newer = findProgram(places).program;
  assert.strictEqual(fs.readFileSync(newer, "utf8"), "newer");
  assert.deepStrictEqual(fs.readdirSync(places.storage), [path.basename(path.dirname(newer))]);
});

test("Windows has another name of the file, and another spelling of PATH", t => {
  const { root, places } = folder(t, { "bin/ts3100.exe": "" });
  const environment = { Path: path.join(root, "bin") };
  assert.deepStrictEqual(findProgram({ ...places, environment, platform: "win32" }), { program: path.join(root, "bin/ts3100.exe") });
});

test("a relative folder of PATH is left out: it depends on where the editor was started", t => {
  const { root, places } = folder(t, { "ts3100": "" });
  const relative = path.relative(process.cwd(), root);
  assert.ok("problem" in findProgram({ ...places, environment: { PATH: relative } }));
});
