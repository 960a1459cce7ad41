// SPDX-License-Identifier: MIT
#include "trephine_c.h"

#include "any_scene.hpp"
#include "guard.hpp"

#include <trephine/version.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <variant>
#include <vector>

using namespace trephine;
using namespace trephine_c;

struct trephine_grid {
  AnyGrid grid;
};

struct trephine_scene {
  std::unique_ptr<Scene> scene;
  double removed_mm3 = 0;
};

struct trephine_reader {
  // Bricks that were named by a poll and not yet by a caller's list come out of `pending` from its end.
  struct Of {
    explicit Of(AnyGrid g) : grid(std::move(g)) {}
    virtual ~Of() = default;
    Of(const Of&) = delete;
    Of& operator=(const Of&) = delete;
    virtual void poll() = 0;
    virtual void copy(std::size_t brick, void* to, std::size_t bytes) const = 0;
    AnyGrid grid;  // kept alive
    std::array<int, 3> bricks{};
    std::vector<std::int32_t> pending;
  };
  std::unique_ptr<Of> of;
};

namespace {

template <VoxelDensity Density>
struct ReaderOf final : trephine_reader::Of {
  ReaderOf(const AnyGrid& any, const VoxelGrid<Density>& of) : trephine_reader::Of(any), reader(of) {
    bricks = of.bricks();
    pending.reserve(reader.brick_count());
  }
  void poll() override {
    reader.poll([this](std::size_t b) { pending.push_back(static_cast<std::int32_t>(b)); });
  }
  void copy(std::size_t brick, void* to, std::size_t bytes) const override {
    constexpr std::size_t kCount =
        std::size_t{GridReader<Density>::kHaloed} * GridReader<Density>::kHaloed * GridReader<Density>::kHaloed;
    require(bytes == kCount * sizeof(Density), "trephine_reader_copy: needs a buffer of ", kCount * sizeof(Density),
            " bytes, got ", bytes);
    static_cast<void>(reader.copy_brick(brick, std::span<Density, kCount>(static_cast<Density*>(to), kCount)));
  }
  GridReader<Density> reader;
};

template <VoxelDensity Density>
std::shared_ptr<VoxelGrid<Density>> make_grid(const trephine_grid_options& o, const void* voxels, std::size_t bytes) {
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
  return std::make_shared<VoxelGrid<Density>>(geometry,
                                              std::span<const Density>(static_cast<const Density*>(voxels), count),
                                              GridOptions{.keep_original = o.keep_original != 0});
}

AnyGrid make_any_grid(const trephine_grid_options& o, const void* voxels, std::size_t bytes) {
  switch (o.density_type) {
    case TREPHINE_INT16:
      return make_grid<std::int16_t>(o, voxels, bytes);
    case TREPHINE_FLOAT32:
      return make_grid<float>(o, voxels, bytes);
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

trephine_tick_result default_tick_result() {
  trephine_tick_result r{};
  r.X_WV = kIdentity;
  return r;
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
    *grid = std::make_unique<trephine_grid>(trephine_grid{make_any_grid(o, voxels, bytes)}).release();
  });
}

void trephine_grid_destroy(trephine_grid* grid) noexcept { delete grid; }

trephine_result trephine_grid_set_pose(trephine_grid* grid, const trephine_pose* X_WG) noexcept {
  return guarded([&] {
    require_pointers(grid, X_WG);
    const Posed X = checked_pose(*X_WG);
    std::visit([&](const auto& g) { g->set_X_WG(X); }, grid->grid);
  });
}

trephine_result trephine_grid_restore(trephine_grid* grid, size_t most_bricks, size_t* left) noexcept {
  return guarded([&] {
    require_pointers(grid);
    const std::size_t more = std::visit([&](const auto& g) { return g->restore(most_bricks); }, grid->grid);
    if (left != nullptr) *left = more;
  });
}

trephine_result trephine_grid_copy(const trephine_grid* grid, void* voxels, size_t bytes) noexcept {
  return guarded([&] {
    require_pointers(grid, voxels);
    std::visit(
        [&]<class Density>(const std::shared_ptr<VoxelGrid<Density>>& g) {
          require(bytes % sizeof(Density) == 0, "trephine_grid_copy: ", bytes, " bytes are no whole number of voxels");
          g->copy_voxels({static_cast<Density*>(voxels), bytes / sizeof(Density)});
        },
        grid->grid);
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
    *scene = std::make_unique<trephine_scene>(trephine_scene{make_scene(grid->grid, o)}).release();
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
    const TickResult r = scene->scene->tick({.X_WT = X, .spindle_on = spindle_on != 0}, dt);
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
    out.X_WV = from_pose(scene->scene->visual_pose());
    out.contacts = r.contact.count;
    out.tip = r.contact.tip ? 1 : 0;
    out.shaft = r.contact.shaft ? 1 : 0;
    write_struct(out, *result);
  });
}

trephine_result trephine_scene_reset(trephine_scene* scene) noexcept {
  return guarded([&] {
    require_pointers(scene);
    scene->scene->reset();
  });
}

trephine_result trephine_reader_create(const trephine_grid* grid, trephine_reader** reader) noexcept {
  return guarded([&] {
    require_pointers(grid, reader);
    auto of = std::visit(
        [&]<class Density>(const std::shared_ptr<VoxelGrid<Density>>& g) -> std::unique_ptr<trephine_reader::Of> {
          return std::make_unique<ReaderOf<Density>>(grid->grid, *g);
        },
        grid->grid);
    *reader = std::make_unique<trephine_reader>(trephine_reader{std::move(of)}).release();
  });
}

void trephine_reader_destroy(trephine_reader* reader) noexcept { delete reader; }

trephine_result trephine_reader_bricks(const trephine_reader* reader, int32_t bricks[3]) noexcept {
  return guarded([&] {
    require_pointers(reader, bricks);
    for (std::size_t a = 0; a < 3; ++a) bricks[a] = reader->of->bricks[a];
  });
}

trephine_result trephine_reader_changed(trephine_reader* reader, int32_t* bricks, size_t room, size_t* count) noexcept {
  return guarded([&] {
    require_pointers(reader, count);
    require(bricks != nullptr || room == 0, "trephine_reader_changed: room for ", room, " bricks at null");
    auto& of = *reader->of;
    if (of.pending.empty()) of.poll();
    std::size_t n = 0;
    for (; n < room && !of.pending.empty(); ++n) {
      bricks[n] = of.pending.back();
      of.pending.pop_back();
    }
    *count = n;
  });
}

trephine_result trephine_reader_copy(const trephine_reader* reader, int32_t brick, void* voxels,
                                     size_t bytes) noexcept {
  return guarded([&] {
    require_pointers(reader, voxels);
    const auto& n = reader->of->bricks;
    require(brick >= 0 && brick < n[0] * n[1] * n[2], "trephine_reader_copy: there is no brick ", brick);
    reader->of->copy(static_cast<std::size_t>(brick), voxels, bytes);
  });
}
