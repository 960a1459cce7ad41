// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/gradient.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// The bone as contact search reads it: a scalar field over points in G [m], >= 0 in bone, < 0 outside, with the
/// surface at 0. `values` and `gradients` are the batched forms. They take n points in a frame that X maps to G, n a
/// multiple of kLane, and return gradients in G axes.
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

/// True for a field that interpolates its voxels trilinearly. Its surface bends within a cell where bone is curved.
template <class F>
inline constexpr bool kTrilinear = requires { requires F::kTrilinear; };

/// The density of a VoxelGrid minus the isovalue, as a field in G. Bone is >= 0; a density equal to the isovalue is
/// bone. A view: cheap to construct, valid while the grid lives. Haptic thread only.
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
        max_spacing_(static_cast<Scalar>(grid.spacing().maxCoeff())),
        min_rise_(static_cast<Scalar>(kFlatShare * (static_cast<double>(grid.original_range().max) -
                                                    static_cast<double>(grid.original_range().min)))) {}

  /// Returns the same density with smooth normals.
  [[nodiscard]] auto smooth() const noexcept {
    return DensityField<Density, Scalar, std::conditional_t<kSmoothNormals, GradientChoice, SplineGradient>>(
        *grid_, static_cast<double>(isovalue_));
  }

  /// Returns the shortest spacing [m], the unit of step lengths.
  [[nodiscard]] Scalar voxel() const noexcept { return voxel_; }
  [[nodiscard]] const VoxelGrid<Density>& grid() const noexcept { return *grid_; }

  /// Returns true if the ball of `radius` [m] around p_G lies beyond the grid, and the density there is air.
  [[nodiscard]] bool is_beyond(const Vec3<Scalar>& p_G, Scalar radius) const noexcept {
    const Vec3<Scalar> u = coordinates(p_G);
    const Vec3<Scalar> reach = radius * per_metre_;
    const bool below = ((u + reach).array() <= Scalar(0)).any();
    const bool above = ((u - reach - view_.last).array() >= Scalar(0)).any();
    return (below || above) && static_cast<Scalar>(grid_->outside()) < isovalue_;
  }

  /// Returns the density minus the isovalue at p_G [m]; >= 0 is bone.
  [[nodiscard]] Scalar value(const Vec3<Scalar>& p_G) const noexcept {
    return sample(view_, coordinates(p_G)) - isovalue_;
  }

  /// Returns ∇ρ at p_G in G axes [density per metre], by the gradient policy. At a surface it points into the bone.
  [[nodiscard]] Vec3<Scalar> gradient(const Vec3<Scalar>& p_G) const noexcept {
    return GradientChoice::at(view_, coordinates(p_G)).cwiseProduct(per_metre_);
  }

  /// Computes the outward unit normal −∇ρ/|∇ρ| at p_G, in G axes. If the density is flat there (8-bit plateaus, deep in
  /// bone), the normal is taken from mean gradients over balls of 2, 4, 8 and 16 voxels. The smallest ball that is not
  /// flat decides. The error is within 9° (2–3° on average) at 12 voxels deep in saturated balls of 12 to 40 voxels.
  /// Returns false and leaves `n` unchanged if all balls are flat.
  [[nodiscard]] bool normal(const Vec3<Scalar>& p_G, Vec3<Scalar>& n) const noexcept {
    Vec3<Scalar> g = gradient(p_G);
    Scalar length = g.norm();
    for (int reach = kMinReach; !(length * max_spacing_ > min_rise_) && reach <= kMaxReach; reach *= 2) {
      g = mean_gradient(p_G, static_cast<Scalar>(reach) * max_spacing_);
      length = g.norm();
    }
    if (!(length * max_spacing_ > min_rise_)) return false;
    n = -g / length;
    return true;
  }

  /// Computes value() of n points (x, y, z) [m] in a frame that X maps to G; n must be a multiple of kLane.
  void values(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* out,
              int n) const noexcept {
    const Mat3<Scalar> A = per_metre_.asDiagonal() * X.linear();
    const Vec3<Scalar> t = coordinates(X.translation());
    sample_points(view_, A, t, x, y, z, out, n);
    const Scalar isovalue = isovalue_;  // a copy, which `out` cannot alias
    for (int i = 0; i < n; i += kLane)
      for (int l = 0; l < kLane; ++l) out[i + l] -= isovalue;
  }

  /// Computes gradient() of n points, given as for `values`, by the policy's batched form if it has one.
  void gradients(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* gx, Scalar* gy,
                 Scalar* gz, int n) const noexcept {
    if constexpr (BatchedGradientPolicy<GradientChoice>) {
      const Mat3<Scalar> A = per_metre_.asDiagonal() * X.linear();
      GradientChoice::at_points(view_, A, coordinates(X.translation()), x, y, z, gx, gy, gz, n);
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
  // Numbers that decide: radii [longest spacings] of the smallest and largest ball that `normal` tries on flat density.
  // The smallest exceeds one cell; the largest reaches out of bone that is 12 voxels deep. Each ball costs 26 samples.
  static constexpr int kMinReach = 2;
  static constexpr int kMaxReach = 16;

  /// Returns the mean gradient [density per metre] over a ball of radius h [m], from 26 samples on its surface. Six
  /// samples along the axes are not enough: on a plateau each is plain bone or air, and the direction errs by up to
  /// 45°.
  [[nodiscard]] Vec3<Scalar> mean_gradient(const Vec3<Scalar>& p_G, Scalar h) const noexcept {
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

  /// Returns the voxel coordinates of p_G in the padded array.
  [[nodiscard]] Vec3<Scalar> coordinates(const Vec3<Scalar>& p_G) const noexcept {
    return p_G.cwiseProduct(per_metre_) + Vec3<Scalar>::Ones();
  }

  const VoxelGrid<Density>* grid_;
  SampleView<Density, Scalar> view_;
  Scalar isovalue_;
  Vec3<Scalar> per_metre_;
  Scalar voxel_;        // shortest spacing [m]
  Scalar max_spacing_;  // longest spacing [m]
  Scalar min_rise_;     // [density per longest spacing] smaller gradients count as flat
};

}  // namespace trephine
