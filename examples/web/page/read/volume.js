// SPDX-License-Identifier: MIT
// A scan becomes a volume for the engine: 16-bit densities, x fastest, along the patient's left, back and top.

/// What is told to the user: one sentence, and the present bone stays.
export class Refusal extends Error {}
export const refuse = (sentence) => {
  throw new Refusal(sentence);
};

export const kMostVoxels = 110e6; // more would not fit beside the engine's own fields
const kMostBytes = 2 ** 31 - 1; // of one array that every browser gives

/// Reads `bytes` of a file's stream from `offset` on, unpacked where it is gzip.
export async function bytesOf(file, offset, bytes, packed) {
  if (!(bytes <= kMostBytes)) refuse(`${file.name} is larger than a browser can hold, so please crop it before.`);
  if (!packed) {
    if (offset + bytes > file.size) refuse(`${file.name} ends before its last voxel, so it is not complete.`);
    return new Uint8Array(await file.slice(offset, offset + bytes).arrayBuffer());
  }
  const out = take(file, bytes);
  const reader = file.stream().pipeThrough(new DecompressionStream("gzip")).getReader();
  let at = -offset;
  try {
    while (at < bytes) {
      const { done, value } = await reader.read();
      if (done) break;
      const from = Math.max(0, -at);
      if (from < value.length) out.set(value.subarray(from, Math.min(value.length, bytes - at)), at + from);
      at += value.length;
    }
  } catch {
    refuse(`${file.name} cannot be unpacked: it is damaged or incomplete.`);
  } finally {
    reader.cancel().catch(() => {});
  }
  if (at < bytes) refuse(`${file.name} ends before its last voxel, so it is not complete.`);
  return out;
}

function take(file, bytes) {
  try {
    return new Uint8Array(bytes);
  } catch {
    return refuse(`This device has too little memory for ${file.name}.`);
  }
}

/// The first bytes of a file, unpacked, at most `bytes`.
export async function headOf(file, bytes, packed) {
  if (!packed) return new Uint8Array(await file.slice(0, bytes).arrayBuffer());
  const parts = [];
  let length = 0;
  const reader = file.stream().pipeThrough(new DecompressionStream("gzip")).getReader();
  try {
    while (length < bytes) {
      const { done, value } = await reader.read();
      if (done) break;
      parts.push(value);
      length += value.length;
    }
  } catch {
    // The part before the damage may still tell what the file is.
  } finally {
    reader.cancel().catch(() => {});
  }
  return new Uint8Array(await new Blob(parts).slice(0, bytes).arrayBuffer());
}

const kTypes = {
  int8: Int8Array, uint8: Uint8Array, int16: Int16Array, uint16: Uint16Array,
  int32: Int32Array, uint32: Uint32Array, float: Float32Array, double: Float64Array,
};
export const bytesPerVoxel = (type) => kTypes[type].BYTES_PER_ELEMENT;

/// Numbers of a type from bytes in either order; the bytes are used up.
export function numbers(bytes, type, littleEndian) {
  const width = bytesPerVoxel(type);
  if (!littleEndian && width > 1)
    for (let i = 0; i + width <= bytes.length; i += width) bytes.subarray(i, i + width).reverse();
  return new kTypes[type](bytes.buffer, bytes.byteOffset, Math.floor(bytes.length / width));
}

/// The count of voxels, once sizes are such.
export function countOf(name, size) {
  if (size.length !== 3 || !size.every((n) => Number.isInteger(n) && n >= 1))
    refuse(`${name} has no size of three dimensions, so there is no volume to drill.`);
  if (size.some((n) => n < 4)) refuse(`${name} has ${size.join(" × ")} voxels, and fewer than four along an axis are no volume.`);
  return size[0] * size[1] * size[2];
}

/// For each of left, back and top: the array's axis that runs along it best, and its sign.
function orientation(axes) {
  const along = axes.map((v) => v.map((c) => c / Math.hypot(...v)));
  const found = [];
  for (let step = 0; step < 3; ++step) {
    let best = { size: -1 };
    for (let from = 0; from < 3; ++from)
      for (let to = 0; to < 3; ++to)
        if (!found.some((f) => f.from === from || f.to === to) && Math.abs(along[from][to]) > best.size)
          best = { from, to, size: Math.abs(along[from][to]), sign: along[from][to] < 0 ? -1 : 1 };
    found.push(best);
  }
  return found.sort((a, b) => a.to - b.to);
}

/// Factors that make a volume small enough, along the finest axes first.
function thinning(size, spacing, most) {
  const factor = [1, 1, 1];
  const left = () => size.reduce((n, s, a) => n * Math.floor(s / factor[a]), 1);
  while (left() > most) {
    let finest = 0;
    for (let a = 1; a < 3; ++a) if (spacing[a] * factor[a] < spacing[finest] * factor[finest]) finest = a;
    ++factor[finest];
  }
  return factor;
}

/// Least and greatest density, and whether all are whole.
function rangeOf(data, slope, intercept) {
  let least = Infinity, most = -Infinity, whole = true;
  for (let i = 0; i < data.length; ++i) {
    const v = data[i];
    if (v < least && v > -Infinity) least = v;
    if (v > most && v < Infinity) most = v;
    if (whole && v !== Math.trunc(v)) whole = false;
  }
  whole &&= Number.isInteger(slope) && Number.isInteger(intercept);
  const ends = [least * slope + intercept, most * slope + intercept];
  return { least: Math.min(...ends), most: Math.max(...ends), whole };
}

/// The factor that puts densities into 16 bits without losing their steps.
function factorFor({ least, most, whole }) {
  if (least < -32768 || most > 32767) {
    let k = 1;
    while (least * k < -32768 || most * k > 32767) k /= 2;
    return k;
  }
  if (whole || most - least >= 100) return 1;
  return 10 ** Math.floor(Math.log10(10000 / (most - least)));
}

/// The density between the two kinds of voxels that differ most (Otsu).
function middle(voxels, least, most) {
  const kBins = 256;
  const bins = new Float64Array(kBins);
  const step = Math.max(1, Math.floor(voxels.length / 4e6)), scale = (kBins - 1) / Math.max(1, most - least);
  let count = 0, sum = 0;
  for (let i = 0; i < voxels.length; i += step) {
    const b = Math.round((voxels[i] - least) * scale);
    ++bins[b];
    ++count;
    sum += b;
  }
  let below = 0, sumBelow = 0, best = -1, first = 0, last = 0;
  for (let b = 0; b < kBins - 1; ++b) {
    below += bins[b];
    sumBelow += b * bins[b];
    if (below === 0 || below === count) continue;
    const apart = sumBelow / below - (sum - sumBelow) / (count - below);
    const between = below * (count - below) * apart * apart;
    if (between > best) [best, first, last] = [between, b, b];
    else if (between === best) last = b;
  }
  return Math.round(least + ((first + last) / 2 + 0.5) / scale);
}

/// The first voxel's centre [m] and the directions of x and y, at a right angle also where the scanner's were not.
function frameOf(origin, axes, turned, factor, size) {
  const first = [...origin];
  turned.forEach(({ from, sign }) => {
    // The middle of the voxels that become the first one.
    const steps = sign > 0 ? (factor[from] - 1) / 2 : size[from] - 1 - (factor[from] - 1) / 2;
    axes[from].forEach((c, i) => (first[i] += steps * c));
  });
  const unit = (v) => v.map((c) => c / Math.hypot(...v));
  const [x, y] = turned.map(({ from, sign }) => unit(axes[from].map((c) => sign * c)));
  const along = x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  return [...first.map((c) => c * 1e-3), ...x, ...unit(y.map((c, i) => c - along * x[i]))];
}

/// `axes` are the steps from voxel to voxel along the array's axes, in mm, toward the patient's left, back and top, and
/// `origin` is where the first voxel's centre lies there.
export function toVolume({ name, data, size, axes, origin = [0, 0, 0], slope = 1, intercept = 0, notes = [], most = kMostVoxels }) {
  const count = countOf(name, size);
  if (data.length < count) refuse(`${name} ends before its last voxel, so it is not complete.`);
  if (data.length > count) data = data.subarray(0, count);
  if (!(Number.isFinite(slope) && Number.isFinite(intercept)) || slope === 0) [slope, intercept] = [1, 0];
  const spacing = axes.map((v) => Math.hypot(...v));
  if (!spacing.every((s) => s >= 1e-3 && s <= 100))
    refuse(`${name} has voxels of ${spacing.map((s) => +s.toPrecision(3)).join(" × ")} mm, which cannot be.`);

  if (!origin.every(Number.isFinite)) origin = [0, 0, 0];

  const range = rangeOf(data, slope, intercept);
  if (!Number.isFinite(range.most - range.least)) refuse(`${name} holds no densities that are numbers, so there is no bone in it.`);
  if (!(range.most > range.least)) refuse(`${name} has the same density everywhere, so there is no bone in it.`);
  const k = factorFor(range);
  if (k !== 1) notes.push(`Densities are multiplied by ${k}, so that they fit into whole numbers.`);

  const turned = orientation(axes);
  const stride = [1, size[0], size[0] * size[1]];
  const factor = thinning(size, spacing, most);
  if (factor.some((f) => f > 1))
    notes.push(`The volume is too large for this page, so ${factor.join(" × ")} voxels are averaged into one.`);
  const n = turned.map(({ from }) => Math.floor(size[from] / factor[from]));
  const f = turned.map(({ from }) => factor[from]);
  const step = turned.map(({ from, sign }) => sign * stride[from]);
  const start = turned.reduce((at, { from, sign }) => at + (sign < 0 ? (size[from] - 1) * stride[from] : 0), 0);

  const voxels = new Int16Array(n[0] * n[1] * n[2]);
  const scale = k * slope / (f[0] * f[1] * f[2]), offset = k * intercept, thin = f.some((x) => x > 1);
  const floor = Math.round(k * range.least), ceiling = Math.round(k * range.most);
  let out = 0;
  for (let z = 0; z < n[2]; ++z)
    for (let y = 0; y < n[1]; ++y) {
      let at = start + z * f[2] * step[2] + y * f[1] * step[1];
      for (let x = 0; x < n[0]; ++x, at += f[0] * step[0]) {
        let v = data[at];
        if (thin) {
          v = 0;
          for (let c = 0; c < f[2]; ++c)
            for (let b = 0; b < f[1]; ++b)
              for (let a = 0; a < f[0]; ++a) v += data[at + a * step[0] + b * step[1] + c * step[2]];
        }
        const d = Math.round(v * scale + offset);
        voxels[out++] = d >= floor ? (d <= ceiling ? d : ceiling) : floor; // what is no number becomes air
      }
    }
  const hounsfield = k === 1 && range.least <= -500 && range.most >= 700;
  return {
    name, size: n, spacing: turned.map(({ from }) => spacing[from] * factor[from] * 1e-3),
    frame: frameOf(origin, axes, turned, factor, size), voxels,
    least: floor, most: ceiling, isovalue: hounsfield ? 300 : middle(voxels, floor, ceiling), hounsfield, notes,
  };
}
