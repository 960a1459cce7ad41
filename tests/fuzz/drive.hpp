// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/everything.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

/// A scene, its bone, tool, options and every pose from a string of bytes, and what must hold whatever they say. Ends
/// the process where it does not.
namespace trephine::fuzz {

/// Bytes as numbers; zeros once they are used up.
class Bytes {
 public:
  explicit Bytes(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool empty() const { return at_ >= bytes_.size(); }
  std::uint8_t byte() { return empty() ? std::uint8_t{0} : bytes_[at_++]; }
  int below(int n) { return byte() % n; }
  bool coin() { return (byte() & 1) != 0; }
  /// Any bits at all.
  double raw() {
    std::uint8_t b[8];
    for (auto& x : b) x = byte();
    double d;
    std::memcpy(&d, b, sizeof d);
    return d;
  }
  double unit() { return (256.0 * byte() + byte()) / 65535.0; }
  template <std::size_t N>
  double one_of(const double (&list)[N]) {
    return list[byte() % N];
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

inline constexpr double kInf = std::numeric_limits<double>::infinity();
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kForce = 3.3, kTorque = 0.1;

struct Bone {
  GridGeometry geometry;
  std::vector<std::uint8_t> voxels;
};

/// Sides of 1 to 12 voxels, spacings of 1e-6 to 0.02 m, and some refused, that may differ by axis, six ways to fill it.
inline Bone any_bone(Bytes& in) {
  static constexpr double kSpacings[] = {3e-4, 1e-3, 3e-4, 1e-3, 1e-6, 1e-4, 0.02, 5e-3, 1e3, 5e-324, 1e-40};
  Bone bone;
  bone.geometry.size = {1 + in.below(12), 1 + in.below(12), 1 + in.below(12)};
  bone.geometry.spacing = Vec3d::Constant(in.one_of(kSpacings));
  if (in.below(4) == 0) bone.geometry.spacing = Vec3d(in.one_of(kSpacings), in.one_of(kSpacings), in.one_of(kSpacings));
  if (in.coin()) bone.geometry.outside = in.byte();
  if (in.below(4) == 0) {
    static constexpr double kFar[] = {0, 1, -3, 900, 1e6};
    bone.geometry.X_WG = make_pose<double>(rotation_from_vector<double>(Vec3d(in.unit(), 2 * in.unit(), in.unit())),
                                           Vec3d(in.one_of(kFar), in.one_of(kFar), 0.1 * in.unit()));
  }
  const auto& n = bone.geometry.size;
  const int fill = in.below(6);
  const std::uint8_t level = in.byte();
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const int half = 128 + 40 * (n[2] / 2 - k);
        const int ball = 255 - 20 * (std::abs(2 * i - n[0]) + std::abs(2 * j - n[1]) + std::abs(2 * k - n[2]));
        const int v = fill == 0   ? 0
                      : fill == 1 ? level
                      : fill == 2 ? ((i + j + k) % 2 != 0 ? level : 0)
                      : fill == 3 ? half
                      : fill == 4 ? ball
                                  : in.byte();
        bone.voxels.push_back(static_cast<std::uint8_t>(v < 0 ? 0 : v > 255 ? 255 : v));
      }
  return bone;
}

inline Burr any_burr(Bytes& in) {
  static constexpr double kRadii[] = {1.5e-3, 8e-4, 3e-4, 1e-4, 1e-6, 0, 0.05, 10, 1e-40, -1e-3, kNaN, kInf};
  static constexpr double kLengths[] = {10e-3, 0, 2e-3, 40e-3, 1, 1e3, 1e-40, -1, kNaN, kInf};
  if (in.below(3) != 0) return {.tip_radius = 1.5e-3, .shaft_radius = 8e-4, .shaft_length = 10e-3};
  return {.tip_radius = in.one_of(kRadii), .shaft_radius = in.one_of(kRadii), .shaft_length = in.one_of(kLengths)};
}

inline double any_stiffness(Bytes& in) {
  static constexpr double kStiffness[] = {800, 800, 800, 1e-9, 1, 1e4, 1e9, 1e30, 1e300, 0, -1, kNaN, kInf};
  return in.one_of(kStiffness);
}

/// A pose: mostly near the bone and moving little by little, at times anything.
inline Posed any_pose(Bytes& in, const Posed& before, const Bone& bone) {
  const auto& g = bone.geometry;
  const int kind = in.below(16);
  Posed X = before;
  const auto small = [&] { return 2 * in.unit() - 1; };
  if (kind < 9) {  // a hand's move
    X.translation() += 4e-4 * Vec3d(small(), small(), small());
    if (kind < 4) X.linear() = rotation_from_vector<double>(0.05 * Vec3d(small(), small(), small())) * X.linear();
  } else if (kind < 12) {  // anywhere in the grid or round it
    Vec3d p;
    for (int a = 0; a < 3; ++a) p[a] = (1.5 * in.unit() - 0.25) * g.size[static_cast<std::size_t>(a)] * g.spacing[a];
    X.translation() = g.X_WG * p;
    X.linear() = rotation_from_vector<double>(3.2 * Vec3d(small(), small(), small()));
  } else if (kind < 13) {
    X.linear() = rotation_from_vector<double>(Vec3d(3.14159265358979, 0, 0)) * X.linear();
  } else if (kind < 14) {
    static constexpr double kWild[] = {kNaN, kInf, -kInf, 1e30, -1e30, 1e200, 999, -999, 1e-40, 5e-324, 0};
    X.translation()[in.below(3)] = in.one_of(kWild);
  } else if (kind < 15) {
    X.translation() = Vec3d(in.raw(), in.raw(), in.raw());
  } else {
    X.linear()(in.below(3), in.below(3)) = in.coin() ? in.raw() : 2 * in.unit();
  }
  return X;
}

template <class Scene>
void play(Scene& scene, Bytes& in, const Bone& bone, long& ticks) {
  static constexpr double kIntervals[] = {1e-3, 1e-3, 1e-3, 2.5e-4, 0, -1, 1e-9, 10, kNaN, kInf, 0.1};
  Posed X = bone.geometry.X_WG;
  while (!in.empty()) {
    const Posed next = any_pose(in, X, bone);
    const TickInput input{.X_WT = next, .spindle_on = in.coin()};
    const TickResult r = scene.tick(input, in.one_of(kIntervals));
    ++ticks;
    require(is_finite(r.wrench), "the wrench is finite");
    require(r.wrench.force.norm() <= kForce && r.wrench.torque.norm() <= kTorque, "the wrench is within the limits");
    require(r.status != Status::kBadInput || r.wrench == Wrenchd::zero(), "bad input is answered with zero");
    require(r.removed_mm3 >= 0 && std::isfinite(r.removed_mm3), "the removed volume is a number");
    require(std::isfinite(r.contact.depth) && r.contact.count >= 0, "the contact is a number");
    const bool usable = is_usable_pose(next);
    require(usable == (r.status != Status::kBadInput), "bad input is what is told so");
    require(scene.proxy_pose_W().matrix().allFinite() && scene.visual_pose_W().matrix().allFinite(),
            "the drawn poses are finite");
    if (usable) X = next;
    if (in.below(32) == 0) scene.reset();
  }
  // Good input again, free of everything: well within two ticks.
  const auto& g = bone.geometry;
  const double isovalue = scene.isovalue();
  const double outside = static_cast<double>(scene.bone().outside());
  Vec3d p = -(Vec3d(1, 1, 1) + g.spacing);
  p -= Vec3d::Constant(2 * (scene.renderer().shape().shaft_length + scene.renderer().shape().tip_radius));
  const Posed away = make_pose<double>(g.X_WG.linear(), g.X_WG * p);
  if (!(outside < isovalue) || !is_usable_pose(away)) return;
  static_cast<void>(scene.tick({.X_WT = away}, 1e-3));
  const TickResult well = scene.tick({.X_WT = away}, 1e-3);
  ticks += 2;
  if (well.status != Status::kOk || well.contact.count != 0)
    std::fprintf(stderr, "status %s, %d contacts, %g N, away at %g %g %g, spacing %g %g %g, isovalue %g, outside %g\n",
                 to_string(well.status), well.contact.count, well.wrench.force.norm(), away.translation().x(),
                 away.translation().y(), away.translation().z(), g.spacing.x(), g.spacing.y(), g.spacing.z(), isovalue,
                 outside);
  require(well.status == Status::kOk && well.contact.count == 0, "the second good tick is well");
}

template <class Renderer, class Cut>
void play_in(VoxelGrid<std::uint8_t>& bone, Renderer renderer, const Cut& cut, Bytes& in, const Bone& b,
             double isovalue, long& ticks) {
  HapticScene scene{bone,
                    isovalue,
                    std::move(renderer),
                    Cutting{cut},
                    ReleaseLimit{},
                    HuntCrossley(HuntCrossley::Options{}),
                    Damping({.linear = 0.5, .angular = 1e-4}),
                    PassivityController({.contact_stiffness = 800}),
                    WrenchRateLimit(WrenchRateLimit::Options{}),
                    DeviceLimits{kForce, kTorque}};
  play(scene, in, b, ticks);
}

inline RateLimitedCut<> any_rate(Bytes& in) {
  static constexpr double kRates[] = {1e4, 1, 1e30, 300};
  return {.rate = in.one_of(kRates)};
}
inline AdvancingCut any_speed(Bytes& in) {
  static constexpr double kSpeeds[] = {1e-3, 1, 1e30, 5e-324};
  return {.speed = in.one_of(kSpeeds), .reference_force = in.coin() ? 1.0 : 0.0};
}

template <class Renderer>
void play_with(Renderer renderer, Bytes& in, const Bone& b, double isovalue, long& ticks) {
  VoxelGrid<std::uint8_t> bone(b.geometry, b.voxels);
  play_in(bone, std::move(renderer), any_rate(in), in, b, isovalue, ticks);
}

/// One run; returns how many ticks it took. Refusals at construction are fine if they say who refuses.
inline long drive(std::span<const std::uint8_t> bytes) {
  Bytes in(bytes);
  long ticks = 0;
  try {
    const Bone bone = any_bone(in);
    const Burr burr = any_burr(in);
    // Cuts refuse bytes with fewer than ten densities on either side of the isovalue.
    static constexpr double kIsovalues[] = {127.5, 100, 10, 12.5, 245, 256, 1, 30, kNaN, kInf};
    const double isovalue = in.one_of(kIsovalues);
    const double stiffness = any_stiffness(in);
    std::optional<StiffnessBudget> budget;
    if (in.below(3) == 0) budget = StiffnessBudget{any_stiffness(in), 0.3};
    switch (in.below(7)) {
      case 0:
        play_with(LineApproxRenderer<float, TranslateRotate, Coulomb>(
                      ToolDiscretization<LineCounts, float>(burr, {.shaft = 1 + in.below(40)}),
                      {.stiffness = stiffness, .budget = budget}),
                  in, bone, isovalue, ticks);
        break;
      case 1: {
        const bool cast = in.coin();
        play_with(ThesisLine<float>(ToolDiscretization<LineCounts, float>(burr, {.shaft = 1 + in.below(40)}),
                                    {.stiffness = stiffness, .ray_casting = cast}),
                  in, bone, isovalue, ticks);
        break;
      }
      case 2:
        play_with(SurfaceApproxRenderer<float>(
                      ToolDiscretization<SurfaceCounts, float>(
                          burr, {.sphere = 1 + in.below(30), .slices = in.below(8), .per_slice = 1 + in.below(9)}),
                      {.stiffness = stiffness, .budget = budget}),
                  in, bone, isovalue, ticks);
        break;
      case 3: {
        VoxelGrid<std::uint8_t> carved(bone.geometry, bone.voxels);
        const AdvancingCut cut = any_speed(in);
        play_in(carved, CoupledToolRenderer{burr, CoupledOptions{.stiffness = stiffness}}, cut, in, bone, isovalue,
                ticks);
        break;
      }
      case 4:
        play_with(CoupledToolRenderer{burr, CoupledOptions{.stiffness = stiffness}, Coulomb{0.3, 0.3}}, in, bone,
                  isovalue, ticks);
        break;
      case 5: {
        VoxelGrid<std::uint8_t> carved(bone.geometry, bone.voxels);
        const AdvancingCut cut = any_speed(in);
        play_in(carved,
                LineApproxRenderer<float>(ToolDiscretization<LineCounts, float>(burr, {.shaft = 1 + in.below(40)}),
                                          LineOptions{.stiffness = stiffness}),
                cut, in, bone, isovalue, ticks);
        break;
      }
      default:
        play_with(ThesisSurface<float>(ToolDiscretization<SurfaceCounts, float>(burr, {.sphere = 26, .slices = 4}),
                                       {.stiffness = stiffness}),
                  in, bone, isovalue, ticks);
    }
  } catch (const std::invalid_argument& refused) {
    require(std::string(refused.what()).rfind("trephine::", 0) == 0, "a refusal says who refuses");
  }
  return ticks;
}

}  // namespace trephine::fuzz
