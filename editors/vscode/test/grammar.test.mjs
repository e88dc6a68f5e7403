// The TextMate grammar by the library and regular expressions that Visual Studio Code uses. A small source of marks and
// expected scopes, then every source of the repository.

import assert from "node:assert/strict";
import * as fs from "node:fs";
import { createRequire } from "node:module";
import * as path from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

const require = createRequire(import.meta.url);
const { Registry, parseRawGrammar, INITIAL } = require("vscode-textmate");
const { loadWASM, OnigScanner, OnigString } = require("vscode-oniguruma");

const root = fileURLToPath(new URL("../../..", import.meta.url));
const wasm = fs.readFileSync(path.join(path.dirname(require.resolve("vscode-oniguruma")), "onig.wasm"));

async function load() {
  await loadWASM(wasm.buffer.slice(wasm.byteOffset, wasm.byteOffset + wasm.byteLength));
  const registry = new Registry({
    onigLib: Promise.resolve({
      createOnigScanner: (patterns) => new OnigScanner(patterns),
      createOnigString: (text) => new OnigString(text),
    }),
    loadGrammar: async (scope) => {
      if (scope !== "source.impasto") return null;
      const file = fileURLToPath(new URL("../syntaxes/impasto.tmLanguage.json", import.meta.url));
      return parseRawGrammar(fs.readFileSync(file, "utf8"), file);
    },
  });
  return registry.loadGrammar("source.impasto");
}

const grammar = await load();

/** Every token of a text: where it is, what it is, and its innermost scope. */
function tokens(text) {
  let stack = INITIAL;
  const found = [];
  text.split("\n").forEach((line, row) => {
    const result = grammar.tokenizeLine(line, stack);
    stack = result.ruleStack;
    for (const token of result.tokens) {
      const piece = line.slice(token.startIndex, token.endIndex);
      found.push({ row, start: token.startIndex, text: piece, scopes: token.scopes });
    }
  });
  return { found, stack };
}

/** The scopes of the first token of a line that has exactly this text. */
function scopes(line, text) {
  const token = tokens(line).found.find((t) => t.text.trim() === text);
  assert.ok(token, `no token \`${text}\` in \`${line}\`: ${JSON.stringify(tokens(line).found.map((t) => t.text))}`);
  return token.scopes.join(" ");
}

const CASES = [
  ["//! A file.", "//!", "comment.line.documentation"],
  ["/// A `fn` here.", "`fn`", "markup.inline.raw"],
  ["/// Source: Lambert 1760.", "Source:", "storage.type.class.documentation"],
  ["/// Albedo: exact. Source: Lambert 1760.", "Source:", "storage.type.class.documentation"],
  ["/// Reflection: it goes both ways.", "Reflection:", "storage.type.class.documentation"],
  ["//// ruler", "ruler", "comment.line.double-slash", "////"],
  ["a /* b */ c", "b", "comment.block"],
  ["use std::bsdf::{diffuse, mirror as shiny};", "std", "entity.name.namespace"],
  ["use std::bsdf::{diffuse, mirror as shiny};", "bsdf", "entity.name.namespace"],
  ["use std::bsdf::{diffuse, mirror as shiny};", "diffuse", "variable.other.import"],
  ["use std::bsdf::{diffuse, mirror as shiny};", "as", "keyword.control.import"],
  ["material glaze {", "material", "storage.type"],
  ["material glaze {", "glaze", "entity.name.type.material"],
  ["delta bsdf shiny(ior: float = 1.5) {", "delta", "storage.modifier"],
  ["delta bsdf shiny(ior: float = 1.5) {", "shiny", "entity.name.function"],
  ["delta bsdf shiny(ior: float = 1.5) {", "ior", "variable.parameter"],
  ["delta bsdf shiny(ior: float = 1.5) {", "float", "support.type"],
  ["delta bsdf shiny(ior: float = 1.5) {", "1.5", "constant.numeric.float"],
  ["private fn f(a: vec3 = vec3(0.0, g(1)), b: Flakes) -> Flakes = a;", "private", "storage.modifier"],
  ["private fn f(a: vec3 = vec3(0.0, g(1)), b: Flakes) -> Flakes = a;", "b", "variable.parameter"],
  ["private fn f(a: vec3 = vec3(0.0, g(1)), b: Flakes) -> Flakes = a;", "Flakes", "entity.name.type"],
  ["fn f(a: color[5]) -> bsdf =", "bsdf", "support.type"],
  ["fn f(a: color[5]) -> bsdf =", "5", "constant.numeric.integer"],
  ["    param clay: color = srgb(0xb5552f);", "param", "storage.type"],
  ["    param clay: color = srgb(0xb5552f);", "clay", "variable.other.definition"],
  ["    param clay: color = srgb(0xb5552f);", "color", "support.type"],
  ["    param clay: color = srgb(0xb5552f);", "0xb5552f", "constant.other.color"],
  ["    param size: length = 0.6 mm in 0.05mm .. 10 m;", "mm", "keyword.other.unit"],
  ["    param size: length = 0.6 mm in 0.05mm .. 10 m;", "m", "keyword.other.unit"],
  ["    param size: length = 0.6 mm in 0.05mm .. 10 m;", "in", "keyword.control"],
  ["    param size: length = 0.6 mm in 0.05mm .. 10 m;", "..", "keyword.operator.range"],
  ["    let a = 12um;", "um", "keyword.other.unit"],
  ["    let a = 12um;", "12", "constant.numeric.integer"],
  ["    let a = 12u;", "12u", "constant.numeric.integer"],
  ["    for i in 0..8 {", "0", "constant.numeric.integer"],
  ["    for i in 0..8 {", "8", "constant.numeric.integer"],
  ["    let a = x1 * 2.5e-3;", "2.5e-3", "constant.numeric.float"],
  ["    let m = x1 m;", "m", "variable.other"],
  ["    let a = b.xyz;", "xyz", "variable.other.property"],
  ["    x = diffuse(reflectance: normal);", "diffuse", "entity.name.function.call"],
  ["    x = diffuse(reflectance: normal);", "reflectance", "variable.parameter"],
  ["    x = diffuse(reflectance: normal);", "normal", "variable.language"],
  ["    surface = layer(a);", "surface", "variable.language"],
  ["    let a = TWO_PI * b;", "TWO_PI", "variable.other.constant"],
  ["    eval(wo, wi) = a when same_side(wo, wi);", "when", "keyword.control"],
  ["    while a limit 4 {", "limit", "keyword.control"],
  ['    let a = "// no comment";', "// no comment", "string.quoted.double"],
  ["    let a = true;", "true", "constant.language.boolean"],
  ["    material = other(a);", "material", "storage.type"],
];

for (const [line, text, expected, instead] of CASES) {
  test(`${text} in ${line.trim()}`, () => {
    const found = instead ? tokens(line).found.at(-1).scopes.join(" ") : scopes(line, text);
    assert.ok(found.includes(expected), `${found} lacks ${expected}`);
  });
}

test("the second m of a parameter's range is a unit, too", () => {
  const { found } = tokens("param size: length = 0.6 mm in 0.05mm .. 10 m { unit: mm };");
  const units = found.filter((t) => t.scopes.at(-1).startsWith("keyword.other.unit"));
  assert.deepEqual(units.map((t) => t.text.trim()), ["mm", "mm", "m"]);
});

test("a string that does not end is over at the end of its line", () => {
  const { found } = tokens('let a = "wood\nlet b = 1;');
  assert.ok(found.some((t) => t.row === 1 && t.text === "let" && t.scopes.at(-1).startsWith("storage.type")));
});

function sourcesBelow(folder) {
  return fs.readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const file = path.join(folder, entry.name);
    if (entry.isDirectory()) return sourcesBelow(file);
    return entry.name.endsWith(".impasto") ? [file] : [];
  });
}

const sources = ["stdlib", "materials", "examples"].flatMap((name) => sourcesBelow(path.join(root, name)));

test("every source of the repository ends outside of all brackets, with no name left plain by mistake", () => {
  assert.ok(sources.length > 100);
  for (const file of sources) {
    const text = fs.readFileSync(file, "utf8");
    const { found, stack } = tokens(text);
    assert.equal(stack.depth, 1, `${file} ends within a rule`);
    for (const token of found) {
      const isBare = token.scopes.length === 1 && /[A-Za-z0-9]/.test(token.text);
      assert.ok(!isBare, `${file}:${token.row + 1}: \`${token.text}\` has no scope`);
      const isInvalid = token.scopes.some((s) => s.startsWith("invalid"));
      assert.ok(!isInvalid, `${file}:${token.row + 1}: \`${token.text}\` is invalid`);
    }
  }
});

test("definitions are found where the sources have them", () => {
  for (const file of sources) {
    const text = fs.readFileSync(file, "utf8");
    const { found } = tokens(text);
    const scoped = found.filter((t) => /^entity\.name\.(function|type\.(material|struct))\.impasto$/.test(t.scopes.at(-1)));
    const lines = text.split("\n").map((line) => line.match(/^(?:private )?(?:material|fn|struct|bsdf|delta bsdf|edf) (\w+)/)?.[1]);
    assert.deepEqual(scoped.map((t) => t.text), lines.filter(Boolean), file);
  }
});
