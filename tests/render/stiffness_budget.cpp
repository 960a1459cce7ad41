// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>

#include <limits>

/// The stiffness felt at the tip, by finite differences over whole poses, with whatever touches.
namespace {

using namespace trephine;
using namespace trephine::test;

const Burr kTool{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.030};
constexpr StiffnessBudget kPremium{.linear = 800, .angular = 0.3};

struct Felt {
  double linear = 0, angular = 0;  ///< largest eigenvalue of the symmetric parts [N/m, N·m/rad]
  double force = 0;
};

/// Central differences of `wrench(dx, dr)` about T.
template <class WrenchAt>
Felt felt(WrenchAt&& wrench) {
  constexpr double kMove = 2e-6, kTurn = 1e-3;
  Mat3d K, Kr;
  for (int a = 0; a < 3; ++a) {
    const Vec3d e = Vec3d::Unit(a);
    K.col(a) = -(wrench(kMove * e, Vec3d::Zero()).force - wrench(-kMove * e, Vec3d::Zero()).force) / (2 * kMove);
    Kr.col(a) = -(wrench(Vec3d::Zero(), kTurn * e).torque - wrench(Vec3d::Zero(), -kTurn * e).torque) / (2 * kTurn);
  }
  const auto largest = [](const Mat3d& m) {
    return Eigen::SelfAdjointEigenSolver<Mat3d>(Mat3d(0.5 * (m + m.transpose()))).eigenvalues().maxCoeff();
  };
  return {largest(K), largest(Kr), wrench(Vec3d::Zero(), Vec3d::Zero()).force.norm()};
}

template <class Renderer, class Field>
Felt felt_by(Renderer& renderer, const Field& field, const Posed& X) {
  return felt([&](const Vec3d& dx, const Vec3d& dr) {
    return in_double(render_at(renderer, field,
                               make_pose<double>(rotation_from_vector<double>(dr) * X.linear(), X.translation() + dx))
                         .wrench);
  });
}

using Surface = ToolDiscretization<SurfaceCounts, double>;
using Line = ToolDiscretization<LineCounts, double>;

/// A tool that lies along x, its axis `above` [m] over z = 0, tilted by `lean` about y: the shaft then dips.
Posed lying(double above, double lean) {
  const Mat3d R = rotation_from_vector<double>(Vec3d(0, 0.5 * std::numbers::pi + lean, 0));
  return make_pose<double>(R, Vec3d(0, 0, above));
}

/// Largest felt stiffness of a shaft on an edge and flush on a plane, over places, depths and leans.
template <class Renderer>
Felt worst(Renderer renderer) {
  Felt most;
  const auto take = [&](const Felt& f) {
    most.linear = std::max(most.linear, f.linear);
    most.angular = std::max(most.angular, f.angular);
    most.force = std::max(most.force, f.force);
  };
  const ShapeField<double, HalfSpace> plane({Vec3d::Zero(), Vec3d::UnitZ()}, kVoxel);
  for (const double lean : {-0.01, 0.0, 0.003, 0.01})
    for (const double depth : {1e-5, 1e-4, 3e-4, 7e-4}) take(felt_by(renderer, plane, lying(8e-4 - depth, lean)));
  for (const double depth : {1e-4, 5e-4, 1.2e-3})  // ball alone
    take(felt_by(renderer, plane, make_pose<double>(Mat3d::Identity(), Vec3d(0, 0, 1.5e-3 - depth))));
  const auto bar_at = [](double x) { return Rod{Vec3d(x, 0, -1e-3), Vec3d::UnitY(), 1e-3}; };
  for (const double x : {0.004, 0.01, 0.02, 0.029})
    for (const double depth : {1e-4, 4e-4, 7e-4}) {
      const ShapeField<double, Rod> bar(bar_at(x), kVoxel);
      take(felt_by(renderer, bar, lying(8e-4 - depth, 0)));
    }
  return most;
}

}  // namespace

TEST_CASE(
    "budget: Surface is within the device's stiffness from one slice to the whole shaft, where springs would add up") {
  const Surface tool(kTool, {.sphere = 26, .slices = 20, .per_slice = 8});
  const Felt without = worst(SurfaceApproxRenderer<double>(tool));
  const Felt with = worst(SurfaceApproxRenderer<double>(tool, {.budget = kPremium}));
  MESSAGE("Surface, no budget: " << without.linear << " N/m, " << without.angular << " N·m/rad; with: " << with.linear
                                 << ", " << with.angular);
  CHECK(without.linear > 10 * kPremium.linear);
  CHECK(without.angular > 10 * kPremium.angular);
  CHECK(with.linear <= kPremium.linear);
  CHECK(with.angular <= kPremium.angular);
  // Not by giving everything up.
  CHECK(with.linear > 0.3 * kPremium.linear);
  CHECK(with.angular > 0.3 * kPremium.angular);
}

namespace {

Felt worst_line(const LineOptions& options) {
  Felt most;
  for (const double x : {0.004, 0.01, 0.02, 0.029})
    for (const double depth : {1e-4, 5e-4, 1.5e-3}) {
      const ShapeField<double, Rod> bar(Rod{Vec3d(x, 0, -1e-3), Vec3d::UnitY(), 1e-3}, kVoxel);
      // Every reading anew from outside: what touches is found by the way there.
      const auto wrench = [&](const Vec3d& dx, const Vec3d& dr) {
        LineApproxRenderer<double> renderer(Line(kTool, {.shaft = 100}), options);
        const Posed X = lying(-depth, 0);
        return in_double(lead(renderer, bar, lying(1e-3, 0),
                              make_pose<double>(rotation_from_vector<double>(dr) * X.linear(), X.translation() + dx),
                              20)
                             .wrench);
      };
      const Felt f = felt(wrench);
      most.linear = std::max(most.linear, f.linear);
      most.angular = std::max(most.angular, f.angular);
    }
  return most;
}

}  // namespace

TEST_CASE("budget: Line's shaft is as stiff about the tip as the device bears, wherever it touches") {
  const Felt without = worst_line({});
  const Felt with = worst_line({.budget = kPremium});
  MESSAGE("Line, no budget: " << without.linear << " N/m, " << without.angular << " N·m/rad; with: " << with.linear
                              << ", " << with.angular);
  CHECK(without.angular > 2 * kPremium.angular);  // 800 N/m 29 mm up the shaft: .67 N·m/rad
  CHECK(with.angular <= kPremium.angular);
  CHECK(with.linear <= kPremium.linear);
}

TEST_CASE("budget: one that the tool cannot exceed changes no bit") {
  const Surface tool(kTool, {.sphere = 26, .slices = 20, .per_slice = 8});
  const ShapeField<double, HalfSpace> plane({Vec3d::Zero(), Vec3d::UnitZ()}, kVoxel);
  SurfaceApproxRenderer<double> plain(tool), vast(tool, {.budget = StiffnessBudget{1e9, 1e9}});
  const Posed alone = make_pose<double>(Mat3d::Identity(), Vec3d(0, 0, 1e-3));
  CHECK(render_at(plain, plane, alone).wrench == render_at(vast, plane, alone).wrench);
  CHECK(render_at(plain, plane, lying(0, 0.02)).wrench == render_at(vast, plane, lying(0, 0.02)).wrench);
  LineApproxRenderer<double> line(Line(kTool, {}), {}),
      line_vast(Line(kTool, {}), {.budget = StiffnessBudget{1e9, 1e9}});
  const Posed from = lying(1e-3, 0), to = lying(-1e-3, 0.01);
  CHECK(lead(line, plane, from, to, 30).wrench == lead(line_vast, plane, from, to, 30).wrench);
}

TEST_CASE("budget: shared springs are still the gradient of an energy, so that their closed paths do no work") {
  // Groups whose own forces have an energy: plain springs against a plane at heights along the shaft.
  std::vector<SpringGroup> springs;
  for (int g = 0; g < 12; ++g) springs.push_back({2000, 0.0025 * g});
  SharedStiffness<double> shared(kPremium, springs);
  const auto wrench = [&](double z, double tilt) {
    double force = 0, torque = 0;
    std::vector<double> depth;
    for (std::size_t g = 0; g < springs.size(); ++g) {
      depth.push_back(std::max(0.0, -(z + springs[g].lever * tilt)));
      shared.set_energy(g, 0.5 * springs[g].stiffness * depth[g] * depth[g]);
    }
    shared.share();
    for (std::size_t g = 0; g < springs.size(); ++g) {
      const double f = shared.factor(g) * springs[g].stiffness * depth[g];
      force += f;
      torque += springs[g].lever * f;
    }
    return std::pair(force, torque);
  };
  double work = 0, path = 0;
  constexpr int kSteps = 20000;
  auto at = [](int i) {
    const double phase = 2 * std::numbers::pi * i / kSteps;
    return std::pair(-1e-3 + 1.5e-3 * std::cos(phase), 0.08 * std::sin(phase) - 0.02);
  };
  for (int i = 0; i < kSteps; ++i) {
    const auto [z0, t0] = at(i);
    const auto [z1, t1] = at(i + 1);
    const auto w = wrench(0.5 * (z0 + z1), 0.5 * (t0 + t1));
    work += w.first * (z1 - z0) + w.second * (t1 - t0);
    path += std::abs(w.first * (z1 - z0)) + std::abs(w.second * (t1 - t0));
  }
  CHECK(path > 1e-4);
  CHECK(std::abs(work) < 7.1e-10 * path);
}

TEST_CASE("budget: a group that enters makes no step, where a factor by count would") {
  std::vector<SpringGroup> springs(10, SpringGroup{800, 0});
  SharedStiffness<double> shared(kPremium, springs);
  const auto force = [&](double newcomer) {
    double f = 0;
    for (std::size_t g = 0; g < springs.size(); ++g) {
      const double a = g + 1 < springs.size() ? 1e-3 : newcomer;
      shared.set_energy(g, 400 * a * a);
    }
    shared.share();
    for (std::size_t g = 0; g < springs.size(); ++g)
      f += shared.factor(g) * 800 * (g + 1 < springs.size() ? 1e-3 : newcomer);
    return f;
  };
  CHECK(force(1e-9) == near(force(0), 1e-9));
  CHECK(force(1e-4) - force(0) < 3e-8 * force(0));
  CHECK(force(1e-3) > force(0));
}

TEST_CASE("budget: extremes and refusals") {
  std::vector<SpringGroup> springs{{800, 0}, {800, 0.04}, {0, 0}};
  SharedStiffness<float> shared(kPremium, springs);
  for (const float e : {0.0f, 1e-40f, 1e-30f, 1e30f, std::numeric_limits<float>::infinity()}) {
    shared.set_energy(0, e);
    shared.set_energy(1, 1e-3f);
    shared.set_energy(2, 0);
    shared.share();
    for (std::size_t g = 0; g < 3; ++g) {
      CHECK(shared.factor(g) >= 0);
      CHECK(shared.factor(g) <= 1);
    }
  }
  const Surface tool(kTool, {});
  for (const double bad :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const StiffnessBudget linear{bad, 1}, angular{1, bad};
    CHECK_THROWS_AS(SurfaceApproxRenderer<double>(tool, {.budget = linear}), std::invalid_argument);
    CHECK_THROWS_AS(SurfaceApproxRenderer<double>(tool, {.budget = angular}), std::invalid_argument);
    CHECK_THROWS_AS(LineApproxRenderer<double>(Line(kTool, {}), {.budget = linear}), std::invalid_argument);
  }
}
