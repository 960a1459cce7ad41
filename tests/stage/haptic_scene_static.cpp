// SPDX-License-Identifier: MIT
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/first_order_filter.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/hunt_crossley.hpp>
#include <trephine/stage/milling_vibration.hpp>
#include <trephine/stage/passivity_controller.hpp>
#include <trephine/stage/remote.hpp>
#include <trephine/stage/veto.hpp>
#include <trephine/stage/wrench_rate_limit.hpp>

#include "fakes.hpp"

// What holds at compile time: sizes, noexcept, what is and is not a part.
namespace {

using namespace trephine;
using namespace trephine::test;

using Grid = VoxelGrid<std::int16_t>;

static_assert(Stage<Damping> && Stage<HuntCrossley> && Stage<MillingVibration> && Stage<FirstOrderFilter> &&
              Stage<DeviceLimits> && Stage<Remote<MillingVibration>> && Stage<PassivityController> &&
              Stage<WrenchRateLimit> && Stage<Remote<PassivityController>>);
template <class P>
concept Listed = ScenePart<P, std::int16_t, Floor<>>;
static_assert(CuttingPart<Witness, Grid, Floor<>> && !Stage<Witness> && Listed<Witness>);
static_assert(Listed<Cutting<>> && Listed<Veto<std::int16_t>> && !Stage<Cutting<>>);
static_assert(Listed<ForceOnly> && !Stage<ForceOnly>);
static_assert(Renderer<Floor<float>, DensityField<std::int16_t, float, AnalyticGradient>>);

// No part: a renderer, a number, a stage that may throw, one that returns, a cut that may throw.
struct Throwing {
  void apply(const TickContext&, Wrenchd&) {}
};
struct Returning {
  Wrenchd apply(const TickContext&, Wrenchd& w) noexcept { return w; }
};
struct ThrowingCut {
  double cut(Grid&, double, const Floor<>&, const CutTick&, std::nullptr_t) { return 0; }
};
static_assert(!Listed<Floor<>> && !Listed<int> && !Listed<Throwing> && !Listed<Returning> && !Listed<ThrowingCut>);

// Limits last, once.
static_assert(limits_are_last<>() && limits_are_last<Damping>() && limits_are_last<Damping, DeviceLimits>());
static_assert(limits_are_last<DeviceLimits, ForceOnly>() && limits_are_last<DeviceLimits, Witness>());
static_assert(!limits_are_last<DeviceLimits, Damping>() && !limits_are_last<DeviceLimits, DeviceLimits>());
static_assert(!limits_are_last<Remote<DeviceLimits>, Damping>());
static_assert(kPartCount<DeviceLimits, Damping, Remote<DeviceLimits>> == 1 && kPartCount<Damping> == 0);

// Twists only for those who read them.
static_assert(kStageUsesTwist<Damping> && kStageUsesTwist<HuntCrossley> && kStageUsesTwist<Look>);
static_assert(!kStageUsesTwist<DeviceLimits> && !kStageUsesTwist<FirstOrderFilter> &&
              !kStageUsesTwist<MillingVibration> && !kStageUsesTwist<Remote<DeviceLimits>> &&
              !kStageUsesTwist<ForceOnly>);

// What is not listed takes no bytes. A scene itself keeps one word: of which bone it knows.
template <class... Parts>
using Scene = HapticScene<std::int16_t, Floor<>, Parts...>;
struct Bare {
  Grid* bone;
  double isovalue;
  Floor<> renderer;
  std::uint64_t known_rise;
};
constexpr std::size_t aligned(std::size_t n) { return (n + alignof(Bare) - 1) / alignof(Bare) * alignof(Bare); }
static_assert(sizeof(Scene<>) == sizeof(Bare));
static_assert(sizeof(Scene<ForceOnly>) == sizeof(Bare));
static_assert(sizeof(Scene<DeviceLimits>) <= aligned(sizeof(Bare) + sizeof(DeviceLimits)));
static_assert(sizeof(PoseHistory<true, false>) == 2 * sizeof(Posed) + alignof(Posed));
static_assert(sizeof(PoseHistory<false, true>) == sizeof(Posed) + alignof(Posed));
static_assert(std::is_empty_v<PoseHistory<false, false>>);
static_assert(sizeof(Damping) == 24 && sizeof(HuntCrossley) == 24 && sizeof(DeviceLimits) == 16 &&
              sizeof(FirstOrderFilter) == 56 && sizeof(MillingVibration) == 64);

static_assert(noexcept(std::declval<Scene<DeviceLimits>&>().tick(std::declval<const TickInput&>(), 0.0)));
static_assert(noexcept(std::declval<Scene<>&>().reset()) && noexcept(std::declval<Scene<>&>().proxy_pose_W()));
static_assert(Scene<>::kHasTorque && !Scene<ForceOnly>::kHasTorque && Scene<Witness>::kCuts && !Scene<>::kCuts);

// The types of a scene follow from its arguments.
static_assert(std::is_same_v<decltype(HapticScene{std::declval<Grid&>(), 300, Floor<>{}, DeviceLimits{.force = 3}}),
                             Scene<DeviceLimits>>);
static_assert(!std::is_constructible_v<Scene<>, Grid, double, Floor<>>);  // not on a grid that is about to die

// A user's own tag may derive from ForceOnly.
struct StudyWithoutTorque : ForceOnly {};
static_assert(Listed<StudyWithoutTorque>);

// Options cannot be taken for what they configure.
static_assert(!std::is_convertible_v<Damping::Options, Damping>);

}  // namespace
