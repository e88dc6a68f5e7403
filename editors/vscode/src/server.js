// The language server: finding it, starting it, and telling it only of documents that are its own.

import * as path from "node:path";
import * as vscode from "vscode";
import { CloseAction, LanguageClient, State, TransportKind } from "vscode-languageclient/node";

import { expanded, findCommand, isScene, whyNoServer } from "./command.js";

export const LIBRARY = "impasto-std";

export class Server {
  #output;
  #client;
  #status;
  #missingShown = false;
  /** Starts and stops follow each other: two changes of settings at once must not start two servers. */
  #turn = Promise.resolve();
  #isLeaving = false;

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
    await this.#showProblem(message);
    return undefined;
  }

  async #showProblem(message) {
    const choice = await vscode.window.showErrorMessage(message, "Open Setting", "Show Output");
    if (choice === "Show Output") this.#output.show();
    if (choice !== "Open Setting") return;
    // The path is of the machine that the server runs on: its page, since that of the user does not have the setting.
    const page = vscode.env.remoteName ? "openRemoteSettings" : "openSettings";
    await vscode.commands.executeCommand(`workbench.action.${page}`, { query: "impasto.path" });
  }

  start() {
    return this.#next(() => this.#start());
  }

  stop() {
    this.#isLeaving = true;
    return this.#next(() => this.#stop().finally(() => (this.#isLeaving = false)));
  }

  async restart() {
    await this.stop();
    await this.start();
  }

  #next(step) {
    this.#turn = this.#turn.then(step).catch((error) => this.#output.error(error));
    return this.#turn;
  }

  async #start() {
    const { command, file } = this.program();
    if (!file) {
      this.#state(vscode.LanguageStatusSeverity.Error, "not found", `The command \`${command}\` was not found.`);
      this.#output.error(`The command \`${command}\` was not found on PATH or in the setting impasto.path.`);
      // Once: whoever only reads sources wants colors, and no message at each start.
      if (!this.#missingShown) this.programOrMessage();
      this.#missingShown = true;
      return;
    }
    const why = await whyNoServer(file);
    if (why) return this.#failed(file, why);
    this.#output.info(`Starting ${file} lsp`);
    const client = new Client("impasto", "Impasto", serverOptions(file), this.#clientOptions());
    client.onDidChangeState(({ newState }) => {
      const version = client.initializeResult?.serverInfo?.version ?? "";
      if (newState === State.Running) this.#state(vscode.LanguageStatusSeverity.Information, `${version} running`, file);
      if (newState === State.Stopped) this.#state(vscode.LanguageStatusSeverity.Warning, "stopped", file);
    });
    this.#client = client;
    await client.start().catch((error) => this.#failed(file, error.message ?? String(error)));
  }

  /** Says that a program is no server. Nothing waits for the answer of a person. */
  #failed(file, why) {
    this.#state(vscode.LanguageStatusSeverity.Error, "failed", why);
    this.#output.error(`${file} lsp: ${why}`);
    this.#showProblem(`\`${file}\` does not start as a language server (${why}). Is it an older build of Impasto?`);
  }

  async #stop() {
    const client = this.#client;
    this.#client = undefined;
    // One that starts again after a crash cannot be stopped until it runs.
    if (client?.state === State.Starting) await client.start().catch(() => {});
    if (client?.isRunning()) await client.stop();
  }

  /** Asks the server, which may still start; undefined if none runs. */
  async request(method, params) {
    await this.#turn;
    if (!this.#client?.isRunning()) return undefined;
    return this.#client.sendRequest(method, params);
  }

  #state(severity, text, detail) {
    this.#status.severity = severity;
    this.#status.text = `Impasto: ${text}`;
    this.#status.detail = detail;
  }

  /** Starts a server again that ended at its work, and not one that never came to work. */
  #errorHandler() {
    let usual;
    const handler = () => (usual ??= this.#client.createDefaultErrorHandler());
    return {
      error: (...given) => handler().error(...given),
      closed: () => (this.#client?.hasRun ? handler().closed() : { action: CloseAction.DoNotRestart }),
    };
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
      // The server itself asks for the files that it watches.
      synchronize: { configurationSection: "impasto" },
      middleware: {
        ...scenesOnly(opened),
        // A change of the path is a change of the settings, too: a client that stops for it must not be sent that.
        workspace: { didChangeConfiguration: async (sections, next) => this.#isLeaving || next(sections) },
      },
      errorHandler: this.#errorHandler(),
      initializationFailedHandler: () => false,
    };
  }
}

/** A client whose errors are only written down before its server runs: `Server` tells of those, once. */
class Client extends LanguageClient {
  get hasRun() {
    return this.initializeResult !== undefined;
  }

  error(message, data, showNotification) {
    super.error(message, data, this.hasRun && showNotification);
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
