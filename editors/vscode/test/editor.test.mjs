// Tries the extension in Visual Studio Code the way people use it: a browser shows code-server, and what the page shows is
// compared. `npm run try` runs it alone. It needs programs that the repository does not have, in these variables:
//
//     CODE_SERVER   the command code-server
//     CHROMIUM      a Chromium or Chrome
//     PUPPETEER     the folder of the npm package puppeteer-core
//     IMPASTO       the command impasto
//     SHOTS         a folder for a picture of each step, if there is to be one
//
// Without them it says NOT CHECKED.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import * as fs from "node:fs";
import * as os from "node:os";
import * as path from "node:path";
import { after, before, describe, it } from "node:test";
import { fileURLToPath } from "node:url";

import { Editor, until } from "./editor.mjs";

const extensionFolder = fileURLToPath(new URL("..", import.meta.url));
const root = path.join(extensionFolder, "../..");
const { CODE_SERVER, CHROMIUM, PUPPETEER, IMPASTO, SHOTS } = process.env;
const lacking = Object.entries({ CODE_SERVER, CHROMIUM, PUPPETEER, IMPASTO })
  .filter(([, value]) => !value || !fs.existsSync(value))
  .map(([name]) => name);
const skip = lacking.length > 0 && `NOT CHECKED: ${lacking.join(", ")} of the environment name no files`;
if (skip) console.log(`the extension in Visual Studio Code: ${skip}`);

const LENS = ".codelens-decoration";
const SUGGESTION = ".suggest-widget .monaco-list-row";
const MESSAGE = ".notification-toast .notification-list-item-message";
const ERROR = ".squiggly-error";

describe("the extension in Visual Studio Code", { skip }, () => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "impasto-editor-"));
  const workspace = path.join(folder, "workspace");
  const starts = path.join(folder, "starts");
  const program = path.join(folder, "impasto");
  const other = path.join(folder, "other");
  let editor;

  /** What a file of the workspace has on the disk. */
  const onDisk = (file) => fs.readFileSync(path.join(workspace, file), "utf8");
  /** The processes of the server so far, the newest last. */
  const servers = () => (fs.existsSync(starts) ? fs.readFileSync(starts, "utf8").trim().split("\n").map(Number) : []);
  /** Settings of the workspace, which follow each other while the editor runs. */
  const set = (settings) => {
    fs.mkdirSync(path.join(workspace, ".vscode"), { recursive: true });
    fs.writeFileSync(path.join(workspace, ".vscode/settings.json"), JSON.stringify(settings));
  };
  const line = async (part) => (await editor.lines()).find((l) => l.includes(part));
  const revert = async () => {
    await editor.press("Escape", "Escape");
    await editor.command("File: Revert File");
    await editor.gone(".tab.active.dirty");
  };
  const clear = () => editor.command("Notifications: Clear All Notifications");
  /** One step of the test; `run` takes its picture when there is something to look at. */
  const step = (name, run) => it(name, () => run(() => editor.shot(name.replaceAll(/\W+/g, "-"))));

  before(async () => {
    execFileSync("npm", ["run", "package"], { cwd: extensionFolder, stdio: "pipe", shell: process.platform === "win32" });
    const { version } = JSON.parse(fs.readFileSync(path.join(extensionFolder, "package.json"), "utf8"));
    fs.cpSync(path.join(root, "materials"), path.join(workspace, "materials"), { recursive: true });
    fs.cpSync(path.join(root, "examples/wax"), path.join(workspace, "wax"), { recursive: true });
    fs.renameSync(path.join(workspace, "wax/scene.toml"), path.join(workspace, "wax/candles.toml"));
    // Notes which processes serve.
    const script = `#!/bin/sh\n[ "$1 $2" = "lsp --stdio" ] && echo $$ >> '${starts}'\nexec '${IMPASTO}' "$@"\n`;
    fs.writeFileSync(program, script, { mode: 0o755 });
    fs.writeFileSync(other, `#!/bin/sh\necho >> '${other}.starts'\nexec '${IMPASTO}' "$@"\n`, { mode: 0o755 });
    set({ "impasto.path": other });
    editor = await Editor.start({ codeServer: CODE_SERVER, browser: CHROMIUM, puppeteer: PUPPETEER }, folder, {
      workspace,
      extension: path.join(extensionFolder, `impasto-${version}.vsix`),
      machine: { "impasto.path": program },
      settings: {
        "chat.disableAIFeatures": true,
        "editor.minimap.enabled": false,
        "files.autoSave": "off",
        "security.workspace.trust.banner": "never",
        "security.workspace.trust.startupPrompt": "never",
        "workbench.colorTheme": "Default Dark Modern",
        "workbench.secondarySideBar.defaultVisibility": "hidden",
        "workbench.startupEditor": "none",
      },
      shots: SHOTS,
    });
    await editor.press("Control+b");
  });

  after(async () => {
    await editor?.stop();
    fs.rmSync(folder, { recursive: true, force: true, maxRetries: 5 });
  });

  step("a source starts the server, and costs are shown", async (picture) => {
    await editor.open("car_paint.impasto");
    await editor.see(LENS, /[\d,]+ operations, \d+ live numbers, \d+ lobes \| show preview/);
    await until(async () => /;[\d,]+ ops$/.test(await line("let coarse")), "a line shows its cost");
    assert.equal(servers().length, 1);
    await picture();
  });

  step("the folder names the command once it is trusted", async () => {
    assert.ok(!fs.existsSync(`${other}.starts`), "not before");
    await editor.command("Workspaces: Manage Workspace Trust");
    await editor.click(".workspace-trust-editor .monaco-button", "Trust");
    await until(() => fs.existsSync(`${other}.starts`), "it is followed");
    await editor.press("Control+w");
    set({});
    await until(() => servers().length === 2, "the command of the machine is back");
  });

  step("colors of the grammar and of the server", async (picture) => {
    await editor.at("materials/car_paint.impasto", "position, normal", 1);
    await editor.command("Developer: Inspect Editor Tokens and Scopes");
    const token = await editor.see(".token-inspect-widget", "semantic token type");
    assert.match(token, /semantic token typevariablemodifiersreadonly defaultLibrary/);
    assert.match(token, /variable\.language\.impasto/);
    await picture();
    await editor.press("Escape");
    const colors = await editor.page.$$eval(".view-line span span", (spans) => spans.map((s) => getComputedStyle(s).color));
    assert.ok(new Set(colors).size > 5, "sources have colors");
  });

  step("hover", async (picture) => {
    await editor.at("materials/car_paint.impasto", "flakes(position", 2);
    await editor.press("Control+k", "Control+i");
    await editor.see(".monaco-hover", "coverage: float = 0.5");
    await editor.see(".monaco-hover", "std::noise::flakes");
    await picture();
    await editor.press("Escape");
  });

  step("an error shows while it is typed, with what to do", async (picture) => {
    await editor.at("materials/car_paint.impasto", "coverage: 0.06");
    await editor.type("x");
    await editor.see(ERROR);
    await editor.press("Control+Shift+m");
    await editor.see(".markers-panel .monaco-list-row", "`flakes` has no parameter `xcoverage`");
    await editor.see(".markers-panel .monaco-list-row", "hint: did you mean `coverage`?");
    await picture();
  });

  step("a quick fix mends it, and the error goes", async (picture) => {
    await editor.press("Control+Shift+m", "Control+1", "Control+.");
    await editor.see(".action-widget .monaco-list-row.focused", "write `coverage`");
    await picture();
    await editor.press("Enter");
    await editor.gone(ERROR);
    assert.match(await line("let coarse"), / coverage: 0\.06/);
    await revert();
  });

  step("completion with its import", async (picture) => {
    await editor.open("car_paint.impasto", 20);
    await editor.type("    let a = perlin_v");
    await editor.see(SUGGESTION, "perlin_vector");
    await picture();
    await editor.press("Enter");
    await until(() => line("use std::noise::{flakes, perlin_vector};"), "the import is there");
    assert.match(await line("let a"), /let a = perlin_vector\(p\)/);
    await editor.type("position, ");
    await editor.see(".parameter-hints-widget", "seed: int = 0");
    await revert();
  });

  step("a definition in the library opens, read-only", async (picture) => {
    await editor.open("car_paint.impasto");
    await editor.at("materials/car_paint.impasto", "flakes(position", 2);
    await editor.press("F12");
    await editor.see(".tab.active", "flakes.impasto");
    await editor.see(".view-line", "fn flakes(");
    await editor.type("x");
    await editor.see(".monaco-editor-overlaymessage", "read-only");
    await picture();
    // And on from there, which asks the server of a document that is on no disk.
    await editor.press("Control+f");
    await editor.fill(".find-widget textarea", "perlin_vector(place");
    await editor.press("Enter", "Escape", "ArrowLeft", "ArrowRight", "F12");
    await editor.see(".tab.active", "perlin_vector.impasto");
  });

  step("rename", async (picture) => {
    await editor.open("marble.impasto");
    await editor.see(LENS, "operations");
    await editor.at("materials/marble.impasto", "vein: color", 1);
    await editor.press("F2");
    await editor.fill(".rename-box input", "streak");
    await editor.press("Enter");
    await until(() => line("mix(stone, streak, "), "the uses are renamed");
    assert.ok(await line("param streak: color"));
    await revert();
    await editor.at("materials/marble.impasto", "vein: color", 1);
    await editor.press("F2");
    await editor.fill(".rename-box input", "let");
    await editor.press("Enter");
    await editor.see(MESSAGE, "`let` is a keyword");
    await picture();
    await clear();
  });

  step("formatting as files are saved", async () => {
    await editor.open("marble.impasto", 9);
    await editor.type("      ");
    await editor.press("Control+s");
    await editor.gone(".tab.active.dirty");
    assert.equal(onDisk("materials/marble.impasto"), fs.readFileSync(path.join(root, "materials/marble.impasto"), "utf8"));
  });

  step("folding", async (picture) => {
    await editor.goto(7, 3);
    await editor.press("Control+Shift+BracketLeft");
    await until(async () => (await editor.lines()).length < 12, "the material is folded");
    await picture();
    await editor.press("Control+Shift+BracketRight");
    await until(async () => (await editor.lines()).length > 12, "the material is unfolded");
  });

  step("color boxes with a picker", async (picture) => {
    assert.equal((await editor.texts(".colorpicker-color-decoration")).length, 2);
    await editor.click(".colorpicker-color-decoration");
    await editor.see(".colorpicker-header .picked-color", "srgb(0xe9e4da)");
    await picture();
    await editor.click(".colorpicker-header .picked-color");
    await until(() => line("param stone: color =  color(0.815, 0.776, 0.701)"), "the color is written another way");
    await revert();
  });

  step("documentation goes on with the line", async () => {
    await editor.goto(8, 1);
    await editor.press("End", "Enter");
    await editor.type("More of it.");
    assert.ok(await line("    /// More of it."));
    await revert();
  });

  step("the cost and the shader open beside", async (picture) => {
    await editor.command("Impasto: Show Cost");
    await editor.see(".tab", "marble.impasto.cost.txt");
    await editor.see(".view-line", "operations of one evaluation");
    await editor.press("Control+1");
    await editor.command("Impasto: Show Generated WGSL");
    await editor.see(".tab", "marble.impasto.wgsl");
    await editor.see(".view-line", "struct SurfacePoint {");
    await picture();
    await editor.command("View: Close All Editors");
  });

  step("a preview on a machine without a display says so", async (picture) => {
    await editor.open("marble.impasto");
    await editor.see(LENS, "show preview");
    await editor.command("Impasto: Show Preview");
    const said = await editor.see(MESSAGE, "The preview of marble.impasto ended: no window could be opened");
    assert.doesNotMatch(said, /hint/);
    await picture();
    await clear();
  });

  step("a scene of any name is served", async (picture) => {
    await editor.open("candles.toml");
    await editor.see(LENS, "show preview");
    await editor.at("wax/candles.toml", "max_depth", 9);
    await editor.type("s");
    await editor.see(ERROR);
    await editor.press("Control+.");
    await editor.see(".action-widget .monaco-list-row", "write `max_depth`");
    await picture();
    await revert();
    await editor.gone(ERROR);
    await editor.at("wax/candles.toml", '"wax.impasto", material = "wax"', 3);
    await editor.press("F12");
    await editor.see(".tab.active", "wax.impasto");
  });

  step("the plan of a scene shows above materials, and why", async (picture) => {
    set({ "impasto.scene": "wax/candles.toml" });
    await editor.open("wax.impasto");
    await editor.see(LENS, /kernel.*wax\/candles\.toml/);
    await editor.click(`${LENS} a`, "kernel");
    await editor.see(".monaco-dialog-box", "kernel");
    await picture();
    await editor.press("Escape");
    await editor.gone(".monaco-dialog-box");
  });

  step("costs are switched off and on", async (picture) => {
    await editor.open("car_paint.impasto");
    await editor.see(LENS, "operations");
    set({ "impasto.cost.lens": false, "impasto.cost.inlayHints": false });
    await editor.gone(LENS);
    await editor.gone(".view-line", / ops$/);
    await picture();
    set({});
    await editor.see(LENS, "operations");
  });

  step("a server that dies is started again", async () => {
    const old = servers().at(-1);
    process.kill(old, "SIGKILL");
    await until(() => servers().at(-1) !== old, "another server runs");
    await editor.at("materials/car_paint.impasto", "coverage: 0.06");
    await editor.type("x");
    await editor.see(ERROR);
    await revert();
    await editor.gone(ERROR);
  });

  step("the command restarts the server", async () => {
    const old = servers().at(-1);
    await editor.command("Impasto: Restart Language Server");
    await until(() => servers().at(-1) !== old, "another server runs");
    await editor.see(LENS, "operations");
  });

  step("a missing command is told once, and how to set it", async (picture) => {
    set({ "impasto.path": "/nowhere/impasto" });
    await editor.see(MESSAGE, "The command `/nowhere/impasto` was not found.");
    assert.ok((await editor.texts(".view-line")).length > 20, "the source can be read all the same");
    await editor.click(".notification-toast .monaco-button", "Open Setting");
    await editor.see(".settings-editor .setting-item-label", "Path");
    await picture();
    await editor.press("Escape", "Control+w");
  });

  step("an older build is told once, and why", async (picture) => {
    const old = path.join(folder, "old");
    const script = "#!/bin/sh\necho \"error: unrecognized subcommand 'lsp'\" >&2\nexit 2\n";
    fs.writeFileSync(old, script, { mode: 0o755 });
    set({ "impasto.path": old });
    await editor.see(MESSAGE, "does not start as a language server (unrecognized subcommand 'lsp')");
    assert.equal((await editor.texts(MESSAGE)).length, 1);
    await picture();
    await clear();
  });

  step("a program that ends at once is told, and not started again and again", async (picture) => {
    const bad = path.join(folder, "bad");
    fs.writeFileSync(bad, `#!/bin/sh\n[ "$2" = --help ] && exit 0\necho >> '${bad}.starts'\nexit 1\n`, { mode: 0o755 });
    set({ "impasto.path": bad });
    await editor.see(MESSAGE, "does not start as a language server");
    assert.equal(fs.readFileSync(`${bad}.starts`, "utf8"), "\n", "it is started once");
    assert.equal((await editor.texts(MESSAGE)).length, 1);
    await picture();
    await clear();
    set({});
    await editor.open("car_paint.impasto");
    await editor.see(LENS, "operations");
  });
});
