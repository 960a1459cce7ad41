// SPDX-License-Identifier: MIT
// What the drill and the view did, as the session that the page saves tells it, and what the picture shows.
import { frames, refusal, removed, sleep, until } from "./browser.mjs";

/// The text of the session so far, caught where the page hands it to the browser as a download.
export const session = (page) =>
  page.evaluate(async () => {
    const { click } = HTMLAnchorElement.prototype, make = URL.createObjectURL;
    let blob = null;
    HTMLAnchorElement.prototype.click = () => {};
    URL.createObjectURL = (b) => ((blob = b), "#");
    document.getElementById("save_session").click();
    HTMLAnchorElement.prototype.click = click;
    URL.createObjectURL = make;
    return blob.text();
  });

const lastOf = (lines, word) => lines.filter((l) => l.split(" ")[1] === word).at(-1)?.split(" ").slice(2) ?? null;
/// The hand's place [mm] and direction (w, x, y, z), the view, and whether the spindle turns, as last told.
export async function told(page) {
  const lines = (await session(page)).split("\n");
  const hand = lastOf(lines, "hand")?.map(Number), view = lastOf(lines, "view")?.map(Number);
  return {
    place: hand?.slice(0, 3), direction: hand?.slice(3), spindle: lastOf(lines, "spindle")?.[0] === "on",
    focus: view?.slice(0, 3), yaw: view?.[3], pitch: view?.[4], distance: view?.[5],
  };
}
/// Likewise, once it holds still.
export async function settled(page) {
  let last = "";
  for (let i = 0; i < 60; ++i) {
    const now = await told(page), text_ = JSON.stringify(now);
    if (text_ === last) return now;
    last = text_;
    await sleep(150);
    await frames(page, 3);
  }
  throw new Error("the hand does not hold still");
}
/// Waits until what is told satisfies `ready`.
export async function tells(page, ready, what, timeout = 60e3) {
  for (const limit = Date.now() + timeout; ; await sleep(100)) {
    const now = await told(page);
    if (ready(now)) return now;
    if (Date.now() > limit) throw new Error(`${what}: ${JSON.stringify(now)}`);
  }
}

export const apart = (a, b) => Math.hypot(...a.map((v, i) => v - b[i]));
const dot = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
/// The screen's axes right, up and back in the bone's, as the engine's camera has them.
export function axesOf({ yaw, pitch }) {
  const [y, p] = [yaw, pitch].map((v) => (v * Math.PI) / 180);
  const right = [-Math.sin(y), Math.cos(y), 0], back = [Math.cos(p) * Math.cos(y), Math.cos(p) * Math.sin(y), Math.sin(p)];
  const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]];
  return [right, up, back];
}
/// How far the hand went along the screen's axes right, up, back [mm].
export const way = (before, after) => axesOf(before).map((axis) => dot(axis, after.place.map((v, i) => v - before.place[i])));
/// The pixel of the window where the hand's place is drawn.
export async function pixelOf(page, now) {
  const box = await page.$eval("#canvas", (c) => { const b = c.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; });
  const [right, up, back] = axesOf(now);
  const eye = now.focus.map((f, i) => f + now.distance * back[i]), d = now.place.map((p, i) => p - eye[i]);
  const scale = (2 * -dot(d, back) * Math.tan(0.3)) / box[3];
  return { x: box[0] + box[2] / 2 + dot(d, right) / scale, y: box[1] + box[3] / 2 - dot(d, up) / scale };
}

export const spindleIs = (page, on) => until(page, (want) => document.getElementById("spindle_state").textContent === want, 60e3, on ? "spindle on" : "spindle off");
/// Waits until more than so much is removed [mm3].
export const takes = (page, mm3, timeout = 150e3) => until(page, (most) => parseFloat(document.getElementById("brief_removed").textContent) > most, timeout, mm3);

/// Takes the drill home and then aside by `mm`, where bone is whole.
export async function goAside(page, mm) {
  await page.focus("#canvas");
  await page.keyboard.press("h");
  const home = await settled(page);
  await page.keyboard.down("ArrowRight");
  await tells(page, (t) => apart(t.place, home.place) > mm, "the drill moves aside");
  await page.keyboard.up("ArrowRight");
  await settled(page);
}

/// Drills from where the drill is until `mm3` more are removed, by keys. Returns what is removed in all. On a machine that
/// does other work keys are let go late, and the hole becomes so deep that its rim holds the shaft; so a drill that takes
/// nothing begins anew beside it.
export async function drill(page, mm3, tries = 3) {
  const before = await removed(page);
  await page.focus("#canvas");
  await page.keyboard.press("Space");
  await spindleIs(page, true);
  await page.keyboard.down("PageUp");
  let failed = null;
  try {
    await takes(page, before + mm3, 40e3);
  } catch (error) {
    failed = error;
  } finally {
    await page.keyboard.up("PageUp");
    await page.keyboard.press("Escape");
  }
  await spindleIs(page, false);
  if (!failed) return removed(page);
  if (tries <= 1) throw new Error(`${before + mm3} mm3 were not reached, "${await page.$eval("#status", (e) => e.textContent)}" at ${JSON.stringify(await told(page))}`, { cause: failed });
  await goAside(page, 1.5 * (4 - tries));
  return drill(page, mm3, tries - 1);
}

/// The drawn picture in coarse parts, as grey values from 0 to 255: grain and waves of sampling vanish in them.
export async function picture(page) {
  const box = await (await page.$("#canvas")).boundingBox();
  // The hint and the ring of focus come and go by themselves.
  const bare = (on) => page.evaluate((hide) => {
    document.getElementById("hint").style.visibility = hide ? "hidden" : "";
    document.getElementById("canvas").style.outline = hide ? "none" : "";
  }, on);
  await bare(true);
  const shot = await page.screenshot({ clip: box, encoding: "base64" });
  await bare(false);
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }), { resizeWidth: 40, resizeHeight: 40, resizeQuality: "high" });
    const c = Object.assign(document.createElement("canvas"), { width: 40, height: 40 }).getContext("2d");
    c.drawImage(image, 0, 0);
    const { data } = c.getImageData(0, 0, 40, 40);
    return Array.from({ length: 1600 }, (_, i) => (data[4 * i] + data[4 * i + 1] + data[4 * i + 2]) / 3);
  }, shot);
}
/// The share of a picture's parts that differ clearly [%].
export const differs = (a, b) => (100 * a.filter((v, i) => Math.abs(v - b[i]) > 12).length) / a.length;
/// The picture once it holds still.
export async function stillPicture(page) {
  let last = await picture(page);
  for (let i = 0; i < 40; ++i) {
    await sleep(300);
    await frames(page, 3);
    const now = await picture(page);
    if (differs(last, now) < 0.1) return now;
    last = now;
  }
  throw new Error("the picture does not hold still");
}

/// One sentence to the user: a capital, a full stop, and no more of it than can be read at a glance.
export const isSentence = (t) => /^[A-Z0-9“"']/.test(t) && /^[^]*[^.]\.$/.test(t) && t.length < 200 && !/[.!?] [A-Z]/.test(t);
export async function refused(page, timeout = 60e3) {
  await until(page, () => !document.getElementById("refusal").hidden, timeout);
  return refusal(page);
}
