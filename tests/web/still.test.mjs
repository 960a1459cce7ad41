// SPDX-License-Identifier: MIT
// While it drills no control moves: a finger or a mouse on its way to one would meet another.
import assert from "node:assert/strict";
import { test } from "node:test";
import { frames, open, sleep, started, until } from "./support/browser.mjs";
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

test("at any width, the longest of what is said moves no control", async () => {
  const { page, seen } = await open(browser, server.url, { bone: "temporal" });
  await page.$eval("#law", (b) => b.click());
  await until(page, () => !document.getElementById("law_figures").hidden);
  const wrong = [];
  for (const width of [320, 360, 390, 430, 540, 570, 640, 800, 900, 1024, 1199, 1201, 1366, 1920]) {
    await page.setViewport({ width, height: 900, deviceScaleFactor: 0.25 });
    await frames(page, 3);
    // In one go, since the page writes its own words again.
    wrong.push(...await page.evaluate((at) => {
      document.body.classList.remove("folded");
      const place = () => [...document.querySelectorAll("button, select, input, #canvas")].filter((e) => e.checkVisibility())
        .map((e) => ({ id: e.id, box: e.getBoundingClientRect() }));
      const longest = {
        title: ["coupled, match-head-10.5 mm", "surface, burr diameter 10.0 mm"],
        touch: ["", "passes through bone", "tip and shaft touch"],
        status: ["All well", "No force, no cut until the drill is out of bone", "Replays a session"],
        tick: ["999 µs, at most 138 ms; late 123456", "0 µs, at most 0 µs; late 0"],
        force: ["12.34 N, at most 12.34", "0.00 N, at most 0.00"],
        torque: ["123.4 mN m, at most 123.4", "0.0 mN m, at most 0.0"],
        structure_name: ["–", "posterior semicircular canal"],
        structure_distance: ["", "−12.34 mm"],
        structure_words: ["the drill is in this structure", "–"],
        structure_felt: ["No soft structure is felt", "12.34 N on the sigmoid sinus; facial nerve torn"],
        thrust: ["123.4 N"], cutting_torque: ["123.4 mN m"], rpm: ["123456 rpm"], removed: ["12345.6 mm³"],
        brief_force: ["12.34"], brief_removed: ["1234.5"],
        structure_push: ["12.34 N"], structure_taken: ["1234.56 mm³"], structure_refused: ["1234.56 mm³"],
      };
      const wrong = [];
      for (const [id, texts] of Object.entries(longest))
        for (const words of texts) {
          const e = document.getElementById(id), said = e.textContent, before = place();
          e.textContent = words;
          const moved = place().find(({ box }, i) => Math.max(Math.abs(box.top - before[i].box.top), Math.abs(box.left - before[i].box.left), Math.abs(box.height - before[i].box.height)) > 0.75);
          if (moved) wrong.push(`${at} wide: "${words}" in ${id} moves ${moved.id}`);
          e.textContent = said;
        }
      return wrong;
    }, width));
  }
  assert.deepEqual(wrong, []);
  assert.deepEqual(seen, []);
  await page.close();
});
