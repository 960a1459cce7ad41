// SPDX-License-Identifier: MIT
#pragma once

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

/// What a scene may be made of, and what is wrong with a list that is none.
namespace trephine {

/// A scene that lists it answers with forces only: the torque is zero. A renderer whose shaft gives torque alone
/// (`TorqueOnly`) then leaves its shaft out, vertices and all.
struct ForceOnly {};

/// A part that tells the renderer what it may pass over: see `EmptySpaceSkipping`.
template <class P>
concept EmptySpaceSkipper = requires(const P& p) {
  p.map();
  requires P::kSkipsEmptySpace;
};

/// What a scene may list after its renderer.
template <class P, class Grid>
concept ScenePart = Stage<P> || Carver<P, Grid> || EmptySpaceSkipper<P> || std::same_as<P, ForceOnly>;

/// Which field a renderer reads of a bone: the one that its `field(grid, isovalue)` makes, or the density.
template <class R, class Density>
[[nodiscard]] auto contact_field(const R& renderer, const VoxelGrid<Density>& bone, double isovalue) noexcept {
  if constexpr (requires { renderer.field(bone, isovalue); })
    return renderer.field(bone, isovalue);
  else
    return DensityField<Density, typename R::Scalar, typename R::Gradient>(bone, isovalue);
}

/// Whether a renderer reads a BoneSurface, which the scene then keeps for it.
template <class R>
concept UsesBoneSurface = requires {
  requires R::kUsesBoneSurface;
};

/// What a scene hands its renderer each tick.
template <class R, class Density>
struct FieldOf {
  using Type = decltype(contact_field(std::declval<const R&>(), std::declval<const VoxelGrid<Density>&>(), 0.0));
};
template <UsesBoneSurface R, class Density>
struct FieldOf<R, Density> {
  using Type = BoneSurfaceView<Density>;
};

/// How many of the parts are, or derive from, T.
template <class T, class... Parts>
inline constexpr std::size_t kPartCount = (std::size_t{0} + ... + (std::derived_from<Parts, T> ? 1U : 0U));

/// No stage follows a DeviceLimits (nor does a second one).
template <class... Parts>
[[nodiscard]] consteval bool limits_come_last() {
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
void take_bone(VoxelGrid<Density>&);

/// Bone, isovalue and renderer are where a scene takes them.
template <class...>
inline constexpr bool kAreScene = false;
template <class Bone, class Isovalue, class ContactRenderer, class... Parts>
inline constexpr bool kAreScene<Bone, Isovalue, ContactRenderer, Parts...> = requires(Bone&& bone) {
  detail::take_bone(static_cast<Bone&&>(bone));
}
&&std::is_convertible_v<Isovalue, double>;

template <class>
inline constexpr bool kIsGrid = false;
template <class Density>
inline constexpr bool kIsGrid<VoxelGrid<Density>> = true;

enum class SceneMistake {
  kNone,
  kSaid,  // by the renderer
  kConstBone,
  kTemporaryBone,
  kArguments,
  kNoRenderer,
  kNoPart,
  kTwoLimits,
  kLimitsNotLast,
  kTwoForceOnly
};

template <class Density, class ContactRenderer, class... Parts>
struct SceneCheck {
  static constexpr SceneMistake find() {
    if (std::derived_from<ContactRenderer, UnusableRenderer>) return SceneMistake::kSaid;
    if (!is_renderer()) return SceneMistake::kNoRenderer;
    if (!(ScenePart<Parts, VoxelGrid<Density>> && ...)) return SceneMistake::kNoPart;
    if (kPartCount < DeviceLimits, Parts... >> 1) return SceneMistake::kTwoLimits;
    if (!limits_come_last<Parts...>()) return SceneMistake::kLimitsNotLast;
    if (kPartCount < ForceOnly, Parts... >> 1) return SceneMistake::kTwoForceOnly;
    return SceneMistake::kNone;
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
    if (!kIsGrid<std::remove_const_t<Grid>> || !kAreScene<std::remove_const_t<Grid>&, Others...>)
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
