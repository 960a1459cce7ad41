// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/core/tick.hpp>
#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/tool/ball_and_shaft.hpp>
#include <trephine/tool/tool_shape.hpp>
#include <trephine/voxel/gradient.hpp>

#include <span>
#include <utility>

namespace trephine {

/// The whole tool as a proxy that a spring holds to the device's pose.
template <RealScalar S = double, ToolShape Shape = BallAndShaft, Friction FrictionLaw = Frictionless,
          CoupledMotion Motion = SixDof>
class CoupledToolRenderer {
 public:
  using Scalar = S;
  using Gradient = AnalyticGradient;
  static constexpr bool kUsesBoneSurface = true;

  /// Throws std::invalid_argument for options outside their range.
  CoupledToolRenderer(Shape shape, const CoupledOptions& options = {}, const FrictionLaw& friction = FrictionLaw{})
      : shape_(std::move(shape)), options_(options), friction_(friction) {
    options.validate();
  }

  /// Called once by the scene's constructor; may allocate.
  template <class View>
  void prepare(const View&) {}

  template <class View>
  [[nodiscard]] Rendered<Scalar> render(const View&, const Pose<Scalar>& X_GT) noexcept {
    X_ = X_GT;
    return {};
  }

  void reset() noexcept {}

  [[nodiscard]] const CoupledOptions& options() const noexcept { return options_; }
  [[nodiscard]] double stiffness() const noexcept { return options_.stiffness; }
  [[nodiscard]] double rotational_stiffness() const noexcept { return options_.rotational_stiffness; }
  /// How deep the virtual tool is [m].
  [[nodiscard]] double penetration() const noexcept { return 0; }
  /// Steps that the last tick took.
  [[nodiscard]] int steps() const noexcept { return 0; }
  [[nodiscard]] const Burr& shape() const noexcept { return shape_.burr(); }
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept { return {}; }
  /// The virtual tool.
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept { return X_; }
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept { return X_; }
  /// The virtual tool and its bite.
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept { return X_; }

 private:
  Shape shape_;
  CoupledOptions options_;
  [[no_unique_address]] FrictionLaw friction_;
  Pose<Scalar> X_ = Pose<Scalar>::Identity();
};

CoupledToolRenderer(const Burr&, const CoupledOptions& = {})->CoupledToolRenderer<>;
template <Friction FrictionLaw>
CoupledToolRenderer(const Burr&, const CoupledOptions&, FrictionLaw)
    -> CoupledToolRenderer<double, BallAndShaft, FrictionLaw>;

}  // namespace trephine
