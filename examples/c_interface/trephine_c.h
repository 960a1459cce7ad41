/* SPDX-License-Identifier: MIT */
#ifndef TREPHINE_C_H
#define TREPHINE_C_H

/* trephine for programs that speak C: Unity and Unreal plug-ins, C itself.
 *
 * Units are SI throughout: m, s, N, N m. Frames: W the world, G the grid (origin: the centre of voxel (0,0,0)), T the
 * tool (origin: the burr's centre; +z along the shaft toward the handle). A pose X_WT maps coordinates of T to W. Axes
 * are right-handed; Unity's and Unreal's are not, so poses, forces and torques are mirrored (trephine_mirror_pose).
 *
 * Errors: functions return a trephine_result; trephine_last_error() then tells in one line what was wrong, in the
 * calling thread. A function that fails changes nothing and leaves its outputs alone, unless it says otherwise.
 *
 * Structs that may grow begin with `struct_size`. Have them filled with defaults, the size being that of the caller's
 * header, and change what is needed: a newer library reads and writes no more than that, an older one refuses.
 *
 *   trephine_scene_options options;
 *   trephine_scene_options_init(&options, sizeof options);
 *
 * Threads: one thread, the haptic one, calls tick and reset on a scene and pose and restore on its grid. Each reader is
 * for one thread, whichever that is, and reads while the haptic thread drills. Protections are made and destroyed on
 * any thread while a scene ticks. The rest is for one thread at a time that is not in a tick. Handles may be destroyed
 * in any order: scenes and readers keep their grid alive. */

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32) && defined(TREPHINE_C_BUILDS)
#define TREPHINE_C_API __declspec(dllexport)
#elif defined(_WIN32)
#define TREPHINE_C_API __declspec(dllimport)
#else
#define TREPHINE_C_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
#define TREPHINE_C_NOEXCEPT noexcept
extern "C" {
#else
#define TREPHINE_C_NOEXCEPT
#endif

typedef int32_t trephine_result;
enum {
  TREPHINE_OK = 0,
  TREPHINE_NULL_ARGUMENT = 1,    /* a handle or a pointer is null */
  TREPHINE_INVALID_ARGUMENT = 2, /* a value is out of its range */
  TREPHINE_WRONG_STRUCT = 3,     /* struct_size is none that this library knows */
  TREPHINE_OUT_OF_MEMORY = 4,
  TREPHINE_INTERNAL_ERROR = 5
};

/* Never null; empty before the calling thread's first error. Valid until that thread's next error. */
TREPHINE_C_API const char* trephine_last_error(void) TREPHINE_C_NOEXCEPT;
/* 10000 * major + 100 * minor + patch. */
TREPHINE_C_API int32_t trephine_version(void) TREPHINE_C_NOEXCEPT;

/* Position [m] and rotation as a quaternion x, y, z, w. A quaternion is normalised; one whose length is more than 0.001
 * off 1 is not a rotation. */
typedef struct trephine_pose {
  double position[3];
  double rotation[4];
} trephine_pose;

/* ---- The bone ---------------------------------------------------------------------------------------------------- */

typedef struct trephine_grid trephine_grid;

enum { TREPHINE_INT16 = 0, TREPHINE_FLOAT32 = 1 };

typedef struct trephine_grid_options {
  uint32_t struct_size;
  int32_t density_type;  /* TREPHINE_INT16 (default: Hounsfield units) or _FLOAT32 */
  int32_t size[3];       /* voxels along x (fastest in memory), y, z; each >= 1. Default 0: must be given */
  int32_t keep_original; /* 1 (default): a copy is kept for trephine_grid_restore */
  double spacing[3];     /* [m]. Default 0: must be given */
  trephine_pose X_WG;    /* default: identity */
  double outside;        /* density beyond the grid; NaN (default): the smallest in the data */
} trephine_grid_options;

TREPHINE_C_API trephine_result trephine_grid_options_init(trephine_grid_options* options,
                                                          size_t struct_size) TREPHINE_C_NOEXCEPT;
/* Copies `bytes` bytes of voxels, which must be size's product times the size of a density. */
TREPHINE_C_API trephine_result trephine_grid_create(const trephine_grid_options* options, const void* voxels,
                                                    size_t bytes, trephine_grid** grid) TREPHINE_C_NOEXCEPT;
/* Null is ignored. */
TREPHINE_C_API void trephine_grid_destroy(trephine_grid* grid) TREPHINE_C_NOEXCEPT;
/* Moves the bone; haptic thread, between ticks. */
TREPHINE_C_API trephine_result trephine_grid_set_pose(trephine_grid* grid,
                                                      const trephine_pose* X_WG) TREPHINE_C_NOEXCEPT;
/* Puts original densities back in up to `most_bricks` edited bricks; `left` (may be null) tells how many more there
 * are. Haptic thread, between ticks: a few at a time keep it short. Invalid without keep_original. */
TREPHINE_C_API trephine_result trephine_grid_restore(trephine_grid* grid, size_t most_bricks,
                                                     size_t* left) TREPHINE_C_NOEXCEPT;
/* Copies all voxels, x fastest, to a buffer of exactly their bytes: for saving. Haptic thread, between ticks. */
TREPHINE_C_API trephine_result trephine_grid_copy(const trephine_grid* grid, void* voxels,
                                                  size_t bytes) TREPHINE_C_NOEXCEPT;

/* ---- The scene: one tool in one bone ------------------------------------------------------------------------------
 */

typedef struct trephine_scene trephine_scene;

enum { TREPHINE_LINE = 0, TREPHINE_SURFACE = 1, TREPHINE_COUPLED = 2 };
enum {
  TREPHINE_MILL_NOTHING = 0,
  TREPHINE_MILL_GEOMETRIC = 1,
  TREPHINE_MILL_RATE_LIMITED = 2,
  TREPHINE_MILL_BY_LAW = 3
};
/* Turns a minute as radians a second. */
#define TREPHINE_RPM(turns) ((turns)*0.10471975511965977)

typedef struct trephine_tool {
  double tip_radius;   /* [m] */
  double shaft_radius; /* [m] */
  double shaft_length; /* from the burr's centre [m]; 0: no shaft */
} trephine_tool;

typedef struct trephine_scene_options {
  uint32_t struct_size;
  int32_t algorithm; /* TREPHINE_LINE, TREPHINE_SURFACE (default) or TREPHINE_COUPLED */
  double isovalue;   /* density from which on there is bone. Default NaN: must be given */
  trephine_tool tool;
  /* [N/m]; Coupled: of the coupling, which is all that the hand feels. Line, Coupled: where bone gives way the force
   * falls by 60 N/s. */
  double stiffness;
  int32_t sphere_vertices; /* Surface: on the tip */
  int32_t slices;          /* Surface: along the shaft */
  int32_t per_slice;       /* Surface: vertices round each slice */
  int32_t shaft_vertices;  /* Line: along the shaft's centre */
  double static_friction;  /* Line, Coupled: coefficients, 0 <= kinetic <= static */
  double kinetic_friction;
  double damping;              /* in contact [N s/m] */
  double angular_damping;      /* in contact [N m s/rad] */
  int32_t milling;             /* TREPHINE_MILL_NOTHING, _GEOMETRIC (default), _RATE_LIMITED or _BY_LAW */
  int32_t reserved;            /* 0 */
  double milling_rate;         /* rate-limited: densities/s that a covered voxel loses */
  double milling_force;        /* rate-limited: that rate holds at this force [N]; 0 (default): force plays no part */
  double force_limit;          /* [N] */
  double torque_limit;         /* [N m]; 0 for a device without torque */
  double rotational_stiffness; /* Coupled: of the coupling [N m/rad] */
  /* Coupled: a tool's family and diameter in mm, as "match-head-3", instead of `tool`; null (default): `tool`. A wrong
   * name is refused with all that there are. Read in the call alone. */
  const char* tool_name;
  /* By law, Coupled alone: bone gives way at the feed at which the thrust of the cutting edges equals the contact's
   * force; their torque and sideways pull come on top. The edges are those of tool_name, else 8 flutes. */
  double spindle_speed;    /* without load [rad/s]. Default 30000 turns a minute */
  double force_scale;             /* share of the true forces that the device gets, in (0, 1]: 1/60 for a drill. Default 1 */
  double stall_torque;     /* at which the spindle stands [N m]; 0 (default): it keeps its speed */
  double soft_density;     /* without strength: of water. Default 0 HU */
  double cortical_density; /* of cortical bone, > soft_density. Default 1700 HU */
} trephine_scene_options;

TREPHINE_C_API trephine_result trephine_scene_options_init(trephine_scene_options* options,
                                                           size_t struct_size) TREPHINE_C_NOEXCEPT;
TREPHINE_C_API trephine_result trephine_scene_create(trephine_grid* grid, const trephine_scene_options* options,
                                                     trephine_scene** scene) TREPHINE_C_NOEXCEPT;
/* Null is ignored. */
TREPHINE_C_API void trephine_scene_destroy(trephine_scene* scene) TREPHINE_C_NOEXCEPT;

enum {
  TREPHINE_STATUS_OK = 0,
  TREPHINE_STATUS_WORK_BOUND = 1,     /* a search was cut short and goes on at the next tick */
  TREPHINE_STATUS_STARTED_INSIDE = 2, /* the tool appeared in bone. Surface's force comes at once, here and at a jump:
                                         bring it back by a trephine_ramp. The others' rises by a slope */
  TREPHINE_STATUS_JUMP = 3,           /* tool or bone moved farther in a tick than a hand can; nothing was milled */
  TREPHINE_STATUS_BAD_INPUT = 4,      /* pose not finite, no rotation or absurdly far: zero wrench, nothing milled */
  TREPHINE_STATUS_NON_FINITE = 5,     /* a law overflowed: zero wrench, contact starts anew */
  TREPHINE_STATUS_FAR_AWAY = 6        /* the tool stays over 2 m from the bone: are poses in metres? */
};

typedef struct trephine_tick_result {
  uint32_t struct_size;
  int32_t status;           /* TREPHINE_STATUS_... */
  double force[3];          /* on the tool, W axes [N]; always finite */
  double torque[3];         /* on the tool about T's origin, W axes [N m]; always finite */
  double depth;             /* deepest penetration [m] */
  double removed_mm3;       /* in this tick [mm^3] */
  double removed_total_mm3; /* since the scene was made [mm^3]; restoring the bone does not lower it */
  trephine_pose X_WV;       /* where to draw the tool */
  int32_t contacts;         /* places that touch */
  uint8_t tip, shaft;       /* 1: in contact */
  uint8_t reserved[2];      /* 0 */
  /* Of structures, see trephine_scene_set_structures. */
  int32_t nearest;       /* number of the structure nearest to the tool; -1: none known */
  int32_t warns;         /* 1: that structure is guarded and nearer than its margin */
  double distance;       /* of the whole tool from it [m], negative inside; infinite: none known */
  double push_force[3];  /* the guard's part of `force` [N] */
  double push_torque[3]; /* the guard's part of `torque` [N m] */
  double refused_mm3;    /* protected bone that cuts would have taken in this tick, each voxel once [mm^3] */
  double taken_mm3;      /* bone of watched structures that cuts took in this tick, each voxel once [mm^3] */
  /* True forces of TREPHINE_MILL_BY_LAW, before the device's share; 0 otherwise. */
  double thrust;         /* of the contact on the head; of a drill along its axis [N] */
  double spindle_torque; /* of the bone about the spindle's axis [N m] */
  double spindle_speed;  /* [rad/s] */
  double feed;           /* speed at which the head may advance [m/s] */
} trephine_tick_result;

TREPHINE_C_API trephine_result trephine_tick_result_init(trephine_tick_result* result,
                                                         size_t struct_size) TREPHINE_C_NOEXCEPT;
/* One step of the loop: the tool's pose, whether the burr turns, the measured time since the last tick [s] (clamped to
 * 10 us .. 100 ms). A pose that cannot be used is no error here: the result's status says so and its wrench is zero, so
 * that a loop has one way out. Takes no memory, lock or clock, unless it fails. */
TREPHINE_C_API trephine_result trephine_scene_tick(trephine_scene* scene, const trephine_pose* X_WT, int32_t spindle_on,
                                                   double dt, trephine_tick_result* result) TREPHINE_C_NOEXCEPT;
/* Another tool, for scenes of the coupled tool, of a burr too. From the next tick on the scene is as a new
 * one with that tool, and edges are the tool's: where the tool then lies in bone the status is
 * TREPHINE_STATUS_STARTED_INSIDE. Haptic thread, between ticks; takes no memory, unless it fails. Refused while
 * structures are guarded: take them out before, and set them again after. */
TREPHINE_C_API trephine_result trephine_scene_set_tool(trephine_scene* scene, const char* name) TREPHINE_C_NOEXCEPT;
/* Forgets contact and velocity; the bone and the removed volume stay. So does the force that acts, with the coupled tool
 * and Line: the next ticks go on from it by a slope. */
TREPHINE_C_API trephine_result trephine_scene_reset(trephine_scene* scene) TREPHINE_C_NOEXCEPT;

/* ---- Structures that must not be cut ------------------------------------------------------------------------------
 */

typedef struct trephine_structures trephine_structures;

typedef struct trephine_labels_options {
  uint32_t struct_size;
  int32_t size[3];    /* voxels along x (fastest in memory), y, z; each >= 1. Default 0: must be given */
  double spacing[3];  /* [m]. Default 0: must be given */
  trephine_pose X_GS; /* of the labels' frame in the grid's; default identity: both share a grid */
  double reach;       /* half width of the bands with distances of each structure [m]. Default 0.006 */
  int32_t threads;    /* that build; 0 (default): as many as the machine has */
  int32_t raw;        /* 0 (default): surfaces are fitted to the labels; 1: they lie midway between voxels */
} trephine_labels_options;

TREPHINE_C_API trephine_result trephine_labels_options_init(trephine_labels_options* options,
                                                            size_t struct_size) TREPHINE_C_NOEXCEPT;
/* Builds the distances from `bytes` labels, a byte a voxel: 0 is none, s + 1 is structure s. Takes seconds; not for the
 * haptic thread. */
TREPHINE_C_API trephine_result trephine_structures_create(const trephine_labels_options* options, const uint8_t* labels,
                                                          size_t bytes,
                                                          trephine_structures** structures) TREPHINE_C_NOEXCEPT;
/* Null is ignored. Scenes keep what they use. */
TREPHINE_C_API void trephine_structures_destroy(trephine_structures* structures) TREPHINE_C_NOEXCEPT;
/* Number of structures: the highest label. */
TREPHINE_C_API trephine_result trephine_structures_count(const trephine_structures* structures,
                                                         int32_t* count) TREPHINE_C_NOEXCEPT;

enum { TREPHINE_GUARD_OFF = 0, TREPHINE_GUARD_WARN = 1, TREPHINE_GUARD_PUSH = 2 };
enum { TREPHINE_VETO_FREE = 0, TREPHINE_VETO_WATCH = 1, TREPHINE_VETO_PROTECT = 2, TREPHINE_VETO_KEEP_IN = 3 };

typedef struct trephine_structure_options {
  uint32_t struct_size;
  int32_t guard;         /* TREPHINE_GUARD_OFF, _WARN (within the margin) or _PUSH (default: also out of it) */
  double margin;         /* distance at which the push begins [m] */
  double stiffness;      /* of the push [N/m] */
  double greatest_force; /* the push grows no further [N] */
  double damping;        /* of motion toward the structure [N s/m] */
  int32_t veto;          /* TREPHINE_VETO_FREE, _WATCH (count what is cut), _PROTECT (default) or _KEEP_IN (a cavity) */
  int32_t reserved;      /* 0 */
  double veto_margin;    /* no cut takes bone within this of the border [m]. Default 0 */
} trephine_structure_options;

TREPHINE_C_API trephine_result trephine_structure_options_init(trephine_structure_options* options,
                                                               size_t struct_size) TREPHINE_C_NOEXCEPT;
/* Options of structure s, from the next trephine_scene_set_structures on. Their ranges are checked there. */
TREPHINE_C_API trephine_result trephine_structures_set(trephine_structures* structures, int32_t structure,
                                                       const trephine_structure_options* options) TREPHINE_C_NOEXCEPT;
/* A structure's name, one line, copied; "structure 1" unless set. The name that is given back is valid until the next
 * is set or the structures are destroyed. */
TREPHINE_C_API trephine_result trephine_structures_set_name(trephine_structures* structures, int32_t structure,
                                                            const char* name) TREPHINE_C_NOEXCEPT;
TREPHINE_C_API trephine_result trephine_structures_name(const trephine_structures* structures, int32_t structure,
                                                        const char** name) TREPHINE_C_NOEXCEPT;

typedef struct trephine_guard_options {
  uint32_t struct_size;
  int32_t push;          /* 1 (default); 0: distances and warnings, but no force */
  double ramp_time;      /* in which a push fades in and out [s]. Default 0.25 */
  double smoothing;      /* over which distances are smoothed [m]. Default 0.0006 */
  double linear_budget;  /* most that the guard may stiffen the loop [N/m]; 0 (default): no budget ... */
  double angular_budget; /* ... and about T's origin [N m/rad]. Both or none are given */
} trephine_guard_options;

TREPHINE_C_API trephine_result trephine_guard_options_init(trephine_guard_options* options,
                                                           size_t struct_size) TREPHINE_C_NOEXCEPT;
/* Options of the guard for all structures, from the next trephine_scene_set_structures on. */
TREPHINE_C_API trephine_result trephine_structures_set_guard(trephine_structures* structures,
                                                             const trephine_guard_options* options) TREPHINE_C_NOEXCEPT;
/* Guards structures and keeps cuts from them, instead of those before; null takes guard and vetoes out. Haptic thread,
 * between ticks; takes memory and up to seconds. Margin + the tool's largest radius + 2.6 smoothings must be within
 * `reach`, and so must a veto's margin + the diagonal of a voxel of bone. */
TREPHINE_C_API trephine_result trephine_scene_set_structures(trephine_scene* scene,
                                                             const trephine_structures* structures) TREPHINE_C_NOEXCEPT;
/* The same without memory in the haptic thread: guard and vetoes are made on another thread, while the scene ticks, and
 * exchanged between ticks. The protection then holds those before, for another thread to destroy.
 *
 *   trephine_protection_create(scene, structures, &protection);   any thread; nobody changes the structures meanwhile
 *   trephine_scene_exchange(scene, protection);                   haptic thread, between ticks; microseconds
 *   trephine_protection_destroy(protection);                      any thread
 */
typedef struct trephine_protection trephine_protection;

/* Null structures: one that protects nothing. The scene must not be destroyed meanwhile. */
TREPHINE_C_API trephine_result trephine_protection_create(const trephine_scene* scene,
                                                          const trephine_structures* structures,
                                                          trephine_protection** protection) TREPHINE_C_NOEXCEPT;
/* Null is ignored. */
TREPHINE_C_API void trephine_protection_destroy(trephine_protection* protection) TREPHINE_C_NOEXCEPT;
/* Only for the scene that the protection was made for. A push that acts ends at once: fade it out before. */
TREPHINE_C_API trephine_result trephine_scene_exchange(trephine_scene* scene,
                                                       trephine_protection* protection) TREPHINE_C_NOEXCEPT;

typedef struct trephine_structure_totals {
  uint32_t struct_size;
  int32_t breaches;   /* times that the tool went into the structure while it was guarded */
  double refused_mm3; /* protected bone that cuts would have taken, each voxel once [mm^3] */
  double taken_mm3;   /* bone that cuts took of it while it was watched, each voxel once [mm^3] */
} trephine_structure_totals;

TREPHINE_C_API trephine_result trephine_structure_totals_init(trephine_structure_totals* totals,
                                                              size_t struct_size) TREPHINE_C_NOEXCEPT;
/* What was counted of structure s since its protection came into the scene; zeros for a number that is none. Haptic
 * thread, between ticks; no memory. */
TREPHINE_C_API trephine_result trephine_scene_structure_totals(const trephine_scene* scene, int32_t structure,
                                                               trephine_structure_totals* totals) TREPHINE_C_NOEXCEPT;
/* The same of a protection that left the scene. */
TREPHINE_C_API trephine_result trephine_protection_structure_totals(
    const trephine_protection* protection, int32_t structure, trephine_structure_totals* totals) TREPHINE_C_NOEXCEPT;
/* Switches the guard's push, which fades in or out in its ramp time; distances and vetoes stay. Haptic thread, between
 * ticks.
 */
TREPHINE_C_API trephine_result trephine_scene_set_push(trephine_scene* scene, int32_t on) TREPHINE_C_NOEXCEPT;

/* ---- What changed, for a mesher on another thread -----------------------------------------------------------------
 */

typedef struct trephine_reader trephine_reader;

enum { TREPHINE_BRICK = 8, TREPHINE_HALOED = 10 }; /* voxels along a brick's edge; with one more on each side */

/* Every brick counts as changed at first. */
TREPHINE_C_API trephine_result trephine_reader_create(const trephine_grid* grid,
                                                      trephine_reader** reader) TREPHINE_C_NOEXCEPT;
/* Null is ignored. */
TREPHINE_C_API void trephine_reader_destroy(trephine_reader* reader) TREPHINE_C_NOEXCEPT;
/* Bricks along x, y, z; brick b is (b % x, b / x % y, b / x / y). */
TREPHINE_C_API trephine_result trephine_reader_bricks(const trephine_reader* reader,
                                                      int32_t bricks[3]) TREPHINE_C_NOEXCEPT;
/* Writes the numbers of up to `room` bricks that changed since they were last named and how many it wrote; those for
 * which there was no room come next time. 0: nothing changed. */
TREPHINE_C_API trephine_result trephine_reader_changed(trephine_reader* reader, int32_t* bricks, size_t room,
                                                       size_t* count) TREPHINE_C_NOEXCEPT;
/* Copies brick b and one voxel round it, x fastest, TREPHINE_HALOED^3 densities of the grid's type in `bytes` bytes;
 * voxel (0,0,0) of the copy is voxel 8 * (brick's x, y, z) - 1 of the grid. */
TREPHINE_C_API trephine_result trephine_reader_copy(const trephine_reader* reader, int32_t brick, void* voxels,
                                                    size_t bytes) TREPHINE_C_NOEXCEPT;

/* ---- The surface of the bone, for a renderer ----------------------------------------------------------------------
 */

enum {
  TREPHINE_MESH_MIRRORED = 1, /* z is negated, for left-handed axes. Alone: as Unreal draws, with 100 units a metre */
  TREPHINE_MESH_CLOCKWISE = 2 /* seen from outside; else triangles are counter-clockwise. Both flags: as Unity draws */
};

/* Makes brick b's share of the surface where densities reach `isovalue`, and tells how many vertices and indices it
 * has: none where no surface passes. The reader keeps it until the next call, whatever the haptic thread drills. Bricks
 * that share a vertex give it and its normal the same bits, so no crack shows once all changed bricks are made anew.
 * Takes memory, and some tens of microseconds. */
TREPHINE_C_API trephine_result trephine_reader_mesh(trephine_reader* reader, int32_t brick, double isovalue,
                                                    int32_t flags, size_t* vertices,
                                                    size_t* indices) TREPHINE_C_NOEXCEPT;
/* Copies what trephine_reader_mesh made: x, y, z of each vertex [m] and of its unit normal out of the bone (null: no
 * normals), and three indices a triangle. Refused where there is room for fewer vertices or indices. They are in G,
 * because then a bone that moves needs no new mesh: draw it at X_WG, mirrored likewise. */
TREPHINE_C_API trephine_result trephine_reader_copy_mesh(const trephine_reader* reader, float* positions,
                                                         float* normals, size_t vertex_room, uint32_t* indices,
                                                         size_t index_room) TREPHINE_C_NOEXCEPT;

/* ---- What a loop multiplies force and torque by before they go to a device ----------------------------------------
 */

typedef struct trephine_ramp trephine_ramp;

/* Rises from 0 to 1 in `duration` [s]; 0.1 is usual. */
TREPHINE_C_API trephine_result trephine_ramp_create(double duration, trephine_ramp** ramp) TREPHINE_C_NOEXCEPT;
/* Null is ignored. */
TREPHINE_C_API void trephine_ramp_destroy(trephine_ramp* ramp) TREPHINE_C_NOEXCEPT;
/* The factor for a tick's wrench, from its status and the measured time since the last tick [s]. It is 0 at first, and
 * again at a stall of over 20 ms, at each status from TREPHINE_STATUS_BAD_INPUT on, and at a jump or a start in bone
 * where the scene lets its wrench step. Haptic thread, once after each tick; takes no memory, unless it fails. */
TREPHINE_C_API trephine_result trephine_ramp_step(trephine_ramp* ramp, const trephine_scene* scene, int32_t status,
                                                  double dt, double* factor) TREPHINE_C_NOEXCEPT;
/* The next factor is 0, and rises from there: for a device that tripped, or whatever else let go of the hand. */
TREPHINE_C_API trephine_result trephine_ramp_restart(trephine_ramp* ramp) TREPHINE_C_NOEXCEPT;

/* ---- Left-handed axes ---------------------------------------------------------------------------------------------
 * Mirrors z. Each is its own inverse, and may write over what it reads: from W to the host's axes and back. A tool's
 * shaft, along +z in T, is along -z there. No unit changes: Unreal's lengths are centimetres. */

TREPHINE_C_API trephine_result trephine_mirror_pose(const trephine_pose* from, trephine_pose* to) TREPHINE_C_NOEXCEPT;
/* Forces, positions and velocities. */
TREPHINE_C_API trephine_result trephine_mirror_force(const double from[3], double to[3]) TREPHINE_C_NOEXCEPT;
/* Torques and angular velocities. */
TREPHINE_C_API trephine_result trephine_mirror_torque(const double from[3], double to[3]) TREPHINE_C_NOEXCEPT;

#ifdef __cplusplus
}
#endif

#endif
