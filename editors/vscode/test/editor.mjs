// Drives Visual Studio Code for a test: starts code-server on folders of its own, opens it in a browser without a window,
// and presses keys and reads the page as a person does.

import { execFileSync, spawn } from "node:child_process";
import * as fs from "node:fs";
import { createRequire } from "node:module";
import * as net from "node:net";
import * as path from "node:path";
import { pathToFileURL } from "node:url";

/** How long a thing may take to show up: the first answer of a debug build of the server is slow. */
const PATIENCE = 30_000;

/** The field for commands, files and lines. */
const PALETTE = ".quick-input-widget input";

export class Editor {
  #server;
  #browser;
  #page;
  #shots;
  #workspace;

  /** `tools` are the paths of code-server, the browser and puppeteer-core; `folder` is empty and takes all files. */
  static async start(tools, folder, { workspace, settings, machine, extension, shots }) {
    const editor = new Editor();
    editor.#shots = shots;
    editor.#workspace = workspace;
    const own = ["--user-data-dir", path.join(folder, "user"), "--extensions-dir", path.join(folder, "extensions")];
    const config = path.join(folder, "config.yaml");
    fs.writeFileSync(config, "");
    // Settings of the user, and of the machine that extensions run on.
    for (const [name, values] of [["User", settings], ["Machine", machine]]) {
      fs.mkdirSync(path.join(folder, "user", name), { recursive: true });
      fs.writeFileSync(path.join(folder, "user", name, "settings.json"), JSON.stringify(values, null, 2));
    }
    const codeServer = (args) => [...own, "--config", config, ...args];
    execFileSync(tools.codeServer, codeServer(["--install-extension", extension]), { stdio: "pipe" });

    const port = await freePort();
    const args = codeServer(["--auth", "none", "--bind-addr", `127.0.0.1:${port}`, "--disable-update-check"]);
    // No display, so that previews do not open; a process group of its own, so that all its processes end with it.
    const { DISPLAY, WAYLAND_DISPLAY, WAYLAND_SOCKET, ...env } = process.env;
    editor.#server = spawn(tools.codeServer, [...args, "--disable-telemetry"], { env, detached: true, stdio: "ignore" });
    const address = `http://127.0.0.1:${port}`;
    await until(async () => (await fetch(`${address}/healthz`).catch(() => ({}))).ok, "code-server answers");

    const puppeteer = await import(pathToFileURL(createRequire(import.meta.url).resolve(path.resolve(tools.puppeteer))));
    editor.#browser = await puppeteer.launch({
      executablePath: tools.browser,
      args: ["--no-sandbox", "--disable-gpu"],
      defaultViewport: { width: 1280, height: 800 },
    });
    editor.#page = await editor.#browser.newPage();
    await editor.#page.goto(`${address}/?folder=${encodeURIComponent(workspace)}`);
    await editor.see(".monaco-workbench .part.editor");
    return editor;
  }

  async stop() {
    await this.#browser?.close();
    if (this.#server?.exitCode === null) process.kill(-this.#server.pid);
  }

  get page() {
    return this.#page;
  }

  /** Presses keys, such as `Control+Shift+M`. */
  async press(...chords) {
    for (const chord of chords) {
      const keys = chord.split("+");
      for (const key of keys.slice(0, -1)) await this.#page.keyboard.down(key);
      await this.#page.keyboard.press(keys.at(-1));
      for (const key of keys.slice(0, -1).reverse()) await this.#page.keyboard.up(key);
    }
  }

  async type(text) {
    await this.#page.keyboard.type(text, { delay: 40 });
  }

  /** Replaces the text of a field once it has the focus. */
  async fill(selector, text) {
    const focused = () => this.#page.evaluate((s) => document.activeElement?.matches(s), selector);
    await until(focused, `${selector} has the focus`);
    await this.press("Control+a");
    await this.type(text);
  }

  /** Runs a command of the palette by its title. */
  async command(title) {
    await this.press("F1");
    await this.fill(PALETTE, `>${title}`);
    await this.see(".quick-input-list .monaco-list-row.focused", title.split(": ").at(-1));
    await this.press("Enter");
  }

  /** Opens a file of the workspace, at a line if one is given. */
  async open(file, line) {
    await this.press("Control+p");
    await this.fill(PALETTE, file);
    await this.see(".quick-input-list .monaco-list-row.focused", path.basename(file));
    await this.press("Enter");
    await this.see(".tab.active", path.basename(file));
    await this.see(".editor-instance .view-line");
    if (line) await this.goto(line);
  }

  async goto(line, column = 1) {
    await this.press("Control+g");
    await this.fill(PALETTE, `:${line}:${column}`);
    await this.press("Enter");
    await this.gone(PALETTE);
  }

  /** Puts the cursor at the start of a text in a file as it is on disk, `after` characters on. */
  async at(file, text, after = 0) {
    const source = fs.readFileSync(path.join(this.#workspace, file), "utf8");
    const place = source.indexOf(text);
    if (place < 0) throw new Error(`${file} has no \`${text}\``);
    const before = source.slice(0, place + after).split("\n");
    await this.goto(before.length, before.at(-1).length + 1);
  }

  /** Clicks the first element with a text, once it is there. */
  async click(selector, text = "") {
    await this.see(selector, text);
    for (const element of await this.#page.$$(selector)) {
      if ((await element.evaluate((e) => e.textContent)).includes(text)) return element.click();
    }
  }

  /** The texts of all elements that a selector finds and that are on the screen. */
  async texts(selector) {
    return this.#page.$$eval(selector, (elements) =>
      elements
        .filter((e) => e.getClientRects().length > 0)
        .map((e) => (e.tagName === "INPUT" ? e.value : e.textContent).replaceAll("\u00a0", " ")),
    );
  }

  /** Waits for an element with a text (a string or a regular expression) and returns all of its text. */
  async see(selector, text = "") {
    return (await this.#wait(selector, text, (found) => found.length > 0, "shows"))[0];
  }

  /** Waits until no element shows a text. */
  async gone(selector, text = "") {
    await this.#wait(selector, text, (found) => found.length === 0, "no longer shows");
  }

  async #wait(selector, text, condition, what) {
    const has = (t) => (text instanceof RegExp ? text.test(t) : t.includes(text));
    let all, found;
    const look = async () => {
      all = await this.texts(selector);
      return condition((found = all.filter(has)));
    };
    try {
      await until(look, `${selector} ${what} ${text || "anything"}`);
    } catch (error) {
      await this.shot("failed");
      throw new Error(`${error.message}; its texts are ${JSON.stringify(all).slice(0, 600)}`);
    }
    return found;
  }

  /** The lines of the active editor that are on the screen, from top to bottom. */
  async lines() {
    return this.#page.$$eval(".editor-instance .view-lines .view-line", (lines) =>
      lines
        .map((line) => [line.getBoundingClientRect().top, line.textContent.replaceAll("\u00a0", " ")])
        .sort((a, b) => a[0] - b[0])
        .map(([, text]) => text),
    );
  }

  /** Saves a picture of the page if pictures are wanted. */
  async shot(name) {
    if (!this.#shots) return;
    fs.mkdirSync(this.#shots, { recursive: true });
    await this.#page.screenshot({ path: path.join(this.#shots, `${name}.png`) });
  }
}

/** Waits until a condition holds. */
export async function until(condition, what) {
  const end = Date.now() + PATIENCE;
  for (;;) {
    if (await condition()) return;
    if (Date.now() > end) throw new Error(`after ${PATIENCE / 1000} s it is not so that ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}

function freePort() {
  return new Promise((resolve) => {
    const server = net.createServer().listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  });
}
