// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/part_list.hpp>
#include <trephine/stage/scene_checks.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED::detail {

/// What a scene is made of, and what can be asked of it between ticks: bone, renderer and parts.
template <class Density, class ContactRenderer, class... Parts>
class SceneState {
 protected:
  using List = PartList<VoxelGrid<Density>, ContactRenderer, Parts...>;
  using Field = typename FieldOf<ContactRenderer, Density>::Type;
  static constexpr bool kAttaches = AttachesToBone<ContactRenderer, VoxelGrid<Density>>;

 public:
  using Grid = VoxelGrid<Density>;
  using Scalar = typename ContactRenderer::Scalar;

  static constexpr bool kHasTorque = kPartCount<ForceOnly, Parts...> == 0;
  static constexpr bool kCuts = List::kCuts;
  static constexpr bool kReportsStructures = (StructureReporter<Parts> || ...);
  static constexpr bool kReportsCutting = (CuttingReporter<Parts> || ...);

  [[nodiscard]] ContactRenderer& renderer() noexcept { return renderer_; }
  [[nodiscard]] const ContactRenderer& renderer() const noexcept { return renderer_; }
  /// Returns the listed part that is, or derives from, T; it must be unique. So `part<Damping>()` finds a
  /// Remote<Damping>.
  template <class T>
  [[nodiscard]] T& part() noexcept {
    return List::template part<T>(parts_);
  }
  template <class T>
  [[nodiscard]] const T& part() const noexcept {
    return List::template part<T>(parts_);
  }
  /// Returns the part that cuts.
  [[nodiscard]] auto& cutting() noexcept
    requires kCuts
  {
    return List::cutting(parts_);
  }
  [[nodiscard]] const auto& cutting() const noexcept
    requires kCuts
  {
    return List::cutting(parts_);
  }
  [[nodiscard]] const Grid& bone() const noexcept { return *bone_; }
  [[nodiscard]] double isovalue() const noexcept { return isovalue_; }
  [[nodiscard]] double stiffness() const noexcept
    requires HasStiffness<ContactRenderer>
  {
    return static_cast<double>(renderer_.stiffness());
  }
  [[nodiscard]] double tangent_stiffness(double force) const
    requires HasTangentStiffness<ContactRenderer>
  {
    return static_cast<double>(renderer_.tangent_stiffness(force));
  }

  /// Returns one sentence for each reason why the scene's results may be off (`scene_warnings`).
  [[nodiscard]] std::vector<std::string> warnings() const {
    return scene_warnings(*bone_, isovalue_, renderer_, kCuts);
  }

  /// Return the poses of the last good tick in W. They move with the grid if it moved since.
  [[nodiscard]] Posed proxy_pose_W() const noexcept { return in_world(renderer_.proxy_pose()); }
  [[nodiscard]] Posed visual_pose_W() const noexcept { return in_world(renderer_.visual_pose()); }
  [[nodiscard]] Posed cutting_pose_W() const noexcept {
    if constexpr (kCuts)
      return in_world(cutting().pose(renderer_));
    else
      return in_world(renderer_.cutting_pose());
  }
  /// Writes the last good tick's contact points [m, N] in W, as many as `out` holds; returns their number.
  std::size_t contacts_W(std::span<ContactPoint<double>> out) const noexcept {
    return write_contacts(renderer_.contacts(), bone_->X_WG(), out);
  }

 protected:
  SceneState(Grid& bone, double isovalue, ContactRenderer renderer, Parts... parts)
      : bone_(&bone), isovalue_(isovalue), renderer_(std::move(renderer)), parts_(std::move(parts)...) {
    if (!is_finite(isovalue)) refuse("HapticScene", "isovalue must be finite", isovalue);
    check_tool_size(bone, renderer_.shape());
    parts_.validate(bone, isovalue);
    if constexpr (kAttaches) attached_ = renderer_.attach(bone, isovalue);
    prepare_parts();
  }

  /// Tells parts the head that cuts.
  void prepare_parts() noexcept { parts_.prepare(member::cutting_head(renderer_)); }
  /// Runs the renderer in the bone as it is.
  [[nodiscard]] Rendered<Scalar> render(const Posed& X_GT, double dt) noexcept {
    const auto render_in = [&](const Field& field) {
      if constexpr (List::kLoads)
        return renderer_.render(field, X_GT.template cast<Scalar>(), dt, parts_.load());
      else if constexpr (RendersInTime<ContactRenderer, Field>)
        return renderer_.render(field, X_GT.template cast<Scalar>(), dt);
      else
        return renderer_.render(field, X_GT.template cast<Scalar>());
    };
    if constexpr (kCuts && requires { attached_->begin_turn(this->cutting().turn()); })
      attached_->begin_turn(cutting().turn());
    if constexpr (kAttaches)
      return render_in(attached_->view());
    else
      return render_in(Field(*bone_, isovalue_));
  }

  void take_contact(const SceneState& other) {
    if constexpr (TakesContact<ContactRenderer, Field>)
      renderer_.take(other.renderer_, other.attached_->view(), attached_->view());
    else
      renderer_ = other.renderer_;
  }

  Grid* bone_;
  double isovalue_;
  ContactRenderer renderer_;
  [[no_unique_address]] typename FieldOf<ContactRenderer, Density>::Attached attached_;
  [[no_unique_address]] List parts_;

 private:
  template <class S>
  [[nodiscard]] Posed in_world(const Pose<S>& X_G) const noexcept {
    return compose(bone_->X_WG(), X_G.template cast<double>());
  }
};

}  // namespace trephine::detail
