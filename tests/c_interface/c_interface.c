/* SPDX-License-Identifier: MIT */
/* The C interface as a C11 program sees it: drills with each algorithm, follows the changed bricks, and tries what
 * must be refused. Ends with 0 when all is as it should be. */
#include "check.h"

#include <math.h>
#include <stdlib.h>

enum { kSide = 40, kVoxels = kSide * kSide * kSide, kHaloed = TREPHINE_HALOED * TREPHINE_HALOED * TREPHINE_HALOED };
static const double kSpacing = 0.5e-3;

static int16_t voxels[kVoxels];

/* Bone below half the height: its surface is 900/2200 of a voxel above voxel 19. */
static void fill(void) {
  for (int i = 0; i < kVoxels; ++i) voxels[i] = i < kVoxels / 2 ? 1200 : -1000;
}

static trephine_grid_options grid_options(void) {
  trephine_grid_options o;
  CHECK(trephine_grid_options_init(&o, sizeof o) == TREPHINE_OK);
  for (int a = 0; a < 3; ++a) {
    o.size[a] = kSide;
    o.spacing[a] = kSpacing;
  }
  return o;
}

static trephine_grid* make_grid(void) {
  const trephine_grid_options o = grid_options();
  trephine_grid* grid = NULL;
  CHECK(trephine_grid_create(&o, voxels, sizeof voxels, &grid) == TREPHINE_OK);
  CHECK(grid != NULL);
  return grid;
}

static trephine_scene_options scene_options(int algorithm) {
  trephine_scene_options o;
  CHECK(trephine_scene_options_init(&o, sizeof o) == TREPHINE_OK);
  o.algorithm = algorithm;
  o.isovalue = 300;
  return o;
}

static trephine_pose tool_at(double height) {
  const trephine_pose X_WT = {{10e-3, 10e-3, height}, {0, 0, 0, 1}};
  return X_WT;
}

static const double kSurface = (19 + 900.0 / 2200.0) * 0.5e-3;

/* Presses, then drills, then goes on with the bone restored. */
static void drill(int algorithm) {
  trephine_grid* grid = make_grid();
  const trephine_scene_options options = scene_options(algorithm);
  trephine_scene* scene = NULL;
  CHECK(trephine_scene_create(grid, &options, &scene) == TREPHINE_OK);
  trephine_reader* reader = NULL;
  CHECK(trephine_reader_create(grid, &reader) == TREPHINE_OK);
  int32_t bricks[3];
  CHECK(trephine_reader_bricks(reader, bricks) == TREPHINE_OK);
  CHECK(bricks[0] == 5 && bricks[1] == 5 && bricks[2] == 5);
  int32_t changed[200];
  size_t count = 0;
  CHECK(trephine_reader_changed(reader, changed, 200, &count) == TREPHINE_OK);
  CHECK(count == 125);

  trephine_tick_result r;
  CHECK(trephine_tick_result_init(&r, sizeof r) == TREPHINE_OK);
  /* Line's tip is a point at the burr's centre, Surface's a ball. */
  const double radius = algorithm == TREPHINE_LINE ? 0 : options.tool.tip_radius;
  const double depth = options.tool.tip_radius / 2;
  for (int i = 0; i <= 200; ++i) {
    const trephine_pose X_WT = tool_at(kSurface + radius + 1e-3 - (1e-3 + depth) * i / 200);
    CHECK(trephine_scene_tick(scene, &X_WT, 0, 1e-3, &r) == TREPHINE_OK);
    CHECK(r.status == TREPHINE_STATUS_OK);
  }
  CHECK(r.tip == 1 && r.shaft == 0 && r.contacts > 0);
  /* What `stiffness` means, in both: the spring from here to the surface. The surface is a voxel's ramp wide. */
  printf("algorithm %d: %.3f N at %.2f mm\n", algorithm, r.force[2], 1e3 * depth);
  CHECK(fabs(r.force[2] - options.stiffness * depth) < 0.15 * options.stiffness * depth);
  const double pressed = r.force[2];
  CHECK(r.removed_total_mm3 == 0);
  CHECK(trephine_reader_changed(reader, changed, 200, &count) == TREPHINE_OK);
  CHECK(count == 0);

  double removed = 0;
  for (int i = 0; i < 400; ++i) {
    const trephine_pose X_WT = tool_at(kSurface + radius - depth - 5e-6 * i);
    CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &r) == TREPHINE_OK);
    removed += r.removed_mm3;
  }
  CHECK(r.removed_total_mm3 > 3);
  CHECK(fabs(r.removed_total_mm3 - removed) < 1e-9);
  const double force = sqrt(r.force[0] * r.force[0] + r.force[1] * r.force[1] + r.force[2] * r.force[2]);
  CHECK(force <= options.force_limit);

  /* A list with too little room is continued; each brick comes once, and its copy is the grid's. */
  static int16_t now[kVoxels];
  CHECK(trephine_grid_copy(grid, now, sizeof now) == TREPHINE_OK);
  char seen[125] = {0};
  int named = 0;
  for (;;) {
    CHECK(trephine_reader_changed(reader, changed, 3, &count) == TREPHINE_OK);
    if (count == 0) break;
    CHECK(count <= 3);
    for (size_t n = 0; n < count; ++n, ++named) {
      const int b = changed[n];
      CHECK(seen[b] == 0);
      seen[b] = 1;
      int16_t copy[kHaloed];
      CHECK(trephine_reader_copy(reader, b, copy, sizeof copy) == TREPHINE_OK);
      const int x = b % 5 * 8, y = b / 5 % 5 * 8, z = b / 25 * 8;
      for (int k = 0; k < 8; ++k)
        for (int j = 0; j < 8; ++j)
          for (int i = 0; i < 8; ++i)
            if (copy[((k + 1) * 10 + j + 1) * 10 + i + 1] != now[((z + k) * kSide + y + j) * kSide + x + i]) ++failures;
    }
  }
  CHECK(named > 0 && named < 125);
  CHECK(memcmp(now, voxels, sizeof now) != 0);

  /* The grid's handle may go first. */
  size_t left = 0;
  CHECK(trephine_grid_restore(grid, 1, &left) == TREPHINE_OK);
  CHECK(left > 0);
  CHECK(trephine_grid_restore(grid, 1000, NULL) == TREPHINE_OK);
  CHECK(trephine_grid_copy(grid, now, sizeof now) == TREPHINE_OK);
  CHECK(memcmp(now, voxels, sizeof now) == 0);
  trephine_grid_destroy(grid);
  CHECK(trephine_scene_reset(scene) == TREPHINE_OK);
  for (int i = 0; i <= 200; ++i) {
    const trephine_pose X_WT = tool_at(kSurface + radius + 1e-3 - (1e-3 + depth) * i / 200);
    CHECK(trephine_scene_tick(scene, &X_WT, 0, 1e-3, &r) == TREPHINE_OK);
  }
  CHECK(fabs(r.force[2] - pressed) < 1e-6);
  CHECK(trephine_scene_reset(scene) == TREPHINE_OK);
  const trephine_pose away = tool_at(18e-3);
  /* The force falls along a slope, 0.6 N in 10 ms; Surface's is gone at once. */
  for (int i = 0; i < 12; ++i) {
    CHECK(trephine_scene_tick(scene, &away, 0, 1e-3, &r) == TREPHINE_OK);
    CHECK(r.status == TREPHINE_STATUS_OK && r.contacts == 0);
  }
  CHECK(r.force[2] == 0);
  CHECK(r.X_WV.position[2] > 17.99e-3 && r.X_WV.rotation[3] > 0.999);
  trephine_scene_destroy(scene);
  trephine_reader_destroy(reader);
}

static void refuse_grids(void) {
  trephine_grid_options o = grid_options();
  trephine_grid* grid = NULL;
  CHECK_REFUSED(trephine_grid_create(NULL, voxels, sizeof voxels, &grid), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_grid_create(&o, NULL, sizeof voxels, &grid), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_grid_create(&o, voxels, sizeof voxels, NULL), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_grid_create(&o, voxels, sizeof voxels - 1, &grid), TREPHINE_INVALID_ARGUMENT, "128000 bytes");
  o.size[1] = 0;
  CHECK_REFUSED(trephine_grid_create(&o, voxels, sizeof voxels, &grid), TREPHINE_INVALID_ARGUMENT, "size");
  for (int a = 0; a < 3; ++a) o.size[a] = 1 << 20; /* their product does not fit 32 bits, nor would the volume */
  CHECK(trephine_grid_create(&o, voxels, sizeof voxels, &grid) == TREPHINE_INVALID_ARGUMENT);
  o = grid_options();
  o.spacing[2] = NAN;
  CHECK_REFUSED(trephine_grid_create(&o, voxels, sizeof voxels, &grid), TREPHINE_INVALID_ARGUMENT, "spacing");
  o = grid_options();
  o.X_WG.rotation[0] = 0.1;
  CHECK_REFUSED(trephine_grid_create(&o, voxels, sizeof voxels, &grid), TREPHINE_INVALID_ARGUMENT, "quaternion");
  o = grid_options();
  o.density_type = 7;
  CHECK_REFUSED(trephine_grid_create(&o, voxels, sizeof voxels, &grid), TREPHINE_INVALID_ARGUMENT, "density_type");
  o = grid_options();
  o.struct_size = 4;
  CHECK_REFUSED(trephine_grid_create(&o, voxels, sizeof voxels, &grid), TREPHINE_WRONG_STRUCT, "struct_size is 4");
  o.struct_size = sizeof o + 8;
  CHECK_REFUSED(trephine_grid_create(&o, voxels, sizeof voxels, &grid), TREPHINE_WRONG_STRUCT, "not older");
  CHECK_REFUSED(trephine_grid_options_init(&o, sizeof o + 8), TREPHINE_WRONG_STRUCT, "not older");
  CHECK_REFUSED(trephine_grid_options_init(NULL, sizeof o), TREPHINE_NULL_ARGUMENT, "null");
  CHECK(grid == NULL);

  grid = make_grid();
  trephine_pose X_WG = {{0, 0, NAN}, {0, 0, 0, 1}};
  CHECK_REFUSED(trephine_grid_set_pose(grid, &X_WG), TREPHINE_INVALID_ARGUMENT, "X_WG");
  X_WG.position[2] = 0;
  X_WG.rotation[3] = NAN;
  CHECK_REFUSED(trephine_grid_set_pose(grid, &X_WG), TREPHINE_INVALID_ARGUMENT, "quaternion");
  CHECK_REFUSED(trephine_grid_copy(grid, voxels, 2), TREPHINE_INVALID_ARGUMENT, "needs 64000 voxels");
  CHECK_REFUSED(trephine_grid_copy(grid, voxels, sizeof voxels - 1), TREPHINE_INVALID_ARGUMENT, "whole number");
  CHECK_REFUSED(trephine_grid_restore(NULL, 1, NULL), TREPHINE_NULL_ARGUMENT, "null");
  trephine_grid_destroy(grid);
  trephine_grid_destroy(NULL);

  o = grid_options();
  o.keep_original = 0;
  CHECK(trephine_grid_create(&o, voxels, sizeof voxels, &grid) == TREPHINE_OK);
  CHECK_REFUSED(trephine_grid_restore(grid, 1, NULL), TREPHINE_INVALID_ARGUMENT, "keep_original");
  trephine_reader* reader = NULL;
  CHECK(trephine_reader_create(grid, &reader) == TREPHINE_OK);
  int16_t copy[kHaloed];
  CHECK_REFUSED(trephine_reader_copy(reader, 125, copy, sizeof copy), TREPHINE_INVALID_ARGUMENT, "no brick 125");
  CHECK_REFUSED(trephine_reader_copy(reader, -1, copy, sizeof copy), TREPHINE_INVALID_ARGUMENT, "no brick -1");
  CHECK_REFUSED(trephine_reader_copy(reader, 0, copy, 1000), TREPHINE_INVALID_ARGUMENT, "2000 bytes");
  size_t count = 0;
  CHECK_REFUSED(trephine_reader_changed(reader, NULL, 4, &count), TREPHINE_INVALID_ARGUMENT, "at null");
  trephine_reader_destroy(reader);
  trephine_reader_destroy(NULL);
  trephine_grid_destroy(grid);
}

static void refuse_scenes(void) {
  trephine_grid* grid = make_grid();
  trephine_scene* scene = NULL;
  trephine_scene_options o = scene_options(TREPHINE_SURFACE);
  CHECK_REFUSED(trephine_scene_create(NULL, &o, &scene), TREPHINE_NULL_ARGUMENT, "null");
  o.isovalue = NAN; /* the default */
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "isovalue");
  o = scene_options(3);
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "algorithm");
  o = scene_options(TREPHINE_SURFACE);
  o.tool.tip_radius = -1;
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "tip_radius");
  o = scene_options(TREPHINE_SURFACE);
  o.sphere_vertices = 0;
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "sphere");
  o = scene_options(TREPHINE_LINE);
  o.kinetic_friction = 0.5;
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "static coefficient");
  o = scene_options(TREPHINE_COUPLED);
  o.rotational_stiffness = 0;
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "rotational_stiffness");
  o = scene_options(TREPHINE_LINE);
  o.milling = 9;
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "milling");
  o.milling = TREPHINE_MILL_RATE_LIMITED;
  o.milling_rate = 0;
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "rate");
  o = scene_options(TREPHINE_LINE);
  o.force_limit = -1;
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "force");
  o = scene_options(TREPHINE_LINE);
  o.struct_size = 0;
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_WRONG_STRUCT, "struct_size is 0");
  CHECK(scene == NULL);

  /* Bad poses are answered, not refused: zero wrench and a status; the next good one works. */
  o = scene_options(TREPHINE_LINE);
  CHECK(trephine_scene_create(grid, &o, &scene) == TREPHINE_OK);
  trephine_tick_result r;
  CHECK(trephine_tick_result_init(&r, sizeof r) == TREPHINE_OK);
  trephine_pose X_WT = tool_at(kSurface + 1e-4);
  CHECK(trephine_scene_tick(scene, &X_WT, 0, 1e-3, &r) == TREPHINE_OK);
  CHECK(r.status == TREPHINE_STATUS_OK);
  const trephine_pose pressed = tool_at(kSurface - 5e-4);
  CHECK(trephine_scene_tick(scene, &pressed, 0, 1e-3, &r) == TREPHINE_OK);
  CHECK(r.force[2] > 0.1);
  const double force = r.force[2];
  const double bad[] = {NAN, INFINITY, 1e9};
  for (int i = 0; i < 3; ++i) {
    X_WT = pressed;
    X_WT.position[1] = bad[i];
    CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &r) == TREPHINE_OK);
    CHECK(r.status == TREPHINE_STATUS_BAD_INPUT && r.force[2] == 0 && r.removed_mm3 == 0);
    X_WT = pressed;
    X_WT.rotation[i] = bad[i];
    CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &r) == TREPHINE_OK);
    CHECK(r.status == TREPHINE_STATUS_BAD_INPUT && r.force[2] == 0);
    CHECK(trephine_scene_tick(scene, &pressed, 0, NAN, &r) == TREPHINE_OK);
    CHECK(r.status == TREPHINE_STATUS_OK);
    /* From the zero that was sent the force rises along a slope. */
    for (int n = 0; n < 100; ++n) CHECK(trephine_scene_tick(scene, &pressed, 0, 1e-3, &r) == TREPHINE_OK);
    CHECK(r.status == TREPHINE_STATUS_OK && fabs(r.force[2] - force) < 0.01 * force);
  }
  CHECK_REFUSED(trephine_scene_tick(NULL, &pressed, 0, 1e-3, &r), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_scene_tick(scene, NULL, 0, 1e-3, &r), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_scene_tick(scene, &pressed, 0, 1e-3, NULL), TREPHINE_NULL_ARGUMENT, "null");
  r.struct_size = 12;
  CHECK_REFUSED(trephine_scene_tick(scene, &pressed, 0, 1e-3, &r), TREPHINE_WRONG_STRUCT, "struct_size is 12");
  CHECK_REFUSED(trephine_scene_reset(NULL), TREPHINE_NULL_ARGUMENT, "null");
  trephine_scene_destroy(scene);
  trephine_scene_destroy(NULL);
  trephine_grid_destroy(grid);
}

/* Callers whose header is older: their struct lacks the last fields, and nothing beyond it is touched. */
static void older_structs(void) {
  const size_t older = offsetof(trephine_scene_options, rotational_stiffness);
  trephine_grid* grid = make_grid();
  trephine_scene_options o;
  for (int algorithm = TREPHINE_LINE; algorithm <= TREPHINE_COUPLED; ++algorithm) {
    memset(&o, 0xAB, sizeof o);
    CHECK(trephine_scene_options_init(&o, older) == TREPHINE_OK);
    CHECK(o.struct_size == older);
    for (size_t i = older; i < sizeof o; ++i) CHECK(((const unsigned char*)&o)[i] == 0xAB);
    o.algorithm = algorithm;
    o.isovalue = 300;
    o.rotational_stiffness = -1; /* would be refused, were it read */
    trephine_scene* scene = NULL;
    CHECK(trephine_scene_create(grid, &o, &scene) == TREPHINE_OK);
    trephine_scene_destroy(scene);
  }
  trephine_scene* scene = NULL;
  o.struct_size = (uint32_t)offsetof(trephine_scene_options, tool_name); /* a header before named tools */
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "rotational_stiffness");
  o.rotational_stiffness = 0.3;
  CHECK(trephine_scene_create(grid, &o, &scene) == TREPHINE_OK);
  trephine_scene_destroy(scene);
  /* Older than the first release there is none. */
  memset(&o, 0xAB, sizeof o);
  CHECK_REFUSED(trephine_scene_options_init(&o, older - 8), TREPHINE_WRONG_STRUCT, "this library knows");
  CHECK(((const unsigned char*)&o)[0] == 0xAB);
  trephine_grid_destroy(grid);
}

/* A device without torque: the virtual tool turns as the device does. */
static void without_torque(void) {
  trephine_grid* grid = make_grid();
  trephine_scene_options o = scene_options(TREPHINE_COUPLED);
  o.torque_limit = 0;
  trephine_scene* scene = NULL;
  CHECK(trephine_scene_create(grid, &o, &scene) == TREPHINE_OK);
  trephine_tick_result r;
  CHECK(trephine_tick_result_init(&r, sizeof r) == TREPHINE_OK);
  /* Lying along x, the shaft on the bone, the ball beside it: what touches there would turn a tool that may. */
  trephine_pose X_WT = {{-4e-3, 10e-3, kSurface + 5e-3}, {0, sqrt(0.5), 0, sqrt(0.5)}};
  for (int i = 0; i < 500; ++i) {
    X_WT.position[2] -= 1e-5;
    CHECK(trephine_scene_tick(scene, &X_WT, 0, 1e-3, &r) == TREPHINE_OK);
  }
  CHECK(r.shaft == 1 && r.force[2] > 0.1);
  for (int i = 0; i < 3; ++i) CHECK(r.torque[i] == 0);
  for (int i = 0; i < 4; ++i) CHECK(fabs(r.X_WV.rotation[i] - X_WT.rotation[i]) < 1e-6);
  trephine_scene_destroy(scene);
  trephine_grid_destroy(grid);
}

/* A float grid in another place: the force turns with it. */
static void turn(void) {
  float* densities = malloc(kVoxels * sizeof(float));
  if (densities == NULL) exit(2);
  for (int i = 0; i < kVoxels; ++i) densities[i] = voxels[i];
  trephine_grid_options o = grid_options();
  o.density_type = TREPHINE_FLOAT32;
  /* G's z is W's x: a quarter turn about y. */
  const trephine_pose X_WG = {{0.1, 0, 0}, {0, sqrt(0.5), 0, sqrt(0.5)}};
  o.X_WG = X_WG;
  trephine_grid* grid = NULL;
  CHECK(trephine_grid_create(&o, densities, kVoxels * sizeof(float), &grid) == TREPHINE_OK);
  free(densities);
  const trephine_scene_options s = scene_options(TREPHINE_SURFACE);
  trephine_scene* scene = NULL;
  CHECK(trephine_scene_create(grid, &s, &scene) == TREPHINE_OK);
  trephine_tick_result r;
  CHECK(trephine_tick_result_init(&r, sizeof r) == TREPHINE_OK);
  const trephine_pose X_WT = {{0.1 + kSurface + 1e-3, 10e-3, -10e-3}, {0, sqrt(0.5), 0, sqrt(0.5)}};
  CHECK(trephine_scene_tick(scene, &X_WT, 0, 1e-3, &r) == TREPHINE_OK);
  CHECK(r.force[0] > 0.1 && fabs(r.force[1]) < 1e-3 && fabs(r.force[2]) < 1e-3);
  trephine_scene_destroy(scene);
  trephine_grid_destroy(grid);
}

enum { kLabelSide = 40 };
static uint8_t labels[kLabelSide * kLabelSide * kLabelSide];

/* A box 3 mm below the surface that must stay, and one beside the drill's way that may break. They share the grid. */
static trephine_structures* make_structures(void) {
  for (int k = 0; k < kLabelSide; ++k)
    for (int j = 0; j < kLabelSide; ++j)
      for (int i = 0; i < kLabelSide; ++i) {
        const int keep = k >= 9 && k <= 12 && i >= 16 && i <= 24 && j >= 16 && j <= 24;
        const int may_break = k >= 14 && k <= 17 && i >= 22 && i <= 25 && j >= 18 && j <= 22;
        labels[(k * kLabelSide + j) * kLabelSide + i] = (uint8_t)(keep ? 1 : may_break ? 2 : 0);
      }
  trephine_labels_options o;
  CHECK(trephine_labels_options_init(&o, sizeof o) == TREPHINE_OK);
  CHECK(o.reach == 0.006 && o.threads == 0 && o.X_GS.rotation[3] == 1);
  for (int a = 0; a < 3; ++a) {
    o.size[a] = kLabelSide;
    o.spacing[a] = kSpacing;
  }
  trephine_structures* structures = NULL;
  CHECK(trephine_structures_create(&o, labels, sizeof labels, &structures) == TREPHINE_OK);
  int32_t count = 0;
  CHECK(trephine_structures_count(structures, &count) == TREPHINE_OK);
  CHECK(count == 2);

  trephine_structures* none = NULL;
  CHECK_REFUSED(trephine_structures_create(NULL, labels, sizeof labels, &none), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_structures_create(&o, labels, 7, &none), TREPHINE_INVALID_ARGUMENT, "one number a voxel");
  o.reach = 0;
  CHECK_REFUSED(trephine_structures_create(&o, labels, sizeof labels, &none), TREPHINE_INVALID_ARGUMENT, "reach");
  o.reach = 0.006;
  o.X_GS.rotation[0] = 0.1;
  CHECK_REFUSED(trephine_structures_create(&o, labels, sizeof labels, &none), TREPHINE_INVALID_ARGUMENT, "quaternion");
  CHECK(none == NULL);
  return structures;
}

/* The drill goes straight down to 0.5 mm below the upper side of the first structure. */
static trephine_pose deeper(int tick) {
  const double top = 12.5 * kSpacing, from = kSurface + 2e-3, to = top - 0.5e-3;
  return tool_at(from + 1.5e-3 + (to - from) * (tick < 1000 ? tick / 1000.0 : 1.0));
}

/* Another guard, made apart: in, and out again with its counts. The twin's does not fit. */
static void exchange(trephine_structures* s, trephine_scene* scene, trephine_scene* twin, const trephine_pose* X_WT,
                     double taken) {
  trephine_guard_options g;
  CHECK(trephine_guard_options_init(&g, sizeof g) == TREPHINE_OK);
  CHECK(g.push == 1 && g.ramp_time == 0.25 && g.smoothing == 0.6e-3 && g.linear_budget == 0 && g.angular_budget == 0);
  trephine_protection *other = NULL, *wrong = NULL;
  g.ramp_time = 0;
  CHECK(trephine_structures_set_guard(s, &g) == TREPHINE_OK);
  CHECK_REFUSED(trephine_protection_create(scene, s, &other), TREPHINE_INVALID_ARGUMENT, "ramp_time");
  g.ramp_time = 0.01;
  g.linear_budget = 20;
  CHECK(trephine_structures_set_guard(s, &g) == TREPHINE_OK);
  CHECK_REFUSED(trephine_protection_create(scene, s, &other), TREPHINE_INVALID_ARGUMENT, "angular");
  g.angular_budget = 0.01;
  CHECK(trephine_structures_set_guard(s, &g) == TREPHINE_OK);
  CHECK_REFUSED(trephine_protection_create(NULL, s, &other), TREPHINE_NULL_ARGUMENT, "null");
  CHECK(other == NULL);
  CHECK(trephine_protection_create(scene, s, &other) == TREPHINE_OK);
  CHECK(trephine_protection_create(twin, NULL, &wrong) == TREPHINE_OK);
  CHECK_REFUSED(trephine_scene_exchange(scene, wrong), TREPHINE_INVALID_ARGUMENT, "made for this scene");
  CHECK_REFUSED(trephine_scene_exchange(scene, NULL), TREPHINE_NULL_ARGUMENT, "null");
  trephine_tick_result r;
  CHECK(trephine_tick_result_init(&r, sizeof r) == TREPHINE_OK);
  CHECK(trephine_scene_tick(scene, X_WT, 1, 1e-3, &r) == TREPHINE_OK);
  const double before = r.push_force[2];
  CHECK(trephine_scene_exchange(scene, other) == TREPHINE_OK);
  for (int tick = 0; tick < 20; ++tick) CHECK(trephine_scene_tick(scene, X_WT, 1, 1e-3, &r) == TREPHINE_OK);
  CHECK(r.push_force[2] > 0 && r.push_force[2] < 0.1 * before); /* the budget, faded in within 10 ticks */
  trephine_structure_totals t;
  CHECK(trephine_structure_totals_init(&t, sizeof t) == TREPHINE_OK);
  CHECK(trephine_scene_structure_totals(scene, 1, &t) == TREPHINE_OK && t.taken_mm3 == 0 && t.breaches == 1);
  CHECK(trephine_protection_structure_totals(other, 1, &t) == TREPHINE_OK && fabs(t.taken_mm3 - taken) < 1e-9);
  CHECK(trephine_scene_exchange(scene, other) == TREPHINE_OK);
  CHECK(trephine_scene_structure_totals(scene, 1, &t) == TREPHINE_OK && fabs(t.taken_mm3 - taken) < 1e-9);
  for (int tick = 0; tick < 300; ++tick) CHECK(trephine_scene_tick(scene, X_WT, 1, 1e-3, &r) == TREPHINE_OK);
  trephine_protection_destroy(other);
  trephine_protection_destroy(wrong);
  trephine_protection_destroy(NULL);
}

static void structures(void) {
  trephine_structures* s = make_structures();
  trephine_structure_options o;
  CHECK(trephine_structure_options_init(&o, sizeof o) == TREPHINE_OK);
  CHECK(o.guard == TREPHINE_GUARD_PUSH && o.veto == TREPHINE_VETO_PROTECT && o.margin == 1e-3 && o.stiffness == 1000);
  o.stiffness = 500;
  o.veto_margin = 0.3e-3;
  CHECK(trephine_structures_set(s, 0, &o) == TREPHINE_OK);
  o.guard = TREPHINE_GUARD_WARN;
  o.veto = TREPHINE_VETO_WATCH;
  CHECK(trephine_structures_set(s, 1, &o) == TREPHINE_OK);
  CHECK_REFUSED(trephine_structures_set(s, 2, &o), TREPHINE_INVALID_ARGUMENT, "no structure 2");
  CHECK_REFUSED(trephine_structures_set(s, -1, &o), TREPHINE_INVALID_ARGUMENT, "no structure -1");
  o.veto = 9;
  CHECK_REFUSED(trephine_structures_set(s, 1, &o), TREPHINE_INVALID_ARGUMENT, "veto");
  o.guard = 9;
  CHECK_REFUSED(trephine_structures_set(s, 1, &o), TREPHINE_INVALID_ARGUMENT, "guard");
  o.struct_size = 5;
  CHECK_REFUSED(trephine_structures_set(s, 1, &o), TREPHINE_WRONG_STRUCT, "struct_size is 5");
  CHECK_REFUSED(trephine_structures_set(NULL, 0, &o), TREPHINE_NULL_ARGUMENT, "null");

  const char* name = NULL;
  CHECK(trephine_structures_name(s, 1, &name) == TREPHINE_OK && strcmp(name, "structure 2") == 0);
  CHECK(trephine_structures_set_name(s, 1, "chorda tympani") == TREPHINE_OK);
  CHECK(trephine_structures_name(s, 1, &name) == TREPHINE_OK && strcmp(name, "chorda tympani") == 0);
  CHECK_REFUSED(trephine_structures_set_name(s, 1, ""), TREPHINE_INVALID_ARGUMENT, "one line");
  CHECK_REFUSED(trephine_structures_set_name(s, 1, "a\nb"), TREPHINE_INVALID_ARGUMENT, "one line");
  CHECK_REFUSED(trephine_structures_set_name(s, 2, "c"), TREPHINE_INVALID_ARGUMENT, "no structure 2");
  CHECK_REFUSED(trephine_structures_name(s, 2, &name), TREPHINE_INVALID_ARGUMENT, "no structure 2");
  CHECK_REFUSED(trephine_structures_name(s, 0, NULL), TREPHINE_NULL_ARGUMENT, "null");

  trephine_grid* grid = make_grid();
  trephine_scene_options options = scene_options(TREPHINE_COUPLED);
  trephine_scene *scene = NULL, *twin = NULL; /* the twin warns only */
  CHECK(trephine_scene_create(grid, &options, &scene) == TREPHINE_OK);
  trephine_grid* twin_grid = make_grid();
  CHECK(trephine_scene_create(twin_grid, &options, &twin) == TREPHINE_OK);
  CHECK_REFUSED(trephine_scene_set_structures(NULL, s), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_scene_set_push(NULL, 1), TREPHINE_NULL_ARGUMENT, "null");
  trephine_tick_result r, t;
  CHECK(trephine_tick_result_init(&r, sizeof r) == TREPHINE_OK);
  CHECK(trephine_tick_result_init(&t, sizeof t) == TREPHINE_OK);
  CHECK(r.nearest == -1 && isinf(r.distance));
  trephine_pose X_WT = deeper(0);
  CHECK(trephine_scene_tick(scene, &X_WT, 0, 1e-3, &r) == TREPHINE_OK);
  CHECK(r.nearest == -1 && isinf(r.distance) && r.warns == 0 && r.push_force[2] == 0);
  CHECK(trephine_scene_set_structures(scene, s) == TREPHINE_OK);
  CHECK(trephine_scene_set_structures(twin, s) == TREPHINE_OK);
  CHECK(trephine_scene_set_push(twin, 0) == TREPHINE_OK);
  CHECK(trephine_scene_tick(twin, &X_WT, 0, 1e-3, &t) == TREPHINE_OK);
  double refused = 0, taken = 0, push = 0, least = 1;
  int off = 0, warned = 0;
  for (int tick = 1; tick < 1200; ++tick) {
    X_WT = deeper(tick);
    CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &r) == TREPHINE_OK);
    CHECK(trephine_scene_tick(twin, &X_WT, 1, 1e-3, &t) == TREPHINE_OK);
    refused += r.refused_mm3;
    taken += r.taken_mm3;
    warned += r.warns;
    if (r.push_force[2] > push) push = r.push_force[2];
    if (r.distance < least) least = r.distance;
    for (int i = 0; i < 3; ++i) {
      off += fabs(r.force[i] - r.push_force[i] - t.force[i]) > 1e-9;
      off += fabs(r.torque[i] - r.push_torque[i] - t.torque[i]) > 1e-9;
    }
    off += t.push_force[2] != 0 || t.distance != r.distance || t.nearest != r.nearest || t.warns != r.warns;
  }
  printf("structures: push %.2f N, distance %.2f mm, refused %.2f mm3, taken %.2f mm3\n", push, 1e3 * least, refused,
         taken);
  CHECK(off == 0);
  CHECK(r.nearest == 1 && warned > 100); /* the drill is deeper in what may break */
  CHECK(push > 0.5 && push < 2.4);
  CHECK(least < 0 && least > -1e-3);
  CHECK(refused > 0.5 && taken > 0.5);
  static int16_t now[kVoxels];
  CHECK(trephine_grid_copy(grid, now, sizeof now) == TREPHINE_OK);
  int lost = 0, broken = 0;
  for (int v = 0; v < kVoxels; ++v) {
    lost += labels[v] == 1 && now[v] < 300;
    broken += labels[v] == 2 && now[v] < 300;
  }
  CHECK(lost == 0);
  CHECK(broken > 0 && fabs(taken - broken * 0.125) < 1e-9);
  trephine_structure_totals first, second;
  CHECK(trephine_structure_totals_init(&first, sizeof first) == TREPHINE_OK);
  second = first;
  CHECK(trephine_scene_structure_totals(scene, 0, &first) == TREPHINE_OK);
  CHECK(trephine_scene_structure_totals(scene, 1, &second) == TREPHINE_OK);
  CHECK(fabs(first.refused_mm3 - refused) < 1e-9 && first.taken_mm3 == 0 && second.refused_mm3 == 0);
  CHECK(fabs(second.taken_mm3 - taken) < 1e-9 && second.breaches == 1);
  CHECK(trephine_scene_structure_totals(scene, 7, &first) == TREPHINE_OK && first.refused_mm3 == 0);
  first.struct_size = 3;
  CHECK_REFUSED(trephine_scene_structure_totals(scene, 0, &first), TREPHINE_WRONG_STRUCT, "struct_size is 3");
  exchange(s, scene, twin, &X_WT, taken);

  /* A caller with an older header gets the same tick, and nothing beyond its struct is touched. */
  const size_t older = offsetof(trephine_tick_result, nearest);
  memset(&t, 0xAB, sizeof t);
  CHECK(trephine_tick_result_init(&t, older) == TREPHINE_OK);
  CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &t) == TREPHINE_OK);
  CHECK(fabs(t.force[2] - r.force[2]) < 0.1 && t.struct_size == older);
  for (size_t i = older; i < sizeof t; ++i) CHECK(((const unsigned char*)&t)[i] == 0xAB);

  /* Refused options leave the scene as it was. */
  CHECK(trephine_structure_options_init(&o, sizeof o) == TREPHINE_OK);
  o.margin = 0.04;
  CHECK(trephine_structures_set(s, 0, &o) == TREPHINE_OK);
  CHECK_REFUSED(trephine_scene_set_structures(scene, s), TREPHINE_INVALID_ARGUMENT, "reach");
  CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &r) == TREPHINE_OK);
  CHECK(r.nearest == 1 && r.push_force[2] > 0.5);
  trephine_structures_destroy(s);
  trephine_structures_destroy(NULL);
  CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &r) == TREPHINE_OK);
  CHECK(r.nearest == 1);
  CHECK(trephine_scene_set_structures(scene, NULL) == TREPHINE_OK);
  CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &r) == TREPHINE_OK);
  CHECK(r.nearest == -1 && isinf(r.distance) && r.push_force[2] == 0);
  trephine_scene_destroy(scene);
  trephine_scene_destroy(twin);
  trephine_grid_destroy(grid);
  trephine_grid_destroy(twin_grid);
}

/* A tool by its name: the coupled tool alone, another one between ticks, and all names where it is none. */
static void named_tools(void) {
  trephine_grid* grid = make_grid();
  trephine_scene* scene = NULL;
  trephine_scene_options o = scene_options(TREPHINE_COUPLED);
  CHECK(o.tool_name == NULL);
  o.tool_name = "ball-3";
  CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "match-head-1.5 to 5");
  CHECK(strstr(trephine_last_error(), "got ball-3") != NULL);
  for (int algorithm = TREPHINE_LINE; algorithm <= TREPHINE_SURFACE; ++algorithm) {
    o = scene_options(algorithm);
    o.tool_name = "match-head-3";
    CHECK_REFUSED(trephine_scene_create(grid, &o, &scene), TREPHINE_INVALID_ARGUMENT, "line and surface take a Burr");
  }
  CHECK(scene == NULL);
  o = scene_options(TREPHINE_COUPLED);
  o.tool_name = "match-head-3";
  CHECK(trephine_scene_create(grid, &o, &scene) == TREPHINE_OK);
  trephine_tick_result r;
  CHECK(trephine_tick_result_init(&r, sizeof r) == TREPHINE_OK);
  /* Half a ball in front: pressed like one. */
  const double radius = 1.5e-3, depth = radius / 2;
  trephine_pose X_WT = tool_at(kSurface + radius);
  for (int i = 0; i <= 200; ++i) {
    X_WT = tool_at(kSurface + radius + 1e-3 - (1e-3 + depth) * i / 200);
    CHECK(trephine_scene_tick(scene, &X_WT, 0, 1e-3, &r) == TREPHINE_OK);
    CHECK(r.status == TREPHINE_STATUS_OK);
  }
  CHECK(r.tip == 1 && fabs(r.force[2] - o.stiffness * depth) < 0.15 * o.stiffness * depth);
  /* Less deep than the head is long, its hole is that of a round burr. */
  double hole[2];
  for (int round = 0; round < 2; ++round) {
    if (round == 1) {
      trephine_scene_destroy(scene);
      CHECK(trephine_grid_restore(grid, 1000, NULL) == TREPHINE_OK);
      o.tool_name = "round-3";
      CHECK(trephine_scene_create(grid, &o, &scene) == TREPHINE_OK);
    }
    for (int i = -50; i <= 600; ++i) {
      X_WT = tool_at(kSurface + radius - 3e-3 * (i < 500 ? i : 500) / 500);
      CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &r) == TREPHINE_OK);
    }
    hole[round] = r.removed_total_mm3;
  }
  printf("holes: %.2f mm3 of a match head, %.2f of a round burr\n", hole[0], hole[1]);
  CHECK(hole[0] > 17 && fabs(hole[0] - hole[1]) < 0.02 * hole[1]);

  /* A wider tool in that hole lies in bone; its force is to be ramped, and it removes nothing by itself. */
  const double before = r.removed_total_mm3;
  CHECK(trephine_scene_set_tool(scene, "cylinder-4") == TREPHINE_OK);
  CHECK(trephine_scene_tick(scene, &X_WT, 0, 1e-3, &r) == TREPHINE_OK);
  CHECK(r.status == TREPHINE_STATUS_STARTED_INSIDE && r.removed_total_mm3 == before);
  for (int i = 0; i < 200; ++i) CHECK(trephine_scene_tick(scene, &X_WT, 1, 1e-3, &r) == TREPHINE_OK);
  CHECK(r.removed_total_mm3 > before + 15); /* 44 mm3 in all, and the hole was 20 */
  CHECK_REFUSED(trephine_scene_set_tool(scene, "disc"), TREPHINE_INVALID_ARGUMENT, "disc-3 to 20");
  CHECK_REFUSED(trephine_scene_set_tool(scene, NULL), TREPHINE_NULL_ARGUMENT, "null");
  CHECK_REFUSED(trephine_scene_set_tool(NULL, "disc-3"), TREPHINE_NULL_ARGUMENT, "null");
  trephine_scene_destroy(scene);

  /* A scene with a round burr takes another shape too. */
  o = scene_options(TREPHINE_COUPLED);
  CHECK(trephine_scene_create(grid, &o, &scene) == TREPHINE_OK);
  CHECK(trephine_scene_set_tool(scene, "disc-3") == TREPHINE_OK);
  trephine_scene_destroy(scene);
  trephine_grid_destroy(grid);
}

/* Milling by the law of cutting: true forces in each tick, the device's share of them, and edges of the tool's name. At
   6000 rpm both burrs have come to the feed of the hand in 1.5 s; a slower diamond still presses the spring together. */
static trephine_scene* law_scene(trephine_grid* grid, const char* name) {
  trephine_scene_options o = scene_options(TREPHINE_COUPLED);
  CHECK(o.force_scale == 1 && o.stall_torque == 0 && fabs(o.spindle_speed - TREPHINE_RPM(30000)) < 1e-9);
  o.milling = TREPHINE_MILL_BY_LAW;
  o.tool_name = name;
  o.stiffness = 2000;
  o.spindle_speed = TREPHINE_RPM(6000);
  o.force_scale = 0.02;
  o.stall_torque = 1;
  o.cortical_density = 1200;
  trephine_scene* scene = NULL;
  CHECK(trephine_scene_create(grid, &o, &scene) == TREPHINE_OK);
  return scene;
}

static void by_law(void) {
  trephine_grid* grids[3];
  trephine_scene* scenes[3];
  const char* const names[3] = {"round-3", "diamond-3", "round-3"};
  for (int s = 0; s < 3; ++s) {
    grids[s] = make_grid();
    scenes[s] = law_scene(grids[s], names[s]);
  }
  CHECK(trephine_scene_set_tool(scenes[2], "diamond-3") == TREPHINE_OK);
  trephine_tick_result r[3];
  for (int s = 0; s < 3; ++s) CHECK(trephine_tick_result_init(&r[s], sizeof r[s]) == TREPHINE_OK);
  int different = 0;
  for (int i = 0; i < 1500; ++i) {
    const trephine_pose X_WT = tool_at(kSurface + 1.6e-3 - 2e-6 * i);
    for (int s = 0; s < 3; ++s) CHECK(trephine_scene_tick(scenes[s], &X_WT, 1, 1e-3, &r[s]) == TREPHINE_OK);
    different += memcmp(&r[1], &r[2], sizeof r[1]) != 0;
  }
  printf("by law: %.1f N, %.1f N mm of a round burr, %.1f N of a diamond\n", r[0].thrust, 1e3 * r[0].spindle_torque,
         r[1].thrust);
  CHECK(different == 0);
  CHECK(r[1].thrust > 1.1 * r[0].thrust); /* grains press by their negative rake */
  for (int s = 0; s < 2; ++s) {
    CHECK(r[s].spindle_torque > 3e-3);
    CHECK(fabs(r[s].force[2] - 0.02 * r[s].thrust) < 0.05 * 0.02 * r[s].thrust);
    CHECK(fabs(r[s].torque[2] - 0.02 * r[s].spindle_torque) < 0.1 * 0.02 * r[s].spindle_torque);
    CHECK(fabs(r[s].spindle_speed / TREPHINE_RPM(6000) - 1 + r[s].spindle_torque) < 0.02);
    CHECK(fabs(r[s].feed - 2e-3) < 0.3 * 2e-3);
    CHECK(r[s].removed_total_mm3 > 5);
  }
  /* Nothing with the spindle off, and a caller with an older header gets no more than it knows. */
  const trephine_pose X_WT = tool_at(kSurface + 1e-3);
  for (int i = 0; i < 2; ++i) CHECK(trephine_scene_tick(scenes[0], &X_WT, 0, 1e-3, &r[0]) == TREPHINE_OK);
  CHECK(r[0].spindle_torque == 0 && r[0].spindle_speed == 0 && r[0].feed == 0);
  const size_t older = offsetof(trephine_tick_result, thrust);
  memset(&r[0], 0xAB, sizeof r[0]);
  CHECK(trephine_tick_result_init(&r[0], older) == TREPHINE_OK);
  CHECK(trephine_scene_tick(scenes[0], &X_WT, 1, 1e-3, &r[0]) == TREPHINE_OK);
  for (size_t i = older; i < sizeof r[0]; ++i) CHECK(((const unsigned char*)&r[0])[i] == 0xAB);
  for (int s = 0; s < 3; ++s) trephine_scene_destroy(scenes[s]);

  trephine_scene* scene = NULL;
  trephine_scene_options o = scene_options(TREPHINE_SURFACE);
  o.milling = TREPHINE_MILL_BY_LAW;
  CHECK_REFUSED(trephine_scene_create(grids[0], &o, &scene), TREPHINE_INVALID_ARGUMENT, "for TREPHINE_COUPLED");
  o = scene_options(TREPHINE_COUPLED);
  o.milling = TREPHINE_MILL_BY_LAW;
  o.force_scale = 2;
  CHECK_REFUSED(trephine_scene_create(grids[0], &o, &scene), TREPHINE_INVALID_ARGUMENT, "force_scale");
  /* A header before the law: its defaults. */
  o.struct_size = (uint32_t)offsetof(trephine_scene_options, spindle_speed);
  CHECK(trephine_scene_create(grids[0], &o, &scene) == TREPHINE_OK);
  trephine_scene_destroy(scene);
  o = scene_options(TREPHINE_COUPLED);
  o.milling = TREPHINE_MILL_BY_LAW;
  o.stall_torque = -1;
  CHECK_REFUSED(trephine_scene_create(grids[0], &o, &scene), TREPHINE_INVALID_ARGUMENT, "stall_torque");
  for (int s = 0; s < 3; ++s) trephine_grid_destroy(grids[s]);
}

int main(void) {
  fill();
  CHECK(trephine_version() == TREPHINE_EXPECTED_VERSION);
  CHECK(trephine_last_error()[0] == '\0');
  drill(TREPHINE_LINE);
  drill(TREPHINE_SURFACE);
  drill(TREPHINE_COUPLED);
  named_tools();
  by_law();
  without_torque();
  structures();
  older_structs();
  refuse_grids();
  refuse_scenes();
  turn();
  failures += for_engines();
  if (failures == 0) printf("the C interface works\n");
  return failures == 0 ? 0 : 1;
}
