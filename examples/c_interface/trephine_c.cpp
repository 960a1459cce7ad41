// SPDX-License-Identifier: MIT
#include "trephine_c.h"

#include "guard.hpp"
#include "handles.hpp"

#include <trephine/compiled/scene.hpp>
#include <trephine/compiled/structures.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/version.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

using namespace trephine;
using namespace trephine_c;

namespace {

/// Calls `body` with a number of the type of the bone's voxels.
template <class Body>
void with_density(const compiled::Bone& bone, Body&& body) {
  if (bone.density_type() == compiled::DensityType::kFloat)
    body(float{});
  else
    body(std::int16_t{});
}

template <VoxelDensity Density>
compiled::Bone make_bone(const trephine_grid_options& o, const void* voxels, std::size_t bytes) {
  std::size_t count = 1;
  for (const std::int32_t n : o.size) {
    require(n >= 1 && n <= 1 << 20, "trephine_grid_create: each size must be 1 to 2^20 voxels, got ", n);
    count *= static_cast<std::size_t>(n);
  }
  require(bytes == count * sizeof(Density), "trephine_grid_create: needs ", count * sizeof(Density),
          " bytes of voxels, got ", bytes);
  GridGeometry geometry{.size = {o.size[0], o.size[1], o.size[2]},
                        .spacing = Vec3d(o.spacing[0], o.spacing[1], o.spacing[2]),
                        .X_WG = checked_pose(o.X_WG)};
  if (!std::isnan(o.outside)) geometry.outside = o.outside;
  return compiled::Bone(geometry, std::span(static_cast<const Density*>(voxels), count),
                        GridOptions{.keep_original = o.keep_original != 0});
}

compiled::Bone make_any_bone(const trephine_grid_options& o, const void* voxels, std::size_t bytes) {
  switch (o.density_type) {
    case TREPHINE_INT16:
      return make_bone<std::int16_t>(o, voxels, bytes);
    case TREPHINE_FLOAT32:
      return make_bone<float>(o, voxels, bytes);
    default:
      fail("trephine_grid_create: no such density_type: ", o.density_type);
  }
}

const trephine_pose kIdentity{{0, 0, 0}, {0, 0, 0, 1}};

trephine_grid_options default_grid_options() {
  trephine_grid_options o{};
  o.density_type = TREPHINE_INT16;
  o.keep_original = 1;
  o.X_WG = kIdentity;
  o.outside = std::numeric_limits<double>::quiet_NaN();
  return o;
}

trephine_scene_options default_scene_options() {
  const Burr burr;
  const compiled::RendererOptions renderer;
  trephine_scene_options o{};
  o.algorithm = TREPHINE_SURFACE;
  o.isovalue = std::numeric_limits<double>::quiet_NaN();
  o.tool = {burr.tip_radius, burr.shaft_radius, burr.shaft_length};
  o.stiffness = renderer.surface.stiffness;
  o.sphere_vertices = renderer.surface_counts.sphere;
  o.slices = renderer.surface_counts.slices;
  o.per_slice = renderer.surface_counts.per_slice;
  o.shaft_vertices = renderer.line_counts.shaft;
  o.milling = TREPHINE_MILL_GEOMETRIC;
  o.milling_rate = RateLimitedCut<>{}.rate;
  o.force_limit = 3.3;
  o.torque_limit = 0.1;
  o.rotational_stiffness = renderer.coupled.rotational_stiffness;
  const CuttingForceOptions law;
  o.spindle_speed = law.speed;
  o.force_scale = law.force_scale;
  o.soft_density = law.strength.soft;
  o.cortical_density = law.strength.cortical;
  return o;
}

compiled::RendererOptions renderer_of(const trephine_scene_options& o) {
  compiled::RendererOptions r;
  if (o.algorithm != TREPHINE_SURFACE && (o.static_friction != 0 || o.kinetic_friction != 0))
    r.friction = Coulomb{o.static_friction, o.kinetic_friction};
  switch (o.algorithm) {
    case TREPHINE_LINE:
      r.renderer = compiled::RendererKind::kLine;
      r.line.stiffness = o.stiffness;
      r.line_counts.shaft = o.shaft_vertices;
      return r;
    case TREPHINE_SURFACE:
      r.renderer = compiled::RendererKind::kSurface;
      r.surface.stiffness = o.stiffness;
      r.surface_counts = {.sphere = o.sphere_vertices, .slices = o.slices, .per_slice = o.per_slice};
      return r;
    case TREPHINE_COUPLED:
      r.renderer = compiled::RendererKind::kCoupled;
      r.coupled.stiffness = o.stiffness;
      r.coupled.rotational_stiffness = o.rotational_stiffness;
      r.coupled.force = o.force_limit;
      // Without motors for torque the tool turns as the device does.
      if (o.torque_limit == 0)
        r.coupled.rotational_stiffness = std::numeric_limits<double>::infinity();
      else
        r.coupled.torque = o.torque_limit;
      return r;
    default:
      fail("trephine_scene_create: no such algorithm: ", o.algorithm);
  }
}

CuttingForceOptions law_of(const trephine_scene_options& o, const CuttingEdges& edges) {
  CuttingForceOptions law{.edges = edges,
                          .speed = o.spindle_speed,
                          .strength = {.soft = o.soft_density, .cortical = o.cortical_density},
                          .force_scale = o.force_scale};
  if (o.stall_torque != 0) law.stall_torque = o.stall_torque;
  return law;
}

compiled::StageOptions stages_of(const trephine_scene_options& o, const CuttingEdges& edges) {
  compiled::StageOptions s;
  switch (o.milling) {
    case TREPHINE_MILL_NOTHING:
      break;
    case TREPHINE_MILL_GEOMETRIC:
      s.cut = GeometricCut{};
      break;
    case TREPHINE_MILL_RATE_LIMITED:
      s.cut = RateLimitedCut<>{.rate = o.milling_rate, .reference_force = o.milling_force};
      break;
    case TREPHINE_MILL_BY_LAW:
      require(o.algorithm == TREPHINE_COUPLED, "trephine_scene_create: TREPHINE_MILL_BY_LAW is for TREPHINE_COUPLED");
      s.cut = PressureCut{};
      s.law = law_of(o, edges);
      break;
    default:
      fail("trephine_scene_create: no such milling: ", o.milling);
  }
  // Line's tip is a point, and drops off an edge at once; tip and shaft add up.
  if (o.algorithm == TREPHINE_LINE) s.release_limit = ReleaseLimit::Options{.stiffness = 2 * o.stiffness};
  s.damping = Damping::Options{.linear = o.damping, .angular = o.angular_damping, .only_in_contact = true};
  s.limits = {.force = o.force_limit, .torque = o.torque_limit};
  return s;
}

compiled::Scene scene_of(const compiled::Bone& bone, const trephine_scene_options& o) {
  if (o.tool_name != nullptr) {
    const NamedTool named = tool_by_name(o.tool_name);
    return {bone, o.isovalue, named.tool, renderer_of(o), stages_of(o, named.edges)};
  }
  const Burr burr{o.tool.tip_radius, o.tool.shaft_radius, o.tool.shaft_length};
  return {bone, o.isovalue, burr, renderer_of(o), stages_of(o, {})};
}

trephine_tick_result default_tick_result() {
  trephine_tick_result r{};
  r.X_WV = kIdentity;
  r.nearest = -1;
  r.distance = std::numeric_limits<double>::infinity();
  return r;
}

trephine_labels_options default_labels_options() {
  trephine_labels_options o{};
  o.X_GS = kIdentity;
  o.reach = compiled::LabelGeometry{}.field.reach;
  return o;
}

trephine_structure_options default_structure_options() {
  const auto [guard, veto] = ProtectedStructure{};
  trephine_structure_options o{};
  o.guard = static_cast<std::int32_t>(guard.mode);
  o.margin = guard.margin;
  o.stiffness = guard.stiffness;
  o.greatest_force = guard.greatest_force;
  o.damping = guard.damping;
  o.veto = static_cast<std::int32_t>(veto.mode);
  o.veto_margin = veto.margin;
  return o;
}

static_assert(static_cast<int>(GuardMode::kWarn) == TREPHINE_GUARD_WARN &&
              static_cast<int>(GuardMode::kPush) == TREPHINE_GUARD_PUSH);
static_assert(static_cast<int>(StructureVeto::Mode::kWatch) == TREPHINE_VETO_WATCH &&
              static_cast<int>(StructureVeto::Mode::kProtect) == TREPHINE_VETO_PROTECT &&
              static_cast<int>(StructureVeto::Mode::kKeepIn) == TREPHINE_VETO_KEEP_IN);

ProtectedStructure structure_of(const trephine_structure_options& o) {
  require(o.guard >= TREPHINE_GUARD_OFF && o.guard <= TREPHINE_GUARD_PUSH,
          "trephine_structures_set: no such guard: ", o.guard);
  require(o.veto >= TREPHINE_VETO_FREE && o.veto <= TREPHINE_VETO_KEEP_IN,
          "trephine_structures_set: no such veto: ", o.veto);
  return {.guard = {.mode = static_cast<GuardMode>(o.guard),
                    .margin = o.margin,
                    .stiffness = o.stiffness,
                    .greatest_force = o.greatest_force,
                    .damping = o.damping},
          .veto = {.mode = static_cast<StructureVeto::Mode>(o.veto), .margin = o.veto_margin}};
}

trephine_guard_options default_guard_options() {
  const auto [potential, guard] = ProtectionOptions{};
  trephine_guard_options o{};
  o.push = guard.push ? 1 : 0;
  o.ramp_time = guard.ramp_time;
  o.smoothing = potential.smoothing;
  return o;
}

ProtectionOptions guard_of(const trephine_guard_options& o) {
  ProtectionOptions g{.potential = {.smoothing = o.smoothing},
                      .guard = {.push = o.push != 0, .ramp_time = o.ramp_time}};
  if (o.linear_budget != 0 || o.angular_budget != 0)
    g.potential.budget = StiffnessBudget{o.linear_budget, o.angular_budget};
  return g;
}

void write_totals(const compiled::StructureTotals& t, trephine_structure_totals& to) {
  trephine_structure_totals out{};
  out.breaches = t.breaches;
  out.refused_mm3 = t.refused_mm3;
  out.taken_mm3 = t.taken_mm3;
  write_struct(out, to);
}

}  // namespace

const char* trephine_last_error(void) noexcept { return last_error(); }

int32_t trephine_version(void) noexcept { return 10000 * kVersionMajor + 100 * kVersionMinor + kVersionPatch; }

trephine_result trephine_grid_options_init(trephine_grid_options* options, size_t struct_size) noexcept {
  return guarded([&] { init_struct(options, struct_size, default_grid_options()); });
}

trephine_result trephine_grid_create(const trephine_grid_options* options, const void* voxels, size_t bytes,
                                     trephine_grid** grid) noexcept {
  return guarded([&] {
    require_pointers(options, voxels, grid);
    const auto o = read_struct(*options, default_grid_options());
    *grid = std::make_unique<trephine_grid>(trephine_grid{make_any_bone(o, voxels, bytes)}).release();
  });
}

void trephine_grid_destroy(trephine_grid* grid) noexcept { delete grid; }

trephine_result trephine_grid_set_pose(trephine_grid* grid, const trephine_pose* X_WG) noexcept {
  return guarded([&] {
    require_pointers(grid, X_WG);
    grid->bone.set_X_WG(checked_pose(*X_WG));
  });
}

trephine_result trephine_grid_restore(trephine_grid* grid, size_t most_bricks, size_t* left) noexcept {
  return guarded([&] {
    require_pointers(grid);
    const std::size_t more = grid->bone.restore(most_bricks);
    if (left != nullptr) *left = more;
  });
}

trephine_result trephine_grid_copy(const trephine_grid* grid, void* voxels, size_t bytes) noexcept {
  return guarded([&] {
    require_pointers(grid, voxels);
    with_density(grid->bone, [&]<class Density>(Density) {
      require(bytes % sizeof(Density) == 0, "trephine_grid_copy: ", bytes, " bytes are no whole number of voxels");
      grid->bone.copy_voxels(std::span(static_cast<Density*>(voxels), bytes / sizeof(Density)));
    });
  });
}

trephine_result trephine_scene_options_init(trephine_scene_options* options, size_t struct_size) noexcept {
  return guarded([&] { init_struct(options, struct_size, default_scene_options()); });
}

trephine_result trephine_scene_create(trephine_grid* grid, const trephine_scene_options* options,
                                      trephine_scene** scene) noexcept {
  return guarded([&] {
    require_pointers(grid, options, scene);
    const auto o = read_struct(*options, default_scene_options());
    *scene = std::make_unique<trephine_scene>(trephine_scene{scene_of(grid->bone, o)}).release();
  });
}

void trephine_scene_destroy(trephine_scene* scene) noexcept { delete scene; }

trephine_result trephine_tick_result_init(trephine_tick_result* result, size_t struct_size) noexcept {
  return guarded([&] { init_struct(result, struct_size, default_tick_result()); });
}

trephine_result trephine_scene_tick(trephine_scene* scene, const trephine_pose* X_WT, int32_t spindle_on, double dt,
                                    trephine_tick_result* result) noexcept {
  return guarded([&] {
    require_pointers(scene, X_WT, result);
    check_struct(*result);
    // What is no rotation becomes a pose that the scene refuses.
    Posed X = Posed::Identity();
    if (!to_pose(*X_WT, X)) X.translation().setConstant(std::numeric_limits<double>::quiet_NaN());
    const TickResult r = scene->scene.tick({.X_WT = X, .spindle_on = spindle_on != 0}, dt);
    scene->removed_mm3 += r.removed_mm3;

    trephine_tick_result out{};
    out.status = static_cast<std::int32_t>(r.status);
    for (int i = 0; i < 3; ++i) {
      out.force[i] = r.wrench.force[i];
      out.torque[i] = r.wrench.torque[i];
    }
    out.depth = r.contact.depth;
    out.removed_mm3 = r.removed_mm3;
    out.removed_total_mm3 = scene->removed_mm3;
    out.X_WV = from_pose(scene->scene.visual_pose_W());
    out.contacts = r.contact.count;
    out.tip = r.contact.tip ? 1 : 0;
    out.shaft = r.contact.shaft ? 1 : 0;
    const StructureSummary& s = r.structures;
    out.nearest = s.nearest;
    out.warns = s.warns ? 1 : 0;
    out.distance = s.distance;
    for (int i = 0; i < 3; ++i) {
      out.push_force[i] = s.push.force[i];
      out.push_torque[i] = s.push.torque[i];
    }
    out.refused_mm3 = s.refused_mm3;
    out.taken_mm3 = s.taken_mm3;
    out.thrust = r.cutting.thrust;
    out.spindle_torque = r.cutting.torque;
    out.spindle_speed = r.cutting.spindle;
    out.feed = r.cutting.feed;
    write_struct(out, *result);
  });
}

trephine_result trephine_scene_set_tool(trephine_scene* scene, const char* name) noexcept {
  return guarded([&] {
    require_pointers(scene, name);
    const NamedTool named = tool_by_name(name);
    scene->scene.set_tool(named.tool);
    compiled::StageOptions stages = scene->scene.stages();
    if (!stages.law) return;
    stages.law->edges = named.edges;
    scene->scene.set_stages(stages);
  });
}

trephine_result trephine_scene_reset(trephine_scene* scene) noexcept {
  return guarded([&] {
    require_pointers(scene);
    scene->scene.reset();
  });
}

trephine_result trephine_labels_options_init(trephine_labels_options* options, size_t struct_size) noexcept {
  return guarded([&] { init_struct(options, struct_size, default_labels_options()); });
}

trephine_result trephine_structures_create(const trephine_labels_options* options, const uint8_t* labels, size_t bytes,
                                           trephine_structures** structures) noexcept {
  return guarded([&] {
    require_pointers(options, labels, structures);
    const auto o = read_struct(*options, default_labels_options());
    const compiled::LabelGeometry geometry{.size = {o.size[0], o.size[1], o.size[2]},
                                           .spacing = Vec3d(o.spacing[0], o.spacing[1], o.spacing[2]),
                                           .X_GS = checked_pose(o.X_GS),
                                           .field = {.smooth = o.raw == 0, .reach = o.reach, .threads = o.threads}};
    compiled::Structures made(geometry, std::span(labels, bytes));
    std::vector<ProtectedStructure> each(static_cast<std::size_t>(made.count()));
    std::vector<std::string> names;
    for (int s = 1; s <= made.count(); ++s) names.push_back("structure " + std::to_string(s));
    *structures =
        std::make_unique<trephine_structures>(trephine_structures{std::move(made), std::move(each), std::move(names)})
            .release();
  });
}

void trephine_structures_destroy(trephine_structures* structures) noexcept { delete structures; }

trephine_result trephine_structures_count(const trephine_structures* structures, int32_t* count) noexcept {
  return guarded([&] {
    require_pointers(structures, count);
    *count = structures->distances.count();
  });
}

trephine_result trephine_structure_options_init(trephine_structure_options* options, size_t struct_size) noexcept {
  return guarded([&] { init_struct(options, struct_size, default_structure_options()); });
}

trephine_result trephine_structures_set(trephine_structures* structures, int32_t structure,
                                        const trephine_structure_options* options) noexcept {
  return guarded([&] {
    require_pointers(structures, options);
    structures->each[structures->index("trephine_structures_set", structure)] =
        structure_of(read_struct(*options, default_structure_options()));
  });
}

trephine_result trephine_structures_set_name(trephine_structures* structures, int32_t structure,
                                             const char* name) noexcept {
  return guarded([&] {
    require_pointers(structures, name);
    std::string& own = structures->names[structures->index("trephine_structures_set_name", structure)];
    const std::string_view text(name);
    require(!text.empty() && text.find_first_of("\r\n") == text.npos,
            "trephine_structures_set_name: a name must be one line, not empty");
    own = text;
  });
}

trephine_result trephine_structures_name(const trephine_structures* structures, int32_t structure,
                                         const char** name) noexcept {
  return guarded([&] {
    require_pointers(structures, name);
    *name = structures->names[structures->index("trephine_structures_name", structure)].c_str();
  });
}

trephine_result trephine_guard_options_init(trephine_guard_options* options, size_t struct_size) noexcept {
  return guarded([&] { init_struct(options, struct_size, default_guard_options()); });
}

trephine_result trephine_structures_set_guard(trephine_structures* structures,
                                              const trephine_guard_options* options) noexcept {
  return guarded([&] {
    require_pointers(structures, options);
    structures->options = guard_of(read_struct(*options, default_guard_options()));
  });
}

trephine_result trephine_scene_set_structures(trephine_scene* scene, const trephine_structures* structures) noexcept {
  return guarded([&] {
    require_pointers(scene);
    if (structures != nullptr)
      scene->scene.set_structures(structures->distances, structures->each, structures->options);
    else
      scene->scene.clear_structures();
  });
}

trephine_result trephine_protection_create(const trephine_scene* scene, const trephine_structures* structures,
                                           trephine_protection** protection) noexcept {
  return guarded([&] {
    require_pointers(scene, protection);
    const compiled::Scene& of = scene->scene;
    *protection =
        std::make_unique<trephine_protection>(
            trephine_protection{structures != nullptr
                                    ? of.make_protection(structures->distances, structures->each, structures->options)
                                    : of.make_protection()})
            .release();
  });
}

void trephine_protection_destroy(trephine_protection* protection) noexcept { delete protection; }

trephine_result trephine_scene_exchange(trephine_scene* scene, trephine_protection* protection) noexcept {
  return guarded([&] {
    require_pointers(scene, protection);
    scene->scene.exchange(protection->protection);
  });
}

trephine_result trephine_structure_totals_init(trephine_structure_totals* totals, size_t struct_size) noexcept {
  return guarded([&] { init_struct(totals, struct_size, trephine_structure_totals{}); });
}

trephine_result trephine_scene_structure_totals(const trephine_scene* scene, int32_t structure,
                                                trephine_structure_totals* totals) noexcept {
  return guarded([&] {
    require_pointers(scene, totals);
    check_struct(*totals);
    write_totals(scene->scene.totals(structure), *totals);
  });
}

trephine_result trephine_protection_structure_totals(const trephine_protection* protection, int32_t structure,
                                                     trephine_structure_totals* totals) noexcept {
  return guarded([&] {
    require_pointers(protection, totals);
    check_struct(*totals);
    write_totals(protection->protection.totals(structure), *totals);
  });
}

trephine_result trephine_scene_set_push(trephine_scene* scene, int32_t on) noexcept {
  return guarded([&] {
    require_pointers(scene);
    scene->scene.set_push(on != 0);
  });
}

trephine_result trephine_reader_create(const trephine_grid* grid, trephine_reader** reader) noexcept {
  return guarded([&] {
    require_pointers(grid, reader);
    *reader = std::make_unique<trephine_reader>(grid->bone).release();
  });
}

void trephine_reader_destroy(trephine_reader* reader) noexcept { delete reader; }

trephine_result trephine_reader_bricks(const trephine_reader* reader, int32_t bricks[3]) noexcept {
  return guarded([&] {
    require_pointers(reader, bricks);
    for (std::size_t a = 0; a < 3; ++a) bricks[a] = reader->bone.bricks()[a];
  });
}

trephine_result trephine_reader_changed(trephine_reader* reader, int32_t* bricks, size_t room, size_t* count) noexcept {
  return guarded([&] {
    require_pointers(reader, count);
    require(bricks != nullptr || room == 0, "trephine_reader_changed: room for ", room, " bricks at null");
    auto& pending = reader->pending;
    if (pending.empty())
      reader->reader.poll([&](std::size_t brick) { pending.push_back(static_cast<std::int32_t>(brick)); });
    std::size_t n = 0;
    for (; n < room && !pending.empty(); ++n) {
      bricks[n] = pending.back();
      pending.pop_back();
    }
    *count = n;
  });
}

trephine_result trephine_reader_copy(const trephine_reader* reader, int32_t brick, void* voxels,
                                     size_t bytes) noexcept {
  return guarded([&] {
    require_pointers(reader, voxels);
    require(brick >= 0 && static_cast<std::size_t>(brick) < reader->brick_count(),
            "trephine_reader_copy: there is no brick ", brick);
    with_density(reader->bone, [&]<class Density>(Density) {
      constexpr std::size_t kCount = std::size_t{TREPHINE_HALOED} * TREPHINE_HALOED * TREPHINE_HALOED;
      require(bytes == kCount * sizeof(Density), "trephine_reader_copy: needs a buffer of ", kCount * sizeof(Density),
              " bytes, got ", bytes);
      reader->reader.copy_brick(static_cast<std::size_t>(brick), std::span(static_cast<Density*>(voxels), kCount));
    });
  });
}
