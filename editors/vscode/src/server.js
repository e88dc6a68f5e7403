// The language server: finding it, starting it, and telling it only of documents that are its own.

import * as path from "node:path";
import * as vscode from "vscode";
import { LanguageClient, State, TransportKind } from "vscode-languageclient/node";

import { expanded, findCommand, isScene } from "./command.js";

export const LIBRARY = "impasto-std";

export class Server {
  #output;
  #client;
  #status;
  #missingShown = false;

  constructor(output) {
    this.#output = output;
    this.#status = vscode.languages.createLanguageStatusItem("impasto.server", { language: "impasto" });
    this.#status.name = "Impasto";
    this.#status.command = { command: "impasto.restartServer", title: "Restart" };
  }

  dispose() {
    this.#status.dispose();
    return this.stop();
  }

  /** The program that the settings name, with no message. */
  program() {
    const folder = vscode.workspace.workspaceFolders?.[0]?.uri.fsPath;
    const setting = vscode.workspace.getConfiguration("impasto").get("path", "impasto");
    const command = expanded(setting, folder);
    return { command, file: findCommand(command, folder) };
  }

  /** The program that the settings name; tells people what to do if there is none. */
  async programOrMessage() {
    const { command, file } = this.program();
    if (file) return file;
    const message =
      `The command \`${command}\` was not found. Build it in the repository of Impasto with ` +
      "`cargo install --path . --locked`, or say where it is in the setting `impasto.path`.";
    const choice = await vscode.window.showErrorMessage(message, "Open Setting");
    if (choice) await vscode.commands.executeCommand("workbench.action.openSettings", "impasto.path");
    return undefined;
  }

  async start() {
    const { command, file } = this.program();
    if (!file) {
      this.#state(vscode.LanguageStatusSeverity.Error, "not found", `The command \`${command}\` was not found.`);
      this.#output.error(`The command \`${command}\` was not found on PATH or in the setting impasto.path.`);
      // Once: whoever only reads sources wants colors, and no message at each start.
      if (!this.#missingShown) this.programOrMessage();
      this.#missingShown = true;
      return;
    }
    this.#output.info(`Starting ${file} lsp`);
    const client = new LanguageClient("impasto", "Impasto", serverOptions(file), this.#clientOptions());
    client.onDidChangeState(({ newState }) => {
      if (newState === State.Running) this.#state(vscode.LanguageStatusSeverity.Information, "running", file);
      if (newState === State.Stopped) this.#state(vscode.LanguageStatusSeverity.Warning, "stopped", file);
    });
    this.#client = client;
    try {
      await client.start();
    } catch (error) {
      this.#state(vscode.LanguageStatusSeverity.Error, "failed", String(error));
      const message = `\`${file} lsp\` does not run: ${error.message ?? error}. Does this build of Impasto have a language server?`;
      const choice = await vscode.window.showErrorMessage(message, "Show Output");
      if (choice) this.#output.show();
    }
  }

  async stop() {
    const client = this.#client;
    this.#client = undefined;
    if (client?.isRunning()) await client.stop();
  }

  async restart() {
    await this.stop();
    await this.start();
  }

  /** Asks the server; undefined if none runs. */
  async request(method, params) {
    if (!this.#client?.isRunning()) return undefined;
    return this.#client.sendRequest(method, params);
  }

  #state(severity, text, detail) {
    this.#status.severity = severity;
    this.#status.text = `Impasto: ${text}`;
    this.#status.detail = detail;
  }

  #clientOptions() {
    const opened = (document) => {
      const feature = this.#client?.getFeature("textDocument/didOpen");
      return feature?.getProvider(document);
    };
    return {
      documentSelector: [
        { scheme: "file", language: "impasto" },
        { scheme: "untitled", language: "impasto" },
        { scheme: LIBRARY, language: "impasto" },
        // Scenes may have any name: `middleware` leaves other TOML files out.
        { scheme: "file", pattern: "**/*.toml" },
      ],
      // The settings, too: the server shows costs from the first document on.
      initializationOptions: () => {
        const { scene, cost } = vscode.workspace.getConfiguration("impasto");
        return { virtualDocuments: true, commands: true, scene, cost };
      },
      outputChannel: this.#output,
      synchronize: {
        configurationSection: "impasto",
        fileEvents: [
          vscode.workspace.createFileSystemWatcher("**/*.impasto"),
          vscode.workspace.createFileSystemWatcher("**/*.toml"),
        ],
      },
      middleware: scenesOnly(opened),
    };
  }
}

function serverOptions(command) {
  return { command, args: ["lsp"], transport: TransportKind.stdio };
}

/** Keeps TOML files that are no scenes from the server. One that becomes a scene is opened then. */
function scenesOnly(provider) {
  const told = new Set();
  const isOurs = (document) => {
    if (path.posix.extname(document.uri.path) !== ".toml") return true;
    return path.posix.basename(document.uri.path) === "scene.toml" || isScene(document.getText());
  };
  const isForeign = (uri) => {
    const parsed = vscode.Uri.parse(uri);
    return path.posix.extname(parsed.path) === ".toml" && !told.has(parsed.toString());
  };
  return {
    didOpen: async (document, next) => {
      if (!isOurs(document)) return;
      told.add(document.uri.toString());
      await next(document);
    },
    didChange: async (event, next) => {
      const key = event.document.uri.toString();
      if (told.has(key) || path.posix.extname(event.document.uri.path) !== ".toml") return next(event);
      if (!isOurs(event.document)) return;
      // `send` goes by `didOpen` above.
      await provider(event.document)?.send(event.document);
    },
    didSave: async (document, next) => {
      if (!isForeign(document.uri.toString())) await next(document);
    },
    didClose: async (document, next) => {
      if (isForeign(document.uri.toString())) return;
      told.delete(document.uri.toString());
      await next(document);
    },
    sendRequest: (type, param, token, next) => {
      const uri = param?.textDocument?.uri;
      if (uri !== undefined && isForeign(uri)) return Promise.resolve(null);
      return next(type, param, token);
    },
  };
}
