// Bundles the extension into dist/, with the licences of all that is bundled.

import { copyFileSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import * as path from "node:path";
import { build } from "esbuild";

// The package has the licence of the project.
copyFileSync("../../LICENSE", "LICENSE");

const NOTICES = "dist/third-party-notices.txt";

const { metafile } = await build({
  entryPoints: ["src/extension.ts"],
  outfile: "dist/extension.js",
  bundle: true,
  platform: "node",
  format: "cjs",
  target: "node20",
  external: ["vscode"],
  minify: true,
  legalComments: "none",
  metafile: true,
});

const folders = new Set(
  Object.keys(metafile.inputs).flatMap((file) => /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(file)?.[1] ?? []),
);
const notices = [...folders].sort().map((folder) => {
  const { name, version, license } = JSON.parse(readFileSync(path.join(folder, "package.json"), "utf8"));
  const file = readdirSync(folder).find((each) => /^licen[cs]e/i.test(each));
  const text = file === undefined ? "" : readFileSync(path.join(folder, file), "utf8").trim();
  return `${name} ${version} (${license})\n\n${text}\n`;
});
notices.push("Graphviz (EPL-1.0), compiled to WebAssembly, is part of @viz-js/viz\n");
writeFileSync(NOTICES, notices.join(`\n${"-".repeat(80)}\n\n`));
