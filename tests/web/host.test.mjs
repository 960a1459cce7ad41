// SPDX-License-Identifier: MIT
// What happens around the page: a host that knows no headers, no network, two tabs, and a lost graphics card.
import assert from "node:assert/strict";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { test } from "node:test";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { late, open, opened, removed, servePlainly, sleep, started, text, until, watch } from "./support/browser.mjs";
import { picture } from "./support/picture.mjs";

const { server, browser } = await started();

/// Drills into what lies under the start until bone is gone.
async function drill(page) {
  await page.focus("#canvas");
  await page.keyboard.press("Space");
  await page.keyboard.down("PageUp");
  await until(page, () => parseFloat(document.getElementById("brief_removed").textContent) > 0.5);
  await page.keyboard.up("PageUp");
  await page.keyboard.press("Space");
}
/// The share of the picture that is bright, as bone and steel are.
async function look(page) {
  const { width, height, at } = await picture(page);
  let bright = 0;
  for (let y = 0; y < height; ++y) for (let x = 0; x < width; ++x) if (at(x, y)[0] > 120) ++bright;
  return bright / (width * height);
}

test("a host without headers: the page brings them, and works offline afterwards", async () => {
  const plain = await servePlainly();
  const page = await browser.newPage();
  const seen = watch(page, plain.url);
  let loads = 0;
  page.on("load", () => ++loads);
  await page.goto(plain.url);
  await opened(page);
  assert.ok(await page.evaluate(() => crossOriginIsolated));
  assert.equal(loads, 2, "the first visit loads the page twice");
  // As a user does: the driver's own reload ends in a page that is not isolated.
  await Promise.all([page.waitForNavigation(), page.evaluate(() => location.reload())]);
  await opened(page);
  assert.equal(loads, 3, "later ones once");
  await page.close();
  await plain.end();
  const offline = await browser.newPage();
  await offline.goto(plain.url);
  await opened(offline);
  await drill(offline);
  assert.deepEqual(seen, []);
  await offline.close();
});

test("where no service worker may be, it says what to do in one sentence", async () => {
  const plain = await servePlainly();
  const barred = await browser.createBrowserContext();
  const page = await barred.newPage();
  await page.evaluateOnNewDocument(() => {
    navigator.serviceWorker.register = () => Promise.reject(new Error("barred"));
  });
  await page.goto(plain.url);
  await until(page, () => !document.getElementById("sentence").hidden);
  assert.match(await text(page, "sentence"), /^[A-Z][^.]*service worker[^.]*\.$/);
  await barred.close();
  await plain.end();
});

test("inside another page it says in one sentence to open it alone", async () => {
  const plain = await servePlainly(), place = await mkdtemp(join(tmpdir(), "trephine-"));
  await writeFile(join(place, "index.html"), `<!doctype html><title>A host</title><iframe src="${plain.url}" width="400" height="300"></iframe>`);
  const host = await servePlainly(place), page = await browser.newPage();
  await page.goto(host.url);
  const frame = await (await page.waitForSelector("iframe")).contentFrame();
  await frame.waitForFunction(() => document.getElementById("sentence")?.hidden === false, { timeout: 60e3 });
  assert.match(await frame.$eval("#sentence", (e) => e.textContent), /^Inside another page [^.]*window of its own\.$/);
  await page.close();
  await host.end();
  await plain.end();
  await rm(place, { recursive: true });
});

test("two tabs: each has a bone of its own, and the hidden one's spindle rests", async () => {
  const one = await open(browser, server.url);
  await drill(one.page);
  const taken = await removed(one.page);
  const two = await open(browser, server.url);
  assert.equal(await removed(two.page), 0);
  await two.page.bringToFront();
  await drill(two.page);
  assert.ok((await removed(two.page)) > 0.5);
  await one.page.bringToFront();
  await sleep(500);
  assert.equal(await removed(one.page), taken);
  assert.equal(await text(one.page, "spindle_state"), "spindle off");
  const before = await late(one.page);
  await sleep(1000);
  assert.ok((await late(one.page)) - before < 900, "the first tab ticks on");
  assert.deepEqual([...one.seen, ...two.seen], []);
  await two.page.close();
  await one.page.close();
});

test("a graphics context that is lost comes back with the drilled bone, and the drill goes on meanwhile", async () => {
  const { page, seen } = await open(browser, server.url);
  await drill(page);
  const taken = await removed(page), whole = await look(page);
  assert.ok(whole > 0.02, `bone covers ${whole} of the picture`);
  await page.evaluate(() => {
    globalThis.loss = document.getElementById("canvas").getContext("webgl2").getExtension("WEBGL_lose_context");
    globalThis.loss.loseContext();
  });
  await sleep(700);
  assert.equal(await removed(page), taken);
  await page.evaluate(() => globalThis.loss.restoreContext());
  await sleep(500);
  await page.keyboard.press("+");
  await page.keyboard.press("-");
  let back = 0;
  for (let i = 0; i < 40 && Math.abs(back - whole) > 0.2 * whole; ++i) {
    await sleep(500);
    back = await look(page);
  }
  assert.ok(Math.abs(back - whole) <= 0.2 * whole, `bone covers ${back} of the picture, and ${whole} before`);
  await drill(page);
  assert.ok((await removed(page)) >= taken);
  assert.equal(await page.$eval("#refusal", (e) => e.hidden), true);
  // Chromium itself tells of the loss that the test asked for.
  assert.deepEqual(seen.filter((s) => !/CONTEXT_LOST_WEBGL|context (was )?lost/i.test(s)), []);
  await page.close();
});
