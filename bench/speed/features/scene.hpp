// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/render/stiffness_budget.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace trephine {
template <VoxelDensity Density>
class ClearanceMap;
}  // namespace trephine

/// Scenes that differ by one feature, each in a translation unit of its own that includes what it lists and no more:
/// its object file is a minimal program with that scene. scenes.cmake makes them from scene.cpp.in.
namespace trephine::bench {

/// Where all scenes are ticked. None of them changes it.
struct Place {
  VoxelGrid<std::uint8_t>& bone;
  double isovalue;
  ClearanceMap<std::uint8_t>& air;
};

/// What a scene has as a number and not as a type.
struct Settings {
  Burr burr;
  std::optional<StiffnessBudget> budget{};
  double rotational_stiffness = 0.3;  ///< of the coupled tool [N·m/rad]
  bool statistics = false;            ///< of a servo loop
};

/// What must not depend on a neutral feature.
struct Outcome {
  Wrenchd wrench;
  Posed X_WP = Posed::Identity();  ///< the proxy
  Status status = Status::kOk;
  ContactSummary contact{};
};

class FeatureScene {
 public:
  FeatureScene() = default;
  FeatureScene(const FeatureScene&) = delete;
  FeatureScene& operator=(const FeatureScene&) = delete;
  virtual ~FeatureScene() = default;
  /// All of a path from its start; outcomes are told where `out` has room for all of them.
  virtual void run(std::span<const TickInput> path, double dt, std::span<Outcome> out) noexcept = 0;
  /// sizeof of the scene, and of what stands around it here: what it allocates counts in neither.
  [[nodiscard]] virtual std::size_t bytes() const noexcept = 0;
  [[nodiscard]] virtual std::size_t wrapped_bytes() const noexcept = 0;
};

using MakeScene = std::unique_ptr<FeatureScene> (*)(const Place&, const Settings&);

/// The scenes that are linked.
struct Registered {
  std::string renderer, name;
  MakeScene make;

  Registered(const char* of, const char* called, MakeScene by) : renderer(of), name(called), make(by) {
    all().push_back(this);
  }
  Registered(const Registered&) = delete;
  Registered& operator=(const Registered&) = delete;
  static std::vector<const Registered*>& all();
};

template <class Scene>
class TickedScene final : public FeatureScene {
 public:
  explicit TickedScene(Scene scene) : scene_(std::move(scene)) {}

  void run(std::span<const TickInput> path, double dt, std::span<Outcome> out) noexcept override {
    scene_.reset();
    const bool told = out.size() == path.size();
    for (std::size_t i = 0; i < path.size(); ++i) {
      const TickResult r = scene_.tick(path[i], dt);
      if (told) out[i] = {r.wrench, scene_.proxy_pose_W(), r.status, r.contact};
    }
  }
  [[nodiscard]] std::size_t bytes() const noexcept override { return sizeof(Scene); }
  [[nodiscard]] std::size_t wrapped_bytes() const noexcept override { return sizeof(TickedScene); }

 private:
  Scene scene_;
};

/// A scene of a renderer and parts.
template <class Renderer, class... Parts>
[[nodiscard]] std::unique_ptr<FeatureScene> scene_of(const Place& place, Renderer renderer, Parts... parts) {
  using Scene = HapticScene<std::uint8_t, Renderer, Parts...>;
  return std::make_unique<TickedScene<Scene>>(
      Scene(place.bone, place.isovalue, std::move(renderer), std::move(parts)...));
}

}  // namespace trephine::bench
