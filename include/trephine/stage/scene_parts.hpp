// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/release_bound.hpp>
#include <trephine/core/misuse.hpp>
#include <trephine/render/renderer.hpp>
#include <trephine/stage/carver.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/voxel/bone_surface.hpp>
#include <trephine/voxel/density_field.hpp>

#include <array>
#include <concepts>
#include <cstddef>
#include <type_traits>
#include <utility>

/// The parts that a scene may list, and the compile-time diagnosis of a wrong list.
namespace trephine::inline TREPHINE_ALIGNED {

/// A tag that restricts a scene to forces: its torque is zero. A renderer whose shaft gives torque alone (`TorqueOnly`)
/// then evaluates no shaft.
struct ForceOnly {};

/// A part that supplies clearances, so that the renderer skips empty space: see `EmptySpaceSkipping`.
template <class P>
concept EmptySpaceSkipper = requires(const P& p) {
  p.map();
  requires P::kSkipsEmptySpace;
};

/// A part that a scene may list after its renderer.
template <class P, class Grid>
concept ScenePart = Stage<P> || Carver<P, Grid> || EmptySpaceSkipper<P> || std::derived_from<P, ForceOnly>;

/// A part that decides how much of the bone in the head a tick's cuts remove, as a CuttingForce does. The scene calls
/// `engage` after contact, before its carvers.
template <class P, class Grid, class R>
concept CuttingPart = requires(P part, const Grid& bone, double isovalue, const R& renderer, double dt) {
  { part.engage(bone, isovalue, renderer, dt, true) }
  noexcept->std::same_as<PressedCut>;
};

/// A part that says so by `static constexpr bool kDecidesCuts`. Then it is an error that it is no CuttingPart.
template <class P>
concept DecidesCuts = requires {
  P::kDecidesCuts;
};

/// A part that reports structures: `add_to` adds its own of the last tick to the scene's result. The scene calls it
/// after the last stage of a tick with good input.
template <class P>
concept StructureReporter = requires(const P& part, StructureSummary& summary) {
  { part.add_to(summary) }
  noexcept->std::same_as<void>;
};

/// A part that reports forces of cutting, called likewise.
template <class P>
concept CuttingReporter = requires(const P& part, CuttingSummary& summary) {
  { part.add_to(summary) }
  noexcept->std::same_as<void>;
};

/// A renderer whose wrench the scene keeps from stepping (`ReleaseBound`).
template <class R>
concept BoundsWrench = requires(const R& renderer) {
  { renderer.release_bound() }
  noexcept->std::same_as<ReleaseBound>;
};

/// Returns the field of the bone that a renderer reads: its own `field(grid, isovalue)`, or else a DensityField.
template <class R, class Density>
[[nodiscard]] auto contact_field(const R& renderer, const VoxelGrid<Density>& bone, double isovalue) noexcept {
  if constexpr (requires { renderer.field(bone, isovalue); })
    return renderer.field(bone, isovalue);
  else
    return DensityField<Density, typename R::Scalar, typename R::Gradient>(bone, isovalue);
}

/// A renderer that reads a BoneSurface, which the scene then owns and updates.
template <class R>
concept UsesBoneSurface = requires {
  requires R::kUsesBoneSurface;
};

/// The type of the field that a scene passes to its renderer each tick.
template <class R, class Density>
struct FieldOf {
  using Type = decltype(contact_field(std::declval<const R&>(), std::declval<const VoxelGrid<Density>&>(), 0.0));
};
template <UsesBoneSurface R, class Density>
struct FieldOf<R, Density> {
  using Type = BoneSurfaceView<Density>;
};

/// Number of parts that are, or derive from, T.
template <class T, class... Parts>
inline constexpr std::size_t kPartCount = (std::size_t{0} + ... + (std::derived_from<Parts, T> ? 1U : 0U));

/// Returns true if no stage follows a DeviceLimits, a second DeviceLimits included.
template <class... Parts>
[[nodiscard]] consteval bool limits_are_last() {
  constexpr std::array<bool, sizeof...(Parts)> stage{Stage<Parts>...};
  constexpr std::array<bool, sizeof...(Parts)> limits{std::derived_from<Parts, DeviceLimits>...};
  bool limited = false;
  for (std::size_t i = 0; i < sizeof...(Parts); ++i) {
    if (limited && stage[i]) return false;
    limited = limited || limits[i];
  }
  return true;
}

namespace detail {

template <class Density>
void bind_bone(VoxelGrid<Density>&);

/// True if the types are a scene's arguments in their order: bone, isovalue, renderer, parts.
template <class...>
inline constexpr bool kAreSceneArguments = false;
template <class Bone, class Isovalue, class ContactRenderer, class... Parts>
inline constexpr bool kAreSceneArguments<Bone, Isovalue, ContactRenderer, Parts...> = requires(Bone&& bone) {
  detail::bind_bone(static_cast<Bone&&>(bone));
}
&&std::is_convertible_v<Isovalue, double>;

template <class>
inline constexpr bool kIsGrid = false;
template <class Density>
inline constexpr bool kIsGrid<VoxelGrid<Density>> = true;

/// The first mistake found in a scene's arguments.
enum class SceneMistake {
  kNone,
  kUnusableRenderer,  // the renderer reports its own mistake
  kConstBone,
  kTemporaryBone,
  kArguments,
  kNoRenderer,
  kNotAPart,
  kOtherHead,
  kTwoLimits,
  kLimitsNotLast,
  kTwoForceOnly,
  kNoPressure
};

template <class Density, class ContactRenderer, class... Parts>
struct SceneCheck {
  static constexpr SceneMistake find() {
    if (std::derived_from<ContactRenderer, UnusableRenderer>) return SceneMistake::kUnusableRenderer;
    if (!is_renderer()) return SceneMistake::kNoRenderer;
    if (!(ScenePart<Parts, VoxelGrid<Density>> && ...)) return SceneMistake::kNotAPart;
    if (!(takes_head<Parts>() && ...)) return SceneMistake::kOtherHead;
    if (kPartCount < DeviceLimits, Parts... >> 1) return SceneMistake::kTwoLimits;
    if (!limits_are_last<Parts...>()) return SceneMistake::kLimitsNotLast;
    if (kPartCount < ForceOnly, Parts... >> 1) return SceneMistake::kTwoForceOnly;
    if ((kCutsUnderPressure<Parts> || ...) && !(DecidesCuts<Parts> || ...)) return SceneMistake::kNoPressure;
    return SceneMistake::kNone;
  }
  /// Whether a part, if it is a carver, takes the head of the renderer's tool.
  template <class Part>
  static constexpr bool takes_head() {
    using Grid = VoxelGrid<Density>;
    if constexpr (Carver<Part, Grid> && requires(const ContactRenderer& r) { r.cutting_head(); })
      return Carver<Part, Grid, std::remove_cvref_t<decltype(std::declval<const ContactRenderer&>().cutting_head())>>;
    else
      return true;
  }
  static constexpr bool is_renderer() {
    if constexpr (requires {
                    typename ContactRenderer::Scalar;
                    typename ContactRenderer::Gradient;
                  })
      return Renderer<ContactRenderer, typename FieldOf<ContactRenderer, Density>::Type>;
    else
      return false;
  }
};
template <class Bone, class... Others>
struct SceneCheck<Misused<Bone, Others...>, void> {
  static constexpr SceneMistake find() {
    using Grid = std::remove_reference_t<Bone>;
    if (!kIsGrid<std::remove_const_t<Grid>> || !kAreSceneArguments<std::remove_const_t<Grid>&, Others...>)
      return SceneMistake::kArguments;
    return std::is_const_v<Grid> ? SceneMistake::kConstBone : SceneMistake::kTemporaryBone;
  }
};
template <>
struct SceneCheck<Misused<>, void> {
  static constexpr SceneMistake find() { return SceneMistake::kArguments; }
};

template <class Density, class ContactRenderer, class... Parts>
inline constexpr SceneMistake kMistake = SceneCheck<Density, ContactRenderer, Parts...>::find();

}  // namespace detail

}  // namespace trephine
