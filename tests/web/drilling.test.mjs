// SPDX-License-Identifier: MIT
// A script drills, and the picture changes where it drilled and nowhere else: pixels against rays that are cast through
// the saved bone, before and after.
import assert from "node:assert/strict";
import { test } from "node:test";
import { join } from "node:path";
import { downloads, give, open, project, removed, started, text, until } from "./support/browser.mjs";
import { cameraOf, firstBone, readNrrd, still } from "./support/picture.mjs";

const kIsovalue = 85.5; // of the made tooth (examples/drill/phantom.hpp)
const kReach = 3; // voxels around one that was cut: a still picture takes normals from two voxels beside, which are interpolated
const { server, browser } = await started();

async function saved(page, files, kind) {
  await page.evaluate((id) => document.getElementById(id).click(), kind === "session" ? "save_session" : `save_${kind}`);
  return files.next(`.${kind}`);
}

test("the picture changes where the drill has been, and nowhere else", async (t) => {
  const { page, seen } = await open(browser, server.url, { width: 700, height: 380, scale: 1 });
  const files = await downloads(page);
  await page.focus("#canvas");
  await page.keyboard.press("m"); // no marks
  await page.keyboard.press("h");
  const whole = await still(page), boneBefore = readNrrd(await saved(page, files, "nrrd"));

  await give(page, "session_input", join(project, "tests/web/sessions/pecking.session"));
  await until(page, () => parseFloat(document.getElementById("brief_removed").textContent) > 1);
  await until(page, () => !/replays/i.test(document.getElementById("status").textContent), 90e3);
  await page.focus("#canvas");
  await page.keyboard.press("h");
  const drilled = await still(page);
  const taken = await removed(page);
  const boneAfter = readNrrd(await saved(page, files, "nrrd"));
  const session = (await saved(page, files, "session")).toString();
  const camera = cameraOf(session, whole.width, whole.height);
  // The drill's flutes have turned, and its spring may have brought it back a little beside. Along its axis, in balls:
  const [px, py, pz, qw, qx, qy, qz] = [...session.matchAll(/ hand (.*)/g)].at(-1)[1].split(" ").map(Number);
  const axis = [2 * (qx * qz + qw * qy), 2 * (qy * qz - qw * qx), 1 - 2 * (qx * qx + qy * qy)];
  const radius = parseFloat(/([\d.]+) mm/.exec(await text(page, "title"))[1]) / 2;
  const balls = Array.from({ length: 100 }, (_, n) => ({ to: [px, py, pz].map((c, i) => c + 0.4 * n * axis[i] - camera.eye[i]), r: (n < 5 ? 1.05 : 0.75) * radius }));
  const isDrill = (d) => balls.some(({ to, r }) => {
    const t = to[0] * d[0] + to[1] * d[1] + to[2] * d[2];
    return Math.hypot(to[0] - t * d[0], to[1] - t * d[1], to[2] - t * d[2]) < r;
  });

  // The removed volume is that of the voxels.
  const n = boneBefore.size, near = new Uint8Array(boneBefore.voxels.length);
  let voxels = 0;
  for (let k = 0; k < n[2]; ++k)
    for (let j = 0; j < n[1]; ++j)
      for (let i = 0; i < n[0]; ++i) {
        const at = (k * n[1] + j) * n[0] + i;
        if (boneBefore.voxels[at] === boneAfter.voxels[at]) continue;
        ++voxels;
        for (let c = -kReach; c <= kReach; ++c)
          for (let b = -kReach; b <= kReach; ++b)
            for (let a = -kReach; a <= kReach; ++a) {
              const v = [i + a, j + b, k + c];
              if (v.every((x, d) => x >= 0 && x < n[d])) near[(v[2] * n[1] + v[1]) * n[0] + v[0]] = 1;
            }
      }
  assert.ok(voxels > 100, `${voxels} voxels are cut`);
  assert.ok(taken > 1);

  const isNear = (hit) => hit !== null && near[(Math.round(hit.u[2]) * n[1] + Math.round(hit.u[1])) * n[0] + Math.round(hit.u[0])] === 1;
  /// Whether the way to the light is another one since.
  const lit = (bone, hit) => firstBone(bone, kIsovalue, hit.p, camera.key, 1.0) === null;
  let must = 0, missed = 0, astray = 0, bonePixels = 0, wrongBone = 0;
  const w = whole.width, h = whole.height, changes = new Uint8Array(w * h), allowed = new Uint8Array(w * h);
  for (let y = 0; y < h; ++y)
    for (let x = 0; x < w; ++x) {
      const d = camera.ray(x, y);
      if (isDrill(d)) continue;
      const a = firstBone(boneBefore, kIsovalue, camera.eye, d), b = firstBone(boneAfter, kIsovalue, camera.eye, d);
      const [p, q] = [whole.at(x, y), drilled.at(x, y)];
      const change = Math.max(...[0, 1, 2].map((c) => Math.abs(p[c] - q[c])));
      if (a) ++bonePixels;
      // Bone is bright and the background dark; the drill stands before both.
      if (a && Math.max(...p) < 40) ++wrongBone;
      if (change > 40) changes[y * w + x] = 1;
      const deeper = a && (!b || b.t - a.t > 0.5);
      if (isNear(a) || isNear(b)) allowed[y * w + x] = 1;
      else if (change > 40 && a && b && lit(boneBefore, a) !== lit(boneAfter, b)) allowed[y * w + x] = 1;
      if (deeper) {
        ++must;
        if (change <= 6) ++missed;
      }
    }
  for (let y = 0; y < h; ++y)
    for (let x = 0; x < w; ++x) {
      if (!changes[y * w + x]) continue;
      let ok = false;
      for (let b = -2; b <= 2 && !ok; ++b) for (let a = -2; a <= 2 && !ok; ++a) ok = allowed[Math.min(Math.max(y + b, 0), h - 1) * w + Math.min(Math.max(x + a, 0), w - 1)] === 1;
      if (!ok) ++astray;
    }
  const changed = changes.reduce((s, c) => s + c, 0);
  t.diagnostic(`${w} x ${h}: ${bonePixels} pixels of bone, ${wrongBone} of them dark; ${changed} changed, ${astray} astray; ${must} lie deeper, ${missed} of them look the same`);
  assert.ok(bonePixels > 0.05 * w * h);
  assert.ok(wrongBone < 0.02 * bonePixels);
  assert.ok(must > 100 && missed < 0.1 * must);
  assert.ok(changed > 100);
  assert.ok(astray <= 0.01 * changed);

  // What is put back looks as before.
  await page.keyboard.press("Backspace");
  await page.keyboard.press("h");
  const again = await still(page);
  assert.equal(await text(page, "brief_removed"), "0.0");
  let different = 0;
  for (let y = 0; y < h; ++y) for (let x = 0; x < w; ++x) if (!isDrill(camera.ray(x, y)) && Math.abs(whole.at(x, y)[0] - again.at(x, y)[0]) > 40) ++different;
  t.diagnostic(`${different} pixels differ after the bone was put back`);
  assert.ok(different < 0.01 * changed);
  await files.end();
  assert.deepEqual(seen, []);
  await page.close();
});
