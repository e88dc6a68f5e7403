// The commands: each runs the command `impasto` beside the server.

import { execFile, spawn } from "node:child_process";
import * as path from "node:path";
import * as vscode from "vscode";

import { problem } from "./command.js";

/** What a command prints of a file, as a document: its scheme is the command's. */
const PRINTED = {
  "impasto-wgsl": { args: (file) => ["emit", file, "--what", "wgsl"], ending: ".wgsl", what: "WGSL" },
  "impasto-cost": { args: (file) => ["cost", file], ending: ".cost.txt", what: "the cost" },
};

export function registerCommands(context, server, output) {
  const register = (name, run) => context.subscriptions.push(vscode.commands.registerCommand(name, run));
  const previews = new Previews(server, output);
  const printed = Object.keys(PRINTED).map((scheme) => new Printed(scheme, server, output));
  context.subscriptions.push(previews, ...printed);
  register("impasto.restartServer", () => server.restart());
  register("impasto.showPreview", (uri) => previews.show(uri));
  // Lenses of the server name this one: why a material is in its kernel.
  register("impasto.explain", (text) => explain(String(text)));
  register("impasto.showWgsl", (uri) => printed[0].show(uri));
  register("impasto.showCost", (uri) => printed[1].show(uri));
}

/** The saved file that a lens, a menu or the active editor means. */
async function savedFile(uri) {
  const given = typeof uri === "string" ? vscode.Uri.parse(uri) : uri;
  const target = given ?? vscode.window.activeTextEditor?.document.uri;
  if (target?.scheme !== "file") {
    vscode.window.showWarningMessage("Open a saved file of Impasto first.");
    return undefined;
  }
  const open = vscode.workspace.textDocuments.find((d) => d.uri.toString() === target.toString());
  if (open?.isDirty) await open.save();
  return target;
}

/** Shows a text of several lines: the first as the title. */
function explain(text) {
  const [title, ...rest] = text.trim().split("\n");
  return vscode.window.showInformationMessage(title, { modal: true, detail: rest.join("\n") });
}

/** Windows of `impasto view`, one a file. The window follows the file by itself, at each save. */
class Previews {
  #running = new Map();
  #server;
  #output;

  constructor(server, output) {
    this.#server = server;
    this.#output = output;
  }

  async show(uri) {
    const target = await savedFile(uri);
    if (!target) return;
    const file = target.fsPath;
    if (this.#running.has(file)) {
      vscode.window.showInformationMessage(`The preview of ${path.basename(file)} is open. It follows each save.`);
      return;
    }
    const program = await this.#server.programOrMessage();
    if (!program) return;
    this.#output.info(`${program} view ${file}`);
    const child = spawn(program, ["view", file], { cwd: path.dirname(file), stdio: ["ignore", "pipe", "pipe"] });
    this.#running.set(file, child);
    let said = "";
    const log = (data) => {
      said = (said + data).slice(-2000);
      this.#output.info(String(data).trimEnd());
    };
    child.stdout.on("data", log);
    child.stderr.on("data", log);
    child.on("error", (error) => this.#ended(file, error.message));
    child.on("close", (code) => this.#ended(file, code === 0 || code === null ? "" : problem(said) || `exit code ${code}`));
  }

  #ended(file, why) {
    const was = this.#running.delete(file);
    if (!was || !why) return;
    // Messages have no lines: hints and places are in the output.
    vscode.window
      .showErrorMessage(`The preview of ${path.basename(file)} ended: ${why}`, "Show Output")
      .then((choice) => choice && this.#output.show());
  }

  dispose() {
    for (const child of this.#running.values()) child.kill();
    this.#running.clear();
  }
}

/** Documents that a command prints, made anew when their file is saved. */
class Printed {
  #scheme;
  #server;
  #output;
  #changed = new vscode.EventEmitter();
  #subscriptions;

  constructor(scheme, server, output) {
    this.#scheme = scheme;
    this.#server = server;
    this.#output = output;
    this.#subscriptions = [
      this.#changed,
      vscode.workspace.registerTextDocumentContentProvider(scheme, {
        onDidChange: this.#changed.event,
        provideTextDocumentContent: (uri) => this.#print(uri),
      }),
      vscode.workspace.onDidSaveTextDocument((document) => {
        if (document.languageId === "impasto") this.#changed.fire(this.#address(document.uri));
      }),
    ];
  }

  dispose() {
    for (const subscription of this.#subscriptions) subscription.dispose();
  }

  #address(file) {
    return file.with({ scheme: this.#scheme, path: file.path + PRINTED[this.#scheme].ending });
  }

  async show(uri) {
    const target = await savedFile(uri);
    if (!target || !(await this.#server.programOrMessage())) return;
    const address = this.#address(target);
    this.#changed.fire(address);
    const document = await vscode.workspace.openTextDocument(address);
    await vscode.window.showTextDocument(document, { viewColumn: vscode.ViewColumn.Beside, preview: true });
  }

  #print(uri) {
    const { args, ending, what } = PRINTED[this.#scheme];
    const file = uri.with({ scheme: "file", path: uri.path.slice(0, -ending.length) }).fsPath;
    const { file: program } = this.#server.program();
    const options = { cwd: path.dirname(file), maxBuffer: 64 << 20 };
    return new Promise((resolve) => {
      if (!program) return resolve("// The command `impasto` was not found.\n");
      execFile(program, args(file), options, (error, stdout, stderr) => {
        if (!error) return resolve(stdout);
        this.#output.error(stderr || error.message);
        const lines = (stderr || error.message).trimEnd().split("\n");
        resolve(`// There is no way to show ${what}:\n//\n${lines.map((line) => `// ${line}`).join("\n")}\n`);
      });
    });
  }
}
