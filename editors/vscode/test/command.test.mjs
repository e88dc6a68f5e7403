// How the extension finds the command, and what it takes for a scene.

import assert from "node:assert/strict";
import * as fs from "node:fs";
import * as os from "node:os";
import * as path from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

import { expanded, findCommand, isScene, problem, whyNoServer } from "../src/command.js";

const root = fileURLToPath(new URL("../../..", import.meta.url));

test("the setting is expanded", () => {
  assert.equal(expanded("", "/w"), "impasto");
  assert.equal(expanded(" ~/bin/impasto ", "/w", "/home/a"), "/home/a/bin/impasto");
  assert.equal(expanded("${workspaceFolder}/target/release/impasto", "/w"), "/w/target/release/impasto");
});

test("a program is found on PATH, by its path, and from the folder", { skip: process.platform === "win32" }, () => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "impasto-"));
  const program = path.join(folder, "impasto");
  fs.writeFileSync(program, "#!/bin/sh\n");
  assert.equal(findCommand("impasto", "/", { PATH: folder }), undefined, "it cannot be run");
  fs.chmodSync(program, 0o755);
  assert.equal(findCommand("impasto", "/", { PATH: `/nowhere:${folder}` }), program);
  assert.equal(findCommand("./impasto", folder, { PATH: "" }), program);
  assert.equal(findCommand(program, "/", { PATH: "" }), program);
  assert.equal(findCommand("impasto", folder, { PATH: "/nowhere" }), undefined);
  assert.equal(findCommand(folder, "/", { PATH: "" }), undefined, "a folder is no program");
  fs.rmSync(folder, { recursive: true });
});

test("a program without a server says why", { skip: process.platform === "win32" }, async () => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "impasto-"));
  const program = (name, script) => {
    fs.writeFileSync(path.join(folder, name), `#!/bin/sh\n${script}\n`, { mode: 0o755 });
    return path.join(folder, name);
  };
  assert.equal(await whyNoServer(program("new", "exit 0")), undefined);
  const old = program("old", "echo \"error: unrecognized subcommand 'lsp'\" >&2; echo Usage: >&2; exit 2");
  assert.equal(await whyNoServer(old), "unrecognized subcommand 'lsp'");
  assert.match(await whyNoServer(program("silent", "exit 3")), /silent lsp --help/);
  fs.rmSync(folder, { recursive: true });
});

test("the problem is the first error of what was printed", () => {
  assert.equal(problem("reading\nerror: no window\nhint: lend one\n"), "no window");
  assert.equal(problem("error[E0210]: no parameter\n --> a.impasto\n"), "error[E0210]: no parameter");
  assert.equal(problem("Segmentation fault\n"), "Segmentation fault");
  assert.equal(problem(""), "");
});

test("scenes are told from other TOML files", () => {
  assert.ok(isScene('[materials."*"]\nfile = "a.impasto"\n'));
  assert.ok(isScene("name = 'lamp'\n\n[ camera ]\n"));
  assert.ok(!isScene("[package]\nname = 'materials'\n"));
  assert.ok(!isScene(fs.readFileSync(path.join(root, "Cargo.toml"), "utf8")));
  const scenes = fs.readdirSync(path.join(root, "examples")).map((name) => path.join(root, "examples", name, "scene.toml"));
  const found = scenes.filter((file) => fs.existsSync(file));
  assert.ok(found.length > 3);
  for (const file of found) assert.ok(isScene(fs.readFileSync(file, "utf8")), file);
});
