// SPDX-License-Identifier: MIT
// Pictures of the page, and rays cast through a saved bone by brute force.

import { frames } from "./browser.mjs";

const kSettles = 12; // turns of the page's loop: a still picture is the mean of eight

/// The picture as { width, height, at(x, y) -> [r, g, b] }, once two in a row are alike. Overlays are hidden.
export async function still(page) {
  let last = "";
  for (let i = 0; i < 60; ++i) {
    await page.evaluate(() => (document.getElementById("hint").style.visibility = "hidden"));
    await frames(page, kSettles);
    const shot = await screenshot(page);
    if (shot === last) return decoded(page, shot);
    last = shot;
  }
  throw new Error("the picture does not come to rest");
}

/// The picture as it is now, likewise.
export const picture = async (page) => decoded(page, await screenshot(page));

const screenshot = async (page) => (await page.$("#canvas")).screenshot({ encoding: "base64" });

async function decoded(page, png) {
  const { width, height, data } = await page.evaluate(async (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = new OffscreenCanvas(image.width, image.height), context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const pixels = context.getImageData(0, 0, image.width, image.height).data;
    let out = "";
    for (let i = 0; i < pixels.length; i += 4096) out += String.fromCharCode(...pixels.subarray(i, i + 4096));
    return { width: image.width, height: image.height, data: btoa(out) };
  }, png);
  const pixels = Buffer.from(data, "base64");
  return { width, height, at: (x, y) => pixels.subarray(4 * (y * width + x), 4 * (y * width + x) + 3) };
}

/// A bone that the page saved: densities, and where they lie [mm].
export function readNrrd(bytes) {
  const end = bytes.indexOf("\n\n");
  const head = bytes.subarray(0, end).toString("latin1");
  const field = (name) => new RegExp(`^${name}: (.*)$`, "m").exec(head)[1];
  const vectors = (text) => [...text.matchAll(/\(([^)]*)\)/g)].map((v) => v[1].split(",").map(Number));
  const size = field("sizes").split(" ").map(Number);
  const voxels = new Int16Array(size[0] * size[1] * size[2]);
  const body = bytes.subarray(end + 2);
  if (body.length !== 2 * voxels.length) throw new Error(`${body.length} bytes for ${voxels.length} voxels`);
  for (let i = 0; i < voxels.length; ++i) voxels[i] = body.readInt16LE(2 * i);
  return { size, voxels, steps: vectors(field("space directions")), origin: vectors(field("space origin"))[0], space: field("space") };
}

const sub = (a, b) => a.map((c, i) => c - b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const along = (a, t, d) => a.map((c, i) => c + t * d[i]);
const unit = (v) => v.map((c) => c / Math.hypot(...v));

/// The camera of a session's line `view X Y Z YAW PITCH DISTANCE` [mm, degrees], as examples/live/orbit_camera.hpp has it.
export function cameraOf(session, width, height) {
  const lines = [...session.matchAll(/ view (.*)/g)];
  const [x, y, z, yaw, pitch, distance] = lines.at(-1)[1].split(" ").map(Number);
  const a = (yaw * Math.PI) / 180, p = (pitch * Math.PI) / 180;
  const back = [Math.cos(p) * Math.cos(a), Math.cos(p) * Math.sin(a), Math.sin(p)];
  const right = [-Math.sin(a), Math.cos(a), 0];
  const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]];
  const eye = along([x, y, z], distance, back), scale = (2 * Math.tan(0.3)) / height;
  return {
    eye, right, up, back,
    ray: (i, j) => {
      const u = scale * (i + 0.5 - width / 2), v = -scale * (j + 0.5 - height / 2);
      return unit(right.map((c, k) => u * c + v * up[k] - back[k]));
    },
    /// Toward the key light, as examples/live/scene_picture.cpp has it.
    key: unit(right.map((c, k) => -0.5 * c + 0.6 * up[k] + 0.75 * back[k])),
  };
}

/// Where a ray enters bone, as a place in voxels, or nothing: densities between voxels are linear, and each quarter of a
/// voxel is looked at.
export function firstBone(bone, isovalue, from, direction, start = 0, longest = 400) {
  const h = bone.steps.map((v) => Math.hypot(...v)), axes = bone.steps.map(unit);
  const local = (v) => axes.map((a, i) => dot(a, v) / h[i]);
  const o = local(sub(from, bone.origin)), d = local(direction), n = bone.size;
  let t0 = start, t1 = longest;
  for (let a = 0; a < 3; ++a) {
    const s = (-o[a]) / d[a], e = (n[a] - 1 - o[a]) / d[a];
    t0 = Math.max(t0, Math.min(s, e));
    t1 = Math.min(t1, Math.max(s, e));
  }
  const density = (u) => {
    const f = u.map((c, a) => Math.min(Math.max(Math.floor(c), 0), n[a] - 2)), w = u.map((c, a) => c - f[a]);
    let sum = 0;
    for (let c = 0; c < 8; ++c) {
      const b = [c & 1, (c >> 1) & 1, c >> 2];
      const share = b.reduce((s, bit, a) => s * (bit ? w[a] : 1 - w[a]), 1);
      sum += share * bone.voxels[(f[2] + b[2]) * n[0] * n[1] + (f[1] + b[1]) * n[0] + f[0] + b[0]];
    }
    return sum;
  };
  const step = 0.25 * Math.min(...h);
  for (let t = t0; t <= t1; t += step) {
    const u = along(o, t, d);
    if (density(u) >= isovalue) return { u, p: along(from, t, direction), t };
  }
  return null;
}
