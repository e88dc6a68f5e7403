// Definitions of the library open as read-only documents, whose text the server has: it lies in the command itself.

import * as vscode from "vscode";

import { LIBRARY } from "./server.js";

export function registerLibrary(context, server) {
  const provider = {
    async provideTextDocumentContent(uri) {
      const answer = await server.request("impasto/libraryText", { uri: uri.toString() });
      return answer?.text ?? `// The language server has no library file \`${uri.path}\`.\n`;
    },
  };
  context.subscriptions.push(vscode.workspace.registerTextDocumentContentProvider(LIBRARY, provider));
}
