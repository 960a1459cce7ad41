// SPDX-License-Identifier: MIT
#pragma once

#include "support/figures.hpp"
#include "support/path_work.hpp"
#include "support/poses.hpp"
#include "support/raster.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

/// Images, tools and scenes of the coupled tool's tests.
namespace trephine::test::coupled {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kH = 3e-4;  ///< spacing unless a test says otherwise [m]
inline constexpr double kK = 800;   ///< stiffness [N/m]
inline constexpr double kForce = 3.3;
inline constexpr double kDt = 1e-3;
/// Without a bound on the wrench's change: contact alone is looked at. Tests of the bound set one.
inline const CoupledOptions kGains{.stiffness = kK,
                                   .rotational_stiffness = 0.3,
                                   .force = kForce,
                                   .torque = 0.1,
                                   .release = std::numeric_limits<double>::infinity()};
inline constexpr Burr kBall{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0};
inline constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.040};

using Bone = VoxelGrid<std::int16_t>;
inline constexpr double kIso = 0;  ///< of these images, from −1000 to 1000

struct ImageOptions {
  std::array<int, 3> size{44, 44, 44};
  Vec3d spacing = Vec3d::Constant(kH);
  double sigma = 1;  ///< of the blur [finest spacings]
  double noise = 0;  ///< standard deviation
  unsigned seed = 1;
  [[nodiscard]] Vec3d middle() const {
    return 0.5 * spacing.cwiseProduct(Vec3d(size[0] - 1, size[1] - 1, size[2] - 1));
  }
  /// The middle and up to a voxel more along each axis.
  [[nodiscard]] Vec3d near_middle(Random& random) const {
    return middle() + Vec3d{random.uniform(), random.uniform(), random.uniform()}.cwiseProduct(spacing);
  }
};

template <class Value>
[[nodiscard]] Bone make_bone(const ImageOptions& o, Value&& value) {
  std::vector<std::int16_t> voxels;
  Random noise(o.seed);
  for (int k = 0; k < o.size[2]; ++k)
    for (int j = 0; j < o.size[1]; ++j)
      for (int i = 0; i < o.size[0]; ++i)
        voxels.push_back(
            nearest_density<std::int16_t>(value(i, j, k) + (o.noise > 0 ? o.noise * noise.normal() : 0.0)));
  return Bone({.size = o.size, .spacing = o.spacing}, voxels);
}

/// A shape by its signed distance, blurred as a plane is: exact for planes.
template <class Shape>
[[nodiscard]] Bone image(const Shape& shape, const ImageOptions& o) {
  const double width = o.sigma * o.spacing.minCoeff() * std::sqrt(2.0);
  return make_bone(
      o, [&](int i, int j, int k) { return -1000 * std::erf(shape(o.spacing.cwiseProduct(Vec3d(i, j, k))) / width); });
}

/// A shape's inside, truly blurred: shares of voxels, then a Gaussian that makes sigma of them.
template <class Shape>
[[nodiscard]] Bone blurred(const Shape& shape, const ImageOptions& o, int points = 3) {
  const std::array<int, 3>& n = o.size;
  const auto at = [&](int i, int j, int k) { return static_cast<std::size_t>((k * n[1] + j) * n[0] + i); };
  std::vector<double> v(static_cast<std::size_t>(n[0] * n[1] * n[2])), w(v.size());
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double d = shape(o.spacing.cwiseProduct(Vec3d(i, j, k)));
        int in = 0;
        const int all = points * points * points;
        if (std::abs(d) > o.spacing.norm())
          in = d < 0 ? all : 0;
        else
          for (int c = 0; c < all; ++c) {
            const Vec3d f(c % points, c / points % points, c / (points * points));
            const Vec3d q = Vec3d(i, j, k) + (f + Vec3d::Constant(0.5)) / points - Vec3d::Constant(0.5);
            in += shape(o.spacing.cwiseProduct(q)) <= 0 ? 1 : 0;
          }
        v[at(i, j, k)] = static_cast<double>(in) / all;
      }
  // A voxel's box has a variance of 1/12 itself.
  const double s = std::sqrt(std::max(1e-6, o.sigma * o.sigma - 1.0 / 12));
  const int reach = static_cast<int>(std::ceil(4 * o.sigma));
  std::vector<double> weights;
  double sum = 0;
  for (int q = -reach; q <= reach; ++q) sum += weights.emplace_back(std::exp(-0.5 * q * q / (s * s)));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
          double a = 0;
          for (int q = -reach; q <= reach; ++q) {
            std::array<int, 3> p{i, j, k};
            p[axis] = std::clamp(p[axis] + q, 0, n[axis] - 1);
            a += weights[static_cast<std::size_t>(q + reach)] / sum * v[at(p[0], p[1], p[2])];
          }
          w[at(i, j, k)] = a;
        }
    std::swap(v, w);
  }
  return make_bone(o, [&](int i, int j, int k) { return -1000 + 2000 * v[at(i, j, k)]; });
}

/// A scene of one coupled tool and what else is listed.
template <class Law = Frictionless, class... Parts>
[[nodiscard]] auto coupled_scene(Bone& bone, const Burr& burr, const Law& law = {},
                                 const CoupledOptions& gains = kGains, Parts... parts) {
  return HapticScene{bone, kIso, CoupledToolRenderer<BallAndShaft, Law>{burr, gains, law}, parts...};
}

/// Moves a scene's tool from a to b in `ticks`; the last tick's answer, with the worst status.
template <class Scene>
TickResult lead(Scene& scene, const Posed& a, const Posed& b, int ticks) {
  TickResult out;
  Status worst = Status::kOk;
  for (int i = 0; i <= ticks; ++i) {
    out = scene.tick({.X_WT = between(a, b, static_cast<double>(i) / ticks)}, kDt);
    worst = worse(worst, out.status);
  }
  out.status = worst;
  return out;
}

/// Forces and moments about T's origin at the device of all contacts, less the wrench: as shares of the force and of
/// the force at the tool's radius.
template <class Scene>
double unbalanced(const Scene& scene, const TickResult& r) {
  Vec3d force = Vec3d::Zero(), torque = Vec3d::Zero();
  const Vec3d p = scene.renderer().proxy_pose().translation().template cast<double>();
  for (const auto& c : scene.renderer().contacts()) {
    force += c.force.template cast<double>();
    torque += (c.position.template cast<double>() - p).cross(c.force.template cast<double>());
  }
  const double size = r.wrench.force.norm();
  return std::max((force - r.wrench.force).norm() / size,
                  (torque - r.wrench.torque).norm() / (size * 0.0015 + r.wrench.torque.norm()));
}

/// A wedge of `degrees` about a crest along y, below z = 0 in its own frame.
[[nodiscard]] inline auto wedge(double degrees) {
  const double half = degrees / 2 * kPi / 180;
  return Both{HalfSpace{Vec3d::Zero(), Vec3d(std::cos(half), 0, std::sin(half))},
              HalfSpace{Vec3d::Zero(), Vec3d(-std::cos(half), 0, std::sin(half))}};
}

/// A cube's corner that points up.
[[nodiscard]] inline auto corner() {
  const Mat3d C = rotation_between<double>(Vec3d(1, 1, 1).normalized(), Vec3d::UnitZ());
  return Both{HalfSpace{Vec3d::Zero(), C.col(0)},
              Both{HalfSpace{Vec3d::Zero(), C.col(1)}, HalfSpace{Vec3d::Zero(), C.col(2)}}};
}

}  // namespace trephine::test::coupled
