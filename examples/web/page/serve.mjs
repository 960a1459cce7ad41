#!/usr/bin/env node
// SPDX-License-Identifier: MIT
// Serves a folder on this computer alone, with the headers that shared memory needs:
//   node serve.mjs [FOLDER] [--port PORT]
import { createReadStream } from "node:fs";
import { realpath, stat } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, resolve, sep } from "node:path";

const kTypes = {
  ".html": "text/html; charset=utf-8", ".css": "text/css; charset=utf-8", ".js": "text/javascript; charset=utf-8",
  ".mjs": "text/javascript; charset=utf-8", ".wasm": "application/wasm", ".json": "application/json",
  ".webmanifest": "application/manifest+json", ".svg": "image/svg+xml", ".png": "image/png", ".txt": "text/plain; charset=utf-8",
};
const kHeaders = {
  "Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Embedder-Policy": "require-corp",
  "Cross-Origin-Resource-Policy": "same-origin", "X-Content-Type-Options": "nosniff", "Cache-Control": "no-cache",
};

const args = process.argv.slice(2);
let folder = null, port = 0, wrong = null;
for (let i = 0; i < args.length; ++i) {
  if (args[i] === "--port") {
    port = Number(args[++i]);
    if (!(Number.isInteger(port) && port >= 0 && port < 65536)) wrong = "--port needs a number from 0 to 65535";
  } else if (args[i].startsWith("-") || folder !== null) wrong = "usage: node serve.mjs [FOLDER] [--port PORT]";
  else folder = args[i];
}
const root = wrong ? null : await realpath(resolve(folder ?? ".")).catch(() => null);
if (!root) {
  console.error(`serve: ${wrong ?? `there is no folder ${folder}`}`);
  process.exit(2);
}

/// The file that an address names, if it lies in the folder.
async function fileOf(url) {
  const path = decodeURIComponent(new URL(url, "http://localhost").pathname);
  let file = await realpath(join(root, path));
  if ((await stat(file)).isDirectory()) file = await realpath(join(file, "index.html"));
  if (file !== root && !file.startsWith(root + sep)) throw new Error("outside");
  return { file, size: (await stat(file)).size };
}

const server = createServer(async (request, response) => {
  if (request.method !== "GET" && request.method !== "HEAD") return response.writeHead(405, kHeaders).end();
  try {
    const { file, size } = await fileOf(request.url);
    const type = kTypes[extname(file)] ?? "application/octet-stream";
    response.writeHead(200, { ...kHeaders, "Content-Type": type, "Content-Length": size });
    if (request.method === "HEAD") return response.end();
    createReadStream(file).on("error", () => response.destroy()).pipe(response);
  } catch {
    response.writeHead(404, { ...kHeaders, "Content-Type": "text/plain" }).end("There is no such file.\n");
  }
});
server.on("error", (error) => {
  console.error(`serve: ${error.code === "EADDRINUSE" ? `port ${port} is taken, so choose another` : error.message}`);
  process.exit(1);
});
server.listen(port, "127.0.0.1", () => console.log(`http://127.0.0.1:${server.address().port}/`));
