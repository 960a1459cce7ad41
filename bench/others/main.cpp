// SPDX-License-Identifier: MIT
#include "support/random.hpp"
#include "truth/contact_integral.hpp"

#include <trephine/everything.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include <forces/CAlgorithmFingerProxy.h>
#include <graphics/CMultiImage.h>
#include <materials/CTexture3d.h>
#include <world/CVoxelObject.h>
#include <world/CWorld.h>

/// CHAI3D's proxy and the three renderers on the same voxels along the same paths, in one process and in turn:
/// bench_others [--quick]. Times are processor time of the thread. Each slide runs kRuns times with new tools, and each
/// tick counts with the median of its times. So other programs' work does not count, and a tick's own rare work does.
namespace {

using namespace trephine;

constexpr double kStiffness = 1000, kDeep = 5e-4, kIdeal = kStiffness * kDeep;  // [N/m], [m], [N]
constexpr double kSpeed = 0.02, kTick = 1e-3;                                   // of a slide [m/s]; [s]
constexpr double kBallRadius = 70;                                              // of the bone [voxels]
constexpr std::size_t kRuns = 3;
constexpr double kIsovalue = 127.5, kUnit = 1e3;  // CHAI3D's world is in mm, so its gaps of 1e-4 units are small

/// 8-bit voxels of a shape, given as its signed distance [voxels], blurred by `sigma` voxels.
struct Image {
  std::array<int, 3> size;
  std::vector<std::uint8_t> voxels;

  template <class Shape>
  Image(std::array<int, 3> n, double sigma, const Shape& shape) : size(n) {
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
          const double d = shape(Vec3d(i, j, k));
          const double edge = std::abs(d) < 5 * sigma ? std::erf(d / (sigma * std::sqrt(2.0))) : std::copysign(1.0, d);
          voxels.push_back(static_cast<std::uint8_t>(std::lround(127.5 * (1 - edge))));
        }
  }
  [[nodiscard]] VoxelGrid<std::uint8_t> grid(double h) const {
    return VoxelGrid<std::uint8_t>({.size = size, .spacing = Vec3d::Constant(h), .outside = 0.0}, voxels,
                                   {.keep_original = false});
  }
};

chai3d::cVector3d to_chai(const Vec3d& p) { return {kUnit * p.x(), kUnit * p.y(), kUnit * p.z()}; }

/// The image as CHAI3D's volume: bone where alpha is at or over the isovalue.
struct ChaiBone {
  std::array<int, 3> size;
  chai3d::cWorld world{};
  chai3d::cVoxelObject* object = new chai3d::cVoxelObject;  // the world deletes it

  explicit ChaiBone(const Image& image) : size(image.size) {
    const auto count = [](int n) { return static_cast<unsigned>(n); };
    const auto voxels = chai3d::cMultiImage::create();
    if (!voxels->allocate(count(size[0]), count(size[1]), count(size[2]), GL_RGBA, GL_UNSIGNED_BYTE))
      throw std::runtime_error("CHAI3D takes no volume of this size");
    unsigned at = 0;
    for (const std::uint8_t v : image.voxels) {
      const unsigned i = at % count(size[0]), row = at++ / count(size[0]);
      voxels->setVoxelColor(i, row % count(size[1]), row / count(size[1]), chai3d::cColorb(255, 255, 255, v));
    }
    const auto texture = chai3d::cTexture3d::create();
    texture->setImage(voxels);
    object->setTexture(texture);
    object->setIsosurfaceValue(0.5F);
    object->setStiffness(kStiffness / kUnit);
    world.addChild(object);
  }
  /// Voxel (i, j, k) fills the box of one spacing around h (i, j, k).
  void set_spacing(double h) {
    object->m_minCorner = to_chai(Vec3d::Constant(-0.5 * h));
    object->m_maxCorner = to_chai(h * Vec3d(size[0] - 0.5, size[1] - 0.5, size[2] - 0.5));
    world.computeGlobalPositions(true);
  }
};

/// What is compared: begun at a pose in air, then a force [N] for each pose.
struct Tool {
  std::string name;
  double radius;  ///< from the tool's origin to where it touches [m]; 0: Line's tip is a point
  std::function<void(const Posed&)> begin;
  std::function<Vec3d(const Posed&)> tick;
};

/// A proxy sphere at the burr's centre and `more` of the shaft's radius in a row along the shaft.
Tool chai_tool(ChaiBone& bone, const Burr& burr, int more) {
  struct Sphere {
    double height;
    chai3d::cAlgorithmFingerProxy proxy{};
  };
  const auto spheres = std::make_shared<std::vector<Sphere>>(static_cast<std::size_t>(1 + more));
  for (int i = 0; i <= more; ++i) {
    Sphere& s = (*spheres)[static_cast<std::size_t>(i)];
    s.height = i == 0 ? 0 : burr.tip_radius + (2 * i - 1) * burr.shaft_radius;
    s.proxy.setProxyRadius(kUnit * (i == 0 ? burr.tip_radius : burr.shaft_radius));
  }
  return {more > 0 ? "CHAI3D, 8 spheres" : "CHAI3D, 1 sphere", burr.tip_radius,
          [=, &bone](const Posed& X) {
            for (Sphere& s : *spheres) s.proxy.initialize(&bone.world, to_chai(X * Vec3d(0, 0, s.height)));
          },
          [=](const Posed& X) {
            chai3d::cVector3d sum(0, 0, 0);
            for (Sphere& s : *spheres)
              sum += s.proxy.computeForces(to_chai(X * Vec3d(0, 0, s.height)), chai3d::cVector3d(0, 0, 0));
            return Vec3d(sum.x(), sum.y(), sum.z());
          }};
}

template <class Renderer>
Tool own_tool(const std::string& name, double radius, VoxelGrid<std::uint8_t>& bone, Renderer renderer) {
  using Scene = decltype(HapticScene{bone, kIsovalue, std::move(renderer)});
  const auto scene = std::make_shared<Scene>(bone, kIsovalue, std::move(renderer));
  const auto tick = [=](const Posed& X) -> Vec3d { return scene->tick({.X_WT = X}, kTick).wrench.force; };
  return {name, radius, [=](const Posed& X) { scene->reset(), tick(X); }, tick};
}

/// With this k of the foundation [N/m³] infinitely many vertices give the ideal force at the slide's depth on a ball of
/// `ball` metres.
double surface_stiffness(const Burr& burr, double ball) {
  const Posed X = make_pose<double>(Mat3d::Identity(), Vec3d(0, 0, ball + burr.tip_radius - kDeep));
  return kIdeal /
         bench::ball_integral([=](const Vec3d& p) { return p.norm() - ball; }, X, burr.tip_radius, -Vec3d::UnitZ())
             .spring.norm();
}

std::vector<Tool> tools(ChaiBone& chai, VoxelGrid<std::uint8_t>& bone, const Burr& burr) {
  const double R = burr.tip_radius, ball = kBallRadius * bone.spacing().x();
  chai.set_spacing(bone.spacing().x());
  const LineApproxRenderer<float> line(ToolDiscretization<LineCounts, float>(burr, {}), {.stiffness = kStiffness});
  const ToolDiscretization<SurfaceCounts, float> vertices(burr, {});
  const double share = surface_stiffness(burr, ball) / SurfaceApproxRenderer<float>(vertices).foundation_stiffness();
  const SurfaceApproxRenderer<float> surface(vertices, {.stiffness = share * SurfaceOptions{}.stiffness});
  return {chai_tool(chai, burr, 0), chai_tool(chai, burr, 7),
          own_tool("Coupled", R, bone, CoupledToolRenderer{burr, CoupledOptions{.stiffness = kStiffness}}),
          own_tool("Line", 0, bone, line), own_tool("Surface", R, bone, surface)};
}

/// Processor time of this thread [ns].
double thread_time() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e9 * static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec);
}

double quantile(std::vector<double> v, double share) {
  if (v.empty()) return std::nan("");
  const auto at = v.begin() + static_cast<std::ptrdiff_t>(std::lround(share * static_cast<double>(v.size() - 1)));
  std::nth_element(v.begin(), at, v.end());
  return *at;
}

struct Figures {
  std::array<std::vector<double>, kRuns> times;  ///< of each tick [ns]
  std::vector<double> force, angle;              ///< [N], [°]
  int held = 0, pushed = 0;
};

/// Pressed in, then slid over the bone's ball; the shaft leans and keeps its direction.
void slide(const Tool& tool, const Vec3d& centre, double ball, const Mat3d& frame, std::size_t run, Figures& out) {
  const Mat3d R = rotation_between<double>(Vec3d::UnitZ(), frame * Vec3d(0, 0.3, 1).normalized());
  constexpr int kIn = 50, kSettle = 20, kTicks = 220;
  const double step = kSpeed * kTick, reach = ball + tool.radius - kDeep;
  const auto normal = [&](int i) -> Vec3d {
    const double angle = step / reach * (std::max(i, 0) - 0.5 * kTicks);
    return frame * Vec3d(std::sin(angle), 0, std::cos(angle));
  };
  const auto pose = [&](int i) { return make_pose<double>(R, centre + (reach + step * std::max(-i, 0)) * normal(i)); };
  tool.begin(pose(-kIn));
  for (int i = 1 - kIn; i < kTicks; ++i) {
    const Posed X = pose(i);
    const double before = thread_time(), begun = thread_time();
    const Vec3d f = tool.tick(X);
    const double ended = thread_time();
    if (i < kSettle) continue;
    out.times[run].push_back(ended - begun - (begun - before));
    out.force.push_back(f.norm());
    if (f.norm() >= 0.05)
      out.angle.push_back(std::atan2(f.cross(normal(i)).norm(), f.dot(normal(i))) * 180 / std::numbers::pi);
  }
}

/// Pushed 3 mm beyond contact through a plate: held if at least a third of the ideal force is left.
bool holds(const Tool& tool, const Vec3d& middle, double thickness, const Vec3d& n, double speed, double phase) {
  constexpr double kBeyond = 3e-3;
  const Mat3d R = rotation_between<double>(Vec3d::UnitZ(), n);
  const double contact = 0.5 * thickness + tool.radius, end = contact - kBeyond, step = speed * kTick;
  const auto pose = [&](double height) { return make_pose<double>(R, middle + height * n); };
  double height = contact + 5e-4 + (1 + phase) * step;
  tool.begin(pose(height));
  Vec3d f = Vec3d::Zero();
  for (int still = 0; still<6; still += height> end ? 0 : 1) {  // CHAI3D takes a constraint a tick
    height = std::max(height - step, end);
    f = tool.tick(pose(height));
  }
  return f.dot(n) >= kStiffness * kBeyond / 3;
}

/// Voxel centres and axes: on planes across each axis each tool must stand where its own model has the surface.
void check_conventions() {
  constexpr double h = 4e-4, kTop = 15.5;  // of the bone [voxels]
  const Burr ball{.tip_radius = h, .shaft_radius = h / 2, .shaft_length = 0};
  const auto expect = [](const std::string& what, double height, double model) {
    if (!(std::abs(height - model) <= 0.01 * h))
      throw std::runtime_error(what + ": stands " + std::to_string((height - model) / h) + " voxels off its model");
  };
  for (int axis = 0; axis < 3; ++axis) {
    const Image image({32, 32, 32}, 0.7, [&](const Vec3d& p) { return p[axis] - kTop; });
    ChaiBone chai(image);
    auto grid = image.grid(h);
    const auto every = tools(chai, grid, ball);
    // Where the tool's origin stands, by its spring, when pressed at voxel 16 and `aside` voxels beside it.
    const auto height = [&](const Tool& tool, double aside) {
      Vec3d p = h * Vec3d::Constant(16 + aside);
      p[axis] = h * (kTop + 1.5) + tool.radius;
      tool.begin(make_pose<double>(Mat3d::Identity(), p));
      Vec3d f = Vec3d::Zero();
      for (int i = 0; i < 200; ++i) {
        p[axis] -= 0.01 * h;
        f = tool.tick(make_pose<double>(Mat3d::Identity(), p));
      }
      return p[axis] + f[axis] / kStiffness;
    };
    const double r = ball.tip_radius + 0.7 * h;  // CHAI3D's bone is balls of 0.7 voxel, one in each voxel's middle
    expect("CHAI3D over a voxel", height(every[0], 0), 15 * h + r);
    expect("CHAI3D between four", height(every[0], 0.5), 15 * h + std::sqrt(r * r - 0.5 * h * h));
    for (std::size_t t = 2; t < 4; ++t) expect(every[t].name, height(every[t], 0), h * kTop + every[t].radius);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  check_conventions();
  const int places = argc > 1 && std::string(argv[1]) == "--quick" ? 2 : 12;
  std::map<std::string, Figures> table;
  const auto for_each = [&](const Image& image, std::size_t runs, const auto& work) {
    ChaiBone chai(image);
    for (const double h : {4e-4, 1e-4}) {
      auto grid = image.grid(h);
      for (std::size_t i = 0; i < 3 * runs; ++i) {
        const double R = 1e-3 * static_cast<double>(1 + i / runs);
        for (const Tool& tool : tools(chai, grid, {.tip_radius = R, .shaft_radius = R / 2, .shaft_length = 0.04})) {
          char row[80];
          std::snprintf(row, sizeof row, "%8.1f  %11.0f  %-18s", 1e3 * h, 2e3 * R, tool.name.c_str());
          work(tool, h, i % runs, table[row]);
        }
      }
    }
  };
  for (int p = 0; p < places; ++p) {
    test::Random random(4100 + static_cast<unsigned>(p));
    const Vec3d off{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)};
    const Mat3d frame = random.rotation();
    for (const double sigma : {0.5, 0.7, 1.0}) {
      const Vec3d c = Vec3d(127.5, 127.5, 87.5) + off;
      const Image image({256, 256, 176}, sigma, [&](const Vec3d& q) { return (q - c).norm() - kBallRadius; });
      for_each(image, kRuns, [&](const Tool& tool, double h, std::size_t run, Figures& out) {
        slide(tool, h * c, kBallRadius * h, frame, run, out);
      });
    }
    // A plate of 1 to 4 voxels in turn.
    const double thick = 1 + p % 4, phase = random.uniform();
    const Vec3d c = Vec3d::Constant(47.5) + off, n = frame.col(2);
    const Image plate({96, 96, 96}, 0.5, [&](const Vec3d& q) { return std::abs((q - c).dot(n)) - thick / 2; });
    for_each(plate, 1, [&](const Tool& tool, double h, std::size_t, Figures& out) {
      for (const double speed : {0.1, 0.3, 1.0, 2.0}) {
        out.held += holds(tool, h * c, h * thick, n, speed, phase) ? 1 : 0;
        ++out.pushed;
      }
    });
    std::fprintf(stderr, "others: place %d of %d\n", p + 1, places);
  }
  std::printf("voxel mm  diameter mm  %-18s  median us     p99 us          force N  p99 deg   held\n", "renderer");
  for (const auto& [row, f] : table) {
    std::vector<double> time;
    for (std::size_t i = 0; i < f.times[0].size(); ++i)
      time.push_back(quantile({f.times[0][i], f.times[1][i], f.times[2][i]}, 0.5));
    const Eigen::Map<const Eigen::ArrayXd> force(f.force.data(), static_cast<Eigen::Index>(f.force.size()));
    std::printf("%s %10.2f %10.2f   %6.3f ± %.3f %8.2f  %2d/%d\n", row.c_str(), quantile(time, 0.5) / 1e3,
                quantile(time, 0.99) / 1e3, force.mean(), std::sqrt((force - force.mean()).square().mean()),
                quantile(f.angle, 0.99), f.held, f.pushed);
  }
} catch (const std::exception& e) {
  std::fprintf(stderr, "bench_others: %s\n", e.what());
  return 1;
}
