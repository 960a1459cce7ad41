// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/cutting_law.hpp>
#include <trephine/tool/engagement.hpp>
#include <trephine/tool/head_elements.hpp>
#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/density_field.hpp>
#include <trephine/voxel/sampling.hpp>
#include <trephine/voxel/tissue_cut.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace trephine::inline TREPHINE_ALIGNED {

/// Bone at the elements of a head that face its feed: whether they cut, and what.
///
/// *Cuts.* The density is sampled a quarter and half a voxel ahead, toward the feed, and the greater one counts: a film
/// may be thinner than half a voxel.
///
/// *What.* Bone's strength follows from its density before all cuts (`GridOptions::keep_original`); without it, from
/// bone beyond the reach of cuts. The image blurs bone's surface. The densest of five voxels, a cell's diagonal apart
/// along the normal and the axis, is bone without the blur.
///
/// Haptic thread; no allocation.
template <VoxelDensity Density>
class HeadSamples {
 public:
  /// `feed`: unit vector in T. The head and the bone outlive the samples.
  HeadSamples(const HeadElements& head, const VoxelGrid<Density>& bone, double isovalue, const Posed& X_GT,
              const Vec3d& feed) noexcept
      : head_(head),
        bone_(bone),
        feed_(feed),
        isovalue_(isovalue),
        X_(X_GT.template cast<float>()),
        whole_(static_cast<float>(kLead / 6 * slope_or_auto(0, bone, isovalue))) {
    const Vec3<float> d = feed.cast<float>(), lead = static_cast<float>(kLead * bone.spacing().minCoeff()) * d;
    std::size_t n = 0;
    for (std::size_t i = 0; i < HeadElements::kCount; ++i) {
      nx_[n] = head.normal_x[i], ny_[n] = head.normal_y[i], nz_[n] = head.normal_z[i];
      if (!(d.x() * nx_[n] + d.y() * ny_[n] + d.z() * nz_[n] > 0)) continue;
      element_[n] = i;
      x_[n] = head.x[i] + lead.x(), y_[n] = head.y[i] + lead.y(), z_[n] = head.z[i] + lead.z();
      ++n;
    }
    count_ = n;
    padded_ = static_cast<std::size_t>(padded_to_lane(static_cast<int>(count_)));
    for (auto i = count_; i < padded_; ++i) x_[i] = y_[i] = z_[i] = nx_[i] = ny_[i] = nz_[i] = 0;
  }

  [[nodiscard]] Engagement engagement(const BoneStrength& strength_of, const TissueMap* tissues) const noexcept {
    const Numbers ahead = densities_ahead(), densest = densest_voxels();
    Numbers engaged{}, strength{};
    for (std::size_t i = 0; i < count_; ++i) {
      engaged[element_[i]] = std::clamp(ahead[i] / whole_, 0.0F, 1.0F);
      strength[element_[i]] = static_cast<float>(strength_of(static_cast<double>(densest[i])));
    }
    if (tissues != nullptr) weaken(*tissues, strength);
    return engagement_of(head_, feed_, engaged, strength);
  }

 private:
  using Numbers = HeadElements::Numbers;
  static_assert(HeadElements::kCount % kLane == 0);

  [[nodiscard]] Numbers densities_ahead() const noexcept {
    const DensityField<Density, float> field(bone_, isovalue_);
    const int padded = static_cast<int>(padded_);
    Numbers out;
    field.values(X_, x_.data(), y_.data(), z_.data(), out.data(), padded);
    const float whole = whole_;
    if (!std::any_of(out.begin(), out.begin() + count_, [whole](float v) { return v < whole; })) return out;
    const Vec3<float> less = static_cast<float>(kFilm * kLead * bone_.spacing().minCoeff()) * feed_.cast<float>();
    Numbers nearer, x, y, z;
    for (std::size_t i = 0; i < padded_; ++i) {
      x[i] = x_[i] - less.x();
      y[i] = y_[i] - less.y();
      z[i] = z_[i] - less.z();
    }
    field.values(X_, x.data(), y.data(), z.data(), nearer.data(), padded);
    for (std::size_t i = 0; i < count_; ++i) out[i] = std::max(out[i], nearer[i]);
    return out;
  }

  [[nodiscard]] Numbers densest_voxels() const noexcept {
    SampleView<Density, float> original(bone_);
    original.voxels = bone_.original_data();
    const auto apart =
        static_cast<float>(bone_.spacing().norm() + (bone_.keeps_original() ? 0 : cut_reach(bone_.spacing())));
    const Mat3<float> A = per_metre().asDiagonal() * X_.linear();
    const Vec3<float> t = per_metre().cwiseProduct(X_.translation()) + Vec3<float>::Ones();
    Numbers out, density, x, y, z;
    const auto sample = [&](float by_normal, float by_axis, Numbers& densities) {
      for (std::size_t i = 0; i < padded_; ++i) {
        x[i] = x_[i] + by_normal * nx_[i];
        y[i] = y_[i] + by_normal * ny_[i];
        z[i] = z_[i] + by_normal * nz_[i] + by_axis;
      }
      nearest_voxels(original, A, t, x.data(), y.data(), z.data(), densities.data(), static_cast<int>(padded_));
    };
    sample(0, 0, out);
    for (const float off : {apart, -apart})
      for (const bool along_axis : {false, true}) {
        sample(along_axis ? 0.0F : off, along_axis ? off : 0.0F, density);
        for (std::size_t i = 0; i < padded_; ++i) out[i] = std::max(out[i], density[i]);
      }
    return out;
  }

  /// Divides by the tissues' rates: what is cut more slowly is stronger.
  void weaken(const TissueMap& tissues, Numbers& strength) const noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      const Vec3<float> u = per_metre().cwiseProduct(X_ * Vec3<float>(x_[i], y_[i], z_[i]));
      const auto voxel = [&](int a) {
        return std::clamp(static_cast<int>(u[a] + 0.5F), 0, bone_.size()[static_cast<std::size_t>(a)] - 1);
      };
      strength[element_[i]] /= static_cast<float>(tissues.rate_at(voxel(0), voxel(1), voxel(2)));
    }
  }
  [[nodiscard]] Vec3<float> per_metre() const noexcept { return bone_.spacing().cwiseInverse().template cast<float>(); }

  static constexpr double kLead = 0.5;  // [voxels]
  static constexpr double kFilm = 0.5;  // of the lead, by which it looks nearer for a film

  const HeadElements& head_;
  const VoxelGrid<Density>& bone_;
  Vec3d feed_;
  double isovalue_;
  Pose<float> X_;
  // Density above the isovalue from which bone is whole: beside a cut it rises by the cut's slope. From a higher one
  // a ball's sides, which lie along the feed, would not cut; from a lower one a force aside would have them cut.
  float whole_;
  std::size_t count_ = 0, padded_ = 0;
  std::array<std::size_t, HeadElements::kCount> element_;
  Numbers x_, y_, z_, nx_, ny_, nz_;  // of the elements that face the feed: half a voxel ahead, and normals, in T
};

}  // namespace trephine
