// SPDX-License-Identifier: MIT
// Scans of one's own come in by button and by drop, are drilled, and are saved in their place. Files that are wrong are
// refused in one sentence, and the bone that is open stays.
import assert from "node:assert/strict";
import { mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { gzipSync } from "node:zlib";
import { downloads, frames, give, number, open, opened, removed, started, takeBone, text, until } from "./support/browser.mjs";
import { drill, isSentence, refused } from "./support/drill.mjs";
import {
  block, blockDensity, blockDicom, blockNifti, blockNrrd, bomb, dicomSlice, kBlock, nifti, nrrd, placeOf, readSaved, voxels,
} from "./support/volumes.mjs";

const { server, browser } = await started();
const { page, seen } = await open(browser, server.url);
const saves = await downloads(page);
const folder = await mkdtemp(join(tmpdir(), "trephine-files-"));
after(async () => {
  await saves.end();
  await rm(folder, { recursive: true, force: true });
});

const put = async (name, bytes) => {
  const path = join(folder, name);
  await writeFile(path, bytes);
  return path;
};
/// Drops files on the picture, as from a folder's window.
async function drop(...files) {
  const cdp = await page.createCDPSession();
  const data = { items: [], files, dragOperationsMask: 1 };
  for (const type of ["dragEnter", "dragOver"]) await cdp.send("Input.dispatchDragEvent", { type, x: 150, y: 200, data });
  await until(page, () => !document.getElementById("drop").hidden);
  await cdp.send("Input.dispatchDragEvent", { type: "drop", x: 150, y: 200, data });
  await until(page, () => document.getElementById("drop").hidden);
  await cdp.detach();
}
async function choose(button, ...files) {
  const [chooser] = await Promise.all([page.waitForFileChooser(), page.click(`#${button}`)]);
  await chooser.accept(files);
}
/// Answers the dialog that shows what was read, and waits for the bone.
async function answer({ isovalue = null, button = true } = {}) {
  await until(page, () => document.getElementById("volume").open || !document.getElementById("refusal").hidden);
  assert.equal(await page.$eval("#refusal_text", (e) => e.textContent), "");
  if (isovalue !== null) await page.$eval("#isovalue", (e, v) => (e.value = v), isovalue);
  if (button) await page.click("#volume_open");
  else await page.keyboard.press("Enter");
  await until(page, () => !document.getElementById("volume").open);
  await frames(page, 2); // the dialog tells of its end in a turn of its own
  await until(page, () => document.getElementById("opening").hidden && !document.getElementById("bone").disabled, 120e3);
  await opened(page);
  await until(page, () => document.getElementById("brief_removed").textContent === "0.0" || !document.getElementById("refusal").hidden);
  assert.equal(await page.$eval("#refusal_text", (e) => e.textContent), "");
}
async function saved() {
  await page.click("#save_nrrd");
  return readSaved(await saves.next(".nrrd"));
}

// Frames: straight; an array whose axes are the patient's in another order and mirrored; and one that also lies oblique.
const kStraight = { origin: [-12, 34.5, 300], axes: [[0.4, 0, 0], [0, 0.4, 0], [0, 0, 0.4]] };
const kMirrored = { origin: [20, -7.25, 81], axes: [[0, 0, -0.4], [-0.3, 0, 0], [0, 0.35, 0]] };
const turned = (axes, angle) => {
  const [c, s] = [Math.cos(angle), Math.sin(angle)], spin = ([x, y, z]) => [c * x - s * y, s * x + c * y, z], tip = ([x, y, z]) => [x, c * y - s * z, s * y + c * z];
  return axes.map((v) => tip(spin(v)));
};
const kOblique = { origin: [-40.5, 66, -120], axes: turned(kMirrored.axes, 0.35) };

/// Each saved voxel lies where the file put the voxel of its density.
function liesAs(file, place, { to = 1e-3 } = {}) {
  assert.equal(file.fields.space, "left-posterior-superior");
  assert.equal(file.body.length, 2 * file.size[0] * file.size[1] * file.size[2]);
  const [a, b, c] = place.axes;
  const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const dot = (u, v) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  const volume = dot(a, cross(b, c));
  let at = 0, bone = 0;
  for (let k = 0; k < file.size[2]; ++k)
    for (let j = 0; j < file.size[1]; ++j)
      for (let i = 0; i < file.size[0]; ++i, ++at) {
        const d = placeOf(file.place, i, j, k).map((p, n) => p - place.origin[n]);
        const index = [dot(d, cross(b, c)), dot(d, cross(c, a)), dot(d, cross(a, b))].map((n) => n / volume), whole = index.map(Math.round);
        assert.ok(index.every((n, axis) => Math.abs(n - whole[axis]) < to), `a voxel lies between the file's: ${index}`);
        if (whole.some((n, axis) => n < 0 || n >= kBlock[axis])) continue; // a border that was added
        assert.equal(file.density(at), blockDensity(...whole), `density of voxel ${whole}`);
        if (file.density(at) > 300) ++bone;
      }
  assert.equal(bone, block.filter((v) => v > 300).length, "all bone is there");
}

test("NIfTI by its button: the dialog says what was read, it is drilled, and saved in its place", async () => {
  const path = await put("block.nii", blockNifti(kStraight));
  await choose("open_volume", path);
  await until(page, () => document.getElementById("volume").open);
  assert.match(await text(page, "volume_text"), /^block\.nii: 44 × 40 × 36 voxels of 0\.4 × 0\.4 × 0\.4 mm, densities from -1000 to 1282\.$/);
  assert.equal(await page.$eval("#isovalue", (e) => e.value), "300");
  assert.match(await text(page, "isovalue_help"), /Hounsfield/);
  await answer();
  assert.equal(await page.$eval("#bone", (e) => e.value), "block.nii");
  liesAs(await saved(), kStraight);
  assert.ok((await drill(page, 1)) > 1);
  const file = await saved();
  assert.throws(() => liesAs(file, kStraight), /density of voxel|all bone/, "what was drilled is gone from the saved bone");
});

test("an isovalue that is chosen counts, and Cancel leaves the present bone", async () => {
  const gone = await removed(page);
  const path = await put("other.nii", blockNifti());
  await give(page, "volume_input", path);
  await until(page, () => document.getElementById("volume").open);
  await page.keyboard.press("Escape");
  assert.equal(await page.$eval("#bone", (e) => e.value), "block.nii");
  assert.equal(await removed(page), gone);
  // The field takes no value at which all or nothing is bone.
  await give(page, "volume_input", path);
  await until(page, () => document.getElementById("volume").open);
  await page.$eval("#isovalue", (e) => (e.value = "9999"));
  await page.click("#volume_open");
  assert.ok(await page.$eval("#volume", (e) => e.open));
  await page.$eval("#isovalue", (e) => (e.value = "1100"));
  await page.keyboard.press("Enter");
  await until(page, () => document.getElementById("bone").value === "other.nii" && !document.getElementById("bone").disabled, 120e3);
});

test("packed NIfTI by a drop, mirrored and in another order: the saved bone lies as the file does", async () => {
  await drop(await put("mirrored.nii.gz", gzipSync(blockNifti(kMirrored))));
  await answer({ button: false });
  liesAs(await saved(), kMirrored);
  assert.ok((await drill(page, 0.5)) > 0.5);
});

test("NRRD, packed, oblique and mirrored: the saved bone lies as the file does", async () => {
  await drop(await put("oblique.nrrd", blockNrrd(kOblique, true)));
  await answer();
  const file = await saved();
  liesAs(file, kOblique);
  // The saved file opens again, in the same place.
  const { body, place, size } = file;
  const lines = Object.entries(file.fields).filter(([name]) => name).map(([name, value]) => `${name}: ${value}`);
  await give(page, "volume_input", await put("again.nrrd", nrrd(lines, body)));
  await answer();
  const again = await saved();
  assert.deepEqual(again.size, size);
  again.place.origin.forEach((o, a) => assert.ok(Math.abs(o - place.origin[a]) < 1e-3, `origin ${again.place.origin}, not ${place.origin}`));
  liesAs(again, kOblique);
  assert.ok((await drill(page, 0.5)) > 0.5);
});

test("a DICOM folder, by button and by drop", async () => {
  const at = join(folder, "series");
  await mkdir(at);
  const place = { origin: [5, -60, 12], axes: [kOblique.axes[0], kOblique.axes[1], null] };
  const unit = (v) => v.map((c) => c / Math.hypot(...v)), [x, y] = place.axes.map((v) => v && unit(v));
  place.axes[2] = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]].map((c) => 0.45 * c);
  for (const { name, bytes } of blockDicom(place)) await writeFile(join(at, name), bytes);
  await writeFile(join(at, "notes.txt"), "not a picture");
  await choose("open_folder", at);
  await until(page, () => document.getElementById("volume").open);
  assert.match(await text(page, "volume_text"), /^series: .* voxels of 0\.\d+ × 0\.\d+ × 0\.\d+ mm/);
  await answer();
  liesAs(await saved(), place);
  await takeBone(page, "tooth");
  assert.equal(await page.$$eval("#bone option", (all) => all.length), 2, "a volume of one's own is chosen by opening it again");
  await drop(at);
  await answer();
  liesAs(await saved(), place);
  assert.ok((await drill(page, 0.5)) > 0.5);
});

// What is wrong, and what of the refusal's words tells it.
const random = (n, seed = 5) => Buffer.from(Array.from({ length: n }, () => (seed = (seed * 1103515245 + 12345) % 2147483648) >> 16));
const good = () => blockNifti(), half = (bytes) => bytes.subarray(0, bytes.length >> 1);
const nan = [[NaN, 0, 0], [0, NaN, 0], [0, 0, NaN]];
const kHostile = [
  ["empty.nii", () => Buffer.alloc(0), /empty/],
  ["random.nii", () => random(5000), /no volume/],
  ["random.nii.gz", () => Buffer.concat([Buffer.from([0x1f, 0x8b, 8]), random(5000)]), /no volume|unpacked/],
  ["text.nii", () => "Dear reader, this is no scan.\n".repeat(50), /no volume/],
  ["cut.nii", () => good().subarray(0, 20000), /not complete/],
  ["cut.nii.gz", () => half(gzipSync(good())), /unpacked|not complete/],
  ["cut.nrrd", () => blockNrrd().subarray(0, 20000), /not complete/],
  ["cut_packed.nrrd", () => half(blockNrrd(undefined, true)), /unpacked|not complete/],
  ["endless.nrrd", () => "NRRD0004\ntype: short\n".padEnd(3000, "# and no end\n"), /no end/],
  ["huge.nii", () => nifti({ size: [30000, 30000, 30000] }), /larger than/],
  ["huge.nrrd", () => nrrd(["type: short", "dimension: 3", "sizes: 30000 30000 30000", "encoding: raw"], Int16Array.from(voxels)), /larger than/],
  ["huge_packed.nrrd", () => nrrd(["type: short", "dimension: 3", "sizes: 30000 30000 30000", "encoding: gzip"], gzipSync(Buffer.alloc(1e4))), /larger than/],
  ["nan.nii", () => nifti({ pixels: [NaN, NaN, NaN], rows: nan }), /how large/],
  ["infinite.nii", () => nifti({ pixels: [Infinity, 1, 1] }), /how large/],
  ["nan_densities.nii", () => nifti({ type: 16, bits: 32, data: Float32Array.from(voxels, () => NaN) }), /no densities/],
  ["bomb.nii.gz", () => bomb(nifti({ data: new Int16Array(8) }), 200e6), /same density/],
  ["bomb.gz", () => bomb(Buffer.alloc(0), 200e6), /no volume/],
  ["cut.dcm", () => dicomSlice(0, { cut: 20 }), /not complete/],
  ["picture.dcm", () => Buffer.concat([Buffer.from([0x89]), Buffer.from("PNG\r\n"), random(3000)]), /no DICOM/],
  ["picture.nii", () => Buffer.concat([Buffer.from([0x89]), Buffer.from("PNG\r\n"), random(3000)]), /no volume/],
  ["table.csv", () => "a,b\n1,2\n", /no volume/],
  ["constant.nii", () => nifti({ data: new Int16Array(210).fill(700) }), /same density/],
  ["flat.nii", () => nifti({ size: [210, 1, 1] }), /fewer than four/],
  ["beside.nhdr", () => "NRRD0004\n\n", /another file/],
  [`${"a_very_long_name_".repeat(14)}.nii`, () => Buffer.alloc(0), /empty/],
];
const kHostileSessions = [
  ["nonsense.session", "this is no session\n"], ["binary.session", random(4000)], ["one_line.session", Buffer.alloc(1e6, "x")],
  ["one_line_of_a_start.session", `0 hand ${"1 ".repeat(5e5)}`],
  ["nan_hand.session", "0 hand nan nan nan 1 0 0 0\n1 quit\n"], ["inf_hand.session", "0 hand inf 0 0 1 0 0 0\n1 quit\n"],
  ["nan_turned.session", "0 hand 0 0 0 nan 0 0 0\n1 quit\n"], ["nan_time.session", "nan spindle on\n1 quit\n"], ["inf_time.session", "inf quit\n"],
  ["before.session", "2 spindle on\n1 quit\n"],
  ["nan_push.session", "0 push nan\n1 quit\n"], ["inf_push.session", "0 push inf\n1 quit\n"], ["large_push.session", "0 push 1e999\n1 quit\n"],
  ["nan_move.session", "0 move nan nan\n1 quit\n"], ["inf_turn.session", "0 turn inf -inf\n1 quit\n"], ["nan_orbit.session", "0 orbit nan\n1 quit\n"],
  ["nan_view.session", "0 view 0 0 0 nan 0 100\n1 quit\n"], ["inf_view.session", "0 view 0 0 0 inf 0 100\n1 quit\n"], ["far_view.session", "0 view 0 0 inf 0 0 100\n1 quit\n"],
];

/// The refusal is one sentence, and the bone that is open is as it was and can be drilled on.
async function refuses(name, give_, words) {
  const title = await text(page, "title"), bone = await page.$eval("#bone", (e) => e.value), gone = await number(page, "brief_removed");
  await give_();
  await until(page, () => !document.getElementById("refusal").hidden || document.getElementById("volume").open || document.getElementById("status").textContent === "Replays a session");
  if (await page.$eval("#volume", (e) => e.open)) {
    await page.keyboard.press("Escape");
    assert.fail(`${name} is not refused: ${await text(page, "volume_text")}`);
  }
  const sentence = await refused(page, 5e3);
  assert.ok(isSentence(sentence), `${name}: ${sentence.slice(0, 300)}`);
  assert.match(sentence, words, name);
  assert.equal(await page.$eval("#volume", (e) => e.open), false);
  assert.ok(await page.$eval("#opening", (e) => e.hidden), "no work goes on");
  assert.equal(await text(page, "title"), title, name);
  assert.equal(await page.$eval("#bone", (e) => e.value), bone, name);
  assert.equal(await number(page, "brief_removed"), gone, name);
  await page.click("#refusal_close");
  assert.ok(await page.$eval("#refusal", (e) => e.hidden));
  assert.deepEqual(seen, [], name);
}
async function fresh() {
  await page.click("#restore");
  await page.click("#home");
  await until(page, () => document.getElementById("brief_removed").textContent === "0.0");
}

test("volumes that are wrong are refused in one sentence, and the bone stays", { timeout: 400e3 }, async (t) => {
  await give(page, "volume_input", await put("block.nii", blockNifti()));
  await answer();
  await drill(page, 0.3);
  for (const [name, bytes, words] of kHostile)
    await t.test(name.slice(0, 40), async () => refuses(name, async () => give(page, "volume_input", await put(name, bytes())), words));
  await t.test("several volumes at once", async () =>
    refuses("two", async () => give(page, "volume_input", await put("one.nii", good()), await put("two.nii", good())), /one volume/));
  await t.test("a drop of a wrong file", async () => refuses("drop", async () => drop(await put("wrong.nii", random(400))), /no volume/));
  await t.test("slices that are cut", async () => {
    const files = [];
    for (let z = 0; z < 7; ++z) files.push(await put(`cut_${z}.dcm`, dicomSlice(z, { cut: 20 })));
    await refuses("slices", () => give(page, "volume_input", ...files), /not complete/);
  });
  const before_ = await removed(page);
  assert.ok((await drill(page, 0.3)) > before_ + 0.3 - 0.05, "and is drilled on");
});

test("sessions that are wrong are refused in one sentence, and the bone stays", { timeout: 300e3 }, async (t) => {
  await fresh();
  await drill(page, 0.3);
  for (const [name, bytes] of kHostileSessions)
    await t.test(name, async () => refuses(name, async () => give(page, "session_input", await put(name, bytes)), /./));
  await t.test("by a drop", async () => refuses("drop", async () => drop(await put("dropped.session", "nonsense")), /line 1/));
  const before_ = await removed(page);
  assert.ok((await drill(page, 0.3)) > before_ + 0.3 - 0.05, "and is drilled on");
});

test("the page said nothing in the console and asked for nothing elsewhere", () => assert.deepEqual(seen, []));
