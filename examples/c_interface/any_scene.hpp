// SPDX-License-Identifier: MIT
#pragma once

#include "trephine_c.h"

#include <trephine/core/tick.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <cstdint>
#include <memory>
#include <variant>

/// Scenes that are chosen at run time. In C++ a scene's parts are its type; here every choice that the C interface
/// offers is compiled, and one virtual call a tick picks it.
namespace trephine_c {

using AnyGrid =
    std::variant<std::shared_ptr<trephine::VoxelGrid<std::int16_t>>, std::shared_ptr<trephine::VoxelGrid<float>>>;

class Scene {
 public:
  Scene() = default;
  virtual ~Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  [[nodiscard]] virtual trephine::TickResult tick(const trephine::TickInput& input, double dt) noexcept = 0;
  [[nodiscard]] virtual trephine::Posed visual_pose() const noexcept = 0;
  virtual void reset() noexcept = 0;
};

[[nodiscard]] trephine_scene_options default_scene_options();

/// Throws std::invalid_argument. The scene keeps the grid alive.
[[nodiscard]] std::unique_ptr<Scene> make_scene(const AnyGrid& grid, const trephine_scene_options& options);

}  // namespace trephine_c
