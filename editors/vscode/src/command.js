// Finds the command `impasto` as the setting names it, and reads what it says. Nothing here needs Visual Studio Code, so
// that tests can try it.

import { execFile } from "node:child_process";
import * as fs from "node:fs";
import * as os from "node:os";
import * as path from "node:path";

/** The setting with `~` and `${workspaceFolder}` replaced. */
export function expanded(setting, workspaceFolder, home = os.homedir()) {
  let text = setting.trim() || "impasto";
  if (text === "~" || text.startsWith("~/") || text.startsWith("~\\")) text = home + text.slice(1);
  return text.replaceAll("${workspaceFolder}", workspaceFolder ?? "");
}

/** The file that a command names, or undefined. A bare name is looked for on `PATH`, a path counts from the folder. */
export function findCommand(command, workspaceFolder, environment = process.env, platform = process.platform) {
  const endings = platform === "win32" ? ["", ".exe", ".cmd"] : [""];
  const isBare = !command.includes("/") && !command.includes("\\");
  const variable = environment.PATH ?? environment.Path ?? "";
  const folders = isBare ? variable.split(path.delimiter).filter(Boolean) : [workspaceFolder ?? "."];
  for (const folder of folders) {
    for (const ending of endings) {
      const file = path.resolve(folder, command + ending);
      if (isProgram(file, platform)) return file;
    }
  }
  return undefined;
}

function isProgram(file, platform) {
  try {
    fs.accessSync(file, platform === "win32" ? fs.constants.F_OK : fs.constants.X_OK);
    return fs.statSync(file).isFile();
  } catch {
    return false;
  }
}

/** Why a program has no language server, or undefined: older builds of Impasto have none, and other programs. */
export function whyNoServer(file) {
  return new Promise((resolve) => {
    execFile(file, ["lsp", "--help"], { timeout: 30_000 }, (error, stdout, stderr) => {
      resolve(error ? problem(stderr || error.message) : undefined);
    });
  });
}

/** The problem in what the command printed: its first error, or else its last line. */
export function problem(printed) {
  const lines = printed.trim().split("\n");
  const error = lines.find((line) => /^error\b/.test(line)) ?? lines.at(-1);
  return error.replace(/^error: /, "").trim();
}

/** Is a TOML text a scene? Those have cameras and materials. */
export function isScene(text) {
  return /^[ \t]*\[[ \t]*(camera[ \t]*\]|materials[ \t]*[.\]])/m.test(text);
}
