// SPDX-License-Identifier: MIT

/// Draws values over time: each column shows the largest of the samples that it covers. `top` is the least upper end.
/// Returns the greatest value.
export function plot(canvas, triples, which, scale, top, colour) {
  const ratio = Math.min(devicePixelRatio, 2);
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const c = canvas.getContext("2d");
  c.clearRect(0, 0, width, height);
  const count = triples.length / 3;
  let most = 0;
  for (let i = 0; i < count; ++i) most = Math.max(most, triples[3 * i + which] * scale || 0);
  const full = 1.08 * Math.max(top, most), columns = Math.min(width, count);
  c.beginPath();
  for (let x = 0; x < columns; ++x) {
    let v = 0;
    const end = Math.floor(((x + 1) * count) / columns);
    for (let i = Math.floor((x * count) / columns); i < end; ++i) v = Math.max(v, triples[3 * i + which] * scale || 0);
    c.lineTo((x * width) / Math.max(1, columns - 1), height - ratio - (v / full) * (height - 2 * ratio));
  }
  c.strokeStyle = colour;
  c.lineWidth = 1.25 * ratio;
  c.lineJoin = "round";
  c.stroke();
  return most;
}
