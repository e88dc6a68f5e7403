// The manifest names files that exist and commands that are registered, and no others.

import assert from "node:assert/strict";
import * as fs from "node:fs";
import { test } from "node:test";

const read = (name) => fs.readFileSync(new URL(`../${name}`, import.meta.url), "utf8");
const manifest = JSON.parse(read("package.json"));

test("files that the manifest names exist", () => {
  const { languages, grammars, snippets } = manifest.contributes;
  const named = [manifest.icon, ...languages.map((l) => l.configuration), ...[...grammars, ...snippets].map((e) => e.path)];
  for (const name of named) assert.ok(read(name).length > 0, name);
});

test("commands of the manifest are registered", () => {
  const source = read("src/commands.js");
  const registered = [...source.matchAll(/register\("([^"]+)"/g)].map((m) => m[1]);
  // Lenses of the server name this one; people do not.
  const shown = registered.filter((name) => name !== "impasto.explain");
  assert.deepEqual(manifest.contributes.commands.map((c) => c.command).sort(), shown.sort());
});

test("settings that the extension reads are in the manifest", () => {
  const source = read("src/server.js");
  const settings = Object.keys(manifest.contributes.configuration.properties);
  for (const name of ["path", "scene", "cost.lens", "cost.inlayHints"]) {
    assert.ok(settings.includes(`impasto.${name}`), name);
    assert.ok(source.includes(name.split(".")[0]), name);
  }
});

test("the language configuration is JSON but for its comment", () => {
  const text = read("language-configuration.json").replace(/^\s*\/\/.*$/gm, "");
  const { onEnterRules, indentationRules } = JSON.parse(text);
  const goesOn = (line) => onEnterRules.find((r) => new RegExp(r.beforeText.pattern).test(line))?.action.appendText;
  assert.equal(goesOn("    /// What it is."), "/// ");
  assert.equal(goesOn("//! A file."), "//! ");
  assert.equal(goesOn("//////// ruler"), undefined);
  assert.equal(goesOn("// a comment"), undefined);
  const increase = new RegExp(indentationRules.increaseIndentPattern);
  for (const line of ["material a {", "    surface = layer(", "    let a =", "    let a = [ // b"]) assert.ok(increase.test(line), line);
  for (const line of ["// {", "    let a = b;", "    surface = f(a);"]) assert.ok(!increase.test(line), line);
});
