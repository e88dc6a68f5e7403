// Bundles the extension into one file, with the licences of what is in it, and copies the repository's beside the
// manifest, where packages carry them. Git ignores all that this writes.

import * as fs from "node:fs";
import * as path from "node:path";
import { fileURLToPath } from "node:url";

import { build } from "esbuild";

const folder = fileURLToPath(new URL("..", import.meta.url));
const dist = path.join(folder, "dist");
fs.rmSync(dist, { recursive: true, force: true });

const { metafile } = await build({
  absWorkingDir: folder,
  entryPoints: ["src/extension.js"],
  outfile: "dist/extension.cjs",
  bundle: true,
  external: ["vscode"],
  format: "cjs",
  platform: "node",
  target: "node18",
  minify: true,
  metafile: true,
});

/** The folder of the package that a file belongs to, or undefined. */
function packageOf(file) {
  const match = file.match(/^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//);
  return match?.[1];
}

const packages = [...new Set(Object.keys(metafile.inputs).map(packageOf).filter(Boolean))].sort();
const notices = packages.map((name) => {
  const full = path.join(folder, name);
  const { version, license } = JSON.parse(fs.readFileSync(path.join(full, "package.json"), "utf8"));
  const file = fs.readdirSync(full).find((entry) => /^licen[cs]e/i.test(entry));
  if (!file) throw new Error(`${name} has no licence to hand on`);
  const text = fs.readFileSync(path.join(full, file), "utf8").trim();
  return `${path.basename(name)} ${version} (${license})\n\n${text}\n`;
});
fs.writeFileSync(path.join(dist, "THIRD-PARTY-LICENSES.txt"), notices.join(`\n${"-".repeat(80)}\n\n`));

for (const name of ["LICENSE-MIT", "LICENSE-APACHE"]) {
  fs.copyFileSync(path.join(folder, "../..", name), path.join(folder, name));
}

// The package has the text of the README without its picture, which lies outside of it.
const readme = fs.readFileSync(path.join(folder, "README.md"), "utf8");
fs.writeFileSync(path.join(dist, "README.md"), readme.replaceAll(/^!\[.*\n\n/gm, ""));
