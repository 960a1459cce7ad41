/* SPDX-License-Identifier: MIT */
/* A ball's mesh is closed and has its volume in each handedness, mirrored axes keep what rotations and forces do, and
 * the ramp starts anew where it must. */
#include "check.h"

#include <math.h>
#include <stdlib.h>

enum { kSide = 44, kVoxels = kSide * kSide * kSide, kBricks = 6 * 6 * 6, kMost = 1 << 15 };
static const double kPi = 3.14159265358979323846, kSpacing = 0.5e-3, kRadius = 8.1e-3, kIsovalue = 300;
static const double kCentre[3] = {10.4e-3, 10.9e-3, 10.6e-3};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static void cross(const double a[3], const double b[3], double out[3]) {
  for (int i = 0; i < 3; ++i) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* v turned by q = (u, w): v + 2 w (u x v) + 2 u x (u x v). */
static void turned(const double q[4], const double v[3], double out[3]) {
  double uv[3], uuv[3];
  cross(q, v, uv);
  cross(q, uv, uuv);
  for (int i = 0; i < 3; ++i) out[i] = v[i] + 2 * q[3] * uv[i] + 2 * uuv[i];
}

static double random_number(void) {
  static uint32_t state = 12345;
  state = 1664525 * state + 1013904223;
  return (double)state / 2147483648.0 - 1;
}

static void mirrors(void) {
  double off = 0;
  for (int n = 0; n < 1000; ++n) {
    trephine_pose pose, mirrored, back;
    double point[3], force[3], length = 0;
    for (int i = 0; i < 4; ++i) length += pow(pose.rotation[i] = random_number(), 2);
    for (int i = 0; i < 4; ++i) pose.rotation[i] /= sqrt(length);
    for (int i = 0; i < 3; ++i) {
      pose.position[i] = random_number();
      point[i] = random_number();
      force[i] = random_number();
    }
    CHECK(trephine_mirror_pose(&pose, &mirrored) == TREPHINE_OK);
    CHECK(mirrored.position[2] == -pose.position[2] && mirrored.position[0] == pose.position[0]);
    back = mirrored;
    CHECK(trephine_mirror_pose(&back, &back) == TREPHINE_OK);
    CHECK(memcmp(&back, &pose, sizeof pose) == 0);

    /* Where a point goes, and the torque of a force at it, are the mirrored ones whichever way they are found. */
    double to[3], then_mirrored[3], mirrored_point[3], mirrored_first[3], torque[3], mirrored_force[3];
    turned(pose.rotation, point, to);
    for (int i = 0; i < 3; ++i) to[i] += pose.position[i];
    CHECK(trephine_mirror_force(to, then_mirrored) == TREPHINE_OK);
    CHECK(trephine_mirror_force(point, mirrored_point) == TREPHINE_OK);
    turned(mirrored.rotation, mirrored_point, mirrored_first);
    for (int i = 0; i < 3; ++i) off = fmax(off, fabs(mirrored_first[i] + mirrored.position[i] - then_mirrored[i]));
    cross(point, force, torque);
    CHECK(trephine_mirror_torque(torque, then_mirrored) == TREPHINE_OK);
    CHECK(trephine_mirror_force(force, mirrored_force) == TREPHINE_OK);
    cross(mirrored_point, mirrored_force, mirrored_first);
    for (int i = 0; i < 3; ++i) off = fmax(off, fabs(mirrored_first[i] - then_mirrored[i]));
    CHECK(trephine_mirror_torque(then_mirrored, then_mirrored) == TREPHINE_OK);
    CHECK(memcmp(then_mirrored, torque, sizeof torque) == 0);
  }
  CHECK(off < 1e-14); /* ten roundings of numbers up to 4 */
  double v[3] = {0};
  trephine_pose pose = {{0}, {0}};
  CHECK_REFUSED(trephine_mirror_pose(NULL, &pose), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_mirror_pose(&pose, NULL), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_mirror_force(v, NULL), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_mirror_torque(NULL, v), TREPHINE_NULL_ARGUMENT, "null");
}

static trephine_grid* ball(int density_type) {
  static float floats[kVoxels];
  static int16_t shorts[kVoxels];
  for (int v = 0; v < kVoxels; ++v) {
    double from[3] = {v % kSide * kSpacing, v / kSide % kSide * kSpacing, (double)(v / kSide / kSide) * kSpacing};
    for (int i = 0; i < 3; ++i) from[i] -= kCentre[i];
    floats[v] = (float)(kIsovalue + 400e3 * (kRadius - sqrt(dot(from, from))));
    shorts[v] = (int16_t)lrintf(floats[v]);
  }
  trephine_grid_options o;
  CHECK(trephine_grid_options_init(&o, sizeof o) == TREPHINE_OK);
  o.density_type = density_type;
  for (int a = 0; a < 3; ++a) {
    o.size[a] = kSide;
    o.spacing[a] = kSpacing;
  }
  trephine_grid* grid = NULL;
  CHECK(trephine_grid_create(&o, density_type == TREPHINE_INT16 ? (void*)shorts : (void*)floats,
                             density_type == TREPHINE_INT16 ? sizeof shorts : sizeof floats, &grid) == TREPHINE_OK);
  return grid;
}

static float positions[kMost][3], normals[kMost][3];
static uint32_t indices[3 * kMost];

typedef struct edge {
  float ends[2][3];
  int way;
} edge;
/* The same edge either way about, told by the bits of its ends' places. */
static int by_ends(const void* a, const void* b) { return memcmp(a, b, sizeof(float[2][3])); }

/* All bricks' meshes behind one another; returns the number of indices, or 0 where a call fails. */
static size_t mesh_of_all(trephine_reader* reader, int flags, size_t* vertex_count) {
  size_t n = 0, at = 0;
  for (int b = 0; b < kBricks; ++b) {
    size_t vertices = 0, count = 0;
    CHECK(trephine_reader_mesh(reader, b, kIsovalue, flags, &vertices, &count) == TREPHINE_OK);
    if (n + vertices > kMost || at + count > 3 * kMost) return 0;
    CHECK(trephine_reader_copy_mesh(reader, positions[n], normals[n], vertices, &indices[at], count) == TREPHINE_OK);
    for (size_t i = at; i < at + count; ++i) {
      CHECK(indices[i] < vertices);
      indices[i] += (uint32_t)n;
    }
    n += vertices;
    at += count;
  }
  *vertex_count = n;
  return at;
}

/* Each edge is there as often one way as the other. */
static int open_edges(size_t count) {
  edge* edges = calloc(count, sizeof(edge));
  if (edges == NULL) exit(2);
  for (size_t i = 0; i < count; ++i) {
    const float *from = positions[indices[i]], *to = positions[indices[i % 3 == 2 ? i - 2 : i + 1]];
    const int order = memcmp(from, to, sizeof(float[3])); /* 0: vertices of two cells in one place */
    edges[i].way = (order < 0) - (order > 0);
    memcpy(edges[i].ends[edges[i].way < 0], from, sizeof(float[3]));
    memcpy(edges[i].ends[edges[i].way >= 0], to, sizeof(float[3]));
  }
  qsort(edges, count, sizeof(edge), by_ends);
  int open = 0;
  for (size_t i = 0, sum = 0; i < count; ++i) {
    sum += (size_t)edges[i].way;
    if (i + 1 < count && by_ends(&edges[i], &edges[i + 1]) == 0) continue;
    open += sum != 0;
    sum = 0;
  }
  free(edges);
  return open;
}

/* By its corners as numbers, whatever the axes' handedness: positive where (b - a) x (c - a) is outward. */
static double volume(size_t count) {
  double sum = 0;
  for (size_t i = 0; i < count; i += 3) {
    double corner[3][3], normal[3];
    for (int c = 0; c < 3; ++c)
      for (int a = 0; a < 3; ++a) corner[c][a] = positions[indices[i + (size_t)c]][a];
    cross(corner[1], corner[2], normal);
    sum += dot(corner[0], normal) / 6;
  }
  return sum;
}

static void meshes(void) {
  const double sphere = 4 * kPi / 3 * pow(kRadius, 3);
  for (int type = TREPHINE_INT16; type <= TREPHINE_FLOAT32; ++type) {
    trephine_grid* grid = ball(type);
    trephine_reader* reader = NULL;
    CHECK(trephine_reader_create(grid, &reader) == TREPHINE_OK);
    for (int flags = 0; flags < 4; ++flags) {
      size_t vertices = 0;
      const size_t count = mesh_of_all(reader, flags, &vertices);
      CHECK(count > 6000);
      CHECK(open_edges(count) == 0);
      /* Unity takes triangles whose corners are clockwise in left-handed axes, which is outward as numbers. */
      const double sign = flags == 0 || flags == (TREPHINE_MESH_MIRRORED | TREPHINE_MESH_CLOCKWISE) ? 1 : -1;
      CHECK(fabs(sign * volume(count) - sphere) < 0.01 * sphere);
      double least = 1, farthest = 0;
      for (size_t v = 0; v < vertices; ++v) {
        const double z = (flags & TREPHINE_MESH_MIRRORED) ? -kCentre[2] : kCentre[2];
        const double out[3] = {positions[v][0] - kCentre[0], positions[v][1] - kCentre[1], positions[v][2] - z};
        const double n[3] = {normals[v][0], normals[v][1], normals[v][2]};
        farthest = fmax(farthest, fabs(sqrt(dot(out, out)) - kRadius));
        least = fmin(least, dot(n, out) / sqrt(dot(out, out)));
      }
      CHECK(least > 0.99);              /* a cell is 1/16 of the radius, and normals are its middle's */
      CHECK(farthest < 0.1 * kSpacing); /* chords of cells lie inside */
      if (flags == 0)
        printf("ball: %zu triangles, volume %+.3f %%, normals within %.2f degrees\n", count / 3,
               100 * (volume(count) / sphere - 1), acos(least) * 180 / kPi);
    }
    trephine_reader_destroy(reader);
    trephine_grid_destroy(grid);
  }
}

static void mesh_calls(void) {
  trephine_grid* grid = ball(TREPHINE_INT16);
  trephine_reader* reader = NULL;
  CHECK(trephine_reader_create(grid, &reader) == TREPHINE_OK);
  size_t vertices = 9, count = 9;
  CHECK(trephine_reader_copy_mesh(reader, NULL, NULL, 0, NULL, 0) == TREPHINE_OK); /* none yet */
  CHECK(trephine_reader_mesh(reader, 0, kIsovalue, 0, &vertices, &count) == TREPHINE_OK);
  CHECK(vertices == 0 && count == 0); /* a corner of air */
  const int top = 2 + 6 * 2 + 36 * 4;
  CHECK(trephine_reader_mesh(reader, top, kIsovalue, 0, &vertices, &count) == TREPHINE_OK);
  CHECK(vertices > 50 && count > 150 && count % 3 == 0);
  CHECK_REFUSED(trephine_reader_copy_mesh(reader, positions[0], NULL, vertices - 1, indices, count),
                TREPHINE_INVALID_ARGUMENT, "needs room");
  CHECK_REFUSED(trephine_reader_copy_mesh(reader, positions[0], NULL, vertices, indices, count - 1),
                TREPHINE_INVALID_ARGUMENT, "needs room");
  CHECK_REFUSED(trephine_reader_copy_mesh(reader, NULL, NULL, vertices, indices, count), TREPHINE_NULL_ARGUMENT,
                "null");
  CHECK_REFUSED(trephine_reader_copy_mesh(NULL, positions[0], NULL, 1, indices, 1), TREPHINE_NULL_ARGUMENT, "null");

  /* What was made stays while bone is taken, and nothing is written beyond it; made anew it differs. */
  memset(normals, 0xAB, sizeof normals);
  CHECK(trephine_reader_copy_mesh(reader, positions[0], normals[0], vertices, indices, count) == TREPHINE_OK);
  CHECK(((const unsigned char*)normals[vertices])[0] == 0xAB);
  trephine_scene_options o;
  CHECK(trephine_scene_options_init(&o, sizeof o) == TREPHINE_OK);
  o.isovalue = kIsovalue;
  trephine_scene* scene = NULL;
  CHECK(trephine_scene_create(grid, &o, &scene) == TREPHINE_OK);
  trephine_tick_result r;
  CHECK(trephine_tick_result_init(&r, sizeof r) == TREPHINE_OK);
  for (int i = 0; i < 400; ++i) {
    const trephine_pose X_WT = {{kCentre[0], kCentre[1], kCentre[2] + kRadius + 3e-3 - 1e-5 * i}, {0, 0, 0, 1}};
    CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &r) == TREPHINE_OK);
  }
  CHECK(r.removed_total_mm3 > 1);
  static float before[kMost][3];
  memcpy(before, positions, sizeof before);
  CHECK(trephine_reader_copy_mesh(reader, positions[0], NULL, kMost, indices, 3 * kMost) == TREPHINE_OK);
  CHECK(memcmp(before, positions, sizeof before) == 0);
  size_t now = 0;
  CHECK(trephine_reader_mesh(reader, top, kIsovalue, 0, &vertices, &now) == TREPHINE_OK);
  CHECK(trephine_reader_copy_mesh(reader, positions[0], NULL, vertices, indices, now) == TREPHINE_OK);
  CHECK(memcmp(before, positions, sizeof before) != 0);
  size_t all = 0;
  CHECK(open_edges(mesh_of_all(reader, 3, &all)) == 0);

  /* What is refused leaves the mesh and the counts alone. */
  CHECK(trephine_reader_mesh(reader, top, kIsovalue, 0, &vertices, &count) == TREPHINE_OK);
  now = vertices;
  CHECK_REFUSED(trephine_reader_mesh(reader, -1, kIsovalue, 0, &vertices, &count), TREPHINE_INVALID_ARGUMENT,
                "no brick -1");
  CHECK_REFUSED(trephine_reader_mesh(reader, kBricks, kIsovalue, 0, &vertices, &count), TREPHINE_INVALID_ARGUMENT,
                "no brick 216");
  CHECK_REFUSED(trephine_reader_mesh(reader, 0, kIsovalue, 4, &vertices, &count), TREPHINE_INVALID_ARGUMENT,
                "flags: 4");
  CHECK_REFUSED(trephine_reader_mesh(reader, 0, NAN, 0, &vertices, &count), TREPHINE_INVALID_ARGUMENT, "isovalue");
  CHECK_REFUSED(trephine_reader_mesh(reader, 0, kIsovalue, 0, NULL, &count), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_reader_mesh(NULL, 0, kIsovalue, 0, &vertices, &count), TREPHINE_NULL_ARGUMENT, "null");
  CHECK(vertices == now);
  CHECK(trephine_reader_copy_mesh(reader, positions[0], NULL, vertices, indices, count) == TREPHINE_OK);
  trephine_scene_destroy(scene);
  trephine_reader_destroy(reader);
  trephine_grid_destroy(grid);
}

static double factor_after(trephine_ramp* ramp, const trephine_scene* scene, int status, double dt) {
  double factor = -1;
  CHECK(trephine_ramp_step(ramp, scene, status, dt, &factor) == TREPHINE_OK);
  return factor;
}

static void ramps(void) {
  trephine_grid* grid = ball(TREPHINE_INT16);
  for (int algorithm = TREPHINE_SURFACE; algorithm <= TREPHINE_COUPLED; ++algorithm) {
    trephine_scene_options o;
    CHECK(trephine_scene_options_init(&o, sizeof o) == TREPHINE_OK);
    o.algorithm = algorithm;
    o.isovalue = kIsovalue;
    trephine_scene* scene = NULL;
    CHECK(trephine_scene_create(grid, &o, &scene) == TREPHINE_OK);
    trephine_ramp* ramp = NULL;
    CHECK(trephine_ramp_create(0.1, &ramp) == TREPHINE_OK);
    /* A status, an interval, and whether the ramp starts anew with Surface, whose wrench steps, and with Coupled. */
    const struct {
      int status;
      double dt;
      int anew[2];
    } steps[] = {{TREPHINE_STATUS_OK, 1e-3, {0, 0}},
                 {TREPHINE_STATUS_WORK_BOUND, 1e-3, {0, 0}},
                 {TREPHINE_STATUS_STARTED_INSIDE, 1e-3, {1, 0}},
                 {TREPHINE_STATUS_JUMP, 1e-3, {1, 0}},
                 {TREPHINE_STATUS_BAD_INPUT, 1e-3, {1, 1}},
                 {TREPHINE_STATUS_NON_FINITE, 1e-3, {1, 1}},
                 {TREPHINE_STATUS_FAR_AWAY, 1e-3, {1, 1}},
                 {TREPHINE_STATUS_OK, 0.019, {0, 0}},
                 {TREPHINE_STATUS_OK, 0.021, {1, 1}},
                 {TREPHINE_STATUS_OK, 0, {1, 1}},
                 {TREPHINE_STATUS_OK, NAN, {1, 1}},
                 {TREPHINE_STATUS_OK, INFINITY, {1, 1}}};
    CHECK(factor_after(ramp, scene, TREPHINE_STATUS_OK, 1e-3) == 0);
    for (size_t s = 0; s < sizeof steps / sizeof steps[0]; ++s) {
      for (int i = 1; i <= 110; ++i) {
        const double expected = i < 100 ? 0.01 * i : 1;
        CHECK(fabs(factor_after(ramp, scene, TREPHINE_STATUS_OK, 1e-3) - expected) < 1e-12);
      }
      const int anew = steps[s].anew[algorithm - TREPHINE_SURFACE];
      CHECK(factor_after(ramp, scene, steps[s].status, steps[s].dt) == (anew ? 0 : 1));
      CHECK(trephine_ramp_restart(ramp) == TREPHINE_OK);
      CHECK(factor_after(ramp, scene, TREPHINE_STATUS_OK, 1e-3) == 0);
    }
    double factor = 7;
    CHECK_REFUSED(trephine_ramp_step(NULL, scene, 0, 1e-3, &factor), TREPHINE_NULL_ARGUMENT, "null");
    CHECK_REFUSED(trephine_ramp_step(ramp, NULL, 0, 1e-3, &factor), TREPHINE_NULL_ARGUMENT, "null");
    CHECK_REFUSED(trephine_ramp_step(ramp, scene, 0, 1e-3, NULL), TREPHINE_NULL_ARGUMENT, "null");
    CHECK_REFUSED(trephine_ramp_restart(NULL), TREPHINE_NULL_ARGUMENT, "null");
    CHECK(factor == 7);
    trephine_ramp_destroy(ramp);
    CHECK(trephine_ramp_create(0, &ramp) == TREPHINE_OK);
    CHECK(factor_after(ramp, scene, TREPHINE_STATUS_OK, 1e-3) == 0);
    CHECK(factor_after(ramp, scene, TREPHINE_STATUS_OK, 1e-3) == 1);
    trephine_ramp_destroy(ramp);
    trephine_scene_destroy(scene);
  }
  trephine_ramp* none = NULL;
  CHECK_REFUSED(trephine_ramp_create(-1, &none), TREPHINE_INVALID_ARGUMENT, "duration");
  CHECK_REFUSED(trephine_ramp_create(NAN, &none), TREPHINE_INVALID_ARGUMENT, "duration");
  CHECK_REFUSED(trephine_ramp_create(0.1, NULL), TREPHINE_NULL_ARGUMENT, "null");
  CHECK(none == NULL);
  trephine_ramp_destroy(NULL);
  trephine_grid_destroy(grid);
}

int for_engines(void) {
  mirrors();
  meshes();
  mesh_calls();
  ramps();
  return failures;
}
