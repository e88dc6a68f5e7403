// The extension: it starts the language server (`impasto lsp`), and adds what a server cannot do: windows, terminals of
// messages, and documents that exist on no disk.

import * as vscode from "vscode";

import { registerCommands } from "./commands.js";
import { registerLibrary } from "./library.js";
import { Server } from "./server.js";

let server;

export async function activate(context) {
  const output = vscode.window.createOutputChannel("Impasto", { log: true });
  server = new Server(output);
  context.subscriptions.push(output, server);
  registerLibrary(context, server);
  registerCommands(context, server, output);
  context.subscriptions.push(
    // Trust in a folder changes settings, too: its own path is followed then.
    vscode.workspace.onDidChangeConfiguration((event) => {
      if (event.affectsConfiguration("impasto.path")) server.restart();
    }),
  );
  await server.start();
}

export async function deactivate() {
  await server?.stop();
}
