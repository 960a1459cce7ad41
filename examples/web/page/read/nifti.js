// SPDX-License-Identifier: MIT
import { readHeader } from "nifti-reader-js";
import { bytesOf, bytesPerVoxel, countOf, headOf, numbers, refuse, toVolume } from "./volume.js";

const kTypes = {
  2: "uint8", 4: "int16", 8: "int32", 16: "float", 64: "double", 256: "int8", 512: "uint16", 768: "uint32",
};
const kMillimetres = { 1: 1000, 3: 1e-3 }; // of the units metre and micron; others are millimetres

/// A file of NIfTI 1 or 2 with header and voxels in one, packed by gzip or not.
export async function readNifti(file, packed, most) {
  const head = await headOf(file, 4096, packed);
  let h = null;
  try {
    h = readHeader(head.buffer);
  } catch {
    refuse(`The header of ${file.name} is not one of NIfTI, or it is damaged.`);
  }
  const type = kTypes[h.datatypeCode];
  if (!type) refuse(`${file.name} holds colours, complex numbers or another type that is no density.`);
  const size = [h.dims[1], h.dims[2], h.dims[3]];
  const count = countOf(file.name, size);
  const notes = h.dims[0] > 3 && h.dims[4] > 1 ? [`The file has ${h.dims[4]} volumes, and the first is opened.`] : [];
  if (!(h.vox_offset >= 348 && h.vox_offset < 1e9)) refuse(`The header of ${file.name} does not say where its voxels are.`);
  const bytes = await bytesOf(file, Math.floor(h.vox_offset), count * bytesPerVoxel(type), packed);
  if (![1, 2, 3].every((a) => Number.isFinite(h.pixDims[a]))) refuse(`The header of ${file.name} does not say how large its voxels are.`);
  const mm = kMillimetres[h.xyzt_units & 7] ?? 1;
  const pixels = [1, 2, 3].map((a) => Math.abs(h.pixDims[a]) || 1);
  // NIfTI's axes run to the right, front and top.
  let axes = [0, 1, 2].map((a) => [-h.affine[0][a] * mm, -h.affine[1][a] * mm, h.affine[2][a] * mm]);
  let origin = [-h.affine[0][3] * mm, -h.affine[1][3] * mm, h.affine[2][3] * mm];
  if (!axes.every((v, a) => Math.abs(Math.hypot(...v) - pixels[a] * mm) <= 0.5 * pixels[a] * mm))
    [axes, origin] = [[[-pixels[0] * mm, 0, 0], [0, -pixels[1] * mm, 0], [0, 0, pixels[2] * mm]], [0, 0, 0]];
  const data = numbers(bytes, type, h.littleEndian);
  return toVolume({ name: file.name, data, size, axes, origin, slope: h.scl_slope, intercept: h.scl_inter, notes, most });
}
