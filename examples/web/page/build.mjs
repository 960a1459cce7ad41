#!/usr/bin/env node
// SPDX-License-Identifier: MIT
// Puts the page into a folder, beside an engine that was built there before:
//   node build.mjs FOLDER
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { copyFile, mkdir, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const out = resolve(process.argv[2] ?? join(here, "../../../build/web"));
const kCopied = ["index.html", "style.css", "icon.svg", "manifest.webmanifest"];
const kEngine = ["engine.js", "engine.wasm", "engine.worker.js", "engine.data"];

await mkdir(out, { recursive: true });
await rm(join(out, "read"), { recursive: true, force: true });
for (const file of kCopied) await copyFile(join(here, file), join(out, file));
const common = { bundle: true, format: "esm", minify: true, target: "es2022", absWorkingDir: here, legalComments: "none", logLevel: "warning" };
await build({ ...common, entryPoints: ["main.js"], outfile: join(out, "main.js"), external: ["./engine.js"] });
await build({ ...common, entryPoints: ["read/worker.js"], outdir: join(out, "read"), splitting: true, chunkNames: "[name]-[hash]" });

let licences = "Readers of volumes in this page, and their licences\n";
for (const name of ["dicom-parser", "nifti-reader-js"])
  licences += `\n== ${name} ==\n\n${await readFile(join(here, "node_modules", name, "LICENSE"), "utf8")}`;
licences += `\n== trephine ==\n\n${await readFile(join(here, "../../../LICENSE"), "utf8")}`;
await writeFile(join(out, "licences.txt"), licences);

// The service worker knows all files of this build, so that the page works offline and never mixes two builds.
const present = await readdir(out);
const files = [...kCopied, "main.js", "licences.txt", ...kEngine.filter((f) => present.includes(f))];
files.push(...(await readdir(join(out, "read"))).map((f) => `read/${f}`));
const hash = createHash("sha256");
for (const file of files.sort()) hash.update(file).update(await readFile(join(out, file)));
const worker = (await readFile(join(here, "service_worker.js"), "utf8"))
  .replace('"BUILD"', JSON.stringify(hash.digest("hex").slice(0, 16)))
  .replace('["FILES"]', JSON.stringify(files));
await writeFile(join(out, "service_worker.js"), worker);
if (!present.includes("engine.js")) console.error("build: there is no engine.js in the folder yet: build it, then this page once more");
console.log(`${out}: ${files.length + 1} files`);
