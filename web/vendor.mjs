// Renews exugear/report/web/vendor from the packages that package-lock.json pins: node vendor.mjs
import { createHash } from "node:crypto";
import { copyFileSync, readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const target = (name) => here(`../exugear/report/web/vendor/${name}`);
const packaged = (name) => JSON.parse(readFileSync(here(`node_modules/${name}/package.json`), "utf8"));
const digest = (name) => createHash("sha256").update(readFileSync(target(name))).digest("hex");

for (const name of ["uPlot.iife.min.js", "uPlot.min.css"]) {
  copyFileSync(here(`node_modules/uplot/dist/${name}`), target(name));
}
copyFileSync(here("node_modules/uplot/LICENSE"), target("LICENSE.uplot"));
copyFileSync(here("node_modules/three/LICENSE"), target("LICENSE.three"));
copyFileSync(here("node_modules/codemirror/LICENSE"), target("LICENSE.codemirror"));
for (const [name, globalName] of [
  ["three", "THREE"],
  ["codemirror", "CM"],
]) {
  await build({
    entryPoints: [here(`${name}_entry.js`)],
    outfile: target(`${name}.min.js`),
    bundle: true,
    minify: true,
    format: "iife",
    globalName,
    legalComments: "none",
    charset: "ascii",
    target: "es2020",
  });
}
const listed = [
  ["uplot", ["uPlot.iife.min.js", "uPlot.min.css"]],
  ["three", ["three.min.js"]],
  ["codemirror", ["codemirror.min.js"]],
].map(([name, files]) => ({
  name,
  version: packaged(name).version,
  licence: packaged(name).license,
  licence_file: `LICENSE.${name}`,
  files: Object.fromEntries([...files, `LICENSE.${name}`].map((file) => [file, digest(file)])),
}));
writeFileSync(target("vendor.json"), `${JSON.stringify(listed, null, 2)}\n`);
