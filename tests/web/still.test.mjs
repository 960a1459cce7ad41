// SPDX-License-Identifier: MIT
// While it drills no control moves: a finger or a mouse on its way to one would meet another.
import assert from "node:assert/strict";
import { test } from "node:test";
import { open, sleep, started, until } from "./support/browser.mjs";
import { spindleIs, takes } from "./support/drill.mjs";

const { server, browser } = await started();

/// Writes down from now on where each control lies, and the picture, in every frame; `moved` returns what moved since and
/// while what was said.
const kWatch = () => {
  const first = new Map(), moved = new Map();
  const said = () => ["title", "touch", "status", "tick", "structure_felt"].map((id) => document.getElementById(id).textContent).join(" | ");
  const look = () => {
    for (const e of document.querySelectorAll("button, select, input, #canvas")) {
      if (!e.checkVisibility() || e.closest("dialog, #opening, #refusal")) continue;
      const { left, top, width, height } = e.getBoundingClientRect(), now = [left, top, width, height];
      const before = first.get(e.id) ?? now;
      first.set(e.id, before);
      const most = Math.max(...now.map((v, i) => Math.abs(v - before[i])));
      if (most > 0.75 && !moved.has(e.id)) moved.set(e.id, `${e.id} by ${most} pixels: ${said()}`);
    }
    requestAnimationFrame(look);
  };
  look();
  window.moved = () => [[...moved.values()], first.size];
};

const kShapes = {
  "a wide window, temporal bone": { width: 1280, height: 800, bone: "temporal" },
  "a narrow window, temporal bone": { width: 800, height: 700, bone: "temporal" },
  "a phone held upright, tooth": { phone: true },
};
for (const [shape, size] of Object.entries(kShapes))
  test(`${shape}: drill, law, tools and Put bone back leave every control where it was`, async () => {
    const { page, seen } = await open(browser, server.url, size);
    if (size.phone) await page.$eval("#fold", (b) => b.click());
    await page.$eval("#law", (b) => b.click());
    await until(page, () => !document.getElementById("law_figures").hidden);
    await page.evaluate(kWatch);
    await page.focus("#canvas");
    await page.keyboard.press("Space");
    await spindleIs(page, true);
    await until(page, () => parseFloat(document.getElementById("rpm").textContent) > 1000);
    await page.keyboard.down("PageUp");
    await takes(page, 0.5);
    await page.keyboard.up("PageUp");
    await page.keyboard.press("Space");
    await spindleIs(page, false);
    // Bone comes to be around the drill, which is said in more words, and structures are not looked for meanwhile.
    await page.keyboard.press("Backspace");
    await until(page, () => document.getElementById("touch").textContent === "passes through bone", 20e3).catch(async (error) => {
      throw new Error(await page.evaluate(() => document.getElementById("state").innerText), { cause: error });
    });
    await sleep(500);
    await page.keyboard.press("h");
    for (const tool of ["match-head", "disc", "burr"]) {
      await page.select("#tool", tool);
      await until(page, (t) => document.getElementById("title").textContent.includes(t === "burr" ? "burr diameter" : `${t}-`) ||
        document.getElementById("status").textContent.includes("too large"), 60e3, tool);
    }
    const [moved, controls] = await page.evaluate(() => window.moved());
    assert.ok(controls > 20, `${controls} controls were watched`);
    assert.equal(moved.length, 0, `${moved.length} moved, the first: ${moved[0]}`);
    assert.deepEqual(seen, []);
    await page.close();
  });
