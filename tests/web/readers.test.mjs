// SPDX-License-Identifier: MIT
// The page's readers of volumes, without a browser: densities and places stay, and what is wrong is refused.
import assert from "node:assert/strict";
import { File } from "node:buffer";
import { test } from "node:test";
import { gzipSync } from "node:zlib";
import { readVolume } from "../../examples/web/page/read/any.js";
import { Refusal, toVolume } from "../../examples/web/page/read/volume.js";
import { density, dicomSlice, each, kSize, nifti, nrrd, voxels } from "./support/volumes.mjs";

globalThis.File ??= File; // no global before Node 20

const read = (name, ...parts) => readVolume([new File(parts, name)], 1e6, () => {});
const refuses = (promise, pattern) =>
  assert.rejects(promise, (e) => e instanceof Refusal && pattern.test(e.message) && /^[^.!?]+(\.\S[^.!?]*)*\.$/.test(e.message));

const kLines = ["type: short", "dimension: 3", "sizes: 5 6 7", "endian: little", "spacings: 0.5 0.5 2"];

const series = (options) => [3, 0, 6, 1, 5, 2, 4].map((z) => new File([dicomSlice(z, options)], `${z}.dcm`));

function isTheBlock(v) {
  assert.deepEqual(v.size, kSize);
  assert.deepEqual(v.spacing.map((s) => +s.toPrecision(6)), [5e-4, 5e-4, 2e-3]);
  assert.deepEqual([...v.voxels], voxels);
}

test("NIfTI, plain and packed, keeps densities and places", async () => {
  isTheBlock(await read("a.nii", nifti()));
  isTheBlock(await read("renamed.txt", gzipSync(nifti())));
});
test("a mirrored array is put right", async () => {
  const mirrored = each(kSize, (x, y, z) => density(4 - x, y, z));
  isTheBlock(await read("a.nii", nifti({ data: Int16Array.from(mirrored), rows: [[0.5, 0, 0], [0, -0.5, 0], [0, 0, 2]] })));
  const turned = each([7, 5, 6], (z, x, y) => density(x, y, z));
  const lines = ["type: short", "dimension: 3", "space: LPS", "sizes: 7 5 6", "endian: little", "encoding: raw", "space directions: (0,0,2) (0.5,0,0) (0,0.5,0)"];
  isTheBlock(await read("a.nrrd", nrrd(lines, Int16Array.from(turned))));
});
test("slope, intercept and fractions", async () => {
  const stored = Uint16Array.from(voxels, (v) => v + 1024);
  isTheBlock(await read("a.nii", nifti({ type: 512, data: stored, slope: 1, inter: -1024 })));
  const v = await read("a.nii", nifti({ type: 16, bits: 32, data: Float32Array.from(voxels, (d) => d / 2000) }));
  assert.equal(v.notes.length, 1);
  assert.ok(v.most - v.least >= 1000 && v.most - v.least <= 10000);
  assert.ok(v.isovalue > v.least && v.isovalue < v.most);
});
test("NRRD: raw, gzip, text, either order of bytes", async () => {
  const data = Int16Array.from(voxels);
  isTheBlock(await read("a.nrrd", nrrd([...kLines, "encoding: raw"], data)));
  isTheBlock(await read("a.nrrd", nrrd([...kLines, "encoding: gzip"], gzipSync(Buffer.from(data.buffer)))));
  isTheBlock(await read("a.nrrd", nrrd([...kLines, "encoding: text"], Buffer.from(voxels.join(" ")))));
  const swapped = Buffer.from(data.buffer.slice(0)).swap16();
  isTheBlock(await read("a.nrrd", nrrd([...kLines.map((l) => l.replace("little", "big")), "encoding: raw"], swapped)));
});
test("DICOM: slices in any order, and files beside them", async () => {
  isTheBlock(await readVolume([...series(), new File(["notes"], "readme.txt")], 1e6, () => {}));
  const uneven = await readVolume([...series().slice(0, 5)], 1e6, () => {});
  assert.match(uneven.notes.join(), /unevenly/);
});
test("Hounsfield units have the isovalue 300, others a middle", async () => {
  assert.equal((await read("a.nii", nifti())).isovalue, 300);
  const two = Uint8Array.from(each(kSize, (x) => (x < 2 ? 10 : 200)));
  const v = await read("a.nii", nifti({ type: 2, bits: 8, data: two }));
  assert.ok(v.isovalue > 60 && v.isovalue < 150, `${v.isovalue}`);
});
test("a large volume is averaged with a note", async () => {
  const v = await readVolume([new File([nifti()], "a.nii")], 120, () => {});
  assert.ok(v.voxels.length <= 120);
  assert.match(v.notes.join(), /averaged/);
  assert.ok(Math.abs(v.voxels[0] - voxels[0]) < 600);
});
test("wrong files are refused with one sentence", async () => {
  await refuses(read("a.nii"), /empty/);
  await refuses(read("a.nii", "hello"), /no volume/);
  await refuses(read("a.nii.gz", Uint8Array.of(0x1f, 0x8b, 1, 2, 3)), /no volume/);
  await refuses(read("a.nii", nifti().subarray(0, 500)), /not complete/);
  await refuses(read("a.nii.gz", gzipSync(nifti()).subarray(0, 300)), /unpacked|no volume/);
  await refuses(read("a.nii.gz", gzipSync(nifti().subarray(0, 500))), /not complete/);
  await refuses(read("a.nii", nifti({ size: [32000, 32000, 32000] })), /larger than/);
  await refuses(read("a.nii", nifti({ size: [-5, 6, 7] })), /three dimensions/);
  await refuses(read("a.nii", nifti({ type: 128 })), /no density/);
  await refuses(read("a.nii", nifti({ type: 16, bits: 32, data: new Float32Array(210).fill(NaN) })), /no densities/);
  await refuses(read("a.nii", nifti({ pixels: [NaN, 1, 1] })), /how large/);
  await refuses(read("a.hdr", nifti({ magic: "ni1" })), /another file/);
  await refuses(read("a.nii", nifti({ data: new Int16Array(210) })), /same density/);
  await refuses(read("a.nrrd", nrrd([...kLines, "encoding: raw", "data file: a.raw"], Int16Array.from(voxels))), /another file/);
  await refuses(read("a.nrrd", nrrd([...kLines, "encoding: bzip2"], Int16Array.from(voxels))), /packed as/);
  await refuses(read("a.nrrd", "NRRD0004\ntype: short\n"), /no end/);
  await refuses(read("a.nrrd", nrrd(["type: short", "sizes: 1e9 1e9 1e9", "encoding: raw"], Int16Array.from(voxels))), /larger than/);
  await refuses(read("a.nrrd", nrrd([...kLines.map((l) => l.replace(/spacings.*/, "spacings: 1e9 1 1")), "encoding: raw"], Int16Array.from(voxels))), /cannot be/);
  await refuses(readVolume(series({ syntax: "1.2.840.10008.1.2.4.70" }), 1e6, () => {}), /compressed/);
  await refuses(readVolume(series({ cut: 20 }), 1e6, () => {}), /not complete/);
  await refuses(readVolume(series({ position: [0, 0, 3] }), 1e6, () => {}), /one place/);
  await refuses(readVolume([new File(["x"], "a"), new File(["y"], "b")], 1e6, () => {}), /no DICOM/);
});
test("bytes at random end in a refusal or a volume", async () => {
  const whole = [nifti(), nrrd([...kLines, "encoding: raw"], Int16Array.from(voxels)), dicomSlice(0)];
  let seed = 7;
  const random = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
  for (let i = 0; i < 600; ++i) {
    const bytes = Buffer.from(whole[i % 3]);
    for (let k = 0; k < 8; ++k) bytes[Math.floor(random() ** 3 * bytes.length)] = Math.floor(random() * 256);
    await read("a.dcm", bytes).catch((e) => assert.ok(e instanceof Refusal, `${e.stack}`));
  }
});

// The frame, by brute force: each voxel of the result lies where the file puts the voxel that it came from.
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const determinant = ([a, b, c]) => dot(a, cross(b, c));
function liesRight({ origin, axes }, most) {
  // Voxels are numbered by their density; averages of them are numbered by their middle, since the density is linear.
  const size = [6, 8, 4], number = (i, j, k) => 100 * i + 10 * j + k;
  const data = Int16Array.from(each(size, number));
  const v = toVolume({ name: "a", data, size, axes, origin, most });
  const factor = v.size.reduce((n, s) => n * s, 1) === 192 ? 1 : 192 / (v.size[0] * v.size[1] * v.size[2]);
  assert.equal(factor > 1, most < 192, "thinned or not");
  const [first, x, y] = [v.frame.slice(0, 3), v.frame.slice(3, 6), v.frame.slice(6)];
  const z = cross(x, y);
  // Each direction is nearest to its own of the patient's axes, so nothing is mirrored.
  [x, y, z].forEach((d, a) => assert.ok(Math.abs(Math.hypot(...d) - 1) < 1e-9 && d[a] > 0.3, `direction ${a}: ${d}`));
  let at = 0;
  const inverse = determinant(axes);
  for (let k = 0; k < v.size[2]; ++k)
    for (let j = 0; j < v.size[1]; ++j)
      for (let i = 0; i < v.size[0]; ++i, ++at) {
        const place = first.map((f, c) => 1e3 * (f + i * v.spacing[0] * x[c] + j * v.spacing[1] * y[c] + k * v.spacing[2] * z[c]));
        // Back into the file's array, by Cramer's rule.
        const d = place.map((p, c) => p - origin[c]);
        const file = [determinant([d, axes[1], axes[2]]), determinant([axes[0], d, axes[2]]), determinant([axes[0], axes[1], d])].map((n) => n / inverse);
        assert.ok(file.every((n, a) => n > -1e-6 && n < size[a] - 1 + 1e-6), `inside: ${file}`);
        // A mean of whole numbers is rounded.
        assert.ok(Math.abs(number(...file) - v.voxels[at]) <= (factor > 1 ? 0.51 : 1e-5), `${number(...file)} at ${[i, j, k]}, not ${v.voxels[at]}`);
      }
}
const rotated = (axes, [x, y, z], angle) => {
  const n = Math.hypot(x, y, z), u = [x / n, y / n, z / n], c = Math.cos(angle), s = Math.sin(angle);
  return axes.map((v) => {
    const w = cross(u, v), along = dot(u, v);
    return v.map((e, i) => c * e + s * w[i] + (1 - c) * along * u[i]);
  });
};
function* permutations() {
  for (const [a, b, c] of [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]])
    for (let signs = 0; signs < 8; ++signs) {
      const axes = [[0, 0, 0], [0, 0, 0], [0, 0, 0]], steps = [0.4, 0.7, 1.1];
      [a, b, c].forEach((to, from) => (axes[from][to] = (signs >> from) & 1 ? -steps[from] : steps[from]));
      yield axes;
    }
}
test("voxels lie where the file puts them, for all 48 ways to lay an array along the patient's axes", () => {
  for (const axes of permutations())
    for (const most of [1e6, 60, 20]) {
      liesRight({ origin: [12.5, -70, 31.25], axes }, most);
      liesRight({ origin: [-3, 8, 900], axes: rotated(axes, [1, 2, -0.5], 0.45) }, most);
    }
});
test("and for arrays that lie at random", () => {
  let seed = 11;
  const random = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 1073741824 - 1;
  const [axes] = permutations();
  for (let i = 0; i < 2000; ++i) liesRight({ origin: [random(), random(), random()].map((v) => 200 * v), axes: rotated(axes, [random(), random(), random()], Math.PI * random()) }, 1e6);
});
test("the files' own words of place come to the same frame", async () => {
  const axes = rotated([[0, -0.5, 0], [0, 0, 0.5], [-2, 0, 0]], [1, 0.4, 0.2], 0.3), origin = [10, -20, 30.5];
  const lps = [1, 1, 1], ras = [-1, -1, 1], las = [1, -1, 1];
  const data = Int16Array.from(voxels);
  const wanted = toVolume({ name: "a", data, size: kSize, axes, origin }).frame;
  const same = (got) => got.forEach((v, i) => assert.ok(Math.abs(v - wanted[i]) < 1e-6, `${got} for ${wanted}`));
  const signed = (v, signs) => `(${v.map((c, i) => c * signs[i]).join(",")})`;
  for (const [space, signs] of [["left-posterior-superior", lps], ["RAS", ras], ["left-anterior-superior", las]]) {
    const lines = [
      "type: short", "dimension: 3", `space: ${space}`, "sizes: 5 6 7", "endian: little", "encoding: raw",
      `space directions: ${axes.map((v) => signed(v, signs)).join(" ")}`, `space origin: ${signed(origin, signs)}`,
    ];
    same((await read("a.nrrd", nrrd(lines, data))).frame);
  }
  same((await read("a.nii", nifti({ rows: ras.map((s, c) => [...axes.map((v) => s * v[c]), s * origin[c]]) }))).frame);

  // Slices of DICOM are stacked along their normal, so that the third axis must be at a right angle and may be turned round.
  const unit = (v) => v.map((c) => c / Math.hypot(...v));
  const normal = cross(unit(axes[0]), unit(axes[1]));
  const place = (z) => origin.map((o, c) => o + 2 * z * normal[c]);
  const slices = [4, 1, 6, 0, 2, 5, 3].map(
    (z) => new File([dicomSlice(z, { position: place(z), direction: [...unit(axes[0]), ...unit(axes[1])] })], `${z}.dcm`));
  const stacked = toVolume({ name: "a", data, size: kSize, axes: [axes[0], axes[1], normal.map((c) => 2 * c)], origin });
  const series_ = await readVolume(slices, 1e6, () => {});
  series_.frame.forEach((v, i) => assert.ok(Math.abs(v - stacked.frame[i]) < 1e-6, `${series_.frame} for ${stacked.frame}`));
  assert.deepEqual(series_.voxels, stacked.voxels);
});
