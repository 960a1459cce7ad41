// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/density_field.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// List of sample points in T, each with the vertex that it belongs to and the field's gradient. Gradients are computed
/// in batches. The capacity is fixed at construction.
template <RealScalar Scalar>
class PatchPoints {
 public:
  PatchPoints() = default;
  explicit PatchPoints(int capacity) : vertex_(static_cast<std::size_t>(capacity)) {
    // A batch may start at any point and is padded to a lane.
    for (auto* v : {&x_, &y_, &z_, &gx_, &gy_, &gz_}) v->resize(static_cast<std::size_t>(capacity) + kLane);
  }

  void clear() noexcept { count_ = 0; }
  /// Copies point j, without its gradient, to index `to` <= j.
  void move(int j, int to) noexcept {
    const auto from = static_cast<std::size_t>(j), n = static_cast<std::size_t>(to);
    for (auto* v : {&x_, &y_, &z_}) (*v)[n] = (*v)[from];
    vertex_[n] = vertex_[from];
  }
  /// Drops all but the first `count` points.
  void truncate(int count) noexcept { count_ = count; }
  [[nodiscard]] int count() const noexcept { return count_; }
  /// Vertex that point j belongs to.
  [[nodiscard]] int vertex(int j) const noexcept { return vertex_[static_cast<std::size_t>(j)]; }
  /// Gradient at point j, in G axes [field's unit per metre]; valid after `compute_gradients`.
  [[nodiscard]] Vec3<Scalar> gradient(int j) const noexcept {
    const auto n = static_cast<std::size_t>(j);
    return {gx_[n], gy_[n], gz_[n]};
  }

  /// Appends a point p in T [m].
  void add(const Vec3<Scalar>& p, int vertex) noexcept {
    const auto n = static_cast<std::size_t>(count_++);
    x_[n] = p.x();
    y_[n] = p.y();
    z_[n] = p.z();
    vertex_[n] = vertex;
  }

  /// Computes the gradients at points [from, count()).
  template <ContactField Field>
  void compute_gradients(const Field& field, const Pose<Scalar>& X_GT, int from) noexcept {
    const int padded = padded_to_lane(count_ - from);
    for (int j = count_; j < from + padded; ++j)
      for (auto* v : {&x_, &y_, &z_}) (*v)[static_cast<std::size_t>(j)] = (*v)[static_cast<std::size_t>(count_) - 1];
    field.gradients(X_GT, x_.data() + from, y_.data() + from, z_.data() + from, gx_.data() + from, gy_.data() + from,
                    gz_.data() + from, padded);
  }

 private:
  int count_ = 0;
  std::vector<Scalar> x_, y_, z_, gx_, gy_, gz_;
  std::vector<int> vertex_;
};

}  // namespace trephine
