// SPDX-License-Identifier: MIT
// What bench/figures/web.csv holds, measured here: node figures.mjs FILE. Native ticks are those of the program that
// TREPHINE_LIVE names, interleaved with the browser's; HOUR=1 also plays sessions for an hour of ticks.
import { execFileSync } from "node:child_process";
import { cpus } from "node:os";
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { launch, opened, packedBytes, project, serve, sleep } from "./support/browser.mjs";
import { bare, run } from "./support/engine.mjs";

const out = process.argv[2];
if (!out) {
  console.error("usage: node figures.mjs FILE");
  process.exit(2);
}
const rows = [];
const tell = (name, value, unit, set) => {
  rows.push([name, value, unit, set]);
  console.log(`${name}: ${value} ${unit} (${set})`);
};
const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];
const kBrowser = "drawn by software, two cores";

tell("Page, packed", Math.round((await packedBytes()) / 1e3), "KB", "brotli, made bones included");

const server = await serve();
let browser = null;
try {
  // From the address to the first force, in a browser that has just started: the first tick of the loop comes before the
  // instruments show it.
  for (const bone of ["tooth", "temporal"]) {
    const times = [];
    for (let i = 0; i < 5; ++i) {
      browser = await launch();
      const page = await browser.newPage();
      await page.setViewport({ width: 1000, height: 700 });
      await sleep(1000);
      const start = performance.now();
      await page.goto(`${server.url}#${bone}`);
      await opened(page);
      await page.waitForFunction(() => /[µm]s,/.test(document.getElementById("tick").textContent), { polling: 10 });
      times.push((performance.now() - start) / 1e3);
      await browser.close();
    }
    tell(`From the address to the first force, ${bone === "tooth" ? "tooth" : "temporal bone"}`, median(times).toFixed(1), "s", `${kBrowser}, median of 5`);
  }

  browser = await launch();
  const page = await bare(browser, server.url, "tooth");
  const file = "tests/web/sessions/pecking.session", session = await readFile(join(project, file), "utf8");
  if (process.env.TREPHINE_LIVE) {
    const ratios = [];
    for (let i = 0; i < 7; ++i) {
      const native = Number(/median ([\d.]+) us/.exec(execFileSync(process.env.TREPHINE_LIVE, ["--simulate", join(project, file)], { encoding: "utf8" }))[1]);
      ratios.push((await run(page, session)).tick_us_median / native);
    }
    tell("A tick's time over native", median(ratios).toFixed(1), "", "the same session, median of 7 runs by turns, native by g++");
  }

  // In real time, while the view turns and is drawn.
  const live = await page.evaluate(async (text) => {
    const moving = `0 size 320 240\n0 orbit 40\n${text}`;
    const refused = engine.play(moving);
    if (refused) throw new Error(refused);
    let drawn = 0, before = performance.now();
    const start = performance.now(), state = JSON.parse(engine.state());
    while (performance.now() - start < 5800) {
      const now = await new Promise((next) => requestAnimationFrame(next));
      if (engine.frame((now - before) / 1e3, 320, 240) !== 0) ++drawn;
      before = now;
    }
    const end = JSON.parse(engine.state());
    return { seconds: (performance.now() - start) / 1e3, drawn, ticks: end.ticks - state.ticks, late: end.late - state.late };
  }, session.replace(/^\d[\d.]* quit$/m, ""));
  tell("Ticks in their millisecond while it draws", (100 * (1 - live.late / (live.ticks + live.late))).toFixed(1), "%", `${kBrowser}, drilling`);
  tell("Pictures of 320 × 240", (live.drawn / live.seconds).toFixed(0), "a second", `${kBrowser}, turning and drilling`);

  if (process.env.HOUR) {
    const before = await page.evaluate(() => engine.bytes());
    let ticks = 0;
    while (ticks < 3.6e6) ticks += (await run(page, session)).ticks;
    const after = await page.evaluate(() => engine.bytes());
    tell("Growth of memory over an hour of ticks", ((after - before) / 1e6).toFixed(1), "MB", `${(before / 1e6).toFixed(0)} MB before`);
  }
  await page.close();
} finally {
  await browser?.close();
  server.end();
}
const cell = (text) => (/[",]/.test(String(text)) ? `"${text}"` : text);
const machine = `${cpus()[0].model}, ${cpus().length} cores`;
await writeFile(out, ["name,value,unit,set,machine", ...rows.map((r) => [...r, machine].map(cell).join(","))].join("\n") + "\n");
