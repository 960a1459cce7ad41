// SPDX-License-Identifier: MIT
#include "contact/proxy_helpers.hpp"
#include "support/raster.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <optional>
#include <utility>

/// Moves that a proxy turns down by one sample, beside a search for the height of the surface.
namespace {

using namespace trephine;
using namespace trephine::test;

/// A frictionless slide from q to where p is nearest, each move carried out before it is judged. None where the surface
/// ends: there a proxy goes on straight toward the probe.
template <class Field, class Scalar = typename Field::Scalar>
std::optional<Vec3<Scalar>> plain_slide(const Field& field, Vec3<Scalar> q, Vec3<Scalar> n, const Vec3<Scalar>& p) {
  const ProxyOptions options;
  const Scalar step = static_cast<Scalar>(options.step) * field.voxel(), reach = 2 * step;
  for (int i = 0, most = options.iterations; i < most; ++i) {
    static_cast<void>(field.normal(q, n));
    const Vec3<Scalar> d = p - q;
    const Scalar depth = -d.dot(n);
    const Vec3<Scalar> t = d + depth * n;
    const Scalar slip = t.norm();
    if (depth < 0) return std::nullopt;
    if (!(slip > static_cast<Scalar>(kSurfaceTolerance) * field.voxel())) return q;
    most = std::max(most,
                    options.iterations +
                        plan_steps(static_cast<double>(slip), static_cast<double>(step), 8 * options.iterations).count);
    bool moved = false;
    Scalar length = std::min(slip, step);
    for (int halving = 0; halving < 4 && !moved; ++halving, length /= 2) {
      Vec3<Scalar> to = q + (length / slip) * t;
      const bool in_bone = field.value(to) >= 0;
      const Vec3<Scalar> end = in_bone ? Vec3<Scalar>(to + reach * n) : Vec3<Scalar>(to - reach * n);
      const auto hit = first_crossing(field, to, end, step, 8);
      if (!hit.found && !in_bone) return std::nullopt;
      if (!hit.found) continue;
      to += (in_bone ? hit.after : hit.before) * (end - to);
      moved = (p - to).norm() < d.norm() - Scalar(0.05) * length * (slip / d.norm());
      if (moved) q = to;
    }
    if (!moved) return q;
  }
  return q;
}

struct Moves {
  int ticks = 0;
  int same = 0;  ///< within what a search is exact to
  std::int64_t samples = 0;
  std::int64_t plain_samples = 0;
};

template <class Scalar, class Shape>
Moves compare(const Shape& shape, const RasterOptions& o, Random& random) {
  const double h = kVoxel;
  const auto grid = rasterise<std::uint8_t>(shape, o);
  const auto field = field_of<Scalar>(grid, o);
  const CountingField<decltype(field_of<Scalar>(grid, o))> counting(field);
  const auto place = [&] {
    const Vec3d away = random.unit();
    return Vec3d(o.middle() + random.uniform(0, 12) * h * away);
  };
  Moves moves;
  SurfaceProxy<Scalar> proxy;
  Vec3d from = place();
  for (int leg = 0; leg < 60; ++leg) {
    const Vec3d to = place();
    for (int t = 1; t <= 60; ++t) {  // the last third at rest
      const Vec3<Scalar> p = (from + std::min(1.0, t / 40.0) * (to - from)).template cast<Scalar>();
      const Vec3<Scalar> q = proxy.position(), n = proxy.normal();
      const bool slides =
          proxy.in_contact() && field.value(p) >= 0 && field.value(q) < 0 && field.value(q - Scalar(0.02 * h) * n) >= 0;
      counting.samples = 0;
      static_cast<void>(proxy.follow(counting, p));
      if (!slides || !proxy.in_contact()) continue;
      const std::int64_t samples = std::exchange(counting.samples, 3);  // at the probe, the proxy, the bone under it
      const auto plain = plain_slide(counting, q, n, p);
      if (!plain) continue;
      moves.samples += samples;
      moves.plain_samples += counting.samples;
      ++moves.ticks;
      moves.same += (proxy.position() - *plain).norm() <= Scalar(kSurfaceTolerance * h) ? 1 : 0;
    }
    from = to;
  }
  return moves;
}

TEST_CASE_TEMPLATE("moves turned down by a sample are those that a search turns down", Scalar, float, double) {
  constexpr double kSpared = 0.95;  // a tenth of the samples on any shape, a third on ripples
  Random random(57);
  const RasterOptions o{.size = {64, 64, 64}};
  const auto check = [&](const char* name, const auto& shape) {
    const Moves m = compare<Scalar>(shape, o, random);
    MESSAGE(std::string(name), ": ", m.same, " of ", m.ticks, " ticks alike, ", m.samples,
            " samples, each move carried out ", m.plain_samples);
    CHECK(m.ticks > 500);
    CHECK(m.same == m.ticks);  // tests do not fuse multiply-adds
    CHECK(static_cast<double>(m.samples) < kSpared * static_cast<double>(m.plain_samples));
  };
  check("plane", HalfSpace{o.middle(), Vec3d(0.2, -0.4, 1).normalized()});
  check("ripples", [plane = HalfSpace{o.middle(), Vec3d::UnitZ()}](const Vec3d& p) {
    return plane(p) + 0.3 * kVoxel * std::sin(1.7 * p.x() / kVoxel) * std::sin(2.1 * p.y() / kVoxel);
  });
  check("ball", Ball{o.middle() - 4 * kVoxel * Vec3d::UnitZ(), 10 * kVoxel});
}

}  // namespace
