// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/gradient.hpp>

namespace trephine {

/// What contact code asks of the bone: a scalar that is >= 0 in bone and < 0 outside, with its surface at 0, at points
/// given in G [m]. `values` and `gradients` are the batched forms: n points in a frame that X maps to G, n a multiple
/// of kLane; gradients stay in G axes.
// clang-format off
template <class F>
concept ContactField = requires(const F& f, const Vec3<typename F::Scalar>& p, const Pose<typename F::Scalar>& X,
                                const typename F::Scalar* in, typename F::Scalar* out, Vec3<typename F::Scalar>& n) {
  typename F::Scalar;
  { f.value(p) } noexcept -> std::same_as<typename F::Scalar>;
  { f.gradient(p) } noexcept -> std::same_as<Vec3<typename F::Scalar>>;
  { f.normal(p, n) } noexcept -> std::same_as<bool>;
  { f.values(X, in, in, in, out, 16) } noexcept;
  { f.gradients(X, in, in, in, out, out, out, 16) } noexcept;
  { f.voxel() } noexcept -> std::same_as<typename F::Scalar>;
};
// clang-format on

/// Whether a field's values lie between the voxels' as a trilinear interpolant's do, which bent bone shows.
template <class F>
inline constexpr bool kTrilinear = requires {
  requires F::kTrilinear;
};

/// The density of a VoxelGrid above the isovalue, as a field in G. Bone is where it is >= 0: one fixed rule for ties.
/// A view: cheap to make, valid while the grid lives; haptic thread only.
template <VoxelDensity Density, RealScalar S, GradientPolicy GradientChoice = AnalyticGradient>
class DensityField {
 public:
  using Scalar = S;
  static constexpr bool kTrilinear = true;
  static constexpr bool kSmoothNormals = GradientChoice::kSmooth;

  DensityField(const VoxelGrid<Density>& grid, double isovalue) noexcept
      : grid_(&grid),
        view_(grid),
        isovalue_(static_cast<Scalar>(isovalue)),
        per_metre_(grid.spacing().cwiseInverse().template cast<Scalar>()),
        voxel_(static_cast<Scalar>(grid.spacing().minCoeff())),
        longest_(static_cast<Scalar>(grid.spacing().maxCoeff())),
        flat_(static_cast<Scalar>(kFlatShare * (static_cast<double>(grid.original_range().max) -
                                                static_cast<double>(grid.original_range().min)))) {}

  /// Shortest spacing [m]: the unit of step lengths.
  [[nodiscard]] Scalar voxel() const noexcept { return voxel_; }
  [[nodiscard]] const VoxelGrid<Density>& grid() const noexcept { return *grid_; }

  /// Whether all within `radius` [m] of p_G lies beyond the grid, and air is there.
  [[nodiscard]] bool is_beyond(const Vec3<Scalar>& p_G, Scalar radius) const noexcept {
    const Vec3<Scalar> u = coordinates(p_G);
    const Vec3<Scalar> reach = radius * per_metre_;
    const bool below = ((u + reach).array() <= Scalar(0)).any();
    const bool above = ((u - reach - view_.last).array() >= Scalar(0)).any();
    return (below || above) && static_cast<Scalar>(grid_->outside()) < isovalue_;
  }

  /// Density above the isovalue at p_G [m]; >= 0 is bone.
  [[nodiscard]] Scalar value(const Vec3<Scalar>& p_G) const noexcept {
    return sample(view_, coordinates(p_G)) - isovalue_;
  }

  /// ∇ρ at p_G in G axes [density per metre], by the gradient policy. Points into the bone at a surface.
  [[nodiscard]] Vec3<Scalar> gradient(const Vec3<Scalar>& p_G) const noexcept {
    return GradientChoice::at(*grid_, view_, coordinates(p_G)).cwiseProduct(per_metre_);
  }

  /// Outward unit normal −∇ρ/|∇ρ| at p_G. Where the density is flat there (8-bit plateaus, deep in bone) it is the
  /// direction in which density falls at 2, 4, 8, 16 voxels round the point, the nearest of these that shows any: on
  /// balls of 12 to 40 voxels, 12 voxels deep in saturated bone, within 9° (2–3° on average). Returns false and leaves
  /// `n` alone when all is flat.
  [[nodiscard]] bool normal(const Vec3<Scalar>& p_G, Vec3<Scalar>& n) const noexcept {
    Vec3<Scalar> g = gradient(p_G);
    Scalar length = g.norm();
    for (int reach = 2; !(length * longest_ > flat_) && reach <= 16; reach *= 2) {
      g = rise_around(p_G, static_cast<Scalar>(reach) * longest_);
      length = g.norm();
    }
    if (!(length * longest_ > flat_)) return false;
    n = -g / length;
    return true;
  }

  /// value() of n points (x, y, z) given in a frame that X maps to G; n a multiple of kLane.
  void values(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* out,
              int n) const noexcept {
    const Mat3<Scalar> A = per_metre_.asDiagonal() * X.linear();
    const Vec3<Scalar> t = coordinates(X.translation());
    sample_points(view_, A, t, x, y, z, out, n);
    const Scalar isovalue = isovalue_;  // which `out` is not
    for (int i = 0; i < n; i += kLane)
      for (int l = 0; l < kLane; ++l) out[i + l] -= isovalue;
  }

  /// gradient() of n points, as `values` takes them.
  void gradients(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* gx, Scalar* gy,
                 Scalar* gz, int n) const noexcept {
    if constexpr (std::same_as<GradientChoice, AnalyticGradient>) {
      const Mat3<Scalar> A = per_metre_.asDiagonal() * X.linear();
      sample_gradients(view_, A, coordinates(X.translation()), x, y, z, gx, gy, gz, n);
      for (int i = 0; i < n; ++i) gx[i] *= per_metre_.x();
      for (int i = 0; i < n; ++i) gy[i] *= per_metre_.y();
      for (int i = 0; i < n; ++i) gz[i] *= per_metre_.z();
    } else {
      for (int i = 0; i < n; ++i) {
        const Vec3<Scalar> g = gradient(X * Vec3<Scalar>(x[i], y[i], z[i]));
        gx[i] = g.x();
        gy[i] = g.y();
        gz[i] = g.z();
      }
    }
  }

 private:
  /// Mean gradient [density per metre] over a ball of radius h from 26 samples on it. Six along the axes are not enough
  /// on a plateau: each sees bone or air and nothing between, and the direction is up to 45° off.
  [[nodiscard]] Vec3<Scalar> rise_around(const Vec3<Scalar>& p_G, Scalar h) const noexcept {
    constexpr std::array<Scalar, 4> kPerLength{0, 1, Scalar(0.70710678118654752), Scalar(0.57735026918962576)};
    Vec3<Scalar> sum = Vec3<Scalar>::Zero();
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const auto steps = static_cast<std::size_t>(x * x + y * y + z * z);
          const Vec3<Scalar> d = kPerLength[steps] * Vec3<Scalar>(Scalar(x), Scalar(y), Scalar(z));
          if (steps > 0) sum += value(p_G + h * d) * d;
        }
    // Σ d dᵀ over the 26 unit directions is 26/3 times the identity.
    return (Scalar(3) / (Scalar(26) * h)) * sum;
  }

  [[nodiscard]] Vec3<Scalar> coordinates(const Vec3<Scalar>& p_G) const noexcept {
    return p_G.cwiseProduct(per_metre_) + Vec3<Scalar>::Ones();
  }

  const VoxelGrid<Density>* grid_;
  SampleView<Density, Scalar> view_;
  Scalar isovalue_;
  Vec3<Scalar> per_metre_;
  Scalar voxel_;
  Scalar longest_;
  Scalar flat_;
};

}  // namespace trephine
