// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/render/coupled/foundation.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// List of a tick's contacts, for logs and drawing: one per surface element in contact, in the order of its points.
/// Forces are on the tool [N], in G.
class ContactList {
 public:
  /// Allocates room for `contacts` contacts. Further ones are left out (`is_complete`).
  void reserve(std::size_t contacts) {
    contacts_.resize(contacts);
    sums_.resize(contacts);
  }
  void clear() noexcept {
    count_ = cursor_ = 0;
    is_complete_ = true;
  }

  /// Adds a point with the normal force `load` > 0 [N] to its element's contact. Call it for all points of an element
  /// in a row.
  void add(const FoundationPoint& q, double load) noexcept {
    if (count_ == 0 || sums_[count_ - 1].element != q.element) {
      if (count_ == contacts_.size()) {
        is_complete_ = false;
        return;
      }
      sums_[count_] = {.element = q.element};
      contacts_[count_++] = {};
    }
    ElementSum& s = sums_[count_ - 1];
    s.load += load;
    s.moment += load * q.arm;
    const Vec3d f = -load * q.normal;
    contacts_[count_ - 1].normal += f;
    contacts_[count_ - 1].force += f;
  }

  /// Adds a force [N] to an element's contact. Call it for elements in the order of `add`.
  void add_force(std::uint64_t element, const Vec3d& f) noexcept {
    if (!(f.squaredNorm() > 0)) return;
    while (cursor_ < count_ && sums_[cursor_].element != element) ++cursor_;
    if (cursor_ < count_) contacts_[cursor_].force += f;
  }

  /// Sets positions and normals after all points were added. A contact's position is its centre of pressure; p is the
  /// origin of the points' arms in G [m].
  void finish(const Vec3d& p) noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      contacts_[i].position = p + sums_[i].moment / sums_[i].load;
      contacts_[i].normal.normalize();
    }
  }

  [[nodiscard]] std::span<const ContactPoint<double>> contacts() const noexcept { return {contacts_.data(), count_}; }
  /// Returns false if contacts were left out since `clear`.
  [[nodiscard]] bool is_complete() const noexcept { return is_complete_; }

 private:
  struct ElementSum {
    std::uint64_t element = 0;     // `FoundationPoint::element`
    double load = 0;               // [N]
    Vec3d moment = Vec3d::Zero();  // Σ load · arm [N·m]
  };
  std::vector<ContactPoint<double>> contacts_;
  std::vector<ElementSum> sums_;
  std::size_t count_ = 0;
  std::size_t cursor_ = 0;  // contact that `add_force` found last
  bool is_complete_ = true;
};

}  // namespace trephine
