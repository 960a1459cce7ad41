// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/surface_search.hpp>
#include <trephine/voxel/density_field.hpp>

namespace trephine::inline TREPHINE_ALIGNED::detail {

/// Smallest ContactField, declared but not defined: concepts check a policy's function templates against it.
template <RealScalar S>
struct FieldArchetype {
  using Scalar = S;
  [[nodiscard]] Scalar voxel() const noexcept;
  [[nodiscard]] Scalar value(const Vec3<Scalar>&) const noexcept;
  [[nodiscard]] Vec3<Scalar> gradient(const Vec3<Scalar>&) const noexcept;
  [[nodiscard]] bool normal(const Vec3<Scalar>&, Vec3<Scalar>&) const noexcept;
  void values(const Pose<Scalar>&, const Scalar*, const Scalar*, const Scalar*, Scalar*, int) const noexcept;
  void gradients(const Pose<Scalar>&, const Scalar*, const Scalar*, const Scalar*, Scalar*, Scalar*, Scalar*,
                 int) const noexcept;
};

static_assert(ContactField<FieldArchetype<float>> && PointField<FieldArchetype<float>>);

}  // namespace trephine::detail
