// SPDX-License-Identifier: MIT
#pragma once

#include "solids.hpp"

#include <trephine/structure/label_grid.hpp>
#include <trephine/structure/structure_field.hpp>

#include <memory>
#include <optional>
#include <vector>

namespace drill {

/// Labelled structures as rays meet them: their surfaces, and what of cut bone belongs to them. Const; any thread.
class DrawnStructures {
 public:
  using Field = std::shared_ptr<const trephine::StructureField>;

  /// `left` is what a drill left of the structures in `whole`.
  DrawnStructures(Field whole, Field left, std::vector<trephine::Structure> structures, const trephine::Posed& X_SG);

  struct Hit {
    SolidHit at;
    int structure;
  };
  /// First place on the ray in [from, to] that is in what is left of a structure; `from` where that is in one already.
  [[nodiscard]] std::optional<Hit> hit(const Ray& ray, float from, float to) const;
  /// The structure whose bone is at a place on the bone's surface, if there is one.
  [[nodiscard]] std::optional<int> at(const Vec3f& p) const;
  /// Distance from the nearest of the whole structures [m], negative inside.
  [[nodiscard]] float distance(const Vec3f& p) const;

  [[nodiscard]] const std::vector<trephine::Structure>& structures() const noexcept { return structures_; }
  /// Linear colour.
  [[nodiscard]] Vec3f colour_of(int structure) const;

 private:
  Field whole_, left_;
  std::vector<trephine::Structure> structures_;
  trephine::Posed X_SG_;
};

}  // namespace drill
