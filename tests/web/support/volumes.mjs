// SPDX-License-Identifier: MIT
// Small volumes as bytes of NIfTI, NRRD and DICOM.
import { gzipSync } from "node:zlib";

/// The values of all voxels, x fastest.
export const each = (size, value) => {
  const out = [];
  for (let z = 0; z < size[2]; ++z) for (let y = 0; y < size[1]; ++y) for (let x = 0; x < size[0]; ++x) out.push(value(x, y, z));
  return out;
};

export const kSize = [5, 6, 7];
/// A block whose densities tell where each voxel was.
export const density = (x, y, z) => -1000 + 500 * x + 40 * y + z;
export const voxels = each(kSize, density);

/// A file of NIfTI 1. Rows are of the matrix to the patient's right, front and top [mm], with or without the origin.
export function nifti({
  type = 4, bits = 16, data = Int16Array.from(voxels), rows = [[-0.5, 0, 0], [0, -0.5, 0], [0, 0, 2]], size = kSize, slope = 0, inter = 0, magic = "n+1",
  pixels = [0.5, 0.5, 2],
} = {}) {
  const h = new DataView(new ArrayBuffer(352));
  h.setInt32(0, 348, true);
  [3, ...size, 1, 1, 1, 1].forEach((n, i) => h.setInt16(40 + 2 * i, n, true));
  h.setInt16(70, type, true);
  h.setInt16(72, bits, true);
  [1, ...pixels].forEach((s, i) => h.setFloat32(76 + 4 * i, s, true));
  h.setFloat32(108, 352, true);
  h.setFloat32(112, slope, true);
  h.setFloat32(116, inter, true);
  h.setUint8(123, 2);
  h.setInt16(254, 1, true);
  rows.flatMap((r) => [...r, 0].slice(0, 4)).forEach((v, i) => h.setFloat32(280 + 4 * i, v, true));
  [...magic].forEach((c, i) => h.setUint8(344 + i, c.charCodeAt(0)));
  return Buffer.concat([Buffer.from(h.buffer), Buffer.from(data.buffer)]);
}

export function nrrd(lines, data) {
  return Buffer.concat([Buffer.from(["NRRD0004", ...lines, "", ""].join("\n")), Buffer.from(data.buffer, data.byteOffset, data.byteLength)]);
}

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

/// One slice of DICOM. Densities are stored with an offset of 1024; `cut` bytes of the pixels are missing.
export function dicomSlice(z, {
  syntax = "1.2.840.10008.1.2.1", cut = 0, size = kSize, densities = voxels, position = [0, 0, 2 * z], direction = [1, 0, 0, 0, 1, 0], spacing = [0.5, 0.5],
} = {}) {
  const count = size[0] * size[1];
  const pixels = Int16Array.from(densities.slice(count * z, count * (z + 1)), (v) => v + 1024);
  return Buffer.concat([
    Buffer.alloc(128), Buffer.from("DICM"), element(2, 0x10, "UI", syntax), element(0x20, 0xe, "UI", "1.2.3"),
    element(0x20, 0x32, "DS", position.join("\\")), element(0x20, 0x37, "DS", direction.join("\\")), element(0x28, 2, "US", us(1)),
    element(0x28, 0x10, "US", us(size[1])), element(0x28, 0x11, "US", us(size[0])), element(0x28, 0x30, "DS", spacing.join("\\")),
    element(0x28, 0x100, "US", us(16)), element(0x28, 0x103, "US", us(1)), element(0x28, 0x1052, "DS", "-1024"),
    element(0x28, 0x1053, "DS", "1"), element(0x7fe0, 0x10, "OW", new Uint8Array(pixels.buffer, 0, 2 * count - cut)),
  ]);
}

/// A block of bone in air, big enough to drill: densities differ from voxel to voxel, so that each tells where it was.
export const kBlock = [44, 40, 36];
export const kBlockVoxel = 0.4; // [mm]
const inBlock = (...at) => at.every((n, a) => n >= 6 && n < kBlock[a] - 6);
export const blockDensity = (x, y, z) => (inBlock(x, y, z) ? 1200 : -1000) + ((7 * x + 13 * y + 29 * z) % 83);
export const block = each(kBlock, blockDensity);

/// Where a file puts its voxels: `origin` and the three steps [mm], toward the patient's left, back and top.
export const placeOf = ({ origin, axes }, i, j, k) => origin.map((o, c) => o + i * axes[0][c] + j * axes[1][c] + k * axes[2][c]);
const straight = { origin: [0, 0, 0], axes: [[kBlockVoxel, 0, 0], [0, kBlockVoxel, 0], [0, 0, kBlockVoxel]] };

export function blockNifti(place = straight) {
  const signs = [-1, -1, 1]; // NIfTI's axes run to the right, front and top
  const rows = signs.map((s, c) => [...place.axes.map((v) => s * v[c]), s * place.origin[c]]);
  return nifti({ data: Int16Array.from(block), size: kBlock, pixels: place.axes.map((v) => Math.hypot(...v)), rows });
}
export function blockNrrd(place = straight, packed = false) {
  const vector = (v) => `(${v.join(",")})`;
  const lines = [
    "type: short", "dimension: 3", "space: left-posterior-superior", `sizes: ${kBlock.join(" ")}`,
    `space directions: ${place.axes.map(vector).join(" ")}`, `space origin: ${vector(place.origin)}`, "endian: little", `encoding: ${packed ? "gzip" : "raw"}`,
  ];
  const data = Int16Array.from(block);
  return nrrd(lines, packed ? gzipSync(Buffer.from(data.buffer)) : data);
}
/// The slices of one, in an order that is not theirs.
export function blockDicom(place = straight) {
  const unit = (v) => v.map((c) => c / Math.hypot(...v));
  const slices = [];
  for (let z = 0; z < kBlock[2]; ++z) {
    const options = {
      size: kBlock, densities: block, position: placeOf(place, 0, 0, z), direction: [...unit(place.axes[0]), ...unit(place.axes[1])],
      spacing: [Math.hypot(...place.axes[1]), Math.hypot(...place.axes[0])],
    };
    slices.splice((z * 7) % (slices.length + 1), 0, { name: `slice_${z}.dcm`, bytes: dicomSlice(z, options) });
  }
  return slices;
}

/// Reads an NRRD file that the page wrote: fields, the place of its voxels, and densities.
export function readSaved(bytes) {
  const end = bytes.indexOf("\n\n");
  const fields = Object.fromEntries(bytes.subarray(0, end).toString("latin1").split("\n").slice(1).map((line) => line.split(/: (.*)/).slice(0, 2)));
  const vectors = (text) => [...text.matchAll(/\(([^)]*)\)/g)].map((v) => v[1].split(",").map(Number));
  const body = bytes.subarray(end + 2);
  return {
    fields, size: fields.sizes.split(" ").map(Number), body,
    place: { origin: vectors(fields["space origin"])[0], axes: vectors(fields["space directions"]) },
    density: (at) => body.readInt16LE(2 * at),
  };
}

/// A short gzip file that unpacks to `head` and `zeros` bytes of nothing.
export const bomb = (head, zeros) => gzipSync(Buffer.concat([head, Buffer.alloc(zeros)]));
