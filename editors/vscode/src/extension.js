// The extension: starts the language server, and offers tasks, the debugger, the buttons and the pendant. What the program
// ts3100 does is not done here.

const fs = require("node:fs/promises");
const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");
const { SCOL, debugConfiguration, flags, mainProgram, taskArguments } = require("./configuration");
const { Pendant } = require("./pendant");
const { findProgram } = require("./place");

/** Programs that are files, or become some. The text of a recorded run is SCOL too, and nothing can be done with it. */
const PROGRAMS = [{ language: SCOL, scheme: "file" }, { language: SCOL, scheme: "untitled" }];

/** @type {vscode.ExtensionContext} */
let context;
/** @type {LanguageClient | undefined} */
let client;
/** Ends when the language server runs that was asked for last. */
let starting = Promise.resolve();

/** @param {vscode.ExtensionContext} given */
async function activate(given) {
  context = given;
  const pendant = new Pendant(program, settings);
  /** @type {Record<string, (file?: vscode.Uri) => unknown>} */
  const commands = {
    "ts3100.run": file => started(file, run),
    "ts3100.debug": file => started(file, debug),
    "ts3100.openPendant": () => pendant.open(),
    "ts3100.stepMotion": stepMotion,
    "ts3100.newExample": newExample,
    "ts3100.restartServer": startServer,
  };
  context.subscriptions.push(
    pendant,
    ...Object.entries(commands).map(([name, action]) => vscode.commands.registerCommand(name, action)),
    vscode.languages.registerCodeLensProvider(PROGRAMS, { provideCodeLenses }),
    vscode.tasks.registerTaskProvider("ts3100", { provideTasks, resolveTask }),
    vscode.debug.registerDebugConfigurationProvider(SCOL, { resolveDebugConfiguration }),
    vscode.debug.registerDebugAdapterDescriptorFactory(SCOL, { createDebugAdapterDescriptor }),
    vscode.workspace.onDidChangeConfiguration(change => change.affectsConfiguration("ts3100") && startServer()),
    vscode.workspace.onDidGrantWorkspaceTrust(startServer),
  );
  await startServer();
}

function deactivate() {
  return client?.stop();
}

/** @param {vscode.ConfigurationScope} [scope] */
function settings(scope) {
  const section = vscode.workspace.getConfiguration("ts3100", scope);
  return { model: section.get("model", ""), points: section.get("points", "") };
}

/** The program; without one a message says what to do, and the result is undefined. */
async function program() {
  const found = findProgram({
    setting: vscode.workspace.getConfiguration("ts3100").get("path", ""),
    packaged: vscode.Uri.joinPath(context.extensionUri, "bin", "ts3100.br").fsPath,
    storage: context.globalStorageUri.fsPath,
    environment: process.env,
    platform: process.platform,
  });
  if ("program" in found) return found.program;
  vscode.window.showErrorMessage(found.problem, "Open Settings").then(chosen => {
    if (chosen) vscode.commands.executeCommand("workbench.action.openSettings", "ts3100.path");
  });
  return undefined;
}

/** Starts the language server, again if it runs: with the program and the settings as they are when its turn comes. */
function startServer() {
  starting = starting.then(async () => {
    await client?.dispose();
    client = undefined;
    const command = await program();
    if (!command) return;
    const server = { command, args: ["lsp", ...flags(settings())] };
    client = new LanguageClient("ts3100", "SCOL", server, { documentSelector: PROGRAMS });
    // The client says itself why it cannot start.
    await client.start().catch(() => {});
  });
  return starting;
}

/**
 * Does something with a file, or with the one in front, once it is on the disk.
 * @param {vscode.Uri | undefined} file
 * @param {(file: vscode.Uri) => unknown} action
 */
async function started(file, action) {
  const editor = vscode.window.activeTextEditor;
  const document = file
    ? await vscode.workspace.openTextDocument(file)
    : editor?.document.languageId === SCOL ? editor.document : undefined;
  if (!document) {
    return vscode.window.showErrorMessage("cannot run: no SCOL file is in front; open one");
  }
  // A new file gets its name now; without one there is nothing to run.
  const saved = document.isUntitled || document.isDirty ? await vscode.workspace.save(document.uri) : document.uri;
  return saved && action(saved);
}

/** @param {vscode.Uri} file */
async function run(file) {
  const task = await executable({ type: "ts3100", command: "run", file: file.fsPath }, file);
  return task && vscode.tasks.executeTask(task);
}

/** @param {vscode.Uri} file */
function debug(file) {
  const configuration = { type: SCOL, request: "launch", name: "Run this file", program: file.fsPath };
  return vscode.debug.startDebugging(vscode.workspace.getWorkspaceFolder(file), configuration);
}

/** Continues to the statement after the next motion: a request of this debugger, for which the editor has no button. */
async function stepMotion() {
  const stopped = vscode.debug.activeStackItem;
  if (!stopped) return;
  try {
    await stopped.session.customRequest("stepMotion", { threadId: stopped.threadId });
  } catch (error) {
    vscode.window.showErrorMessage(error instanceof Error ? error.message : String(error));
  }
}

async function newExample() {
  const place = vscode.Uri.joinPath(context.extensionUri, "walkthrough", "pick.scol");
  const content = await fs.readFile(place.fsPath, "utf8");
  return vscode.window.showTextDocument(await vscode.workspace.openTextDocument({ language: SCOL, content }));
}

/** @param {vscode.TextDocument} document */
function provideCodeLenses(document) {
  const line = mainProgram(document.getText());
  if (line === undefined) return [];
  const range = new vscode.Range(line, 0, line, 0);
  return [
    new vscode.CodeLens(range, { title: "$(play) Run", command: "ts3100.run", arguments: [document.uri] }),
    new vscode.CodeLens(range, { title: "$(debug-alt) Debug", command: "ts3100.debug", arguments: [document.uri] }),
  ];
}

/** @typedef {vscode.TaskDefinition & { command: string, file?: string, args?: string[] }} Definition */

/**
 * The task of a definition; undefined without the program.
 * @param {Definition} definition
 * @param {vscode.Uri} [file]
 */
async function executable(definition, file) {
  const command = await program();
  if (!command) return undefined;
  const folder = file ? vscode.workspace.getWorkspaceFolder(file) : vscode.workspace.workspaceFolders?.[0];
  const name = `${definition.command} ${taskObject(definition.file)}`;
  const execution = new vscode.ProcessExecution(command, taskArguments(definition, settings(file)));
  const task = new vscode.Task(definition, folder ?? vscode.TaskScope.Workspace, name, "ts3100", execution, "$ts3100");
  task.group = definition.command === "check" ? vscode.TaskGroup.Build : vscode.TaskGroup.Test;
  return task;
}

/** @param {string | undefined} file */
function taskObject(file) {
  if (!file) return "this file";
  const folder = vscode.workspace.workspaceFolders?.find(folder => folder.uri.fsPath === file);
  return folder ? `all programs of ${folder.name}` : vscode.workspace.asRelativePath(file);
}

async function provideTasks() {
  const definitions = [
    { type: "ts3100", command: "check" },
    { type: "ts3100", command: "run" },
    ...(vscode.workspace.workspaceFolders ?? []).map(folder => ({ type: "ts3100", command: "check", file: folder.uri.fsPath })),
  ];
  const tasks = await Promise.all(definitions.map(definition => executable(definition)));
  return tasks.filter(task => task !== undefined);
}

/** @param {vscode.Task} task */
async function resolveTask(task) {
  const definition = /** @type {Definition} */ (task.definition);
  const made = await executable(definition);
  // The editor takes a resolved task for another one unless it keeps the definition and the scope.
  if (made) made.definition = definition;
  return made;
}

/**
 * @param {vscode.WorkspaceFolder | undefined} folder
 * @param {vscode.DebugConfiguration} given
 */
function resolveDebugConfiguration(folder, given) {
  const found = debugConfiguration(given, vscode.window.activeTextEditor?.document, settings(folder));
  if ("configuration" in found) return /** @type {vscode.DebugConfiguration} */ (found.configuration);
  vscode.window.showErrorMessage(found.problem);
  return undefined;
}

/** @param {vscode.DebugSession} session */
async function createDebugAdapterDescriptor(session) {
  const command = await program();
  // Relative paths of a configuration begin in its folder.
  const options = session.workspaceFolder && { cwd: session.workspaceFolder.uri.fsPath };
  return command ? new vscode.DebugAdapterExecutable(command, ["dap"], options) : undefined;
}

module.exports = { activate, deactivate };
