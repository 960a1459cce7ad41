// SPDX-License-Identifier: MIT
// The pictures, the player and the plots of a session's report. Lengths in m, times in s; axes are the world's.
"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const rgb = (name) => [1, 3, 5].map((i) => parseInt(style(name).slice(i, i + 2), 16));

function decode(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Kind(bytes.buffer);
}

// --- vectors -----------------------------------------------------------------------------------------------------
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / (Math.hypot(...a) || 1));
/** A direction at a right angle to `a`. */
const aside = (a) => unit(cross(a, Math.abs(a[2]) < 0.9 ? [0, 0, 1] : [0, 1, 0]));

// --- meshes ------------------------------------------------------------------------------------------------------
/** Adds a normal for each vertex, the mean of its triangles' by their areas. */
function withNormals(mesh) {
  const { points, triangles } = mesh;
  const normals = (mesh.normals = new Float32Array(points.length));
  const at = (i) => [points[3 * i], points[3 * i + 1], points[3 * i + 2]];
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [at(triangles[t]), at(triangles[t + 1]), at(triangles[t + 2])];
    const n = cross([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
    for (let k = 0; k < 3; ++k) for (let d = 0; d < 3; ++d) normals[3 * triangles[t + k] + d] += n[d];
  }
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
    for (let d = 0; d < 3; ++d) normals[i + d] /= length;
  }
  return mesh;
}

/** A mesh of the report: its vertices are 16-bit steps from `low`. */
function loaded(mesh) {
  const steps = decode(mesh.vertices, Uint16Array);
  const points = Float32Array.from(steps, (v, i) => mesh.low[i % 3] + v * mesh.step);
  return withNormals({ ...mesh, points, triangles: decode(mesh.triangles, Uint16Array) });
}

/** The burr's ball and shaft in the tool's frame: origin in the ball's centre, z to the handle. */
function toolMesh({ tip_radius: radius, shaft_radius, shaft_length }) {
  const rings = [];
  for (let i = 0; i <= 12; ++i) rings.push([radius * Math.sin((Math.PI * i) / 12), -radius * Math.cos((Math.PI * i) / 12)]);
  // Each corner twice, so that it stays sharp: once for the face before it and once for that behind.
  const [bottom, top] = [[shaft_radius, 0], [shaft_radius, shaft_length]];
  const shaft = shaft_length > 0 ? [[0, 0], bottom, bottom, top, top, [0, shaft_length]] : [];
  const points = [], triangles = [], round = 24;
  for (const profile of [rings, shaft]) {
    const first = points.length / 3;
    for (const [r, z] of profile)
      for (let k = 0; k < round; ++k) points.push(r * Math.cos((2 * Math.PI * k) / round), r * Math.sin((2 * Math.PI * k) / round), z);
    for (let i = 0; i + 1 < profile.length; ++i)
      for (let k = 0; k < round; ++k) {
        const a = first + i * round + k, b = first + i * round + ((k + 1) % round);
        triangles.push(a, b, a + round, b, b + round, a + round);
      }
  }
  return withNormals({ points: Float32Array.from(points), triangles: Uint16Array.from(triangles) });
}

/** The mesh turned about the origin so that z is `axis`, and then moved to `to`. */
function moved(mesh, axis, to) {
  const x = aside(axis), y = cross(axis, x);
  const turn = (from) => {
    const out = new Float32Array(from.length);
    for (let i = 0; i < from.length; i += 3)
      for (let d = 0; d < 3; ++d) out[i + d] = x[d] * from[i] + y[d] * from[i + 1] + axis[d] * from[i + 2];
    return out;
  };
  const points = turn(mesh.points);
  for (let i = 0; i < points.length; ++i) points[i] += to[i % 3];
  return { ...mesh, points, normals: turn(mesh.normals) };
}

// --- drawing -----------------------------------------------------------------------------------------------------
// A parallel projection with a depth buffer, in plain numbers, so that the pictures are the same with and without a
// graphics card. Bone, structures and tool are layers of their own: what lies behind the bone shines through.

class Layer {
  constructor(width, height) {
    Object.assign(this, { width, height, colour: new Uint32Array(width * height), depth: new Float32Array(width * height) });
    this.clear();
  }
  clear() {
    this.colour.fill(0);
    this.depth.fill(-Infinity);
    return this;
  }
  /** Draws the front of a closed mesh, lit from over the viewer's right shoulder. */
  draw(mesh, camera, [red, green, blue]) {
    const { width, height, colour, depth } = this, { points, normals, triangles } = mesh, { rows, centre } = camera;
    const count = points.length / 3, scale = camera.scale(width, height);
    const X = new Float32Array(count), Y = new Float32Array(count), Z = new Float32Array(count), L = new Float32Array(count);
    const light = unit([0.45, 0.6, 0.75]);
    for (let i = 0; i < count; ++i) {
      const p = [points[3 * i] - centre[0], points[3 * i + 1] - centre[1], points[3 * i + 2] - centre[2]];
      const n = [normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]];
      X[i] = width / 2 + scale * dot(rows[0], p);
      Y[i] = height / 2 - scale * dot(rows[1], p);
      Z[i] = dot(rows[2], p);
      const shine = light[0] * dot(rows[0], n) + light[1] * dot(rows[1], n) + light[2] * dot(rows[2], n);
      L[i] = Math.min(1, 0.48 + 0.6 * Math.max(0, shine));
    }
    for (let t = 0; t < triangles.length; t += 3) {
      const a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
      const area = (X[c] - X[a]) * (Y[b] - Y[a]) - (X[b] - X[a]) * (Y[c] - Y[a]);
      if (!(area > 0)) continue; // seen from behind, or on edge
      const left = Math.max(0, Math.ceil(Math.min(X[a], X[b], X[c]))), right = Math.min(width - 1, Math.max(X[a], X[b], X[c]));
      const top = Math.max(0, Math.ceil(Math.min(Y[a], Y[b], Y[c]))), bottom = Math.min(height - 1, Math.max(Y[a], Y[b], Y[c]));
      for (let y = top; y <= bottom; ++y)
        for (let x = left; x <= right; ++x) {
          const u = ((X[c] - x) * (Y[b] - y) - (X[b] - x) * (Y[c] - y)) / area;
          const v = ((X[a] - x) * (Y[c] - y) - (X[c] - x) * (Y[a] - y)) / area, w = 1 - u - v;
          if (u < 0 || v < 0 || w < 0) continue;
          const z = u * Z[a] + v * Z[b] + w * Z[c], at = y * width + x;
          if (z <= depth[at]) continue;
          depth[at] = z;
          const l = u * L[a] + v * L[b] + w * L[c];
          colour[at] = 0xff000000 | ((blue * l) << 16) | ((green * l) << 8) | (red * l);
        }
    }
  }
  /** Lays another layer over this: whole where it is in front, and with a share of `through` where it is behind. */
  lay(over, through) {
    for (let i = 0; i < this.colour.length; ++i) {
      const top = over.colour[i], under = this.colour[i];
      if (top === 0) continue;
      if (over.depth[i] >= this.depth[i] || under === 0) {
        this.colour[i] = top;
        this.depth[i] = over.depth[i];
        continue;
      }
      const mix = (shift) => (((top >>> shift) & 255) * through + ((under >>> shift) & 255) * (1 - through)) << shift;
      this.colour[i] = 0xff000000 | mix(16) | mix(8) | mix(0);
    }
  }
  copy(from) {
    this.colour.set(from.colour);
    this.depth.set(from.depth);
  }
}

// --- the session -------------------------------------------------------------------------------------------------
const meshes = data.meshes.map(loaded), structures = meshes.filter((m) => m.kind === "structure");
const tool = toolMesh(data.tool);
const kColumns = 11; // of a frame: time, position, direction of the shaft, force, distance, removed, spindle
const frames = decode(data.frames, Float32Array), count = frames.length / kColumns;
const frame = (i) => frames.subarray(kColumns * i, kColumns * (i + 1));

/** The last frame that is not after a time. */
function frameAt(time) {
  let low = 0, high = count - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (frames[kColumns * middle] <= time) low = middle;
    else high = middle - 1;
  }
  return low;
}
/** The stroke at a time, or the last before it; -1 before the first. */
const strokeAt = (time) => data.strokes.findLastIndex(([start]) => start <= time);

let now = 0, playing = false;

// --- pictures ----------------------------------------------------------------------------------------------------
/** All pictures share a camera, which goes round the world's z; `rows` are the viewer's right, up and back. */
const camera = {
  centre: [0, 0, 0], radius: 1e-3, zoom: 1, around: 0, above: 0, rows: [],
  scale(width, height) { return (0.5 * Math.min(width, height) * this.zoom) / this.radius; },
  reset() {
    const low = [Infinity, Infinity, Infinity], high = low.map((x) => -x);
    const take = (points, step) => {
      for (let i = 0; i < points.length; i += step)
        for (let d = 0; d < 3; ++d) {
          low[d] = Math.min(low[d], points[i + d]);
          high[d] = Math.max(high[d], points[i + d]);
        }
    };
    if (meshes.length) meshes.forEach((m) => take(m.points, 3));
    else take(frames.subarray(1), kColumns);
    if (low[0] <= high[0]) {
      this.centre = low.map((l, d) => (l + high[d]) / 2);
      this.radius = Math.max(Math.hypot(...low.map((l, d) => high[d] - l)) / 2, 4 * data.tool.tip_radius);
    }
    this.zoom = 1.15;
    // From the side of the handle, but beside it, so that the shaft does not hide the burr.
    const handle = [0, 0, 0];
    for (let i = 0; i < count; ++i) for (let d = 0; d < 3; ++d) handle[d] += frame(i)[4 + d];
    this.around = Math.atan2(handle[1], handle[0]);
    this.above = 0.75 * Math.atan2(handle[2], Math.hypot(handle[0], handle[1]));
    this.turn(0.9, 0);
  },
  turn(around, above) {
    this.around += around;
    this.above = Math.min(Math.max(this.above + above, -1.5), 1.5);
    const [ca, sa, ce, se] = [Math.cos(this.around), Math.sin(this.around), Math.cos(this.above), Math.sin(this.above)];
    this.rows = [[-sa, ca, 0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]];
  },
};

class Picture {
  constructor(title, bone) {
    const figure = document.createElement("figure"), caption = document.createElement("figcaption");
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.title = caption.textContent = title;
    this.bone = bone;
    figure.append(caption, this.canvas);
    byId("views").append(figure);
  }
  /** Bone and structures, which change with the camera alone. */
  drawBone(sharp) {
    const width = Math.round(this.canvas.clientWidth * sharp), height = Math.round(this.canvas.clientHeight * sharp);
    if (!(width > 0 && height > 0)) return;
    if (!this.still || this.still.width !== width || this.still.height !== height)
      [this.still, this.layer, this.seen] = [0, 1, 2].map(() => new Layer(width, height));
    this.still.clear();
    this.layer.clear();
    if (this.bone) this.still.draw(this.bone, camera, rgb("--bone"));
    for (const s of structures) this.layer.draw(s, camera, s.colour);
    this.still.lay(this.layer, 0.28);
  }
  /** All of the present moment. */
  draw() {
    if (!this.still) return;
    const { width, height } = this.still, f = frame(frameAt(now));
    this.seen.copy(this.still);
    if (!byId("hides").checked && count > 0) {
      this.layer.clear().draw(moved(tool, f.subarray(4, 7), f.subarray(1, 4)), camera, rgb("--steel"));
      this.seen.lay(this.layer, 0.35);
    }
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const context = this.canvas.getContext("2d", { willReadFrequently: true }); // its pixels are ours, not a card's
    context.putImageData(new ImageData(new Uint8ClampedArray(this.seen.colour.buffer), width, height), 0, 0);
    this.drawPath(context);
    this.canvas.setAttribute("aria-label", `${this.title}, with structures, tool and the path of the stroke at ${now.toFixed(2)} s`);
  }
  drawPath(context) {
    const stroke = data.strokes[strokeAt(now)];
    if (!stroke) return;
    const { width, height } = this.still, scale = camera.scale(width, height), { rows, centre } = camera;
    const end = Math.min(now, stroke[0] + stroke[1]);
    context.beginPath();
    for (let i = frameAt(stroke[0]); i < count && frames[kColumns * i] <= end; ++i) {
      const p = [1, 2, 3].map((d) => frames[kColumns * i + d] - centre[d - 1]);
      context.lineTo(width / 2 + scale * dot(rows[0], p), height / 2 - scale * dot(rows[1], p));
    }
    context.lineJoin = context.lineCap = "round";
    for (const [colour, pixels] of [["--card", 4], ["--accent", 2]]) {
      context.strokeStyle = style(colour);
      context.lineWidth = pixels * (width / this.canvas.clientWidth);
      context.stroke();
    }
  }
}

const before = meshes.find((m) => m.kind === "before"), after = meshes.find((m) => m.kind === "after");
const pictures = [];
if (before) pictures.push(new Picture(after ? "Before" : "Bone before the session", before));
if (after) pictures.push(new Picture(before ? "After" : "Bone after the session", after));
if (!pictures.length) pictures.push(new Picture(structures.length ? "Structures and tool" : "Tool", null));

let wanted = 0; // sharpness of the next picture; 0: it stays
function redraw(sharp) {
  wanted = Math.max(wanted, sharp);
  if (redraw.waits) return;
  redraw.waits = true;
  requestAnimationFrame(() => {
    redraw.waits = false;
    if (wanted) for (const p of pictures) p.drawBone(wanted);
    wanted = 0;
    for (const p of pictures) p.draw();
  });
}
const sharply = () => redraw(Math.max(2, Math.min(3, devicePixelRatio)));
/** Draws coarsely while the camera moves, and sharply when it rests. */
function turned() {
  redraw(1);
  clearTimeout(turned.timer);
  turned.timer = setTimeout(sharply, 200);
}

const pointers = new Map();
for (const { canvas } of pictures) {
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    pointers.set(e.pointerId, [e.clientX, e.clientY]);
  });
  canvas.addEventListener("pointermove", (e) => {
    const last = pointers.get(e.pointerId);
    if (!last) return;
    const apart = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]) || 1; };
    if (pointers.size === 2) {
      const was = apart();
      pointers.set(e.pointerId, [e.clientX, e.clientY]);
      camera.zoom *= apart() / was;
    } else {
      camera.turn((last[0] - e.clientX) * 0.008, (e.clientY - last[1]) * 0.008);
      pointers.set(e.pointerId, [e.clientX, e.clientY]);
    }
    turned();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => pointers.delete(e.pointerId));
  canvas.addEventListener("wheel", (e) => {
    if (document.activeElement !== canvas) return; // the page scrolls
    e.preventDefault();
    camera.zoom *= Math.exp(-0.001 * e.deltaY);
    turned();
  }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const actions = {
      ArrowLeft: () => camera.turn(0.1, 0), ArrowRight: () => camera.turn(-0.1, 0),
      ArrowUp: () => camera.turn(0, -0.1), ArrowDown: () => camera.turn(0, 0.1),
      "+": () => (camera.zoom *= 1.2), "=": () => (camera.zoom *= 1.2), "-": () => (camera.zoom /= 1.2), 0: () => camera.reset(),
    };
    if (!actions[e.key] || e.ctrlKey || e.metaKey) return;
    e.preventDefault();
    actions[e.key]();
    turned();
  });
}

// --- plots -------------------------------------------------------------------------------------------------------
function svg(name, attributes, parent, text) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  parent.append(node);
  return node;
}
/** A step of 1, 2 or 5 that divides a range into at most `most` parts. */
function niceStep(range, most) {
  const power = 10 ** Math.floor(Math.log10(range / most || 1));
  return [1, 2, 5, 10].map((m) => m * power).find((s) => range / s <= most);
}
const label = (value, step) => value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));

class Chart {
  constructor(series) {
    this.series = series;
    const box = document.createElement("div"), title = document.createElement("h3");
    box.className = "chart";
    title.textContent = series.unit ? `${series.name} [${series.unit}]` : series.name;
    this.svg = svg("svg", { role: "img" }, box);
    const known = series.high.filter((v) => v !== null);
    this.svg.setAttribute("aria-label", `${title.textContent} over time; greatest ${known.length ? +Math.max(...known).toPrecision(3) : "unknown"}`);
    box.prepend(title);
    byId("charts").append(box);
    const seek = (e) => setTime(((e.clientX - this.svg.getBoundingClientRect().left - this.left) / this.width) * data.duration);
    this.svg.addEventListener("pointerdown", (e) => { this.svg.setPointerCapture(e.pointerId); seek(e); });
    this.svg.addEventListener("pointermove", (e) => { if (e.buttons) seek(e); });
  }
  x(time) { return this.left + (time / (data.duration || 1)) * this.width; }
  draw() {
    const { low, high, flat } = this.series, full = this.svg.clientWidth;
    if (!full) return;
    const marks = this.series.marks, top = marks ? 16 : 6, tall = flat ? 26 : 96, bottom = top + tall;
    this.left = 42;
    this.width = full - this.left - 8;
    this.svg.replaceChildren();
    this.words = [];
    this.svg.setAttribute("viewBox", `0 0 ${full} ${bottom + 20}`);
    const known = [...low, ...high].filter((v) => v !== null);
    let least = Math.min(0, ...known), most = Math.max(0, ...known);
    if (most === least) most = least + 1;
    const step = niceStep(most - least, 4);
    [least, most] = flat ? [0, 1] : [Math.floor(least / step + 1e-9) * step, Math.ceil(most / step - 1e-9) * step];
    const y = (v) => bottom - ((v - least) / (most - least)) * tall;
    for (const [start, length] of data.strokes)
      svg("rect", { class: "stroke", x: this.x(start), width: Math.max(0.5, this.x(start + length) - this.x(start)), y: top, height: tall }, this.svg);
    for (let v = least; !flat && v <= most + step / 2; v += step) {
      svg("line", { class: Math.abs(v) < step / 2 ? "zero" : "grid", x1: this.left, x2: this.left + this.width, y1: y(v), y2: y(v) }, this.svg);
      svg("text", { x: this.left - 6, y: y(v) + 4, "text-anchor": "end" }, this.svg, label(v, step).replace("-", "−"));
    }
    const seconds = niceStep(data.duration || 1, Math.max(3, this.width / 75));
    for (let s = 0; s <= data.duration + 1e-9; s += seconds)
      svg("text", { x: this.x(s), y: bottom + 15, "text-anchor": "middle" }, this.svg, label(s, seconds) + (s === 0 ? " s" : ""));
    // A band from the least to the greatest of each interval, in the runs that have values.
    const at = (i) => this.x(((i + 0.5) / high.length) * data.duration);
    for (let i = 0; i < high.length; ++i) {
      if (high[i] === null) continue;
      const first = i;
      while (i + 1 < high.length && high[i + 1] !== null) ++i;
      let path = "";
      for (let k = first; k <= i; ++k) path += `${path ? "L" : "M"}${at(k).toFixed(1)} ${y(high[k]).toFixed(1)}`;
      for (let k = i; k >= first; --k) path += `L${at(k).toFixed(1)} ${y(flat ? 0 : low[k]).toFixed(1)}`;
      svg("path", { class: "area", d: path + "Z" }, this.svg);
    }
    if (this.series.limit !== undefined && this.series.limit !== null) {
      svg("line", { class: "limit", x1: this.left, x2: this.left + this.width, y1: y(this.series.limit), y2: y(this.series.limit) }, this.svg);
      high.forEach((v, i) => { if (v > this.series.limit) svg("rect", { class: "over", x: at(i) - 1, width: 2, y: top - 4, height: 4 }, this.svg); });
    }
    for (const [time, text] of data.gaps) {
      svg("line", { class: "gap", x1: this.x(time), x2: this.x(time), y1: top, y2: bottom }, this.svg);
      if (marks) this.mark("missing", time, text);
    }
    for (const [time, text] of data.events) {
      svg("line", { class: "event", x1: this.x(time), x2: this.x(time), y1: top, y2: bottom }, this.svg);
      if (marks) this.mark("mark", time, text);
    }
    this.head = svg("line", { class: "head", y1: top - 2, y2: bottom + 2 }, this.svg);
    this.move();
  }
  /** A word over the plot, unless it would cover the last one. */
  mark(kind, time, text) {
    const half = 3.2 * text.length, x = Math.min(Math.max(this.x(time), half), this.left + this.width - half);
    if (this.words.some((other) => Math.abs(other.x - x) < other.half + half)) return;
    this.words.push({ x, half });
    svg("text", { class: kind, x, y: 10, "text-anchor": "middle" }, this.svg, text);
  }
  move() {
    if (!this.head) return;
    this.head.setAttribute("x1", this.x(now));
    this.head.setAttribute("x2", this.x(now));
  }
}
const charts = data.series.map((series) => new Chart(series));

// --- player ------------------------------------------------------------------------------------------------------
const slider = byId("time");
slider.max = data.duration;

function describe() {
  const [time, , , , , , , force, distance, removed, spindle] = frame(frameAt(now)), stroke = strokeAt(now);
  const runs = stroke >= 0 && now <= data.strokes[stroke][0] + data.strokes[stroke][1];
  return [
    `${now.toFixed(2)} s of ${data.duration.toFixed(2)} s`,
    runs ? `stroke ${stroke + 1} of ${data.strokes.length}` : "between strokes",
    `${force.toFixed(2)} N`,
    `${removed.toFixed(1)} mm³ removed`,
    Number.isFinite(distance) ? `${(1e3 * distance).toFixed(1)} mm from a structure` : "",
    spindle ? "spindle on" : "spindle off",
  ].filter(Boolean).join(" · ").replace("-", "−");
}
function setTime(time) {
  now = Math.min(Math.max(time, 0), data.duration);
  slider.value = now;
  byId("now").value = count ? describe() : "no ticks";
  slider.setAttribute("aria-valuetext", count ? describe() : "no ticks");
  charts.forEach((c) => c.move());
  redraw(0);
}
function play(on) {
  playing = on && count > 0;
  byId("play").textContent = playing ? "Pause" : "Play";
  if (!playing) return;
  if (now >= data.duration) setTime(0);
  let last = performance.now();
  const step = (time) => {
    if (!playing) return;
    setTime(now + (Math.max(0, time - last) / 1e3) * Number(byId("speed").value));
    last = time;
    if (now >= data.duration) play(false);
    else requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}
function stepStroke(by) {
  const starts = data.strokes.map(([start]) => start), margin = 1e-6;
  const to = by > 0 ? starts.find((s) => s > now + margin) : starts.findLast((s) => s < now - margin);
  if (to !== undefined) setTime(to);
}
slider.addEventListener("input", () => setTime(slider.valueAsNumber));
byId("play").addEventListener("click", () => play(!playing));
byId("back").addEventListener("click", () => stepStroke(-1));
byId("on").addEventListener("click", () => stepStroke(1));
byId("hides").addEventListener("change", () => redraw(0));
document.addEventListener("keydown", (e) => {
  if (e.ctrlKey || e.metaKey || e.altKey || ["BUTTON", "SELECT"].includes(e.target.tagName) || e.target.type === "checkbox") return;
  const action = { " ": () => play(!playing), j: () => stepStroke(-1), l: () => stepStroke(1) }[e.key.toLowerCase()];
  if (!action) return;
  e.preventDefault();
  action();
});

// --- start -------------------------------------------------------------------------------------------------------
const keys = document.createElement("ul");
keys.className = "keys";
for (const s of structures) {
  const item = document.createElement("li"), icon = svg("svg", { viewBox: "0 0 10 10", "aria-hidden": "true" }, item);
  svg("rect", { width: 10, height: 10, rx: 2, fill: `rgb(${s.colour.map(Number)})` }, icon);
  item.append(s.name);
  keys.append(item);
}
if (structures.length) byId("views").after(keys);
const drawAll = () => { charts.forEach((c) => c.draw()); sharply(); };
const fromHash = () => { const t = /^#t=([\d.]+)$/.exec(location.hash); if (t) setTime(Number(t[1])); };
camera.reset();
setTime(0);
fromHash();
addEventListener("hashchange", fromHash);
addEventListener("resize", drawAll);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
drawAll();
