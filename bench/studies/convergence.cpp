// SPDX-License-Identifier: MIT
#include "studies/study.hpp"
#include "studies/table.hpp"
#include "sweep/measure.hpp"

#include <trephine/render/line/first_contact.hpp>

#include <numbers>

namespace trephine::bench {
namespace {

using namespace trephine::test;

// Slope of log error over log count by least squares, negated.
[[nodiscard]] double order_of(const std::vector<double>& counts, const std::vector<double>& errors) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double x = std::log(counts[i]), y = std::log(errors[i]);
    ++n;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  return -(n * sxy - sx * sy) / (n * sxx - sx * sx);
}

struct Tables {
  Table points, orders;
  explicit Tables(const std::string& folder)
      : points(folder + "/convergence.csv", "what,law,count,error_p95"),
        orders(folder + "/orders.csv", "what,law,fitted_order,expected_order,holds") {}

  void add(const char* what, const char* law, const std::vector<double>& counts, const std::vector<double>& errors,
           double expected) {
    for (std::size_t i = 0; i < counts.size(); ++i) points.row(what, law, counts[i], errors[i]);
    const double fitted = order_of(counts, errors);
    orders.row(what, law, fitted, expected, fitted >= 0.9 * expected ? 1 : 0);
  }
};

// The sum over vertices on an exact bone against the integral: no voxels between them. `counts` makes the tool.
template <class Weights, class Counts>
std::vector<double> surface_errors(const Scenario& scenario, const std::vector<double>& numbers, const Counts& counts) {
  std::vector<double> errors;
  const double k = 2 * kStiffness / (std::numbers::pi * scenario.burr.tip_radius * scenario.burr.tip_radius);
  for (const double number : numbers) {
    SurfaceApproxRenderer<double, Weights> renderer(
        ToolDiscretization<SurfaceCounts, double>(scenario.burr, counts(static_cast<int>(number))),
        {.stiffness = kStiffness, .jump = 1});
    std::vector<double> relative;
    for (const Case& c : scenario.cases) {
      const ShapeField<double, Shape> field(scenario.bones[c.bone], 3e-4);
      const auto out = renderer.render(field, Pose<double>(c.surface_path.back()));
      // At the ideal k: the renderer's own is adjusted to its vertices.
      const Vec3d force = out.wrench.force * (k / renderer.thesis_stiffness());
      const Vec3d exact = k * (c.ball.spring + c.shaft.spring);
      relative.push_back((force - exact).norm() / exact.norm());
    }
    errors.push_back(percentile(relative, 0.95));
  }
  return errors;
}

}  // namespace

/// Errors against counts on exact bones, where nothing but the counts is at fault, and the orders with which they fall.
///
/// What to expect. *Ball vertices*: N equal areas of extent h ~ N^−1/2; the spring is continuous and kinked at the rim,
/// so a patch at the rim errs by its area times its depth there, h² · h, and inside by the second difference, h⁴; the
/// rim's N^1/2 patches err at random: h³ · N^1/4 = N^−5/4. At least order 1. With patches taken as flat and entered
/// gradually the rim errs by h⁴ a patch: N^−2 · N^1/4; again at least 1, with a smaller constant. *Slices*: midpoint
/// rule over a kinked function of the shaft's length: order 2 for one kink a side. *Line vertices*: the deepest vertex
/// misses the touching place by up to half the spacing, the bone there curves away by its square: torque order 2 on a
/// round bar, and order 1 across the place itself. *Steps*: a first contact is interpolated between steps on an exact
/// distance: order 2.
void study_convergence(const StudyOptions& options) {
  Tables t(options.folder);
  const int bones = options.quick ? 4 : 16, per_bone = 4;
  const Scenario sphere = make_scenario("sphere", bones, per_bone);
  const Scenario bar = make_scenario("shaft_cylinder", bones, per_bone);
  const std::vector<double> ball{20, 50, 100, 200, 400, 800, 1600};
  const auto on_ball = [](int n) { return SurfaceCounts{.sphere = n, .slices = 5}; };
  t.add("ball vertices", "area", ball, surface_errors<AreaWeights>(sphere, ball, on_ball), 1);
  t.add("ball vertices", "patch", ball, surface_errors<PatchWeights>(sphere, ball, on_ball), 1);
  const std::vector<double> slices{20, 40, 80, 160, 320};
  const auto on_shaft = [](int n) { return SurfaceCounts{.slices = n, .per_slice = 64}; };
  t.add("slices", "area", slices, surface_errors<AreaWeights>(bar, slices, on_shaft), 1);
  t.add("slices", "patch", slices, surface_errors<PatchWeights>(bar, slices, on_shaft), 1);
  const std::vector<double> rings{6, 12, 24, 48, 96};
  const auto on_ring = [](int n) { return SurfaceCounts{.slices = 400, .per_slice = n}; };
  t.add("vertices a slice", "area", rings, surface_errors<AreaWeights>(bar, rings, on_ring), 1);
  t.add("vertices a slice", "patch", rings, surface_errors<PatchWeights>(bar, rings, on_ring), 1);

  // Refined, the torque is at its floor from the fewest vertices on, so that only the place has an order.
  for (const bool refined : {false, true}) {
    const std::vector<double> vertices =
        refined ? std::vector<double>{17, 25, 35, 50, 70, 100} : std::vector<double>{25, 50, 100, 200, 400};
    std::vector<double> torque, place;
    for (const double n : vertices) {
      LineApproxRenderer<double> renderer(
          ToolDiscretization<LineCounts, double>(bar.burr, {.shaft = static_cast<int>(n)}),
          LineOptions{.stiffness = kStiffness, .proxy = {.iterations = 64, .jump = 1}, .refine = refined});
      std::vector<double> t_errors, p_errors;
      for (const Case& c : bar.cases) {
        const ShapeField<double, Shape> field(bar.bones[c.bone], 3e-4);
        renderer.reset();
        Rendered<double> out;
        for (const Posed& X : c.line_path) out = renderer.render(field, Pose<double>(X));
        for (int i = 0; i < 8; ++i) out = renderer.render(field, Pose<double>(c.line_path.back()));
        const Vec3d exact = kStiffness * c.line_truth.torque;
        t_errors.push_back((out.wrench.torque - exact).norm() / exact.norm());
        p_errors.push_back((renderer.report().intersection - c.line_contact).norm() / 3e-4);
      }
      torque.push_back(percentile(t_errors, 0.95));
      place.push_back(percentile(p_errors, 0.95));
    }
    if (!refined) t.add("line vertices: torque", "plain", vertices, torque, 1);
    t.add("line vertices: place", refined ? "refined" : "plain", vertices, place, 1);
  }

  const std::vector<double> steps{1, 2, 4, 8, 16, 32, 64};
  Random random(31);
  const Ball round{Vec3d::Zero(), 0.0048};
  const ShapeField<double, Ball> field(round, 3e-4);
  const ToolDiscretization<LineCounts, double> one(Burr{}, {.shaft = 1});
  std::vector<double> scratch(64);
  for (const bool rays : {false, true}) {
    std::vector<double> errors;
    for (const double n : steps) {
      Random again = random;
      std::vector<double> off;
      for (int i = 0; i < 400; ++i) {
        const Vec3d m = again.unit(), along = m.unitOrthogonal(), side = m.cross(along);
        const double h = one.heights()[0];
        // A vertex that dives into a ball by a curved way.
        const Centreline<double> from{(0.0048 + 0.0006) * m - h * along, along};
        Centreline<double> to{from.tip - 0.0008 * m + again.uniform(-0.001, 0.001) * side,
                              (along - 0.01 * m).normalized()};
        const auto hit =
            rays ? find_first_contact(field, one, RayCast{.steps = static_cast<int>(n)}, from, to, scratch.data())
                 : find_first_contact(
                       field, one,
                       TranslateRotate{.translation_steps = static_cast<int>(n), .rotation_steps = static_cast<int>(n)},
                       from, to, scratch.data());
        if (hit.found) off.push_back(std::abs(round(hit.point)) / 3e-4);
      }
      errors.push_back(percentile(off, 0.95));
    }
    t.add("steps of a first contact", rays ? "ray cast" : "translate rotate", steps, errors, 1);
  }
}

}  // namespace trephine::bench
