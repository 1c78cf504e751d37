// Debug configurations, command lines and the line of the main program.

const assert = require("node:assert");
const test = require("node:test");
const { debugConfiguration, loadArguments, mainProgram, taskArguments } = require("../src/configuration");
const { allowsFrame } = require("../src/framing");

const SCOL = { languageId: "scol", isUntitled: false };
const NONE = { model: "", points: "" };

test("F5 without a launch file runs the file in front", () => {
  const configuration = { type: "scol", request: "launch", name: "Run this file", program: "${file}" };
  assert.deepStrictEqual(debugConfiguration({}, SCOL, NONE), { configuration });
});

test("without a SCOL file in front there is nothing to debug, and a file without a name is saved first", () => {
  for (const front of [undefined, { languageId: "json", isUntitled: false }]) {
    for (const given of [{}, { type: "scol", request: "launch", name: "x", program: "${file}" }]) {
      assert.match(debugConfiguration(given, front, NONE).problem, /no SCOL file is in front/);
    }
  }
  assert.match(debugConfiguration({}, { ...SCOL, isUntitled: true }, NONE).problem, /save it first/);
});

test("settings are defaults of a launch file", () => {
  const settings = { model: "scara-600", points: "/p.csv" };
  const given = { type: "scol", request: "launch", name: "x", program: "a.scol", model: "own.toml" };
  assert.deepStrictEqual(debugConfiguration(given, undefined, settings), { configuration: { ...given, points: "/p.csv" } });
});

test("a recording and an emulator have their own model and points", () => {
  for (const given of [
    { type: "scol", request: "launch", name: "x", recording: "run.jsonl" },
    { type: "scol", request: "attach", name: "x" },
  ]) {
    assert.deepStrictEqual(debugConfiguration(given, undefined, { model: "scara-600", points: "/p.csv" }), { configuration: given });
  }
});

test("a task has the flags of the settings, then its own words, then the file", () => {
  const task = { command: "run", file: "a.scol", args: ["--din", "1"] };
  assert.deepStrictEqual(taskArguments(task, { model: "scara-600", points: "" }), ["run", "--model", "scara-600", "--din", "1", "a.scol"]);
  assert.deepStrictEqual(taskArguments({ command: "check" }, NONE), ["check", "${file}"]);
});

test("a file has its name on the controller", () => {
  assert.deepStrictEqual(loadArguments("/a/pick.scol"), ["--load", "/a/pick.scol", "--select", "PICK"]);
});

test("the main program is the first one, wherever it begins", () => {
  assert.strictEqual(mainProgram("' PROGRAM NOT\r\nGLOBAL\r\nEND\r\n  program main\r\nEND\r\nPROGRAM SUB\r\nEND"), 3);
  assert.strictEqual(mainProgram("PROGRAM\nDATA\nEND\n"), undefined);
});

test("a page is shown where its policy names every origin around it", () => {
  const origins = ["vscode-webview://abc", "vscode-file://vscode-app"];
  const policy = ancestors => `default-src 'none'; frame-ancestors ${ancestors}; base-uri 'none'`;
  assert.ok(allowsFrame(policy("vscode-webview://abc vscode-file://vscode-app"), origins));
  assert.ok(allowsFrame(policy("vscode-webview: vscode-file:"), origins));
  assert.ok(!allowsFrame(policy("vscode-webview://abc"), origins));
  assert.ok(!allowsFrame(policy("'none'"), origins));
  assert.ok(allowsFrame(null, origins));
});
