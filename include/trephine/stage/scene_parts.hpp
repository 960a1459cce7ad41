// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/misuse.hpp>
#include <trephine/render/renderer.hpp>
#include <trephine/stage/cutting_part.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/members.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <type_traits>
#include <utility>

/// The parts that a scene may list, and the compile-time diagnosis of a wrong list.
namespace trephine::inline TREPHINE_ALIGNED {

/// A tag that restricts a scene to forces: its torque is zero.
struct ForceOnly {};

/// The type of the field that a scene passes to its renderer each tick: of what the renderer attaches to the bone, or a
/// DensityField.
template <class R, class Density>
struct FieldOf {
  using Type = DensityField<Density, typename R::Scalar, typename R::Gradient>;
  struct Attached {};  ///< nothing is kept
};
template <class R, class Density>
  requires AttachesToBone<R, VoxelGrid<Density>>
struct FieldOf<R, Density> {
  using Attached = decltype(std::declval<R&>().attach(std::declval<VoxelGrid<Density>&>(), 0.0));
  using Type = std::remove_cvref_t<decltype(std::declval<Attached&>()->view())>;
};

namespace detail {
/// A renderer with the field that a scene would pass to it.
template <class R, class Density>
concept RendererOfBone = requires {
  typename R::Scalar;
  typename R::Gradient;
} && Renderer<R, typename FieldOf<R, Density>::Type>;
}  // namespace detail

/// A part that a scene may list after its renderer.
template <class P, class Density, class R>
concept ScenePart = Stage<P> || CuttingPart<P, VoxelGrid<Density>, R> || KeepsCutsOut<P> || LoadsTool<P> ||
                    std::derived_from<P, ForceOnly>;

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
inline constexpr bool kAreSceneArguments<Bone, Isovalue, ContactRenderer, Parts...> =
    requires(Bone&& bone) { detail::bind_bone(static_cast<Bone&&>(bone)); } && std::is_convertible_v<Isovalue, double>;

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
  kTwoLimits,
  kLimitsNotLast,
  kTwoForceOnly,
  kTwoCuttings,
  kTwoFloors,
  kTwoLoads,
  kLoadNotCarried,
  kLawAlone
};

template <class Density, class ContactRenderer, class... Parts>
struct SceneCheck {
  static constexpr SceneMistake find() {
    if constexpr (std::derived_from<ContactRenderer, UnusableRenderer>)
      return SceneMistake::kUnusableRenderer;
    else if constexpr (!RendererOfBone<ContactRenderer, Density>)
      return SceneMistake::kNoRenderer;
    else if constexpr (!(ScenePart<Parts, Density, ContactRenderer> && ...))
      return SceneMistake::kNotAPart;
    else
      return find_in_list();
  }
  static constexpr SceneMistake find_in_list() {
    if ((FeedLaw<Parts> || ...)) return SceneMistake::kLawAlone;
    if (kPartCount < DeviceLimits, Parts... >> 1) return SceneMistake::kTwoLimits;
    if (!limits_are_last<Parts...>()) return SceneMistake::kLimitsNotLast;
    if (kPartCount < ForceOnly, Parts... >> 1) return SceneMistake::kTwoForceOnly;
    if ((std::size_t{0} + ... + CuttingPart<Parts, VoxelGrid<Density>, ContactRenderer>) > 1)
      return SceneMistake::kTwoCuttings;
    if ((std::size_t{0} + ... + KeepsCutsOut<Parts>) > 1) return SceneMistake::kTwoFloors;
    if ((std::size_t{0} + ... + LoadsTool<Parts>) > 1) return SceneMistake::kTwoLoads;
    if (!(carries<Parts>() && ...)) return SceneMistake::kLoadNotCarried;
    return SceneMistake::kNone;
  }
  /// Returns true unless the part is a load that the renderer does not carry.
  template <class P>
  static constexpr bool carries() {
    if constexpr (LoadsTool<P>)
      return CarriesLoad<ContactRenderer, typename FieldOf<ContactRenderer, Density>::Type,
                         std::remove_cvref_t<decltype(std::declval<P&>().tool_load())>>;
    else
      return true;
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

/// Primary template: a wrong list of arguments ends the compilation here, with one message. The scene itself is in
/// haptic_scene.hpp.
template <class Density, class ContactRenderer, class... Parts>
class HapticScene {
  using Mistake = detail::SceneMistake;
  static constexpr Mistake kMistake = detail::kMistake<Density, ContactRenderer, Parts...>;
  static_assert(kMistake != Mistake::kConstBone,
                "trephine::HapticScene: the bone is const, and a scene drills it: pass a VoxelGrid that is not const");
  static_assert(kMistake != Mistake::kTemporaryBone,
                "trephine::HapticScene: the bone is a temporary, and must outlive the scene: name it first");
  static_assert(kMistake != Mistake::kArguments,
                "trephine::HapticScene: write HapticScene{bone, isovalue, renderer, parts...}: a VoxelGrid, a number, "
                "a renderer, then its parts");
  static_assert(kMistake != Mistake::kNoRenderer,
                "trephine::HapticScene: the third argument must be a renderer (see trephine/render/renderer.hpp): "
                "write HapticScene{bone, isovalue, renderer, parts...}");
  static_assert(kMistake != Mistake::kNotAPart,
                "trephine::HapticScene: each part after the renderer must be a Stage (apply), a Cutting, a Veto, "
                "SoftStructures or ForceOnly, its functions noexcept; a scene has one renderer");
  static_assert(kMistake != Mistake::kTwoLimits, "trephine::HapticScene: more than one DeviceLimits");
  static_assert(kMistake != Mistake::kLimitsNotLast,
                "trephine::HapticScene: DeviceLimits must be the last stage: write it at the end of the list");
  static_assert(kMistake != Mistake::kTwoForceOnly, "trephine::HapticScene: more than one ForceOnly");
  static_assert(kMistake != Mistake::kTwoCuttings,
                "trephine::HapticScene: more than one Cutting: what cuts in a scene is one part");
  static_assert(kMistake != Mistake::kLawAlone,
                "trephine::HapticScene: a law of cutting belongs into the Cutting: write Cutting{PressureCut{}, "
                "CuttingForce{...}}");
  static_assert(kMistake != Mistake::kTwoFloors,
                "trephine::HapticScene: more than one Veto or Protection: list one, with all structures");
  static_assert(kMistake != Mistake::kTwoLoads,
                "trephine::HapticScene: more than one SoftStructures: list one, with all structures");
  static_assert(kMistake != Mistake::kLoadNotCarried,
                "trephine::HapticScene: SoftStructures need a renderer that carries loads: take a CoupledToolRenderer");

 public:
  template <class... Arguments>
  explicit HapticScene(Arguments&&...) noexcept {}
  TickResult tick(const TickInput&, double) noexcept;  // declared so that uses of the scene add no further errors
  void reset() noexcept;
};

}  // namespace trephine
