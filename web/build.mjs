// SPDX-License-Identifier: MIT
// Builds the runner that the package ships. Its first line names its sources, so that a test finds one that is old.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync } from "node:fs";
import { build } from "esbuild";

const hash = createHash("sha256");
for (const name of readdirSync("src").sort()) hash.update(readFileSync(`src/${name}`));

await build({
  entryPoints: ["src/main.ts"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "utf8",
  legalComments: "none",
  banner: { js: `/* SPDX-License-Identifier: MIT; built from web/src ${hash.digest("hex")} */` },
  outfile: "../src/fragtracer/apps/web/runner.js",
});
