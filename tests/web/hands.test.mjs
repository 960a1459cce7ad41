// SPDX-License-Identifier: MIT
// Every hand that the page takes: keys, mouse, touch, pen, gamepad. And the spindle never turns on by itself.
import assert from "node:assert/strict";
import { test } from "node:test";
import { give, open, removed, sleep, started, text, until } from "./support/browser.mjs";
import { apart, pixelOf, settled, spindleIs, takes, tells, told, way } from "./support/drill.mjs";
import { blockNifti } from "./support/volumes.mjs";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";

const { server, browser } = await started();
const all = []; // what pages did that they must not

/// One page at a time: only the front one draws.
async function withPage(options, work) {
  const { page, seen } = await open(browser, server.url, options);
  try {
    await work(page);
  } finally {
    all.push(...seen);
    await page.close();
  }
}
const box = (page, id = "canvas") => page.$eval(`#${id}`, (e) => {
  const b = e.getBoundingClientRect();
  return { x: b.left, y: b.top, width: b.width, height: b.height };
});
const centre = async (page, id = "canvas") => {
  const b = await box(page, id);
  return { x: b.x + b.width / 2, y: b.y + b.height / 2 };
};
const near = (a, b, by, what) => assert.ok(Math.abs(a - b) <= by, `${what}: ${a}, not ${b}`);
const angle = (a, b) => (360 / Math.PI) * Math.acos(Math.min(1, Math.abs(a.reduce((sum, v, i) => sum + v * b[i], 0))));
/// The drill went along the screen, to one side of it, as far as was asked for at least [mm].
const wentRight = (from, to, least) => {
  const [right, up, back] = way(from, to);
  assert.ok(right > least && Math.abs(up) < 0.3 * right && Math.abs(back) < 0.3 * right, `went ${[right, up, back]}`);
};

test("keys alone: all controls are reached in order with a visible focus", () =>
  withPage({}, async (page) => {
    const wanted = await page.$$eval("canvas[tabindex], #panel button, #panel select, #panel input", (list) =>
      list.filter((e) => e.checkVisibility() && !e.disabled).map((e) => e.id));
    assert.ok(wanted.length >= 20, `${wanted}`);
    const order = [];
    for (let i = 0; i < wanted.length + 8; ++i) {
      await page.keyboard.press("Tab");
      const now = await page.evaluate(() => {
        const e = document.activeElement;
        if (e === document.body) return null;
        const style = getComputedStyle(e), b = e.getBoundingClientRect();
        return {
          id: e.id, ring: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2,
          inside: b.left >= -1 && b.top >= -1 && b.right <= innerWidth + 1 && b.bottom <= innerHeight + 1,
        };
      });
      if (now === null || order.includes(now.id)) break;
      assert.ok(now.ring, `${now.id} shows its focus`);
      assert.ok(now.inside, `${now.id} is scrolled into the window`);
      order.push(now.id);
    }
    assert.deepEqual(order.filter((id) => wanted.includes(id)), wanted);
    assert.equal(order[0], "canvas", "the picture comes first");
  }));

test("keys alone: arrows, Page Up and Space drill bone; F1 helps and Escape stops", () =>
  withPage({}, async (page) => {
    await page.keyboard.press("Tab");
    const start = await settled(page);
    await page.keyboard.down("ArrowRight");
    await tells(page, (t) => way(start, t)[0] > 0.3, "the right arrow moves the drill to the right");
    await page.keyboard.up("ArrowRight");
    const right = await settled(page);
    wentRight(start, right, 0.3);
    await page.keyboard.down("ArrowUp");
    await tells(page, (t) => way(right, t)[1] > 0.3, "and the upper one up");
    await page.keyboard.up("ArrowUp");
    const up = await settled(page);
    await page.keyboard.down("Shift");
    await page.keyboard.down("ArrowLeft");
    await tells(page, (t) => Math.abs(t.yaw - up.yaw) > 5, "with Shift it turns the view");
    await page.keyboard.up("ArrowLeft");
    await page.keyboard.up("Shift");
    const turned = await settled(page);
    assert.ok(apart(turned.place, up.place) < 1e-3, "and not the drill");
    await page.keyboard.down("Control");
    await page.keyboard.down("ArrowUp");
    await tells(page, (t) => angle(t.direction, turned.direction) > 3, "with Ctrl it tilts the drill");
    await page.keyboard.up("ArrowUp");
    await page.keyboard.up("Control");
    await page.keyboard.press("h");
    await tells(page, (t) => apart(t.place, start.place) < 0.01 && Math.abs(t.yaw - start.yaw) < 0.01, "H takes both back");

    await page.keyboard.press("Space");
    await spindleIs(page, true);
    await page.keyboard.down("PageUp");
    await takes(page, 0.5);
    await page.keyboard.up("PageUp");
    const deep = await settled(page);
    await page.keyboard.down("PageDown");
    await tells(page, (t) => way(deep, t)[2] > 1, "Page Down pulls");
    await page.keyboard.up("PageDown");
    await page.keyboard.press("Escape");
    await spindleIs(page, false);
    const gone = await removed(page);

    await page.keyboard.press("F1");
    assert.ok(await page.$eval("#help", (e) => e.open));
    await page.keyboard.press("u");
    await page.keyboard.press("Escape");
    assert.equal(await page.$eval("#help", (e) => e.open), false);
    assert.equal(await removed(page), gone, "keys do nothing while the help is open");
    await page.keyboard.press("u");
    await until(page, () => document.getElementById("brief_removed").textContent === "0.0");

    // A list that has the focus keeps the keys that it needs.
    await page.focus("#tool");
    await page.keyboard.press("Space");
    await page.keyboard.press("Escape");
    assert.equal(await text(page, "spindle_state"), "spindle off");
  }));

test("mouse: move, wheel, left, right drag, middle drag, Ctrl and Shift", () =>
  withPage({ scale: 1 }, async (page) => {
    const { x, y } = await centre(page);
    const start = await settled(page);
    await page.mouse.move(x, y); // entering moves nothing, so that the drill does not jump
    const entered = await settled(page);
    assert.ok(apart(start.place, entered.place) < 1e-3);
    await page.mouse.move(x + 20, y + 10);
    const first = await tells(page, (t) => apart(t.place, start.place) > 0.01, "the mouse moves the drill");
    const under = await pixelOf(page, await settled(page));
    near(under.x, x + 20, 1, "the drill is under the mouse");
    near(under.y, y + 10, 1, "the drill is under the mouse");
    assert.ok(Math.abs(way(start, first)[2]) < 0.01, "in the plane of the screen");

    let from = await settled(page);
    await page.mouse.wheel({ deltaY: -200 });
    let to = await tells(page, (t) => apart(t.place, from.place) > 0.5, "the wheel pushes");
    near(way(from, to)[2], -0.8, 0.05, "two notches");
    await page.mouse.wheel({ deltaY: 200 });
    await tells(page, (t) => apart(t.place, from.place) < 1e-2, "and pulls");

    await page.mouse.down();
    await spindleIs(page, true);
    await page.mouse.up();
    await spindleIs(page, false);

    from = await settled(page);
    await page.mouse.down({ button: "right" });
    await page.mouse.move(x + 20, y - 10, { steps: 4 });
    await page.mouse.up({ button: "right" });
    to = await tells(page, (t) => apart(t.place, from.place) > 0.9, "a right drag up pushes");
    near(way(from, to)[2], -1, 0.05, "20 pixels");
    assert.equal(await text(page, "spindle_state"), "spindle off");

    from = await settled(page);
    await page.mouse.down({ button: "middle" });
    await page.mouse.move(x + 60, y - 10, { steps: 4 });
    await page.mouse.up({ button: "middle" });
    to = await tells(page, (t) => Math.abs(t.yaw - from.yaw) > 10, "a middle drag turns the view");
    near(to.yaw - from.yaw, (-180 * 40) / (await box(page)).height, 0.5, "half a turn for the picture's height");
    assert.ok(apart(to.place, from.place) < 1e-3 && to.distance === from.distance, "and nothing else");
    // The drill is elsewhere on the screen now, so that a key moves it from there and not from where the mouse was.
    await page.keyboard.press("ArrowRight");
    const pressed = await settled(page);
    assert.ok(apart(pressed.place, to.place) < 3, `a key's press moves it by ${apart(pressed.place, to.place)} mm`);

    from = await settled(page);
    await page.keyboard.down("Shift");
    await page.mouse.down({ button: "middle" });
    await page.mouse.move(x + 20, y + 20, { steps: 4 });
    await page.mouse.up({ button: "middle" });
    to = await tells(page, (t) => apart(t.focus, from.focus) > 0.1, "with Shift it moves the view");
    assert.equal(to.yaw, from.yaw);
    await page.mouse.wheel({ deltaY: -200 });
    to = await tells(page, (t) => t.distance < from.distance, "Shift + wheel brings it closer");
    near(to.distance, from.distance / 1.15 ** 2, 0.1, "two notches");
    assert.ok(apart(to.place, from.place) < 1e-3);
    await page.keyboard.up("Shift");

    from = await settled(page);
    await page.keyboard.down("Control");
    await page.mouse.move(x + 60, y + 20, { steps: 4 });
    await page.keyboard.up("Control");
    to = await tells(page, (t) => angle(t.direction, from.direction) > 3, "Ctrl and a motion tilt the drill");
    assert.ok(apart(to.place, from.place) < 1e-3, "about its tip");

    // Left and wheel drill.
    await page.keyboard.press("h");
    await tells(page, (t) => apart(t.place, start.place) < 0.01, "back at the start");
    await page.mouse.down();
    await spindleIs(page, true);
    for (const limit = Date.now() + 60e3; Date.now() < limit && parseFloat(await text(page, "brief_removed")) < 0.5; await sleep(100))
      await page.mouse.wheel({ deltaY: -100 });
    await page.mouse.up();
    await spindleIs(page, false);
    assert.ok((await removed(page)) > 0.5);
  }));

test("touch: one finger moves, two turn and zoom, two taps take the drill there, buttons drill", () =>
  withPage({ phone: true }, async (page) => {
    const { x, y } = await centre(page);
    const start = await settled(page);
    // The finger may be anywhere: its motion counts, so that it hides nothing.
    const one = await page.touchscreen.touchStart(x - 90, y + 80);
    for (let i = 1; i <= 5; ++i) await one.move(x - 90 + 8 * i, y + 80);
    await one.end();
    const moved = await settled(page);
    wentRight(start, moved, 0.5);
    const before_ = await pixelOf(page, start), after_ = await pixelOf(page, moved);
    near(after_.x - before_.x, 40, 3, "as far as the finger");
    near(after_.y - before_.y, 0, 3, "as far as the finger");

    const a = await page.touchscreen.touchStart(x - 50, y), b = await page.touchscreen.touchStart(x + 50, y);
    for (let i = 1; i <= 5; ++i) {
      await a.move(x - 50 + 8 * i, y);
      await b.move(x + 50 + 8 * i, y);
    }
    await a.end();
    await b.end();
    const turned = await settled(page);
    const half = (-180 * 40) / (await box(page)).height;
    near(turned.yaw - moved.yaw, half, 0.15 * Math.abs(half), "two fingers turn the view as far as they go");
    near(turned.distance, moved.distance, 0.02 * moved.distance, "and do not zoom");
    assert.ok(apart(turned.place, moved.place) < 1e-3, "the drill stays, also while the fingers come and go");

    const c = await page.touchscreen.touchStart(x - 40, y), d = await page.touchscreen.touchStart(x + 40, y);
    for (let i = 1; i <= 5; ++i) {
      await c.move(x - 40 - 8 * i, y);
      await d.move(x + 40 + 8 * i, y);
    }
    await c.end();
    await d.end();
    const closer = await settled(page);
    near(closer.distance, turned.distance / 2, 0.05 * turned.distance, "a pinch to twice the width halves the distance");
    assert.ok(Math.abs(closer.yaw - turned.yaw) < 4);

    await page.tap("#fold"); // shows the instruments
    await page.tap("#home");
    await page.tap("#fold");
    const home = await tells(page, (t) => apart(t.place, start.place) < 0.01 && Math.abs(t.yaw - start.yaw) < 0.01, "Home view");
    // Below the drill, where there is bone.
    const tip = await pixelOf(page, home), there = { x: tip.x, y: tip.y + 40 };
    // All at once, since a wait for the page's answer makes a tap too long where it draws slowly.
    const cdp = await page.createCDPSession();
    const tap = (place, times = 1) => Promise.all(Array.from({ length: 2 * times }, (_, i) =>
      cdp.send("Input.dispatchTouchEvent", i % 2 === 0 ? { type: "touchStart", touchPoints: [place] } : { type: "touchEnd", touchPoints: [] })));
    await tap(there, 2);
    const placed = await tells(page, (t) => apart(t.place, home.place) > 0.05, "two taps take the drill there");
    const under = await pixelOf(page, placed);
    near(under.x, there.x, 2, "under the finger");
    near(under.y, there.y, 2, "under the finger");

    // A thumb holds Push and another Spindle, while a finger moves.
    const spindle = await centre(page, "spindle"), push = await centre(page, "push_in");
    const thumb = await page.touchscreen.touchStart(spindle.x, spindle.y), other = await page.touchscreen.touchStart(push.x, push.y);
    await spindleIs(page, true);
    await takes(page, 0.5);
    await other.end();
    const finger = await page.touchscreen.touchStart(x, y - 60), held = await settled(page);
    for (let i = 1; i <= 4; ++i) await finger.move(x + 3 * i, y - 60);
    await tells(page, (t) => apart(t.place, held.place) > 0.05 && t.spindle, "a finger moves the drill while a thumb holds the spindle");
    await finger.end();
    await thumb.end();
    await spindleIs(page, false);
    const pull = await centre(page, "pull_out"), deep = await settled(page);
    const out = await page.touchscreen.touchStart(pull.x, pull.y);
    await tells(page, (t) => way(deep, t)[2] > 0.3, "Pull pulls");
    await out.end();
    await tap(spindle);
    await spindleIs(page, true);
    await tap(spindle);
    await spindleIs(page, false);

    // A touch that the system takes away stops the spindle.
    await cdp.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [spindle] });
    await spindleIs(page, true);
    await sleep(500);
    await cdp.send("Input.dispatchTouchEvent", { type: "touchCancel", touchPoints: [] });
    await spindleIs(page, false);
    await tap(spindle);
    await spindleIs(page, true);
    await cdp.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [{ x, y }] });
    await cdp.send("Input.dispatchTouchEvent", { type: "touchCancel", touchPoints: [] });
    await spindleIs(page, false);
    assert.ok(!/wheel|mouse|F1|button/i.test(await text(page, "hint")), `a hint for fingers: ${await text(page, "hint")}`);
  }));

test("pen: it moves the drill, pressing turns the spindle, its button pushes by a drag", () =>
  withPage({}, async (page) => {
    const cdp = await page.createCDPSession(), { x, y } = await centre(page);
    const pen = (type, px, py, more = {}) => cdp.send("Input.dispatchMouseEvent", { type, x: px, y: py, pointerType: "pen", ...more });
    const start = await settled(page);
    await pen("mouseMoved", x, y);
    await pen("mouseMoved", x + 15, y + 5);
    const hovered = await tells(page, (t) => apart(t.place, start.place) > 0.01, "the pen moves the drill");
    const under = await pixelOf(page, await settled(page));
    near(under.x, x + 15, 1, "under the pen");
    assert.equal(hovered.spindle, false);
    await pen("mousePressed", x + 15, y + 5, { button: "left", buttons: 1, clickCount: 1, force: 0.05 });
    await pen("mouseMoved", x + 16, y + 5, { button: "left", buttons: 1, force: 0.05 });
    await sleep(300);
    assert.equal((await told(page)).spindle, false, "a touch without pressure does not");
    await pen("mouseMoved", x + 17, y + 5, { button: "left", buttons: 1, force: 0.5 });
    await spindleIs(page, true);
    await pen("mouseMoved", x + 18, y + 5, { button: "left", buttons: 1, force: 0.05 });
    await spindleIs(page, false);
    await pen("mouseMoved", x + 19, y + 5, { button: "left", buttons: 1, force: 0.5 });
    await spindleIs(page, true);
    await pen("mouseReleased", x + 19, y + 5, { button: "left", buttons: 0, clickCount: 1 });
    await spindleIs(page, false);

    const from = await settled(page);
    await pen("mousePressed", x + 19, y + 5, { button: "right", buttons: 2, clickCount: 1, force: 0.5 });
    for (let i = 1; i <= 4; ++i) await pen("mouseMoved", x + 19, y + 5 - 5 * i, { button: "right", buttons: 2, force: 0.5 });
    const to = await tells(page, (t) => way(from, t)[2] < -0.5, "a drag with its button pushes");
    assert.equal(to.spindle, false);
    await pen("mouseReleased", x + 19, y - 15, { button: "right", buttons: 0, clickCount: 1 });
  }));

test("gamepad: sticks move and push, the trigger turns the spindle, the cross turns the view, shoulders change the tool", () =>
  withPage({
    before: () => {
      globalThis.pad = { connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false, value: 0 })) };
      navigator.getGamepads = () => [null, globalThis.pad];
    },
  }, async (page) => {
    const axis = (i, v) => page.evaluate((at, value) => void (globalThis.pad.axes[at] = value), i, v);
    const button = (i, value) => page.evaluate((at, v) => void (globalThis.pad.buttons[at] = { pressed: v > 0, value: v }), i, value);
    const start = await settled(page);
    await axis(0, 0.1); // a stick that rests beside its middle
    await sleep(600);
    assert.ok(apart((await settled(page)).place, start.place) < 1e-3);
    await axis(0, 0.7);
    await tells(page, (t) => way(start, t)[0] > 0.3, "the left stick moves the drill");
    await axis(0, 0);
    const moved = await settled(page);
    wentRight(start, moved, 0.3);
    await button(14, 1);
    await tells(page, (t) => Math.abs(t.yaw - moved.yaw) > 5, "the cross turns the view");
    await button(14, 0);
    const title = await text(page, "title");
    await button(5, 1);
    await until(page, (t) => document.getElementById("title").textContent !== t, 60e3, title);
    const larger = await text(page, "title");
    await sleep(500);
    assert.equal(await text(page, "title"), larger, "one press is one step");
    await button(5, 0);
    await sleep(300);
    await button(4, 1);
    await until(page, (t) => document.getElementById("title").textContent === t, 60e3, title);
    await button(4, 0);
    await page.click("#home");
    await button(7, 0.9);
    await spindleIs(page, true);
    await axis(3, -0.8);
    await takes(page, 0.5);
    await axis(3, 0);
    await button(7, 0);
    await spindleIs(page, false);
    const deep = await settled(page);
    await axis(3, 0.8);
    await tells(page, (t) => way(deep, t)[2] > 0.5, "the right stick pulls, too");
    await axis(3, 0);
  }));

test("the spindle stops where nobody would hear its release: no focus, a hidden tab, a dialog", () =>
  withPage({}, async (page) => {
    const on = async () => {
      await page.focus("#canvas");
      await page.keyboard.press("Space");
      await spindleIs(page, true);
    };
    await on();
    await page.evaluate(() => dispatchEvent(new Event("blur")));
    await spindleIs(page, false);

    // The driver keeps each tab visible, so that a hidden one is played.
    await on();
    await page.evaluate(() => {
      Object.defineProperty(document, "hidden", { value: true, configurable: true });
      document.dispatchEvent(new Event("visibilitychange"));
      delete document.hidden;
    });
    await spindleIs(page, false);

    // Keys that are down while the focus goes are not held for ever.
    await page.focus("#canvas");
    await page.keyboard.down("PageUp");
    await page.evaluate(() => dispatchEvent(new Event("blur")));
    const still = await settled(page);
    await sleep(800);
    assert.ok(apart((await told(page)).place, still.place) < 1e-3);
    await page.keyboard.up("PageUp");

    await on();
    await page.keyboard.press("F1");
    await spindleIs(page, false);
    await page.keyboard.press("Escape");
    await on();
    await page.click("#show_help");
    await spindleIs(page, false);
    await page.keyboard.press("Escape");

    // A volume's dialog opens by itself, once the file is read.
    await on();
    const place = await mkdtemp(join(tmpdir(), "trephine-"));
    await writeFile(join(place, "block.nii"), blockNifti());
    await give(page, "volume_input", join(place, "block.nii"));
    await until(page, () => document.getElementById("volume").open);
    await spindleIs(page, false);
    await page.keyboard.press("Escape");
    await rm(place, { recursive: true });

    // The spindle's button says what is so, also after it was stopped by something else.
    assert.equal(await page.$eval("#spindle", (e) => e.getAttribute("aria-pressed")), "false");
    await page.click("#spindle");
    await spindleIs(page, true);
    await page.keyboard.press("Escape");
    await spindleIs(page, false);
  }));

test("the pages said nothing in the console and asked for nothing elsewhere", () => assert.deepEqual(all, []));
