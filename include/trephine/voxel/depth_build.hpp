// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/density_field.hpp>

#include <cstdint>
#include <functional>
#include <vector>

/// How a DepthMap is made from densities: the surface's nearest point for every voxel beside it, to a small part of a
/// voxel, then the nearest of those points for all voxels within reach.
namespace trephine::detail {

/// A small disc of the bone's surface: a point of it and its outward unit normal, in G [m].
struct SurfaceDisc {
  Vec3<float> point;
  Vec3<float> normal;

  /// Distance [m] of q, whose nearest disc this is. Discs stand a voxel apart: above one it is the height over the
  /// tangent plane. Farther beside it than two thirds of a voxel, up to one, it goes over to the distance of the point:
  /// the surface has an edge there, and its normal says little.
  [[nodiscard]] float distance(const Vec3<float>& q, float voxel) const noexcept {
    const Vec3<float> d = q - point;
    const float height = d.dot(normal);
    const float beside = std::sqrt(std::max(0.0F, d.squaredNorm() - height * height));
    const float out = beside * std::clamp((beside / voxel - 0.65F) / 0.3F, 0.0F, 1.0F);
    return std::sqrt(height * height + out * out);
  }
};

template <VoxelDensity Density>
class DepthBuilder {
 public:
  using Progress = std::function<void(double)>;

  /// `reach` [m]. `progress` is called now and then with the share done.
  DepthBuilder(const VoxelGrid<Density>& bone, double isovalue, double reach, const Progress& progress)
      : bone_(bone),
        field_(bone, isovalue),
        progress_(progress),
        isovalue_(isovalue),
        reach_(static_cast<float>(reach)),
        spacing_(bone.spacing().template cast<float>()),
        nx_(static_cast<std::size_t>(bone.size()[0])),
        ny_(static_cast<std::size_t>(bone.size()[1])),
        nz_(static_cast<std::size_t>(bone.size()[2])) {}

  /// Depth of every voxel in multiples of `unit` [m], positive in bone, x fastest.
  [[nodiscard]] std::vector<std::int16_t> run(double unit) {
    nearest_.assign(nx_ * ny_ * nz_, kNone);
    distance_.assign(nearest_.size(), std::numeric_limits<float>::infinity());
    lanes_.assign(static_cast<std::size_t>(reach_ / lane()) + 2, {});
    find_surface();
    spread();
    return depths(unit);
  }

 private:
  static constexpr std::int32_t kNone = -1;
  struct Entry {
    std::uint32_t voxel;
    std::int32_t disc;
  };

  /// Voxels are visited in the order of their distance, sorted to this [m].
  [[nodiscard]] float lane() const noexcept { return spacing_.minCoeff() / 4; }
  [[nodiscard]] std::size_t index(int i, int j, int k) const noexcept {
    return (static_cast<std::size_t>(k) * ny_ + static_cast<std::size_t>(j)) * nx_ + static_cast<std::size_t>(i);
  }
  [[nodiscard]] Vec3<float> centre(int i, int j, int k) const noexcept {
    return spacing_.cwiseProduct(Vec3<float>(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)));
  }
  [[nodiscard]] bool in_bone(int i, int j, int k) const noexcept {
    return static_cast<double>(bone_.at(i, j, k)) >= isovalue_;
  }
  void tell(double share) const {
    if (progress_) progress_(share);
  }

  /// Every voxel with the surface between it and one of its six neighbours (the border counts as one).
  void find_surface() {
    for (int k = 0; k < bone_.size()[2]; ++k) {
      for (int j = 0; j < bone_.size()[1]; ++j)
        for (int i = 0; i < bone_.size()[0]; ++i) {
          const bool bone = in_bone(i, j, k);
          if (in_bone(i - 1, j, k) != bone || in_bone(i + 1, j, k) != bone || in_bone(i, j - 1, k) != bone ||
              in_bone(i, j + 1, k) != bone || in_bone(i, j, k - 1) != bone || in_bone(i, j, k + 1) != bone)
            add_disc(i, j, k);
        }
      if (k % 8 == 0) tell(0.5 * k / bone_.size()[2]);
    }
  }

  void add_disc(int i, int j, int k) {
    const Vec3<float> q = centre(i, j, k);
    const SurfaceDisc disc = nearest_disc(q, crossing(i, j, k));
    discs_.push_back(disc);
    reached(index(i, j, k), (q - disc.point).norm(), static_cast<std::int32_t>(discs_.size()) - 1);
  }

  /// The nearest place where the surface cuts a lattice edge from this voxel: exact on the interpolant.
  [[nodiscard]] Vec3<float> crossing(int i, int j, int k) const noexcept {
    const double here = static_cast<double>(bone_.at(i, j, k)) - isovalue_;
    Vec3<float> offset = Vec3<float>::Zero();
    float least = std::numeric_limits<float>::infinity();
    for (int a = 0; a < 3; ++a)
      for (const int side : {-1, 1}) {
        const double there =
            static_cast<double>(bone_.at(i + (a == 0 ? side : 0), j + (a == 1 ? side : 0), k + (a == 2 ? side : 0))) -
            isovalue_;
        if ((here >= 0) == (there >= 0)) continue;
        const float s = static_cast<float>(here / (here - there)) * spacing_[a];
        if (!(s < least)) continue;
        least = s;
        offset.setZero();
        offset[a] = static_cast<float>(side) * s;
      }
    return centre(i, j, k) + offset;
  }

  /// Slides from a point of the surface along it to the place nearest to q.
  [[nodiscard]] SurfaceDisc nearest_disc(const Vec3<float>& q, const Vec3<float>& start) const noexcept {
    const float most = spacing_.minCoeff() / 2;
    SurfaceDisc best{start, normal_at(start, q)};
    float least = (q - start).squaredNorm();
    Vec3<float> p = start;
    Vec3<float> n = best.normal;
    for (int step = 0; step < 5; ++step) {
      Vec3<float> along = (q - p) - (q - p).dot(n) * n;
      const float length = along.norm();
      if (length > most) along *= most / length;
      p = onto_surface(p + along, most);
      n = normal_at(p, q);
      if ((q - p).squaredNorm() < least) {
        least = (q - p).squaredNorm();
        best = {p, n};
      }
      if (length < 0.02F * most) break;
    }
    return best;
  }

  [[nodiscard]] Vec3<float> onto_surface(Vec3<float> p, float most) const noexcept {
    for (int i = 0; i < 3; ++i) {
      const float value = field_.value(p);
      const Vec3<float> g = field_.gradient(p);
      const float g2 = g.squaredNorm();
      if (!(g2 > 0)) break;
      const float s = value / std::sqrt(g2);
      p -= std::clamp(s, -most, most) / std::sqrt(g2) * g;
      if (std::abs(s) < 0.002F * most) break;
    }
    return p;
  }

  [[nodiscard]] Vec3<float> normal_at(const Vec3<float>& p, const Vec3<float>& q) const noexcept {
    const Vec3<float> g = field_.smooth_gradient(p);
    const float length = g.norm();
    if (length > 0) return -g / length;
    const Vec3<float> d = q - p;
    return d.norm() > 0 ? Vec3<float>(d.normalized()) : Vec3<float>(Vec3<float>::UnitZ());
  }

  void reached(std::size_t voxel, float distance, std::int32_t disc) {
    if (!(distance < distance_[voxel]) || !(distance <= reach_)) return;
    distance_[voxel] = distance;
    nearest_[voxel] = disc;
    lanes_[static_cast<std::size_t>(distance / lane())].push_back({static_cast<std::uint32_t>(voxel), disc});
  }

  /// Outward from the surface: each voxel offers its disc to its 26 neighbours.
  void spread() {
    for (std::size_t l = 0; l < lanes_.size(); ++l) {
      for (std::size_t e = 0; e < lanes_[l].size(); ++e) {
        const Entry entry = lanes_[l][e];
        if (nearest_[entry.voxel] != entry.disc) continue;  // a nearer one came since
        const int i = static_cast<int>(entry.voxel % nx_);
        const int j = static_cast<int>(entry.voxel / nx_ % ny_);
        const int k = static_cast<int>(entry.voxel / (nx_ * ny_));
        const Vec3<float>& p = discs_[static_cast<std::size_t>(entry.disc)].point;
        for (int dk = -1; dk <= 1; ++dk)
          for (int dj = -1; dj <= 1; ++dj)
            for (int di = -1; di <= 1; ++di)
              if (bone_.contains(i + di, j + dj, k + dk))
                reached(index(i + di, j + dj, k + dk), (centre(i + di, j + dj, k + dk) - p).norm(), entry.disc);
      }
      lanes_[l] = {};
      tell(0.5 + 0.5 * static_cast<double>(l + 1) / static_cast<double>(lanes_.size()));
    }
  }

  [[nodiscard]] std::vector<std::int16_t> depths(double unit) const {
    std::vector<std::int16_t> out(nearest_.size());
    const float voxel = spacing_.maxCoeff();
    const auto per_unit = static_cast<float>(1 / unit);
    for (int k = 0; k < bone_.size()[2]; ++k)
      for (int j = 0; j < bone_.size()[1]; ++j)
        for (int i = 0; i < bone_.size()[0]; ++i) {
          const std::size_t v = index(i, j, k);
          float d = reach_;
          if (nearest_[v] != kNone)
            d = std::min(d, discs_[static_cast<std::size_t>(nearest_[v])].distance(centre(i, j, k), voxel));
          const auto whole = static_cast<int>(std::lround(d * per_unit));
          // Outside is below 0 even beside the surface: the depth's sign is the density's.
          out[v] = static_cast<std::int16_t>(in_bone(i, j, k) ? whole : -std::max(whole, 1));
        }
    return out;
  }

  const VoxelGrid<Density>& bone_;
  DensityField<Density, float> field_;
  const Progress& progress_;
  double isovalue_;
  float reach_;
  Vec3<float> spacing_;
  std::size_t nx_, ny_, nz_;
  std::vector<SurfaceDisc> discs_;
  std::vector<std::int32_t> nearest_;
  std::vector<float> distance_;
  std::vector<std::vector<Entry>> lanes_;
};

}  // namespace trephine::detail
