// SPDX-License-Identifier: MIT
// Builds the runner and the widget that the package ships. Their first line names its sources, so that a test finds those that are old.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync } from "node:fs";
import { build } from "esbuild";

const sources = createHash("sha256");
for (const name of readdirSync("src").sort()) sources.update(readFileSync(`src/${name}`));
const hash = sources.digest("hex");

for (const [entry, outfile, format] of [
  ["main.ts", "runner.js", "iife"],
  ["widget.ts", "widget.js", "esm"],
])
  await build({
    entryPoints: [`src/${entry}`],
    bundle: true,
    minify: true,
    format,
    target: "es2022",
    charset: "utf8",
    legalComments: "none",
    banner: { js: `/* SPDX-License-Identifier: MIT; built from web/src ${hash} */` },
    outfile: `../src/fragtracer/apps/web/${outfile}`,
  });
