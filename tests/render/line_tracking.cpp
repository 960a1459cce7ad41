// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/exact_line.hpp"

#include <trephine/render/thesis/line.hpp>

#include <doctest/doctest.h>

/// The shaft of the Line approximation against the exact constrained line: the direction nearest to the probe's that
/// keeps a rigid line through the tip out of bone, by brute force in double.
namespace {

using namespace trephine;
using namespace trephine::test;

const Burr kBurr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.020};
constexpr double kStiffness = 800;
constexpr double kTorqueError = 0.06, kTorqueFloor = 1e-3;  // 6 % or 1 mN·m

struct Exact {
  Vec3d direction, contact, torque;
};

template <class Shape>
Exact constrained(const Shape& shape, const Vec3d& tip, const Vec3d& s, const Vec3d& guess, double span) {
  const ExactLine line = constrained_line(shape, kBurr, tip, s, guess, span);
  const Vec3d r = line.contact - tip;
  return {line.direction, line.contact, r.cross(kStiffness * (r - r.norm() * s))};
}

// The three places. Each leads a tool from free into contact and then sideways along it.
struct Rim {  // a hole of 2 mm radius in a flat face; the tip is free in it, the shaft leans on its edge
  static constexpr const char* kName = "rim of a hole";
  static constexpr bool kSmooth = false;  // a tight, sharp edge: serrated by as much as it is off
  Vec3d top;
  [[nodiscard]] auto shape() const {
    return Both{HalfSpace{top, Vec3d::UnitZ()}, Hollow{Rod{top, Vec3d::UnitZ(), 0.002}}};
  }
  [[nodiscard]] Vec3d tip() const { return top - Vec3d(0, 0, 0.003); }
  [[nodiscard]] Vec3d free() const { return Vec3d::UnitZ(); }
  // Leaning outward by 0.15 rad more than the rim allows, turned round the hole's axis.
  [[nodiscard]] Vec3d pressed(double turn) const {
    const double lean = std::atan2(0.002, 0.003) + 0.15;
    return {std::sin(lean) * std::cos(turn), std::sin(lean) * std::sin(turn), std::cos(lean)};
  }
};
struct Ridge {  // the straight edge of a block; the shaft is laid across it
  static constexpr const char* kName = "ridge";
  static constexpr bool kSmooth = true;
  Vec3d top;
  [[nodiscard]] auto shape() const { return Both{HalfSpace{top, Vec3d::UnitZ()}, HalfSpace{top, -Vec3d::UnitX()}}; }
  [[nodiscard]] Vec3d tip() const { return top + Vec3d(-0.005, 0, -0.0005); }
  [[nodiscard]] Vec3d free() const { return Vec3d(1, 0, 0.5).normalized(); }
  [[nodiscard]] Vec3d pressed(double turn) const { return Vec3d(1, 0.5 * turn, -0.05).normalized(); }
};
struct Cylinder {  // a round bar; the shaft is laid across it
  static constexpr const char* kName = "cylinder";
  static constexpr bool kSmooth = true;
  Vec3d top;
  [[nodiscard]] auto shape() const { return Rod{top - Vec3d(0, 0, 0.003), Vec3d::UnitY(), 0.003}; }
  [[nodiscard]] Vec3d tip() const { return top + Vec3d(-0.006, 0, -0.0012); }
  [[nodiscard]] Vec3d free() const { return Vec3d(1, 0, 0.6).normalized(); }
  [[nodiscard]] Vec3d pressed(double turn) const { return Vec3d(1, 0.5 * turn, 0.04).normalized(); }
};

struct TrackingError {
  double point = 0;   ///< IntP from the exact contact [mm]
  double along = 0;   ///< of it, across the exact line [mm]
  double torque = 0;  ///< relative, |T − exact| / max(|exact|, 1 mN·m)
  double local = 0;   ///< the same against the nearest local minimum in the voxel image itself
  double rest = 0;    ///< torque's change in 100 ticks at rest [mN·m]
  bool lost = false;
};

template <class Renderer, class Place>
TrackingError track(const Place& place, const RasterOptions& o, int vertices, double sideways) {
  const auto shape = place.shape();
  const auto grid = rasterise<std::uint8_t>(shape, o);
  const auto field = field_of<typename Renderer::Scalar>(grid, o);
  Renderer renderer(typename Renderer::Tool(kBurr, {.shaft = vertices}), {.stiffness = kStiffness});
  const Posed start = tool_at(place.tip(), place.free());
  Posed now = tool_at(place.tip(), place.pressed(0));
  lead(renderer, field, start, now, 100);
  const Posed end = tool_at(place.tip(), place.pressed(sideways));
  lead(renderer, field, now, end, 150);
  auto out = render_at(renderer, field, end);
  for (int i = 0; i < 50; ++i) out = render_at(renderer, field, end);
  TrackingError e;
  const auto& report = renderer.report();
  e.lost = !report.shaft_contact;
  if (e.lost) return e;
  const Vec3d s = end.linear().col(2);
  const Exact exact = constrained(shape, place.tip(), s, Vec3d(s + 0.1 * (place.free() - s)), 0.15);
  const Vec3d off = report.intersection.template cast<double>() - exact.contact;
  e.point = 1e3 * off.norm();
  e.along = 1e3 * (off - off.dot(exact.direction) * exact.direction).norm();
  const Vec3d torque = out.wrench.torque.template cast<double>();
  e.torque = (torque - exact.torque).norm() / std::max(exact.torque.norm(), kTorqueFloor);
  // The image of a sharp edge is serrated: its own local minima are where any line comes to rest.
  const auto exact_field = field_of<double>(grid, o);
  const auto image = [&](const Vec3d& p) { return -exact_field.value(p); };
  const Vec3d own = report.intersection.template cast<double>() - place.tip();
  const Exact local = constrained(image, place.tip(), s, own, 0.01);
  e.local = (torque - local.torque).norm() / std::max(local.torque.norm(), kTorqueFloor);
  for (int i = 0; i < 100; ++i) {
    const Vec3d again = render_at(renderer, field, end).wrench.torque.template cast<double>();
    e.rest = std::max(e.rest, 1e3 * (again - torque).norm());
  }
  return e;
}

template <class Scalar, class Place>
void check_tracking(int vertices) {
  const RasterOptions o{.size = {96, 64, 64}};
  const Place place{Vec3d(0.0144, 0.0096, 0.0120)};
  for (const double sideways : {0.0, 0.6}) {
    const TrackingError projected = track<ThesisLine<Scalar>>(place, o, vertices, sideways);
    const TrackingError constrained = track<LineApproxRenderer<Scalar>>(place, o, vertices, sideways);
    CAPTURE(Place::kName);
    CAPTURE(vertices);
    CAPTURE(sideways);
    CHECK_FALSE(constrained.lost);
    CHECK(constrained.local <= kTorqueError);
    if (Place::kSmooth) CHECK(constrained.torque <= kTorqueError);
    CHECK(constrained.point <= (Place::kSmooth ? 0.13 : 0.95));  // [mm]
    CHECK(constrained.along <= (Place::kSmooth ? 0.08 : 0.95));
    CHECK(constrained.rest == 0);
    // The thesis' line hardly follows the shaft when it is turned along the edge.
    if (sideways > 0) CHECK(projected.torque > 1);
  }
}

TEST_CASE_TEMPLATE("tracking against the exact constrained line", Scalar, float, double) {
  for (const int vertices : {50, 400}) {
    check_tracking<Scalar, Rim>(vertices);
    check_tracking<Scalar, Ridge>(vertices);
    check_tracking<Scalar, Cylinder>(vertices);
  }
}

}  // namespace
