// SPDX-License-Identifier: MIT
import assert from "node:assert/strict";
import { test } from "node:test";
import { gzipSync } from "node:zlib";
import { readVolume } from "../read/any.js";
import { Refusal } from "../read/volume.js";

const kSize = [5, 6, 7];
/// A block whose densities tell where each voxel was.
const density = (x, y, z) => -1000 + 500 * x + 40 * y + z;
const each = (size, value) => {
  const out = [];
  for (let z = 0; z < size[2]; ++z) for (let y = 0; y < size[1]; ++y) for (let x = 0; x < size[0]; ++x) out.push(value(x, y, z));
  return out;
};
const voxels = each(kSize, density);
const read = (name, ...parts) => readVolume([new File(parts, name)], 1e6, () => {});
const refuses = (promise, pattern) =>
  assert.rejects(promise, (e) => e instanceof Refusal && pattern.test(e.message) && /^[^.!?]+(\.\S[^.!?]*)*\.$/.test(e.message));

function nifti({ type = 4, bits = 16, data = Int16Array.from(voxels), rows = [[-0.5, 0, 0], [0, -0.5, 0], [0, 0, 2]], size = kSize, slope = 0, inter = 0, magic = "n+1" } = {}) {
  const h = new DataView(new ArrayBuffer(352));
  h.setInt32(0, 348, true);
  [3, ...size, 1, 1, 1, 1].forEach((n, i) => h.setInt16(40 + 2 * i, n, true));
  h.setInt16(70, type, true);
  h.setInt16(72, bits, true);
  [1, 0.5, 0.5, 2].forEach((s, i) => h.setFloat32(76 + 4 * i, s, true));
  h.setFloat32(108, 352, true);
  h.setFloat32(112, slope, true);
  h.setFloat32(116, inter, true);
  h.setUint8(123, 2);
  h.setInt16(254, 1, true);
  rows.flatMap((r) => [...r, 0]).forEach((v, i) => h.setFloat32(280 + 4 * i, v, true));
  [...magic].forEach((c, i) => h.setUint8(344 + i, c.charCodeAt(0)));
  return Buffer.concat([Buffer.from(h.buffer), Buffer.from(data.buffer)]);
}
function nrrd(lines, data) {
  return Buffer.concat([Buffer.from(["NRRD0004", ...lines, "", ""].join("\n")), Buffer.from(data.buffer, data.byteOffset, data.byteLength)]);
}
const kLines = ["type: short", "dimension: 3", "sizes: 5 6 7", "endian: little", "spacings: 0.5 0.5 2"];

function element(group, number, vr, value) {
  const long = ["OW", "SQ"].includes(vr);
  const body = typeof value === "string" ? Buffer.from(value.padEnd(value.length + (value.length & 1), vr === "UI" ? "\0" : " ")) : Buffer.from(value);
  const head = Buffer.alloc(long ? 12 : 8);
  head.writeUInt16LE(group, 0);
  head.writeUInt16LE(number, 2);
  head.write(vr, 4);
  if (long) head.writeUInt32LE(body.length, 8);
  else head.writeUInt16LE(body.length, 6);
  return Buffer.concat([head, body]);
}
const us = (v) => [v & 255, v >> 8];
function slice(z, { syntax = "1.2.840.10008.1.2.1", cut = 0, place = 2 * z } = {}) {
  const pixels = Int16Array.from(voxels.slice(30 * z, 30 * z + 30), (v) => v + 1024);
  return Buffer.concat([
    Buffer.alloc(128), Buffer.from("DICM"), element(2, 0x10, "UI", syntax), element(0x20, 0xe, "UI", "1.2.3"),
    element(0x20, 0x32, "DS", `0\\0\\${place}`), element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"), element(0x28, 2, "US", us(1)),
    element(0x28, 0x10, "US", us(6)), element(0x28, 0x11, "US", us(5)), element(0x28, 0x30, "DS", "0.5\\0.5"),
    element(0x28, 0x100, "US", us(16)), element(0x28, 0x103, "US", us(1)), element(0x28, 0x1052, "DS", "-1024"),
    element(0x28, 0x1053, "DS", "1"), element(0x7fe0, 0x10, "OW", new Uint8Array(pixels.buffer, 0, 60 - cut)),
  ]);
}
const series = (options) => [3, 0, 6, 1, 5, 2, 4].map((z) => new File([slice(z, options)], `${z}.dcm`));

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
  await refuses(read("a.hdr", nifti({ magic: "ni1" })), /another file/);
  await refuses(read("a.nii", nifti({ data: new Int16Array(210) })), /same density/);
  await refuses(read("a.nrrd", nrrd([...kLines, "encoding: raw", "data file: a.raw"], Int16Array.from(voxels))), /another file/);
  await refuses(read("a.nrrd", nrrd([...kLines, "encoding: bzip2"], Int16Array.from(voxels))), /packed as/);
  await refuses(read("a.nrrd", "NRRD0004\ntype: short\n"), /no end/);
  await refuses(read("a.nrrd", nrrd(["type: short", "sizes: 1e9 1e9 1e9", "encoding: raw"], Int16Array.from(voxels))), /larger than/);
  await refuses(read("a.nrrd", nrrd([...kLines.map((l) => l.replace(/spacings.*/, "spacings: 1e9 1 1")), "encoding: raw"], Int16Array.from(voxels))), /cannot be/);
  await refuses(readVolume(series({ syntax: "1.2.840.10008.1.2.4.70" }), 1e6, () => {}), /compressed/);
  await refuses(readVolume(series({ cut: 20 }), 1e6, () => {}), /not complete/);
  await refuses(readVolume(series({ place: 3 }), 1e6, () => {}), /one place/);
  await refuses(readVolume([new File(["x"], "a"), new File(["y"], "b")], 1e6, () => {}), /no DICOM/);
});
test("bytes at random end in a refusal or a volume", async () => {
  const whole = [nifti(), nrrd([...kLines, "encoding: raw"], Int16Array.from(voxels)), slice(0)];
  let seed = 7;
  const random = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
  for (let i = 0; i < 600; ++i) {
    const bytes = Buffer.from(whole[i % 3]);
    for (let k = 0; k < 8; ++k) bytes[Math.floor(random() ** 3 * bytes.length)] = Math.floor(random() * 256);
    await read("a.dcm", bytes).catch((e) => assert.ok(e instanceof Refusal, `${e.stack}`));
  }
});
