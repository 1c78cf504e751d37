// package.json and the extension agree: what it contributes is registered when the extension starts, in an editor that notes
// what is registered and does nothing else.

const assert = require("node:assert");
const fs = require("node:fs");
const { Module } = require("node:module");
const path = require("node:path");
const test = require("node:test");

const ROOT = path.join(__dirname, "..");
const manifest = JSON.parse(fs.readFileSync(path.join(ROOT, "package.json"), "utf8"));

/** Any module: whatever is read of it can be read, called, extended and constructed. */
function anything() {
  return new Proxy(class {}, {
    get: (target, name) => (name === "prototype" || typeof name === "symbol" ? Reflect.get(target, name) : name === "then" ? undefined : anything()),
    apply: anything,
    construct: anything,
  });
}

/** What the extension registers under each function of the editor. */
async function registered() {
  const calls = {};
  const noting = () => new Proxy({}, { get: (_, name) => (...words) => ((calls[name] ??= []).push(words), anything()) });
  const editor = new Proxy({ commands: noting(), languages: noting(), tasks: noting(), debug: noting() }, {
    get: (target, name) => target[name] ?? anything(),
  });
  const load = Module._load;
  Module._load = (name, ...rest) => (name === "vscode" ? editor : name.startsWith("vscode-languageclient") ? anything() : load(name, ...rest));
  try {
    const extension = require("../src/extension");
    const context = { subscriptions: [], extensionUri: {}, globalStorageUri: { fsPath: "" } };
    await extension.activate(context).catch(() => {});
  } finally {
    Module._load = load;
  }
  return calls;
}

test("every command is registered, and every registered one is contributed", async () => {
  const { registerCommand } = await registered();
  const contributed = manifest.contributes.commands.map(one => one.command);
  assert.deepStrictEqual(registerCommand.map(([name]) => name).sort(), contributed.sort());
});

test("the debugger, the tasks and the lenses are registered under the contributed names", async () => {
  delete require.cache[require.resolve("../src/extension")];
  const calls = await registered();
  const [debugType] = manifest.contributes.debuggers.map(one => one.type);
  assert.strictEqual(calls.registerDebugAdapterDescriptorFactory[0][0], debugType);
  assert.strictEqual(calls.registerDebugConfigurationProvider[0][0], debugType);
  assert.strictEqual(calls.registerTaskProvider[0][0], manifest.contributes.taskDefinitions[0].type);
  for (const { language } of calls.registerCodeLensProvider[0][0]) assert.strictEqual(language, manifest.contributes.languages[0].id);
});

test("menus, walkthrough and files name what is there", () => {
  const { commands, menus, walkthroughs, grammars, languages } = manifest.contributes;
  const known = new Set(commands.map(one => one.command));
  for (const entry of Object.values(menus).flat()) assert.ok(known.has(entry.command), entry.command);
  const steps = walkthroughs.flatMap(one => one.steps);
  for (const step of steps) {
    assert.ok(fs.existsSync(path.join(ROOT, step.media.markdown)), step.media.markdown);
    for (const [, command] of step.description.matchAll(/\(command:([\w.]+)\)/g)) {
      assert.ok(known.has(command) || command.startsWith("workbench."), command);
    }
  }
  for (const file of [grammars[0].path, languages[0].configuration]) assert.ok(fs.existsSync(path.join(ROOT, file)), file);
});

test("the problem matcher reads what ts3100 check prints", () => {
  const { regexp, ...groups } = manifest.contributes.problemMatchers[0].pattern;
  const found = new RegExp(regexp).exec("C:\\robot\\pick.scol:3:7: error[E0103]: MOVEL is not a statement");
  const read = Object.fromEntries(Object.entries(groups).map(([name, group]) => [name, found[group]]));
  assert.deepStrictEqual(read, {
    file: "C:\\robot\\pick.scol",
    line: "3",
    column: "7",
    severity: "error",
    code: "E0103",
    message: "MOVEL is not a statement",
  });
});
