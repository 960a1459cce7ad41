// SPDX-License-Identifier: MIT
// The page in a real browser: Debian's Chromium, without a screen, drawing by software (SwiftShader).
import puppeteer from "puppeteer-core";
import { spawn } from "node:child_process";
import { createServer } from "node:http";
import { mkdtemp, readdir, readFile, rm, stat } from "node:fs/promises";
import { after } from "node:test";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { brotliCompressSync } from "node:zlib";

const here = dirname(fileURLToPath(import.meta.url));
export const project = resolve(here, "../../..");
/// The built page.
export const folder = resolve(process.env.TREPHINE_WEB ?? join(project, "build/web"));
export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

/// Serves the page as `examples/web/run` does.
export async function serve(root = folder) {
  const process_ = spawn(process.execPath, [join(project, "examples/web/page/serve.mjs"), root]);
  const url = await new Promise((done) => process_.stdout.once("data", (line) => done(String(line).trim())));
  return { url, end: () => process_.kill() };
}

const kTypes = { html: "text/html", css: "text/css", js: "text/javascript", wasm: "application/wasm", svg: "image/svg+xml", txt: "text/plain", webmanifest: "application/manifest+json" };
/// Serves it as a host does that knows no headers for shared memory, below /drill/.
export async function servePlainly(root = folder) {
  const server = createServer(async (request, response) => {
    const name = decodeURIComponent(new URL(request.url, "http://x").pathname).replace(/^\/drill\//, "") || "index.html";
    try {
      const body = await readFile(join(root, name));
      response.writeHead(200, { "Content-Type": kTypes[name.split(".").pop()] ?? "application/octet-stream" }).end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return {
    url: `http://127.0.0.1:${server.address().port}/drill/`,
    end: () => new Promise((done) => (server.close(done), server.closeAllConnections())),
  };
}

export const launch = (args = []) =>
  puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    headless: true,
    protocolTimeout: 600e3,
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", ...args],
  });

/// A server of the page and a browser, for all tests of a file; they end with it.
export async function started() {
  const server = await serve(), browser = await launch();
  after(async () => {
    await browser.close();
    server.end();
  });
  return { server, browser };
}

/// All files of the built page.
export async function files(root = folder, below = "") {
  const out = [];
  for (const name of await readdir(join(root, below))) {
    const path = join(below, name);
    if ((await stat(join(root, path))).isDirectory()) out.push(...(await files(root, path)));
    else out.push(path);
  }
  return out;
}
/// Their bytes, each packed by brotli as far as it goes.
export async function packedBytes() {
  let bytes = 0;
  for (const file of await files()) bytes += brotliCompressSync(await readFile(join(folder, file))).length;
  return bytes;
}

/// What a page must not do: words in the console, errors, refused or foreign requests.
export function watch(page, url) {
  const seen = [];
  page.on("console", (m) => seen.push(`console ${m.type()}: ${m.text()}`));
  page.on("pageerror", (e) => seen.push(`error: ${e.message}`));
  page.on("requestfailed", (r) => seen.push(`failed: ${r.url()} ${r.failure()?.errorText}`));
  page.on("response", (r) => r.status() >= 400 && seen.push(`status ${r.status()}: ${r.url()}`));
  page.on("request", (r) => !r.url().startsWith(url) && !/^(data|blob):/.test(r.url()) && seen.push(`foreign: ${r.url()}`));
  return seen;
}

/// Waits until `ready` holds in the page, a function of its own globals and of `values`.
export const until = (page, ready, timeout = 60e3, ...values) => page.waitForFunction(ready, { timeout, polling: 50 }, ...values);
/// Waits until a bone is open; fails at once where the page says that it cannot go on.
export async function opened(page, timeout = 120e3) {
  await until(page, () => !document.getElementById("sentence").hidden ||
    (document.getElementById("opening").hidden && document.getElementById("title").textContent !== ""), timeout);
  const sentence = await page.$eval("#sentence", (e) => (e.hidden ? "" : e.textContent));
  if (sentence) throw new Error(sentence);
}

/// Takes a bone of the list, and waits until it is open. The list is disabled from the choice until then, while the words on
/// what is being made may come and go between two looks.
export async function takeBone(page, bone) {
  await page.select("#bone", bone);
  await until(page, () => !document.getElementById("bone").disabled, 120e3);
  await opened(page);
}

/// Opens the page in a tab of its own, with a bone. `phone` is held upright; `scale` is of drawn pixels to those of CSS, few
/// enough for a machine without a graphics card.
export async function open(browser, url, { bone = "tooth", width = 600, height = 440, phone = false, scale = 0.5, before = null } = {}) {
  const page = await browser.newPage();
  const seen = watch(page, url);
  await page.setViewport(phone ? { width: 390, height: 844, deviceScaleFactor: scale, isMobile: true, hasTouch: true } : { width, height, deviceScaleFactor: scale });
  if (before) await page.evaluateOnNewDocument(before);
  await page.goto(`${url}#${bone}`, { timeout: 120e3 });
  await opened(page);
  return { page, seen };
}

export const text = (page, id) => page.$eval(`#${id}`, (e) => (e.hidden ? "" : e.textContent.trim()));
export const number = async (page, id) => parseFloat(await text(page, id));
export const refusal = (page) => page.evaluate(() => (document.getElementById("refusal").hidden ? "" : document.getElementById("refusal_text").textContent));
/// Waits until the page has gone through so many turns of its loop: without a graphics card one may take a second.
export const frames = (page, count) =>
  page.evaluate((n) => new Promise((done) => {
    const next = () => (n-- > 0 ? requestAnimationFrame(next) : done());
    next();
  }), count);
/// Removed volume [mm3] as the instruments show it, once it holds still.
export async function removed(page) {
  let last = -1;
  for (let i = 0; i < 40; ++i) {
    const now = await number(page, "brief_removed");
    if (now === last) return now;
    last = now;
    await sleep(300);
    await frames(page, 3);
  }
  return last;
}
/// Milliseconds of ticks that the instruments have shown come and go: `late` is cumulative in `#tick`.
export const late = async (page) => Number(/late (\d+)/.exec(await text(page, "tick"))?.[1] ?? NaN);

/// Gives files to one of the page's inputs, as its button's dialog does.
export const give = async (page, input, ...files) => (await page.$(`#${input}`)).uploadFile(...files);

/// Downloads land in a folder of their own. `next` waits for a file whose name ends so and returns its bytes.
export async function downloads(page) {
  const place = await mkdtemp(join(tmpdir(), "trephine-"));
  const cdp = await page.createCDPSession();
  await cdp.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: place });
  return {
    place,
    async next(end, timeout = 30e3) {
      for (const limit = Date.now() + timeout; Date.now() < limit; await sleep(100)) {
        const found = (await readdir(place)).find((f) => f.endsWith(end));
        if (!found) continue;
        await sleep(200);
        const bytes = await readFile(join(place, found));
        await rm(join(place, found));
        return bytes;
      }
      throw new Error(`no download that ends in ${end}`);
    },
    end: () => rm(place, { recursive: true, force: true }),
  };
}
