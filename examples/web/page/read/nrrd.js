// SPDX-License-Identifier: MIT
import { bytesOf, bytesPerVoxel, countOf, headOf, numbers, refuse, toVolume } from "./volume.js";

const kTypes = {
  "signed char": "int8", int8: "int8", int8_t: "int8",
  uchar: "uint8", "unsigned char": "uint8", uint8: "uint8", uint8_t: "uint8",
  short: "int16", "short int": "int16", "signed short": "int16", "signed short int": "int16", int16: "int16", int16_t: "int16",
  ushort: "uint16", "unsigned short": "uint16", "unsigned short int": "uint16", uint16: "uint16", uint16_t: "uint16",
  int: "int32", "signed int": "int32", int32: "int32", int32_t: "int32",
  uint: "uint32", "unsigned int": "uint32", uint32: "uint32", uint32_t: "uint32",
  float: "float", double: "double",
};
const kLongestHeader = 65536;
// Signs that bring a space's axes to left, back and top.
const kSpaces = {
  "left-posterior-superior": [1, 1, 1], lps: [1, 1, 1],
  "right-anterior-superior": [-1, -1, 1], ras: [-1, -1, 1],
  "left-anterior-superior": [1, -1, 1], las: [1, -1, 1],
};

/// The fields of a header and where the voxels begin; nothing where there is no end of it.
function fieldsOf(head) {
  const text = new TextDecoder("latin1").decode(head);
  const end = /\r?\n\r?\n/.exec(text);
  if (!end) return null;
  const fields = {};
  for (const line of text.slice(0, end.index).split(/\r?\n/).slice(1)) {
    const field = /^([^:#]+):=?\s*(.*?)\s*$/.exec(line);
    if (field) fields[field[1].trim().toLowerCase()] = field[2];
  }
  return { fields, begin: end.index + end[0].length };
}

/// An NRRD file with header and voxels in one, raw, as gzip or as text.
export async function readNrrd(file, most) {
  const parsed = fieldsOf(await headOf(file, kLongestHeader, false));
  if (!parsed) refuse(`The header of ${file.name} has no end, so it is damaged or holds no voxels.`);
  const { fields, begin } = parsed;
  if ("data file" in fields || "datafile" in fields)
    refuse(`${file.name} keeps its voxels in another file, so please save it as one .nrrd file.`);
  const type = kTypes[(fields.type ?? "").toLowerCase()];
  if (!type) refuse(`${file.name} holds numbers of the type "${(fields.type ?? "none").slice(0, 30)}", which is no density here.`);
  const size = (fields.sizes ?? "").split(/\s+/).map(Number);
  if (size.length !== 3) refuse(`${file.name} has ${size.length} dimensions, and a volume of densities has three.`);
  const count = countOf(file.name, size);
  const skips = ["byte skip", "byteskip", "line skip", "lineskip"].some((s) => Number(fields[s] ?? 0) !== 0);
  if (skips) refuse(`${file.name} skips bytes before its voxels, so please save it without that.`);

  const encoding = (fields.encoding ?? "").toLowerCase();
  const bytes = count * bytesPerVoxel(type);
  let data = null;
  if (encoding === "raw") {
    data = numbers(await bytesOf(file, begin, bytes, false), type, fields.endian !== "big");
  } else if (encoding === "gzip" || encoding === "gz") {
    const body = new File([file.slice(begin)], file.name);
    data = numbers(await bytesOf(body, 0, bytes, true), type, fields.endian !== "big");
  } else if (encoding === "text" || encoding === "txt" || encoding === "ascii") {
    if (file.size > 2e8) refuse(`${file.name} is too long a text, so please save it as raw or gzip.`);
    data = Float32Array.from((await file.slice(begin).text()).trim().split(/[\s,]+/), Number);
  } else {
    refuse(`${file.name} is packed as "${encoding.slice(0, 20)}", so please save it as raw or gzip.`);
  }

  const notes = [];
  let axes = [...(fields["space directions"] ?? "").matchAll(/\(([^)]*)\)/g)].map((v) => v[1].split(",").map(Number));
  if (axes.length !== 3 || !axes.every((v) => v.length === 3 && v.every(Number.isFinite))) {
    const spacings = (fields.spacings ?? "").split(/\s+/).map((s) => Math.abs(Number(s)));
    const known = spacings.length === 3 && spacings.every((s) => s > 0 && s < Infinity);
    if (!known) notes.push("The file does not say how large voxels are, so 1 mm is assumed.");
    axes = [0, 1, 2].map((a) => [0, 1, 2].map((b) => (a === b ? (known ? spacings[a] : 1) : 0)));
  }
  const signs = kSpaces[(fields.space ?? "").replace(/"/g, "").toLowerCase()] ?? [1, 1, 1];
  axes = axes.map((v) => v.map((c, i) => c * signs[i]));
  const place = /\(([^)]*)\)/.exec(fields["space origin"] ?? "")?.[1].split(",").map(Number) ?? [];
  const origin = place.length === 3 ? place.map((c, i) => c * signs[i]) : undefined;
  return toVolume({ name: file.name, data, size, axes, origin, notes, most });
}
