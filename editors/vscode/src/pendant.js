// The pendant beside the program: the page of an emulator in a view of the editor. A page is shown in the frames only that its
// emulator allows, so the view first tells the origins of the pages around it, and an emulator is started that allows these.

const { execFile, spawn } = require("node:child_process");
const { randomBytes } = require("node:crypto");
const readline = require("node:readline");
const { promisify } = require("node:util");
const vscode = require("vscode");
const { SCOL, flags, loadArguments } = require("./configuration");
const { allowsFrame } = require("./framing");

class Pendant {
  /**
   * @param {() => Promise<string | undefined>} program
   * @param {(scope?: vscode.ConfigurationScope) => { model: string, points: string }} settings
   */
  constructor(program, settings) {
    this.program = program;
    this.settings = settings;
    this.log = vscode.window.createOutputChannel("SCOL Pendant");
    /** @type {vscode.WebviewPanel | undefined} */
    this.panel = undefined;
    /** @type {import("node:child_process").ChildProcess | undefined} */
    this.emulator = undefined;
  }

  dispose() {
    this.emulator?.kill();
    this.panel?.dispose();
    this.log.dispose();
  }

  async open() {
    if (this.panel) return this.panel.reveal();
    const command = await this.program();
    if (!command) return undefined;
    const document = vscode.window.activeTextEditor?.document;
    const file = document?.languageId === SCOL && !document.isUntitled ? document.uri : undefined;
    const options = { enableScripts: true, retainContextWhenHidden: true };
    const panel = vscode.window.createWebviewPanel("ts3100.pendant", "Pendant", vscode.ViewColumn.Beside, options);
    this.panel = panel;
    panel.onDidDispose(() => {
      this.panel = undefined;
      this.emulator?.kill();
      this.emulator = undefined;
    });
    try {
      const origins = await this.origins(panel);
      const url = (await this.running(command, origins)) ?? (await this.start(command, origins, file));
      if (!url) return panel.dispose();
      // With a remote workspace the page is reached through a tunnel.
      const reached = await vscode.env.asExternalUri(vscode.Uri.parse(url));
      panel.webview.html = framed(reached);
    } catch (error) {
      panel.dispose();
      const reason = error instanceof Error ? error.message : String(error);
      const [log] = ["Show Log"];
      vscode.window.showErrorMessage(`cannot open the pendant: ${reason}`, log).then(chosen => chosen && this.log.show());
    }
    return undefined;
  }

  /**
   * The origins of the pages around a frame in this view.
   * @param {vscode.WebviewPanel} panel
   * @returns {Promise<string[]>}
   */
  origins(panel) {
    return new Promise((resolve, reject) => {
      panel.onDidDispose(() => reject(new Error("its view was closed")));
      panel.webview.onDidReceiveMessage(message => resolve(message.origins));
      const script = `
        const around = [location.origin, ...(location.ancestorOrigins ?? [])];
        acquireVsCodeApi().postMessage({ origins: [...new Set(around)].filter(origin => origin !== "null") });`;
      const nonce = randomBytes(16).toString("hex");
      panel.webview.html = page(`script-src 'nonce-${nonce}'`, `<p>Starting&hellip;</p><script nonce="${nonce}">${script}</script>`);
    });
  }

  /**
   * The page of the emulator that runs on this computer, if the view can show it or the user prefers a browser.
   * @param {string} command
   * @param {string[]} origins
   */
  async running(command, origins) {
    const asked = await promisify(execFile)(command, ["ready", "--json"]).catch(error => error);
    let found;
    try {
      found = JSON.parse(asked.stdout);
    } catch {
      return undefined;
    }
    if (!found.ready) return undefined;
    const url = `${found.at}/`;
    const response = await fetch(url);
    if (allowsFrame(response.headers.get("content-security-policy"), origins)) return url;
    const flag = origins.map(origin => `--control-frame-ancestor ${origin}`).join(" ");
    this.log.appendLine(`The emulator at ${found.at} can be shown here if it is started with ${flag}`);
    const [other, browser] = ["Start Another", "Open in Browser"];
    const question = `The emulator at ${found.at} was not started for a view of the editor.`;
    const chosen = await vscode.window.showInformationMessage(question, other, browser);
    if (chosen === browser) vscode.env.openExternal(vscode.Uri.parse(url));
    if (chosen !== other) throw new Error("the emulator that runs does not allow it; the log has the flag");
    return undefined;
  }

  /**
   * Starts an emulator with the file in front. It ends with the view.
   * @param {string} command
   * @param {string[]} origins
   * @param {vscode.Uri} [file]
   * @returns {Promise<string>}
   */
  start(command, origins, file) {
    const load = file ? loadArguments(file.fsPath) : [];
    const allowed = origins.flatMap(origin => ["--control-frame-ancestor", origin]);
    const words = ["serve", "--ports", "auto", "--ready-json", "--servo-on", ...flags(this.settings(file)), ...load, ...allowed];
    this.log.appendLine(`ts3100 ${words.join(" ")}`);
    const emulator = spawn(command, words, { stdio: ["ignore", "pipe", "pipe"] });
    this.emulator = emulator;
    let said = "";
    emulator.stderr.on("data", data => {
      said += data;
      this.log.append(String(data));
    });
    return new Promise((resolve, reject) => {
      emulator.on("error", reject);
      emulator.on("exit", code => reject(new Error(said.trim().replace(/^error: /, "") || `ts3100 serve ended with exit code ${code}`)));
      readline.createInterface(emulator.stdout).once("line", line => resolve(`${JSON.parse(line).control}/`));
    });
  }
}

/** @param {vscode.Uri} address */
function framed(address) {
  const url = address.toString(true);
  const origin = `${address.scheme}://${address.authority}`;
  return page(`frame-src ${origin}`, `<iframe title="Pendant" src="${url.replaceAll("&", "&amp;").replaceAll('"', "&quot;")}"></iframe>`);
}

/**
 * A page of the view, with what it may do besides its styles.
 * @param {string} policy
 * @param {string} body
 */
function page(policy, body) {
  return `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; ${policy}">
<style>html, body, iframe { width: 100%; height: 100%; margin: 0; padding: 0; border: 0; overflow: hidden; }</style>
</head>
<body>${body}</body>
</html>`;
}

module.exports = { Pendant };
