// SPDX-License-Identifier: MIT
// The page loads without a word in the console and without a foreign request; it is small, and looks right wide, on a
// phone held upright, at 200 % zoom and without motion; every control has a name.
import assert from "node:assert/strict";
import { test } from "node:test";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { files, folder, late, launch, number, open, opened, packedBytes, sleep, started, text, until, watch } from "./support/browser.mjs";

const { server, browser } = await started();

test("packed, the page is 400 KB at most, the made bones with it", async () => {
  const bytes = await packedBytes();
  console.log(`page: ${(bytes / 1e3).toFixed(0)} KB by brotli`);
  assert.ok(bytes <= 400e3, `${bytes} bytes`);
});

test("the policy lets nothing in or out but the page's own files", async () => {
  const html = await readFile(join(folder, "index.html"), "utf8");
  const policy = /Content-Security-Policy" content="([^"]*)"/.exec(html)[1];
  assert.match(policy, /default-src 'none'/);
  assert.doesNotMatch(policy, /https?:|\*|unsafe-inline|unsafe-eval'(?<!wasm-unsafe-eval')/);
  for (const file of await files())
    if (/\.(html|css|js|webmanifest)$/.test(file))
      assert.doesNotMatch(await readFile(join(folder, file), "utf8"), /(src|href)="https?:|@import|url\(\s*['"]?https?:|fetch\("https?:/, file);
});

test("wide: it opens a tooth and ticks in time, without a word and without a foreign request", async () => {
  const { page, seen } = await open(browser, server.url);
  assert.match(await text(page, "title"), /mm/);
  assert.equal(await number(page, "brief_removed"), 0);
  await sleep(1500);
  const before = await late(page);
  await sleep(2000);
  assert.ok(Number.isFinite(before) && (await late(page)) < before + 1000, "it does not tick in time");
  const cookies = await browser.defaultBrowserContext().cookies();
  assert.deepEqual(cookies, []);
  assert.deepEqual(seen, []);
  await page.close();
});

const kShapes = {
  "wide": { width: 1400, height: 860, deviceScaleFactor: 0.5 },
  "phone held upright": { width: 390, height: 844, deviceScaleFactor: 0.5, isMobile: true, hasTouch: true },
  "small phone": { width: 320, height: 568, deviceScaleFactor: 0.5, isMobile: true, hasTouch: true },
  "phone on its side": { width: 844, height: 390, deviceScaleFactor: 0.5, isMobile: true, hasTouch: true },
  "1280 by 800 at 200 % zoom": { width: 640, height: 400, deviceScaleFactor: 0.5 },
};
for (const [name, shape] of Object.entries(kShapes))
  test(`${name}: nothing is cut off, and what is touched is large enough`, async () => {
    const page = await browser.newPage();
    const seen = watch(page, server.url);
    await page.setViewport(shape);
    await page.goto(server.url);
    await opened(page);
    for (const folded of [false, true]) {
      await page.evaluate((wanted) => {
        if (document.body.classList.contains("folded") !== wanted) document.getElementById("fold").click();
      }, folded);
      await sleep(400);
      const wrong = await page.evaluate((touch) => {
        const wrong = [];
        const root = document.documentElement;
        if (root.scrollWidth > root.clientWidth) wrong.push(`scrolls sideways: ${root.scrollWidth} > ${root.clientWidth}`);
        const picture = document.getElementById("canvas").getBoundingClientRect();
        if (picture.width * picture.height < 0.3 * innerWidth * innerHeight) wrong.push(`picture of ${picture.width} x ${picture.height}`);
        for (const e of document.querySelectorAll("button, select, input, label, dd, p, h1, h2")) {
          const box = e.getBoundingClientRect();
          if (box.width === 0 || e.closest("dialog:not([open]), .unseen")) continue;
          if (box.left < -0.5 || box.right > innerWidth + 0.5) wrong.push(`${e.id || e.textContent.trim().slice(0, 20)} from ${box.left} to ${box.right}`);
          if (touch && e.matches("button, select") && Math.min(box.width, box.height) < 31.5) wrong.push(`${e.id} is ${box.width} x ${box.height}`);
        }
        // By hand, without a scroll; folded away where a mouse does it.
        if (touch || !document.body.classList.contains("folded")) for (const id of ["spindle", "push_in", "pull_out"]) {
          const box = document.getElementById(id).getBoundingClientRect();
          if (box.bottom > innerHeight + 0.5 || box.height === 0) wrong.push(`${id} is below the screen`);
        }
        return wrong;
      }, shape.hasTouch ?? false);
      assert.deepEqual(wrong, [], `${folded ? "folded" : "unfolded"}`);
    }
    assert.deepEqual(seen, []);
    await page.close();
  });

test("every control has a name, a role and a place in the order of the keys", async () => {
  const { page, seen } = await open(browser, server.url);
  const tree = await page.accessibility.snapshot({ interestingOnly: true });
  const all = [];
  const walk = (node) => {
    all.push(node);
    (node.children ?? []).forEach(walk);
  };
  walk(tree);
  const controls = all.filter((n) => /button|combobox|checkbox|textbox|spinbutton|link|application|img/.test(n.role));
  assert.ok(controls.length > 20, `${controls.length} controls`);
  assert.deepEqual(controls.filter((n) => !n.name?.trim()).map((n) => n.role), []);
  const names = controls.map((n) => n.name);
  for (const name of ["Spindle", "Push", "Pull", "Tool", "Renderer", "Cutting forces", "Undo", "Cut open", "Help"]) assert.ok(names.includes(name), name);
  assert.equal(await page.evaluate(() => document.documentElement.lang), "en");
  assert.deepEqual(seen, []);
  await page.close();
});

test("with reduced motion nothing in the page moves by itself", async () => {
  const page = await browser.newPage();
  await page.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: "reduce" }]);
  const seen = watch(page, server.url);
  await page.goto(server.url);
  await opened(page);
  const moving = await page.evaluate(() => document.getAnimations().filter((a) => a.playState === "running" && a.effect.getTiming().duration > 1).length);
  assert.equal(moving, 0);
  assert.deepEqual(seen, []);
  await page.close();
});

test("without WebGL 2, and without scripts, it says so in one sentence", async () => {
  const blind = await launch(["--disable-gpu", "--disable-3d-apis"]);
  try {
    const page = await blind.newPage();
    await page.goto(server.url);
    await until(page, () => !document.getElementById("sentence").hidden);
    assert.match(await text(page, "sentence"), /^[A-Z][^.]*WebGL 2[^.]*\.$/);
    const plain = await blind.newPage();
    await plain.setJavaScriptEnabled(false);
    await plain.goto(server.url);
    assert.match(await plain.evaluate(() => document.querySelector("noscript").textContent), /JavaScript/);
  } finally {
    await blind.close();
  }
});
