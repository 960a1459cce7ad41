// SPDX-License-Identifier: MIT
import dicomParser from "dicom-parser";
import { bytesPerVoxel, countOf, numbers, refuse, toVolume } from "./volume.js";

const kUncompressed = { "1.2.840.10008.1.2": true, "1.2.840.10008.1.2.1": true, "1.2.840.10008.1.2.2": false };
const kPixels = "x7fe00010";
const kMostBytes = 2 ** 31 - 1;

const list = (set, tag) => (set.string(tag) ?? "").split("\\").map(Number);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const item = (set, ...tags) => tags.reduce((s, tag) => s?.elements[tag]?.items?.[0]?.dataSet, set);
const numbersOk = (v, n) => v.length === n && v.every(Number.isFinite);

/// What a file says of its slices, or nothing where it is no image of DICOM.
async function slicesOf(file, problems) {
  const mark = new TextDecoder("latin1").decode(await file.slice(128, 132).arrayBuffer());
  if (mark !== "DICM" || file.size > kMostBytes) return [];
  const bytes = new Uint8Array(await file.arrayBuffer());
  let set = null;
  try {
    set = dicomParser.parseDicom(bytes);
  } catch {
    return [];
  }
  const pixels = set.elements[kPixels];
  if (!pixels) return [];
  const syntax = set.string("x00020010") ?? "1.2.840.10008.1.2";
  if (!(syntax in kUncompressed)) {
    problems.add("The slices are compressed, so please export them as uncompressed DICOM.");
    return [];
  }
  const bits = set.uint16("x00280100"), signed = set.uint16("x00280103") === 1;
  if ((set.uint16("x00280002") ?? 1) !== 1 || (bits !== 8 && bits !== 16)) {
    problems.add("The pictures are in colour or of another type that is no density.");
    return [];
  }
  const rows = set.uint16("x00280010"), columns = set.uint16("x00280011");
  const frames = Math.max(1, set.intString("x00280008") || 1);
  const type = (signed ? "int" : "uint") + bits, length = rows * columns * bytesPerVoxel(type);
  if (!(length > 0) || pixels.length < length * frames || pixels.dataOffset + length * frames > bytes.length) {
    problems.add(`${file.name} ends before its last pixel, so it is not complete.`);
    return [];
  }
  const shared = item(set, "x52009229");
  const slices = [];
  for (let f = 0; f < frames; ++f) {
    const own = set.elements.x52009230?.items?.[f]?.dataSet;
    const group = (tag) => item(own, tag) ?? item(shared, tag) ?? set;
    const first = (source, tag) => (source.elements[tag] ? source : set);
    const measures = first(group("x00289110"), "x00280030"), values = first(group("x00289145"), "x00281053");
    const from = pixels.dataOffset + f * length;
    slices.push({
      series: `${set.string("x0020000e") ?? ""} ${rows} ${columns} ${type}`, rows, columns, type,
      bytes: bytes.slice(from, from + length), littleEndian: kUncompressed[syntax],
      spacing: list(measures, "x00280030"),
      thickness: Math.abs(measures.floatString("x00180088") || measures.floatString("x00180050") || 0),
      position: list(group("x00209113"), "x00200032"), direction: list(group("x00209116"), "x00200037"),
      slope: values.floatString("x00281053") ?? 1, intercept: values.floatString("x00281052") ?? 0,
      number: frames > 1 ? f : set.intString("x00200013") ?? 0,
    });
  }
  return slices;
}

/// Slices of one series, from files in any order.
export async function readDicom(files, progress, most) {
  const series = new Map(), problems = new Set();
  let read = 0, total = 0;
  for (const file of files) {
    progress(`Reading slice ${++read} of ${files.length}`);
    for (const slice of await slicesOf(file, problems)) {
      total += slice.bytes.length;
      if (total > kMostBytes) refuse("The slices are larger than a browser can hold, so please choose one series.");
      if (!series.has(slice.series)) series.set(slice.series, []);
      series.get(slice.series).push(slice);
    }
  }
  if (series.size === 0) refuse([...problems][0] ?? "There is no DICOM picture in these files.");
  const slices = [...series.values()].reduce((a, b) => (b.length > a.length ? b : a));
  const notes = series.size > 1 ? [`There are ${series.size} series, and the longest is opened.`] : [];
  const { rows, columns, type } = slices[0];
  return toVolume({ name: nameOf(files), ...stack(slices, notes), size: [columns, rows, slices.length], notes, most });

  function stack(all, said) {
    countOf("The series", [columns, rows, all.length]);
    let [row, column] = [[1, 0, 0], [0, 1, 0]];
    const placed = all.every((s) => numbersOk(s.position, 3) && numbersOk(s.direction, 6));
    if (placed) [row, column] = [all[0].direction.slice(0, 3), all[0].direction.slice(3)];
    const normal = cross(row, column);
    const place = (s) => (placed ? dot(s.position, normal) : s.number);
    all.sort((a, b) => place(a) - place(b));
    const gaps = all.slice(1).map((s, i) => place(s) - place(all[i])).sort((a, b) => a - b);
    let gap = gaps[gaps.length >> 1];
    if (!placed) {
      gap = all[0].thickness || 1;
      said.push("The slices do not say where they lie, so they are stacked by their numbers.");
    } else if (!(gap > 0)) {
      refuse("Several slices lie at one place, so they are no volume.");
    } else if (gaps[0] < 0.9 * gap || gaps.at(-1) > 1.1 * gap) {
      said.push("Slices are missing or unevenly spaced, so the bone is distorted there.");
    }
    const [down, across] = numbersOk(all[0].spacing, 2) ? all[0].spacing : [1, 1];
    if (!numbersOk(all[0].spacing, 2)) said.push("The slices do not say how large pixels are, so 1 mm is assumed.");

    const even = all.every((s) => s.slope === all[0].slope && s.intercept === all[0].intercept);
    const length = rows * columns;
    const width = even ? bytesPerVoxel(type) : 4;
    if (length * all.length * width > kMostBytes) refuse("The series is larger than a browser can hold, so please crop it before.");
    const data = even ? numbers(new Uint8Array(length * all.length * width), type, true) : new Float32Array(length * all.length);
    all.forEach((s, i) => {
      const values = numbers(s.bytes, s.type, s.littleEndian);
      data.set(even ? values : Float32Array.from(values, (v) => v * s.slope + s.intercept), i * length);
      s.bytes = null;
    });
    return {
      data, axes: [row.map((c) => c * across), column.map((c) => c * down), normal.map((c) => c * gap)],
      origin: placed ? all[0].position : undefined,
      slope: even ? all[0].slope : 1, intercept: even ? all[0].intercept : 0,
    };
  }
}

function nameOf(files) {
  const folder = files[0].webkitRelativePath?.split("/")[0];
  return folder || (files.length === 1 ? files[0].name : `${files.length} slices`);
}
