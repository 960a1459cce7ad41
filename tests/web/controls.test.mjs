// SPDX-License-Identifier: MIT
// Every control of the panel does what its label says, seen by what it does to bone, drill and picture.
import assert from "node:assert/strict";
import { writeFile } from "node:fs/promises";
import { join } from "node:path";
import { test } from "node:test";
import { downloads, frames, give, number, open, removed, sleep, started, takeBone, text, until } from "./support/browser.mjs";
import {
  apart, differs, drill, goAside, picture, settled, spindleIs, stillPicture, takes, tells, way,
} from "./support/drill.mjs";
import { readSaved } from "./support/volumes.mjs";

const { server, browser } = await started();
const { page, seen } = await open(browser, server.url);
const saves = await downloads(page);

const titled = (words) => until(page, (w) => document.getElementById("title").textContent.includes(w), 60e3, words);
const pressed = (id, on) => until(page, (i, want) => document.getElementById(i).getAttribute("aria-pressed") === want, 60e3, id, String(on));
const disabled = (id) => page.$eval(`#${id}`, (e) => e.disabled);
const options = (id) => page.$$eval(`#${id} option`, (all) => all.map((o) => o.value));
const diameter = async () => Number(/([\d.]+) mm|-([\d.]+)/.exec(await text(page, "title")).slice(1).find(Boolean));
const focused = () => page.evaluate(() => document.activeElement.id);
/// Opens the tooth anew, so that a session begins here.
async function anew(bone = "tooth") {
  await takeBone(page, bone);
  await until(page, () => document.getElementById("brief_removed").textContent === "0.0");
}
/// Where a control lies in the window, once it is scrolled there.
async function middle(id) {
  const control = await page.$(`#${id}`);
  await control.scrollIntoView();
  const box = await control.boundingBox();
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}
/// Holds a button until what is told satisfies `ready`.
async function hold(id, ready, what) {
  const { x, y } = await middle(id);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await tells(page, ready, what);
  await page.mouse.up();
}

test("Push and Pull move the drill along the view while held, and by a step for a click without a pointer", async () => {
  const start = await settled(page);
  await hold("push_in", (t) => way(start, t)[2] < -0.5, "Push moves the drill");
  const pushed = await settled(page);
  const [right, up, back] = way(start, pushed);
  assert.ok(back < -0.5, `Push moves away from the eye: ${back} mm`);
  assert.ok(Math.hypot(right, up) < Math.abs(back), "and not aside");
  await hold("pull_out", (t) => way(pushed, t)[2] > 0.5, "Pull moves the drill back");
  const pulled = await settled(page);
  await frames(page, 4);
  assert.ok(apart((await settled(page)).place, pulled.place) < 1e-3, "and not on, once it is let go");
  await page.$eval("#push_in", (b) => b.click());
  const step = way(pulled, await settled(page))[2];
  assert.ok(Math.abs(step + 0.4) < 0.05, `a step is ${step} mm`);
});

test("Home view takes drill and view back to the start", async () => {
  await page.$eval("#home", (b) => b.click());
  const home = await settled(page);
  await page.focus("#canvas");
  await page.keyboard.press("PageUp");
  await tells(page, (t) => apart(t.place, home.place) > 0.2, "the drill moves");
  await page.keyboard.down("Shift");
  await page.keyboard.down("ArrowRight");
  await tells(page, (t) => Math.abs(t.yaw - home.yaw) > 10, "the view turns");
  await page.keyboard.up("ArrowRight");
  await page.keyboard.up("Shift");
  await page.click("#home");
  await tells(page, (t) => t.yaw === home.yaw && apart(t.place, home.place) < 1e-3, "the view and drill are back");
});

test("Spindle: a tap turns it on or off, holding turns it while held", async () => {
  await page.click("#spindle");
  await spindleIs(page, true);
  await pressed("spindle", true);
  await page.click("#spindle");
  await spindleIs(page, false);
  const { x, y } = await middle("spindle");
  await page.mouse.move(x, y);
  await page.mouse.down();
  await spindleIs(page, true);
  await sleep(500); // longer than a tap
  assert.equal(await text(page, "spindle_state"), "spindle on");
  await page.mouse.up();
  await spindleIs(page, false);
  await pressed("spindle", false);
});

test("Spindle and Push drill", async () => {
  await page.click("#spindle");
  await spindleIs(page, true);
  const { x, y } = await middle("push_in");
  await page.mouse.move(x, y);
  await page.mouse.down();
  await takes(page, 0.5);
  await page.mouse.up();
  await page.click("#spindle");
  await spindleIs(page, false);
  assert.match(await text(page, "removed"), /^\d+\.\d mm³$/);
});

test("Put bone back leaves nothing removed", async () => {
  assert.ok((await removed(page)) > 0.5);
  await page.click("#restore");
  await until(page, () => document.getElementById("brief_removed").textContent === "0.0");
  await until(page, () => document.getElementById("removed").textContent === "0.0 mm³");
  await until(page, () => document.getElementById("undo").disabled);
});

test("Undo brings back a stroke at a time, and has nothing to do then", async () => {
  await page.click("#home");
  assert.ok(await disabled("undo"));
  const first = await drill(page, 0.5);
  assert.equal(await disabled("undo"), false);
  await goAside(page, 1.5);
  const second = await drill(page, 0.5);
  assert.ok(second > first + 0.4);
  await page.click("#undo");
  await until(page, (most) => parseFloat(document.getElementById("brief_removed").textContent) < most, 60e3, second - 0.3);
  assert.ok(Math.abs((await removed(page)) - first) < 0.15, `${await removed(page)} after the first stroke's ${first}`);
  await page.click("#undo");
  await until(page, () => document.getElementById("brief_removed").textContent === "0.0");
  await until(page, () => document.getElementById("undo").disabled);
  await page.click("#home");
});

test("Tool: each of the list is taken, and the title names it; what does not fit is refused in words", async () => {
  const tools = await options("tool");
  assert.deepEqual(tools, ["burr", "round", "diamond", "match-head", "pear", "cylinder", "taper", "barrel", "disc", "twist", "reamer"]);
  const taken = [];
  await until(page, () => document.getElementById("status").textContent === "All well");
  for (const tool of [...tools.slice(1), "burr"]) {
    await page.select("#tool", tool);
    await until(page, (t) => document.getElementById("title").textContent.includes(t === "burr" ? "burr diameter" : `${t}-`) ||
      document.getElementById("status").textContent.includes("too large"), 60e3, tool);
    assert.equal(await focused(), "canvas", "the keys go to the drill again");
    if ((await text(page, "status")).includes("too large")) {
      assert.match(await text(page, "status"), new RegExp(`^The ${tool}-\\d+ is too large for this bone$`));
      // The list shows the tool that is in the hand.
      await until(page, () => document.getElementById("title").textContent.includes(document.getElementById("tool").value));
      await page.select("#tool", "burr");
      await until(page, () => document.getElementById("status").className === "");
    } else taken.push(tool);
  }
  assert.ok(taken.length >= 8, `taken: ${taken}`);
  // Another tool makes another picture and another hole.
  await anew();
  const burr = await stillPicture(page);
  await page.select("#tool", "pear");
  await titled("pear-");
  const pear = await stillPicture(page);
  assert.ok(differs(burr, pear) > 0.2, `the picture differs by ${differs(burr, pear)} %`);
  assert.ok((await drill(page, 0.3)) > 0.3);
  await page.click("#restore");
  await page.click("#home");
  await page.select("#tool", "burr");
  await titled("burr diameter");
});

test("Larger and Smaller change the tool's diameter", async () => {
  const press = async (id) => {
    const title = await text(page, "title");
    await page.click(`#${id}`);
    await until(page, (t) => document.getElementById("title").textContent !== t, 60e3, title);
  };
  await anew();
  for (const tool of ["burr", "cylinder"]) {
    await page.select("#tool", tool);
    await titled(tool);
    const first = await diameter();
    const small = await stillPicture(page);
    await press("larger");
    const second = await diameter();
    assert.ok(second > first * 1.1 && second < first * 1.5, `${first} to ${second} mm`);
    assert.ok(differs(small, await stillPicture(page)) > 0.1, "and it is drawn so");
    await press("smaller");
    assert.ok(Math.abs((await diameter()) - first) <= 0.1, "and back");
  }
  await page.select("#tool", "burr");
  await titled("burr diameter");
});

test("Renderer: each of the three drills", async () => {
  const renderers = await options("renderer");
  assert.deepEqual(renderers, ["coupled", "line", "surface"]);
  for (const renderer of [...renderers.slice(1), "coupled"]) {
    await page.select("#renderer", renderer);
    await titled(`${renderer},`);
    assert.equal(await focused(), "canvas");
    assert.ok((await drill(page, 0.3)) > 0.3, renderer);
    await page.click("#restore");
    await page.click("#home");
    await until(page, () => document.getElementById("brief_removed").textContent === "0.0");
  }
});

test("Cutting forces: the law's figures are there while it is on, and say what the cut needs while the spindle turns", async () => {
  const shown = () => page.$eval("#law_figures", (e) => e.checkVisibility());
  assert.equal(await shown(), false);
  await page.select("#renderer", "line"); // the law needs the coupled one, and takes it
  await titled("line,");
  await page.click("#law");
  await titled("coupled,");
  await until(page, () => !document.getElementById("law_figures").hidden);
  assert.deepEqual(await page.$$eval("#law_figures dd", (all) => all.map((e) => e.textContent)), ["–", "–", "–"]);
  await page.click("#spindle");
  await until(page, () => parseFloat(document.getElementById("rpm").textContent) > 1000);
  assert.equal(await number(page, "thrust"), 0, "in the air");
  const { x, y } = await middle("push_in");
  await page.mouse.move(x, y);
  await page.mouse.down();
  await until(page, () => parseFloat(document.getElementById("thrust").textContent) > 0 && parseFloat(document.getElementById("cutting_torque").textContent) >= 0);
  await takes(page, 0.2);
  await page.mouse.up();
  await page.click("#spindle");
  await spindleIs(page, false);
  await until(page, () => [...document.querySelectorAll("#law_figures dd")].every((e) => e.textContent === "–"));
  await page.click("#spindle");
  await until(page, () => parseFloat(document.getElementById("rpm").textContent) > 1000);
  await page.click("#law");
  await until(page, () => document.getElementById("law_figures").hidden);
  await page.click("#spindle");
  await spindleIs(page, false);
  await page.click("#restore");
  await page.click("#home");
});

test("Cut open shows the inside of bone and closes it", async () => {
  await drill(page, 1);
  const closed = await stillPicture(page);
  assert.ok(differs(closed, await stillPicture(page)) < 0.3, "a still picture stays");
  await page.click("#clip");
  await pressed("clip", true);
  const cut = await stillPicture(page);
  assert.ok(differs(closed, cut) > 1, `the picture differs by ${differs(closed, cut)} %`);
  await page.click("#clip");
  await pressed("clip", false);
  const again = await stillPicture(page);
  assert.ok(differs(closed, again) < 0.3, `closed again but for ${differs(closed, again)} %`);
});

test("Marks show where bone touches and which way it pushes", async () => {
  // The drill leans on bone, without turning, so that there is a force to be drawn.
  await page.click("#restore");
  await page.click("#home");
  await settled(page);
  await until(page, () => parseFloat(document.getElementById("force").textContent) === 0); // of the last cut no more
  await page.focus("#canvas");
  await page.keyboard.down("PageUp");
  await until(page, () => parseFloat(document.getElementById("force").textContent) > 0.2);
  await page.keyboard.up("PageUp");
  await pressed("marks", true);
  const marked = await stillPicture(page);
  await page.click("#marks");
  await pressed("marks", false);
  const plain = await stillPicture(page);
  assert.ok(differs(marked, plain) > 0.1, `the arrow covers ${differs(marked, plain)} %`);
  await page.click("#marks");
  await pressed("marks", true);
  const again = await stillPicture(page);
  assert.ok(differs(marked, again) < differs(marked, plain), `${differs(marked, again)} % differ from before, and ${differs(marked, plain)} % without`);
  await page.click("#home");
});

test("Hide leaves the picture the whole width, and Instruments brings them back", async () => {
  const widthOf = () => page.$eval("#canvas", (c) => c.clientWidth);
  const shows = () => page.$eval("#parts", (e) => e.checkVisibility());
  const narrow = await widthOf();
  assert.ok(await shows());
  assert.equal(await text(page, "fold"), "Hide");
  await page.click("#fold");
  assert.equal(await shows(), false);
  assert.equal(await text(page, "fold"), "Instruments");
  assert.equal(await page.$eval("#fold", (e) => e.getAttribute("aria-expanded")), "false");
  assert.ok((await widthOf()) > narrow + 100);
  await until(page, () => document.getElementById("canvas").width === Math.round(document.getElementById("canvas").clientWidth * devicePixelRatio));
  await page.click("#fold");
  assert.ok(await shows());
  assert.equal(await widthOf(), narrow);
  await page.focus("#canvas");
  await page.keyboard.press("p");
  assert.equal(await shows(), false, "P hides them, too");
  await page.keyboard.press("p");
  assert.ok(await shows());
});

test("Help lists mouse, keys, touch and gamepad; Escape and its button close it", async () => {
  const isOpen = () => page.$eval("#help", (e) => e.open);
  await page.click("#show_help");
  assert.ok(await isOpen());
  assert.deepEqual(await page.$$eval("#help_lists h3", (all) => all.map((h) => h.textContent)), ["Mouse", "Keys", "Touch and pen", "Gamepad"]);
  const names = await page.$$eval("#help_lists dt", (all) => all.map((d) => d.textContent));
  const wanted = [
    "move", "wheel", "left button", "middle drag", "F1", "P", "Arrows", "Page Up, Page Down", "Escape", "Space", "R", "L", "[", "]", "T", "H", "U", "Backspace",
    "C", "G", "M", "+", "-", "one finger", "pen", "left stick",
  ];
  for (const name of wanted) assert.equal(names.filter((n) => n === name).length, 1, name);
  assert.ok(!names.includes("F12"), "what the page cannot do is not listed");
  assert.ok(await page.$$eval("#help_lists dd", (all) => all.every((d) => d.textContent.length > 5)));
  await page.keyboard.press("Escape");
  assert.equal(await isOpen(), false);
  await page.keyboard.press("F1");
  assert.ok(await isOpen());
  await page.click("#help form button");
  assert.equal(await isOpen(), false);
});

test("Single letters act: without it letters do nothing, and other keys still do", async () => {
  const letters = async () => {
    await page.click("#show_help");
    await page.click("#letters");
    await page.keyboard.press("Escape");
    await page.focus("#canvas");
  };
  const title = await text(page, "title");
  await letters();
  await page.keyboard.press("r");
  await page.keyboard.press("]");
  await page.keyboard.press("Space");
  await spindleIs(page, true); // all keys before it were taken or not
  assert.equal(await text(page, "title"), title);
  await page.keyboard.press("Space");
  await spindleIs(page, false);
  await letters();
  await page.keyboard.press("r");
  await titled("line,");
  await page.select("#renderer", "coupled");
  await titled("coupled,");
});

test("Bone as NRRD and as STL: what is saved is the bone as it is now", async () => {
  await page.click("#restore");
  await page.click("#home");
  await until(page, () => document.getElementById("brief_removed").textContent === "0.0");
  // The tooth's isovalue is midway between air and dentine.
  const solid = (file) => {
    let count = 0;
    for (let i = 0; i < file.body.length / 2; ++i) count += file.density(i) > 85.5 ? 1 : 0;
    return file.place.axes.reduce((v, axis) => v * Math.hypot(...axis), count);
  };
  await page.click("#save_nrrd");
  const whole = readSaved(await saves.next(".nrrd"));
  assert.equal(whole.fields.type, "int16");
  assert.equal(whole.fields.space, "left-posterior-superior");
  assert.equal(whole.body.length, 2 * whole.size[0] * whole.size[1] * whole.size[2], "two bytes a voxel");
  assert.ok(solid(whole) > 20, `the tooth has ${solid(whole)} mm3`);

  const gone = await drill(page, 2);
  await page.click("#save_nrrd");
  const drilled = readSaved(await saves.next(".nrrd"));
  assert.deepEqual(drilled.size, whole.size);
  const fewer = solid(whole) - solid(drilled);
  assert.ok(Math.abs(fewer - gone) < 0.1 * gone + 0.1, `${fewer} mm3 fewer voxels of bone, ${gone} removed`);

  await page.click("#save_stl");
  const stl = await saves.next(".stl");
  const triangles = stl.readUInt32LE(80);
  assert.equal(stl.length, 84 + 50 * triangles);
  assert.ok(triangles > 1000, `${triangles} triangles`);
  assert.notEqual(stl.subarray(0, 5).toString("latin1"), "solid", "which would be read as text");
  // All corners lie in the box of voxels, whose axes are the patient's for a made bone.
  const { origin, axes } = drilled.place;
  const lo = [Infinity, Infinity, Infinity], hi = [-Infinity, -Infinity, -Infinity];
  for (let t = 0; t < triangles; ++t)
    for (let c = 0; c < 9; ++c) {
      const v = stl.readFloatLE(84 + 50 * t + 12 + 4 * c);
      lo[c % 3] = Math.min(lo[c % 3], v);
      hi[c % 3] = Math.max(hi[c % 3], v);
    }
  for (let a = 0; a < 3; ++a) {
    const step = axes[a][a], first = origin[a] - step, last = origin[a] + step * drilled.size[a];
    assert.ok(lo[a] >= first && hi[a] <= last, `axis ${a}: ${lo[a]} to ${hi[a]} in ${first} to ${last}`);
    assert.ok(hi[a] - lo[a] > 0.5 * (last - first), "and fill it");
  }
});

test("Session and Replay: the same hole again", async () => {
  await anew();
  await page.focus("#canvas");
  await page.keyboard.press("Space");
  await page.keyboard.down("PageUp");
  await takes(page, 0.1);
  await page.keyboard.up("PageUp");
  // By steps after which the drill comes to rest, so that the hole is one of places and not of the time of ticks.
  let gone = await removed(page);
  for (let i = 0; i < 12 && gone <= 2; ++i) {
    await page.keyboard.press("PageUp");
    gone = await removed(page);
  }
  await page.keyboard.press("Escape");
  await spindleIs(page, false);
  assert.ok(gone > 2);
  await page.click("#save_session");
  const bytes = await saves.next(".session");
  const lines = bytes.toString().trim().split("\n");
  assert.match(lines.at(-1), /^[\d.e+-]+ quit$/);
  assert.ok(lines.some((l) => / spindle on$/.test(l)) && lines.some((l) => / hand /.test(l)) && lines.some((l) => / view /.test(l)));

  const file = join(saves.place, "again.txt"); // any name will do for the button
  await writeFile(file, bytes);
  const [chooser] = await Promise.all([page.waitForFileChooser(), page.click("#replay")]);
  await chooser.accept([file]);
  await until(page, () => document.getElementById("status").textContent === "Replays a session");
  await until(page, () => document.getElementById("brief_removed").textContent === "0.0");
  await until(page, () => document.getElementById("status").textContent !== "Replays a session", 120e3);
  const again = await removed(page);
  assert.ok(Math.abs(again - gone) <= 0.02 * gone + 0.05, `${again} mm3 again, ${gone} before`); // figures are rounded to 0.1
  // The hand has the drill back.
  const held = await settled(page);
  await page.focus("#canvas");
  await page.keyboard.press("PageDown");
  await tells(page, (t) => apart(t.place, held.place) > 0.2, "the hand moves the drill again");
});

test("Bone: the temporal bone comes with structures, and Protection keeps the drill from them", async () => {
  assert.equal(await page.$eval("#protect_row", (e) => e.checkVisibility()), false, "a tooth has no structures");
  const tooth = await stillPicture(page);
  await anew("temporal");
  assert.match(await text(page, "title"), /burr|-/);
  assert.ok(differs(tooth, await picture(page)) > 20, "another bone is drawn");
  assert.ok(await page.$eval("#protect_row", (e) => e.checkVisibility()));
  assert.deepEqual(await options("protection"), ["off", "warn", "push", "veto"]);
  assert.match(await text(page, "structure_name"), /\w/);
  const taken = () => number(page, "structure_taken");
  const kept = () => number(page, "structure_refused");
  await until(page, () => parseFloat(document.getElementById("structure_distance").textContent) > 0);

  // A session drills straight down until shortly over the facial nerve, and looks at it from above. From there on the hand
  // pushes, by keys that push along the view.
  const over = ["0 view 0 -2 0 90 88 60"];
  for (let t = 1; t <= 36; ++t) over.push(`${t / 10} hand 0 -2 ${3 - 0.3 * t} 1 0 0 0`, ...(t === 2 ? ["0.2 spindle on"] : []));
  const file = join(saves.place, "over.txt");
  await writeFile(file, [...over, "4 spindle off", "4.2 quit", ""].join("\n"));
  const results = {};
  for (const protection of ["off", "veto"]) {
    await give(page, "session_input", file);
    await until(page, () => document.getElementById("status").textContent === "Replays a session");
    await until(page, () => document.getElementById("status").textContent !== "Replays a session");
    await page.select("#protection", protection);
    await page.focus("#canvas");
    await page.keyboard.press("Space");
    await spindleIs(page, true);
    await page.keyboard.down("PageUp");
    await until(page, (which) => parseFloat(document.getElementById(`structure_${which}`).textContent) > 0.2,
      60e3, protection === "off" ? "taken" : "refused");
    const words = await text(page, "structure_words");
    await page.keyboard.up("PageUp");
    await page.keyboard.press("Escape");
    await spindleIs(page, false);
    results[protection] = { words, taken: await taken(), kept: await kept() };
  }
  assert.ok(results.off.taken > 0 && results.off.kept === 0, "unprotected, the drill takes of the structure");
  assert.match(results.off.words, /protection is off/);
  assert.ok(results.veto.kept > 0 && results.veto.taken < 0.2 * results.veto.kept, "and the veto keeps it");
  assert.match(results.veto.words, /too near this structure|in this structure/);
});

test("and the tooth comes back", async () => {
  await anew();
  assert.equal(await page.$eval("#protect_row", (e) => e.checkVisibility()), false);
  assert.equal(await page.$eval("#structure", (e) => e.checkVisibility()), false);
  assert.ok((await drill(page, 0.3)) > 0.3);
});

test("the page said nothing in the console and asked for nothing elsewhere", () => assert.deepEqual(seen, []));
