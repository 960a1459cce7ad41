// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/render/coupled/foundation.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trephine {

/// The contacts of a tick, for logs: one for each element of bone that touches, in the order of its points.
template <RealScalar Scalar>
class ContactList {
 public:
  void reserve(std::size_t contacts) {
    contacts_.resize(contacts);
    sums_.resize(contacts);
  }
  void clear() noexcept { count_ = at_ = 0; }

  /// Joins a point of pressure `load` [N], higher than 0, to its element's contact; those beyond the room are left out.
  void add(const FoundationPoint& q, double load) noexcept {
    if (count_ == 0 || sums_[count_ - 1].element != q.element) {
      if (count_ == contacts_.size()) return;
      sums_[count_] = {.element = q.element};
      contacts_[count_++] = {};
    }
    Sum& s = sums_[count_ - 1];
    s.load += load;
    s.moment += load * q.arm;
    const Vec3<Scalar> f = (-load * q.normal).template cast<Scalar>();
    contacts_[count_ - 1].normal += f;
    contacts_[count_ - 1].force += f;
  }

  /// Adds to the force of a element's contact; elements in the order in which points were added.
  void add_force(std::uint64_t element, const Vec3d& f) noexcept {
    if (f == Vec3d::Zero()) return;
    while (at_ < count_ && sums_[at_].element != element) ++at_;
    if (at_ < count_) contacts_[at_].force += f.template cast<Scalar>();
  }

  /// After all points: contacts are where their pressure is, about the origin p of the arms.
  void finish(const Vec3d& p) noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      contacts_[i].position = (p + sums_[i].moment / sums_[i].load).template cast<Scalar>();
      contacts_[i].normal.normalize();
    }
  }

  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept { return {contacts_.data(), count_}; }

 private:
  struct Sum {
    std::uint64_t element = 0;     // `FoundationPoint::element`
    double load = 0;               // [N]
    Vec3d moment = Vec3d::Zero();  // Σ load · arm
  };
  std::vector<ContactPoint<Scalar>> contacts_;
  std::vector<Sum> sums_;
  std::size_t count_ = 0;
  std::size_t at_ = 0;  // where `add_force` was last
};

}  // namespace trephine
