// SPDX-License-Identifier: MIT
// The engine in the browser ends sessions as the native code does, and its memory does not grow.
import assert from "node:assert/strict";
import { test } from "node:test";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { project, started, watch } from "./support/browser.mjs";
import { bare, change, run } from "./support/engine.mjs";

const { server, browser } = await started();

const rows = (await readFile(join(project, "tests/web/sessions.csv"), "utf8")).trim().split("\n").slice(1).map((line) => {
  const [session, bone, removed, x, y, z, ticks] = line.split(",");
  return { session, bone, removed: Number(removed), force: [x, y, z].map(Number), ticks: Number(ticks) };
});

test("sessions end with the native volume and force, to 1e-4", async (t) => {
  assert.ok(rows.length >= 3);
  const page = await bare(browser, server.url, rows[0].bone);
  const seen = watch(page, server.url);
  let open = rows[0].bone;
  for (const { session, bone, removed, force, ticks } of rows) {
    if (bone !== open) await change(page, (open = bone));
    const end = await run(page, await readFile(join(project, session), "utf8"));
    const apart = Math.hypot(...end.force.map((f, i) => f - force[i])) / Math.hypot(...force);
    t.diagnostic(`${session}: volume ${(end.removed_mm3 / removed - 1).toExponential(1)}, force ${apart.toExponential(1)} from native; tick ${end.tick_us_median.toFixed(0)} us`);
    assert.ok(Math.abs(end.removed_mm3 / removed - 1) <= 1e-4, `${end.removed_mm3} mm3, native ${removed}`);
    assert.ok(apart <= 1e-4, `${end.force} N, native ${force}`);
    assert.equal(end.ticks, ticks);
  }
  assert.deepEqual(seen, []);
  await page.close();
});

test("memory does not grow over sessions and bones", async (t) => {
  const page = await bare(browser, server.url, "tooth");
  const seen = watch(page, server.url);
  const session = await readFile(join(project, "tests/web/sessions/tools.session"), "utf8");
  await run(page, session);
  await change(page, "tooth");
  const before = await page.evaluate(() => engine.bytes());
  const rounds = Number(process.env.WEB_ROUNDS ?? 4);
  let ticks = 0;
  for (let i = 0; i < rounds; ++i) {
    ticks += (await run(page, session)).ticks;
    if (i % 4 === 1) await change(page, "tooth");
  }
  const after = await page.evaluate(() => engine.bytes());
  t.diagnostic(`${(ticks / 6e4).toFixed(1)} minutes of ticks: ${(before / 1e6).toFixed(0)} and ${(after / 1e6).toFixed(0)} MB`);
  assert.equal(after, before);
  assert.deepEqual(seen, []);
  await page.close();
});
