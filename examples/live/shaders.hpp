// SPDX-License-Identifier: MIT
#pragma once

/// The shaders, without `gl::kShaderHeader`: GLSL 3.30 and GLSL ES 3.00 at once. Lengths are millimetres in G; u is a
/// place in voxels.
namespace live::shaders {

/// A triangle that covers the picture.
inline constexpr const char* kWholePicture = R"(out vec2 at;
void main() {
  at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(at, 0.0, 1.0);
}
)";

/// Defines for the text below: with structures or without.
inline constexpr const char* kPlain = "";
inline constexpr const char* kWithStructures = "#define STRUCTURES\n";

/// Casts a ray a pixel into bone and tool, and shades what it meets.
inline constexpr const char* kRayCast = R"(in vec2 at;
layout(location = 0) out vec4 colour;

uniform sampler3D densities;
uniform usampler3D distances;  // bricks to the nearest one with bone
uniform sampler3D shares;      // of bone; of bone that was cut
uniform vec3 size;             // voxels
uniform vec3 per_mm;           // voxels
uniform float voxel;           // smallest spacing
uniform float isovalue;        // of `gl::kShortUnit`
uniform float densest;         // above it
uniform ivec3 bricks;

uniform vec3 eye, right, up, back;  // right and up are as long as half the picture at a depth of 1
uniform vec2 jitter;                // of the ray, in units of `at`
uniform vec2 depth_range;           // near and far plane
uniform float pixel;                // width at a depth of 1
uniform float stride;               // of the ray in bone's bricks, voxels
uniform bool fine;                  // the picture stands still: shadows and wider normals
uniform vec4 clip;                  // plane: what has dot(clip.xyz, p) > clip.w is left out; off where clip is 0
uniform vec3 to_key;                // toward the key light

struct Tool { mat3 axes; vec3 tip; };  // axes of T as columns
uniform Tool tool, ghost, tube;
uniform vec2 tube_size;  // of the second hand's tube, rounded at its tip: radius and length; 0: none
uniform vec3 burr;      // radius of the ball, radius and length of the shaft
uniform float spin;     // angle of the burr's flutes
// Another tool: the pieces of its outline in the half plane (rho, z), as `trephine::ToolOutline` has them. 0: the burr.
uniform int pieces;
uniform vec4 ends[24];     // where a piece starts and ends
uniform vec4 arcs[24];     // centre and radius of an arc, and 1 or -1 where it bulges outward or inward; 0: a line
uniform vec4 middles[24];  // direction of an arc's middle, cosine of half its angle
uniform vec4 shape;        // lowest and highest z, largest rho, z up to which there are flutes
uniform float flutes;      // round the head; 0: diamond
uniform float ghostly;  // opacity of the ghost, 0: none
uniform bool flat_shading;  // for tests: bone white, structures in their colours, all else black

#ifdef STRUCTURES
uniform sampler3D structure_distances;   // to what is left of structures; to the whole of them; in mm / range
uniform usampler3D structure_numbers;    // of the nearest structure
uniform sampler2D structure_colours;     // by number
uniform vec3 structure_size;             // samples
uniform mat3 to_samples;                 // from mm in G to samples ...
uniform vec3 first_sample;               // ... and the place of G's origin among them
uniform float structure_range;           // mm
uniform float structure_voxel;           // smallest spacing of samples, mm
uniform float structure_margin;          // mm
#endif

const vec3 kBone = vec3(0.83, 0.74, 0.58);
const vec3 kCut = vec3(0.86, 0.60, 0.50);
const vec3 kGhost = vec3(0.25, 0.55, 1.0);

float above(vec3 u) { return texture(densities, (u + 0.5) / size).r - isovalue; }

/// Distances along a ray between which it is in the volume.
vec2 through_volume(vec3 origin, vec3 direction) {
  vec3 safe = mix(direction, vec3(1e-9), lessThan(abs(direction), vec3(1e-9)));
  vec3 a = -origin / safe, b = ((size - 1.0) / per_mm - origin) / safe;
  vec3 enter = min(a, b), leave = max(a, b);
  return vec2(max(enter.x, max(enter.y, enter.z)), min(leave.x, min(leave.y, leave.z)));
}

/// Outward, of the volume's face at p.
vec3 border_normal(vec3 p) {
  vec3 q = 2.0 * p * per_mm / (size - 1.0) - 1.0, off = abs(q);
  if (off.x >= off.y && off.x >= off.z) return vec3(sign(q.x), 0.0, 0.0);
  return off.y >= off.z ? vec3(0.0, sign(q.y), 0.0) : vec3(0.0, 0.0, sign(q.z));
}

/// Distance along the ray to bone within [from, to], which lies in the volume, or -1. Loops are bounded: a driver
/// cannot be stopped. The outer one goes from brick to brick, the inner one through a brick that holds bone.
float first_bone(vec3 origin, vec3 direction, float from, float to) {
  vec3 u0 = origin * per_mm, du = direction * per_mm;
  du = mix(du, vec3(1e-9), lessThan(abs(du), vec3(1e-9)));
  vec3 inverse = 1.0 / du;
  float step_mm = stride * voxel;
  float t = from, before = from, r = -1.0, s = -1.0;
  for (int i = 0; i < 384 && t < to && s < 0.0; ++i) {
    vec3 u = u0 + du * t;
    ivec3 b = clamp(ivec3(floor(u / 8.0)), ivec3(0), bricks - 1);
    float d = float(texelFetch(distances, b, 0).r);
    float cube = max(d, 1.0);
    vec3 lo = (vec3(b) - (cube - 1.0)) * 8.0, hi = (vec3(b) + cube) * 8.0;
    vec3 leave = (mix(lo, hi, greaterThan(du, vec3(0.0))) - u0) * inverse;
    float end = min(min(leave.x, min(leave.y, leave.z)) + 2e-3, to);
    if (d < 0.5) {
      s = above(u);
      before = t;
      for (int k = 0; k < 48 && t < end && s < 0.0; ++k) {
        r = s;
        before = t;
        t = min(t + step_mm, end);
        s = above(u0 + du * t);
      }
    } else {
      t = max(end, t + 2e-3);
    }
    if (d < 0.5 && s < 0.0) t = max(end, t + 2e-3);
  }
  if (s < 0.0) return -1.0;
  // The crossing by false position, then halving what is left.
  float a = before, c = t;
  for (int k = 0; k < 4; ++k) {
    float middle = k < 2 ? a + (c - a) * clamp(r / (r - s), 0.02, 0.98) : 0.5 * (a + c);
    float m = above(u0 + du * middle);
    if (m >= 0.0) {
      c = middle;
      s = m;
    } else {
      a = middle;
      r = m;
    }
  }
  return a + (c - a) * clamp(r / (r - s), 0.0, 1.0);
}

#ifdef STRUCTURES
/// Signed distances at v, in samples, to what is left and to the whole [mm].
vec2 to_structures(vec3 v) { return structure_range * texture(structure_distances, (v + 0.5) / structure_size).rg; }

bool among_samples(vec3 v) {
  return all(greaterThanEqual(v, vec3(0.0))) && all(lessThanEqual(v, structure_size - 1.0));
}

/// Colour of the structure nearest to v, sRGB.
vec3 structure_colour(vec3 v) {
  ivec3 i = clamp(ivec3(v + 0.5), ivec3(0), ivec3(structure_size) - 1);
  return texelFetch(structure_colours, ivec2(int(texelFetch(structure_numbers, i, 0).r), 0), 0).rgb;
}

/// Distance along the ray to what is left of structures within [from, to], or -1. Steps are as long as the distance
/// allows; the loop is bounded.
float first_structure(vec3 origin, vec3 direction, float from, float to) {
  vec3 o = to_samples * origin + first_sample, d = to_samples * direction;
  d = mix(d, vec3(1e-9), lessThan(abs(d), vec3(1e-9)));
  vec3 a = -o / d, b = (structure_size - 1.0 - o) / d;
  vec3 enter = min(a, b), leave = max(a, b);
  float t = max(from, max(enter.x, max(enter.y, enter.z)));
  float end = min(to, min(leave.x, min(leave.y, leave.z)));
  for (int i = 0; i < 128 && t <= end; ++i) {
    float s = to_structures(o + t * d).r;
    if (s < 0.02 * structure_voxel) return t;
    t += max(0.95 * s, 0.08 * structure_voxel);
  }
  return -1.0;
}

/// Outward, of what is left.
vec3 structure_normal(vec3 p) {
  vec3 v = to_samples * p + first_sample, e = vec3(1.0, 0.0, 0.0);
  vec3 g = vec3(to_structures(v + e.xyy).r - to_structures(v - e.xyy).r, to_structures(v + e.yxy).r - to_structures(v - e.yxy).r,
                to_structures(v + e.yyx).r - to_structures(v - e.yyx).r);
  return normalize(g * to_samples + vec3(1e-9));
}

/// How far bone at p is a structure's, 0..1: 1 where it lies in the structure, and less within its margin.
float share_of_structure(vec3 p, bool on_section, out vec3 srgb) {
  vec3 v = to_samples * p + first_sample;
  srgb = vec3(0.0);
  if (!among_samples(v)) return 0.0;
  float s = to_structures(v).g;
  if (s > structure_margin) return 0.0;
  srgb = structure_colour(v);
  // A surface laid bare is known to a part of a voxel.
  float bare = on_section ? step(s, 0.0) : 1.0 - smoothstep(0.15 * voxel, 0.45 * voxel, s);
  return max(bare, 0.35 * (1.0 - s / structure_margin));
}
#endif

vec3 gradient(vec3 u, float h) {
  vec3 e = vec3(h, 0.0, 0.0);
  return vec3(above(u + e.xyy) - above(u - e.xyy), above(u + e.yxy) - above(u - e.yxy),
              above(u + e.yyx) - above(u - e.yyx)) * per_mm / voxel;
}

/// Outward, over a reach that hides single voxels, and from afar the scan's slices.
vec3 bone_normal(vec3 p, float t) {
  vec3 u = p * per_mm;
  float reach = clamp(2.5 * pixel * t / voxel, 1.0, 4.0);
  vec3 g = gradient(u, reach);
  if (fine) g += 0.7 * gradient(u, 2.0 * reach);
  return -normalize(g + vec3(1e-9));
}

float share_of_bone(vec3 p, float level) {
  return textureLod(shares, (p * per_mm + 0.5) / (vec3(bricks) * 8.0), level).r;
}

/// How much of the sky over p is free, 0..1: bone in three balls that grow with their distance.
float open_sky(vec3 p, vec3 n) {
  float s = 0.30 * share_of_bone(p + n * 2.2 * voxel, 0.0) + 0.40 * share_of_bone(p + n * 5.0 * voxel, 1.0) +
            0.50 * share_of_bone(p + n * 11.0 * voxel, 2.0);
  return clamp(1.08 - 1.25 * s, 0.0, 1.0);
}

/// Distances along a ray at which it meets a ball; x > y: it does not.
vec2 through_ball(vec3 o, vec3 d, float r) {
  float b = dot(o, d), q = b * b - dot(o, o) + r * r;
  if (q < 0.0) return vec2(1.0, -1.0);
  return vec2(-b - sqrt(q), -b + sqrt(q));
}

/// Signed distance of (rho, z) to the outline.
float to_outline(vec2 p) {
  float best = 1e12;
  bool inside = false;
  for (int i = 0; i < pieces; ++i) {
    vec4 e = ends[i], c = arcs[i];
    bool level = p.y >= e.y && p.y < e.w;
    if (c.w == 0.0) {
      vec2 along = e.zw - e.xy, q = p - e.xy;
      vec2 off = q - along * clamp(dot(q, along) / dot(along, along), 0.0, 1.0);
      best = min(best, dot(off, off));
      if (level && q.x * along.y - q.y * along.x < 0.0) inside = !inside;
    } else {
      vec2 q = p - c.xy, m = middles[i].xy;
      float l = length(q);
      bool within = dot(q, m) >= middles[i].z * l;
      vec2 off = p - ((m.x * q.y - m.y * q.x) * c.w > 0.0 ? e.zw : e.xy);
      best = min(best, within ? (l - c.z) * (l - c.z) : dot(off, off));
      bool before = q.x < 0.0, in_circle = l < c.z;
      if (level && (c.w > 0.0 ? before || in_circle : before && !in_circle)) inside = !inside;
    }
  }
  return inside ? -sqrt(best) : sqrt(best);
}

/// The part of a ray that lies in the outline's cylinder, widened by `more`; x > y: none.
vec2 through_cylinder(vec3 o, vec3 d, float more) {
  float r = shape.z + more, a = max(dot(d.xy, d.xy), 1e-9), b = dot(o.xy, d.xy), c = dot(o.xy, o.xy) - r * r;
  float q = b * b - a * c;
  if (q < 0.0) return vec2(1.0, -1.0);
  float z = abs(d.z) > 1e-6 ? d.z : 1e-6;
  float low = (shape.x - more - o.z) / z, high = (shape.y + more - o.z) / z;
  return vec2(max((-b - sqrt(q)) / a, min(low, high)), min((-b + sqrt(q)) / a, max(low, high)));
}

/// Meets the outline's body in T, as `through_tool` does; steps are as long as the distance. The loop is bounded.
float through_outline(vec3 o, vec3 d, out vec3 n, out bool on_head) {
  n = vec3(0.0, 0.0, 1.0);
  on_head = false;
  vec2 part = through_cylinder(o, d, 0.01);
  float t = max(part.x, 0.0);
  for (int i = 0; i < 96 && t <= part.y; ++i) {
    vec3 p = o + t * d;
    vec2 q = vec2(length(p.xy), p.z);
    float s = to_outline(q);
    if (s < 0.002) {
      const float e = 0.004;
      vec2 g = vec2(to_outline(q + vec2(e, 0.0)) - to_outline(q - vec2(e, 0.0)),
                    to_outline(q + vec2(0.0, e)) - to_outline(q - vec2(0.0, e)));
      g = normalize(g + vec2(1e-9));
      n = vec3(q.x > 1e-4 ? g.x * p.xy / q.x : vec2(0.0), g.y);
      on_head = p.z <= shape.w;
      return t;
    }
    t += s;
  }
  return -1.0;
}

/// Meets ball and shaft in T; returns the distance or -1, with the outward normal.
float through_tool(vec3 o, vec3 d, out vec3 n, out bool on_ball) {
  if (pieces > 0) return through_outline(o, d, n, on_ball);
  float best = 1e9;
  on_ball = false;
  n = vec3(0.0, 0.0, 1.0);
  vec2 ball = through_ball(o, d, burr.x);
  if (ball.x <= ball.y && ball.x > 0.0) {
    best = ball.x;
    n = (o + best * d) / burr.x;
    on_ball = true;
  }
  float a = dot(d.xy, d.xy), b = dot(o.xy, d.xy), c = dot(o.xy, o.xy) - burr.y * burr.y;
  float q = b * b - a * c;
  if (q >= 0.0 && a > 1e-12) {
    float t = (-b - sqrt(q)) / a;
    float z = o.z + t * d.z;
    if (t > 0.0 && t < best && z > 0.0 && z < burr.z) {
      best = t;
      n = vec3((o.xy + t * d.xy) / burr.y, 0.0);
      on_ball = false;
    }
  }
  if (abs(d.z) > 1e-9) {
    float t = (burr.z - o.z) / d.z;
    vec2 p = o.xy + t * d.xy;
    if (t > 0.0 && t < best && dot(p, p) < burr.y * burr.y) {
      best = t;
      n = vec3(0.0, 0.0, 1.0);
      on_ball = false;
    }
  }
  return best < 1e8 ? best : -1.0;
}

/// Meets the tube in its own frame, likewise.
float through_tube(vec3 o, vec3 d, out vec3 n) {
  n = vec3(0.0, 0.0, 1.0);
  float best = 1e9;
  vec2 ball = through_ball(o, d, tube_size.x);
  if (ball.x <= ball.y && ball.x > 0.0 && o.z + ball.x * d.z < 0.0) {
    best = ball.x;
    n = (o + best * d) / tube_size.x;
  }
  float a = dot(d.xy, d.xy), b = dot(o.xy, d.xy), c = dot(o.xy, o.xy) - tube_size.x * tube_size.x;
  float q = b * b - a * c;
  if (q >= 0.0 && a > 1e-12) {
    float t = (-b - sqrt(q)) / a;
    float z = o.z + t * d.z;
    if (t > 0.0 && t < best && z >= 0.0 && z < tube_size.y) {
      best = t;
      n = vec3((o.xy + t * d.xy) / tube_size.x, 0.0);
    }
  }
  return best < 1e8 ? best : -1.0;
}

/// Share of the key light at p that the tool lets through; soft, the softer the farther away.
float past_tool(vec3 p) {
  vec3 o = (p - tool.tip) * tool.axes, d = to_key * tool.axes;
  if (pieces > 0) {
    vec2 part = through_cylinder(o, d, 1.0);
    float open = 1.0, s = max(part.x, 0.0);
    for (int i = 0; i < 24 && s <= part.y && open > 0.0; ++i) {
      float gap = to_outline(vec2(length(o.xy + s * d.xy), o.z + s * d.z));
      open = min(open, smoothstep(-0.15, 0.10 * s + 0.15, gap + 0.02));
      s += max(gap, 0.15);
    }
    return open;
  }
  float t = max(-dot(o, d), 0.0);
  float gap = length(o + t * d) - burr.x;
  float light = smoothstep(-0.15, 0.10 * t + 0.15, gap + 0.02);
  // Nearest approach of the ray and the shaft's axis.
  float along = d.z, w = 1.0 - along * along;
  float s = w > 1e-6 ? clamp((along * o.z - dot(o, d)) / w, 0.0, 200.0) : 0.0;
  float z = clamp(o.z + s * along, 0.0, burr.z);
  s = max(dot(vec3(0.0, 0.0, z) - o, d), 0.0);
  float apart = length(o + s * d - vec3(0.0, 0.0, z)) - burr.y;
  return light * smoothstep(-0.15, 0.10 * s + 0.15, apart + 0.02);
}

vec3 sky(vec3 d) {
  float h = dot(d, normalize(up));
  return mix(vec3(0.10, 0.11, 0.13), vec3(0.95, 0.97, 1.0), smoothstep(-0.6, 0.9, h));
}

vec3 lit(vec3 albedo, vec3 n, vec3 v, float key, float open, float gloss) {
  vec3 fill = normalize(back + 0.6 * normalize(right));
  vec3 light = vec3(1.22, 1.16, 1.06) * key * max(dot(n, to_key), 0.0) + vec3(0.26, 0.30, 0.36) * open * max(dot(n, fill), 0.0) +
               mix(vec3(0.10, 0.085, 0.08), vec3(0.36, 0.38, 0.42), 0.5 + 0.5 * dot(n, normalize(up))) * open;
  vec3 h = normalize(to_key - v);
  float shine = pow(max(dot(n, h), 0.0), 60.0) * key;
  float rim = pow(1.0 - max(dot(n, -v), 0.0), 4.0);
  return albedo * light + gloss * (0.55 * shine + 0.10 * rim * open) * vec3(1.0, 0.98, 0.95);
}

vec3 steel(vec3 n_T, vec3 p_T, vec3 v, bool on_ball) {
  float dark = 1.0;
  if (on_ball && pieces > 0 && flutes > 0.0) {
    // Edges that wind round the head, and hardly a disc's or a flat end's.
    float wind = flutes < 3.0 ? 0.9 : 0.35;
    float around = atan(p_T.y, p_T.x) - spin + wind * p_T.z / max(burr.x, 0.1);
    float depth = (1.0 - n_T.z * n_T.z) * smoothstep(0.05, 0.5, length(p_T.xy) / burr.x);
    vec3 tangent = normalize(vec3(-p_T.y, p_T.x, 1e-6));
    n_T = normalize(n_T + 0.55 * depth * cos(flutes * around) * tangent);
    dark = mix(1.0, 0.45 + 0.55 * smoothstep(-0.7, 0.5, sin(flutes * around)), depth);
  } else if (on_ball && pieces > 0) {
    // Diamond grains.
    vec3 cell = floor(vec3(atan(p_T.y, p_T.x) - spin, p_T.z, length(p_T.xy)) * vec3(9.0, 9.0, 9.0));
    vec3 grain = fract(sin(vec3(dot(cell, vec3(12.9, 78.2, 37.7)), dot(cell, vec3(39.3, 11.1, 83.2)),
                                dot(cell, vec3(73.1, 52.2, 9.2)))) * 43758.5);
    n_T = normalize(n_T + 0.7 * (grain - 0.5));
    dark = 0.75;
  } else if (on_ball) {
    // Eight flutes that wind round the ball, deepest at its equator and gone at the tip.
    float around = atan(n_T.y, n_T.x) - spin + 1.6 * n_T.z;
    float blade = sin(8.0 * around);
    vec3 tangent = normalize(vec3(-n_T.y, n_T.x, 1e-6));
    float depth = 1.0 - n_T.z * n_T.z;
    n_T = normalize(n_T + 0.55 * depth * cos(8.0 * around) * tangent);
    dark = mix(1.0, 0.45 + 0.55 * smoothstep(-0.7, 0.5, blade), depth);
  }
  vec3 n = tool.axes * n_T;
  vec3 r = reflect(v, n);
  vec3 c = 0.75 * sky(r) * vec3(0.80, 0.83, 0.88) + 0.10;
  c += pow(max(dot(r, to_key), 0.0), 40.0) * vec3(1.0, 0.97, 0.9);
  return c * dark;
}

void main() {
  vec2 screen = at + jitter;
  vec3 d = normalize(screen.x * right + screen.y * up - back);
  float facing = dot(d, -back);
  colour = vec4(mix(vec3(0.055, 0.065, 0.080), vec3(0.16, 0.18, 0.21), 0.5 - 0.5 * screen.y), 1.0);
  float depth = 1.0;
#ifdef STRUCTURES
  vec3 flat_colour = vec3(1.0);
#endif

  // Through the volume's box, and through what the clip plane leaves.
  vec2 inside = through_volume(eye, d);
  float from = max(inside.x, depth_range.x / facing), to = inside.y;
  bool clipped = false;
  if (dot(clip.xyz, clip.xyz) > 0.0) {
    float side = dot(clip.xyz, eye) - clip.w, rate = dot(clip.xyz, d);
    float t = -side / rate;
    if (side > 0.0 && (rate >= 0.0 || t > from)) { from = rate < 0.0 ? t : 1e9; clipped = true; }
    if (side <= 0.0 && rate > 0.0) to = min(to, t);
  }
  float bone = from < to ? first_bone(eye, d, from, to) : -1.0;

  // What lies foremost of bone and structures.
  float surface = bone;
  // Bone that the volume's border cuts off looks as bone cut open.
  bool at_border = !clipped && from == inside.x && bone <= from + 1e-4;
  bool on_section = at_border || (clipped && bone <= from + 1e-4);
#ifdef STRUCTURES
  // Structures may lie beyond the bone's box.
  float start = depth_range.x / facing, end = bone > 0.0 ? bone + 1e-3 : 1e9;
  bool cut_open = false;
  if (dot(clip.xyz, clip.xyz) > 0.0) {
    float side = dot(clip.xyz, eye) - clip.w, rate = dot(clip.xyz, d);
    float t = -side / rate;
    if (side > 0.0 && (rate >= 0.0 || t > start)) { start = rate < 0.0 ? t : 1e9; cut_open = true; }
    if (side <= 0.0 && rate > 0.0) end = min(end, t);
  }
  float structure = first_structure(eye, d, start, end);
  bool on_cut = cut_open && structure <= start + 1e-4;
  // Where a surface of both is laid bare, bone is drawn, in the structure's colour.
  bool is_structure = structure > 0.0 && (on_cut || bone < 0.0 || bone - structure > 0.5 * voxel);
  if (is_structure) {
    surface = structure;
    on_section = on_cut;
    at_border = false;
  }
#endif

  vec3 n_T;
  bool on_ball;
  float steel_at = through_tool((eye - tool.tip) * tool.axes, d * tool.axes, n_T, on_ball);
  float nearest = 1e9;
  if (steel_at > 0.0 && (surface < 0.0 || steel_at < surface)) {
    nearest = steel_at;
    vec3 p_T = (eye + steel_at * d - tool.tip) * tool.axes;
    vec3 c = steel(n_T, p_T, d, on_ball);
    // Darker down in the hole.
    vec3 p = eye + steel_at * d;
    c *= mix(0.35, 1.0, open_sky(p, tool.axes * n_T));
    colour.rgb = c;
  } else if (surface > 0.0) {
    nearest = surface;
    vec3 p = eye + surface * d;
    vec3 n = !on_section ? bone_normal(p, surface) : at_border ? border_normal(p) : clip.xyz;
#ifdef STRUCTURES
    if (is_structure && !on_section) n = structure_normal(p);
#endif
    if (dot(n, d) > 0.0) n = normalize(n - 1.05 * dot(n, d) * d);
    float key = past_tool(p);
    if (fine && !on_section && dot(n, to_key) > 0.0 && key > 0.0) {
      vec3 start = p + 1.5 * voxel * n;
      if (first_bone(start, to_key, 0.0, min(60.0, through_volume(start, to_key).y)) >= 0.0) key *= 0.25;
    }
    vec3 albedo = kBone;
    float gloss = 0.55;
    if (on_section) {
      float r = clamp(1.3 * above(p * per_mm) / densest, 0.0, 1.0);
      albedo = mix(vec3(0.48, 0.33, 0.27), vec3(0.86, 0.80, 0.68), r);
      gloss = 0.1;
    } else {
      float cut = textureLod(shares, ((p + 0.8 * voxel * n) * per_mm + 0.5) / (vec3(bricks) * 8.0), 0.0).g;
      albedo = mix(kBone, kCut, smoothstep(0.12, 0.40, cut));
      gloss = mix(0.55, 0.9, smoothstep(0.12, 0.40, cut));
    }
#ifdef STRUCTURES
    vec3 srgb;
    float share = share_of_structure(p, on_section, srgb);
    if (is_structure) share = 1.0;
    albedo = mix(albedo, (on_section ? 0.8 : 1.0) * pow(srgb, vec3(2.2)), share);
    if (share > 0.9) flat_colour = srgb;
#endif
    colour.rgb = lit(albedo, n, d, key, on_section ? 1.0 : open_sky(p, n), gloss);
  }
  if (tube_size.x > 0.0) {
    vec3 n_S;
    float t = through_tube((eye - tube.tip) * tube.axes, d * tube.axes, n_S);
    if (t > 0.0 && t < nearest) {
      nearest = t;
      vec3 n = tube.axes * n_S, r = reflect(d, n);
      colour.rgb = 0.70 * sky(r) * vec3(0.72, 0.80, 0.92) + 0.08 + pow(max(dot(r, to_key), 0.0), 40.0);
    }
  }

  if (ghostly > 0.0) {
    vec3 n_G;
    bool on_tip;
    float t = through_tool((eye - ghost.tip) * ghost.axes, d * ghost.axes, n_G, on_tip);
    if (t > 0.0) {
      float edge = 1.0 - abs(dot(ghost.axes * n_G, d));
      float opacity = ghostly * (t < nearest ? 0.30 + 0.55 * edge : 0.10 + 0.25 * edge * edge);
      colour.rgb = mix(colour.rgb, kGhost, opacity);
    }
  }
#ifdef STRUCTURES
  if (flat_shading) colour.rgb = surface > 0.0 && nearest == surface ? flat_colour : vec3(0.0);
#else
  if (flat_shading) colour.rgb = vec3(surface > 0.0 && nearest == surface ? 1.0 : 0.0);
#endif
  else colour.rgb = pow(colour.rgb / (1.0 + 0.12 * colour.rgb), vec3(1.0 / 2.2));

  if (nearest < 1e8) {
    float z = nearest * facing, f = depth_range.y, e = depth_range.x;
    depth = clamp((f / (f - e)) * (1.0 - e / z), 0.0, 1.0);
  }
  gl_FragDepth = depth;
}
)";

/// Copies a texture to the framebuffer.
inline constexpr const char* kCopy = R"(in vec2 at;
layout(location = 0) out vec4 colour;
uniform sampler2D picture;
uniform float opacity;
void main() { colour = vec4(texture(picture, 0.5 * at + 0.5).rgb, opacity); }
)";

/// Marks in the scene: contact points and dust as round sprites, arrows as triangles.
inline constexpr const char* kMarkVertex = R"(layout(location = 0) in vec3 place;  // mm in G
layout(location = 1) in vec4 paint;
layout(location = 2) in float radius;  // mm; 0: part of a triangle
uniform vec3 eye, right, up, back;
uniform vec2 depth_range;
uniform vec2 half_picture;  // pixels
uniform float bias;         // mm toward the eye
out vec4 tint;
flat out float sprite;
void main() {
  vec3 v = place - eye;
  v -= bias * normalize(v);
  float z = -dot(v, back);
  float f = depth_range.y, e = depth_range.x;
  gl_Position = vec4(dot(v, right) / dot(right, right), dot(v, up) / dot(up, up),
                     2.0 * f / (f - e) * (z - e) - z, z);
  gl_PointSize = max(2.0, 2.0 * radius / (z * length(up)) * half_picture.y);
  tint = paint;
  sprite = radius;
}
)";
inline constexpr const char* kMarkFragment = R"(in vec4 tint;
flat in float sprite;
layout(location = 0) out vec4 colour;
void main() {
  float shade = 1.0, opacity = tint.a;
  if (sprite > 0.0) {
    vec2 p = 2.0 * gl_PointCoord - 1.0;
    float q = dot(p, p);
    if (q > 1.0) discard;
    shade = 0.55 + 0.45 * sqrt(1.0 - q);
  }
  colour = vec4(tint.rgb * shade, opacity);
}
)";

}  // namespace live::shaders
