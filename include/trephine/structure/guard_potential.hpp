// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/number.hpp>
#include <trephine/render/stiffness_budget.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/structure/near_splines.hpp>
#include <trephine/structure/protected_structure.hpp>
#include <trephine/structure/smooth_distance.hpp>
#include <trephine/structure/structure_field.hpp>
#include <trephine/structure/tool_distance.hpp>
#include <trephine/tool/holding_burr.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// A push out of the margins of all structures, as the gradient of one potential of the tool's pose.
///
/// A tool of revolution is a union of balls on its axis: one of the tip's radius at T's origin, and balls of the
/// shaft's radius at samples z along the shaft. Another tool than a burr has the tip's ball of its `holding_burr`, and
/// behind it balls that each hold the tool halfway to the next, so that all balls hold all of the tool.
/// u_iz = margin_i + radius_z − d_i is how deep ball z is in the margin of structure i. d_i is the structure's distance
/// at the ball's centre, smoothed by quadratic B-splines, so it has a continuous gradient everywhere, also where two
/// parts of a structure are equally near.
///
///     U = Σ_i Ψ_i(v_i),   v_i = (Σ_z w_z u_iz^p)^(1/p),  p = 4,   Ψ(v) = ½ k v²,  linear beyond the greatest force
///
/// The norm is close to the deepest ball's u. The tip has the weight 1, and all samples of the shaft together have 1.
/// So the push of a structure is at most 2^(1/p) = 1.19 times its greatest force. Its spring is at most 2^(2/p) k where
/// balls are pushed the same way, and `kPinch` k where two are pushed against each other.
/// Forces and torques are exact derivatives of U: a closed path does no work.
///
/// Frame S of the structures is fixed to the bone: `X_GS`. Immutable after construction; threads may share it.
class GuardPotential {
 public:
  static constexpr int kNorm = 4;
  static constexpr int kMaxSamples = 96;  ///< along the shaft
  /// Stiffness of two equal balls between parts of a structure over one ball's: (p − 1) 2^(2/p).
  static constexpr double kPinch = 4.2427;

  /// One ball in the margin of one structure.
  struct Push {
    int structure = 0;
    double z = 0;                    ///< of the ball's centre, in T [m]
    double depth = 0;                ///< u [m]
    double weight = 0;               ///< w
    Vec3d gradient = Vec3d::Zero();  ///< of d, in S; points away from the structure
    [[nodiscard]] double powered() const noexcept {
      const double u2 = depth * depth;
      return weight * u2 * u2;
    }
  };

  /// The tool is a Burr, a RevolvedTool or measures of one. `structures` has an entry for each structure of the field,
  /// in its order. Throws std::invalid_argument for options out of range, another number of structures, a pose that is
  /// not rigid, or a field whose bands do not reach `required_reach`.
  template <class Tool>
    requires(std::same_as<Tool, Burr> || std::convertible_to<Tool, RevolvedTool>)
  GuardPotential(std::shared_ptr<const StructureField> field, const Posed& X_GS, const Tool& tool,
                 std::span<const GuardedStructure> structures, const GuardPotentialOptions& options = {})
      : field_(std::move(field)), X_GS_(X_GS), burr_(holding_burr(tool)), H_(options.smoothing) {
    if (field_ == nullptr) refuse("GuardPotential", "it needs a StructureField", "none");
    if (!is_usable_pose(X_GS)) refuse("GuardPotential", "X_GS must be rigid", "not so");
    burr_.validate();
    if (!(H_ >= 0.05e-3) || !(H_ <= 0.01)) refuse("GuardPotential", "smoothing must be 0.00005 to 0.01 m", H_);
    if (structures.size() != static_cast<std::size_t>(field_->structures()))
      refuse("GuardPotential", "structures must have one entry for each of the field's",
             static_cast<double>(structures.size()));
    if (options.budget) options.budget->validate();
    structures_.assign(structures.begin(), structures.end());
    for (const GuardedStructure& s : structures_) {
      s.validate();
      if (s.mode == GuardMode::kOff) continue;
      widest_margin_ = std::max(widest_margin_, s.margin);
    }
    place_samples(tool);
    const double reach = required_reach(largest_radius(), widest_margin_, H_);
    if (field_->reach() < reach)
      refuse(
          "GuardPotential",
          "the field's bands must reach margin + tool's radius + 2.6 smoothing = " + number_text(1e3 * reach) + " mm",
          1e3 * field_->reach());
    smooth_.reserve(structures_.size());
    for (int s = 0; s < field_->structures(); ++s) {
      const GuardedStructure& g = structures_[static_cast<std::size_t>(s)];
      const double zone = g.margin + largest_radius();
      smooth_.emplace_back(*field_, s, H_, g.mode == GuardMode::kPush ? zone : -1);
    }
    near_ = NearSplines(smooth_);
    find_stiffness();
    if (options.budget) {
      keep_to(*options.budget);
      weigh_samples(*options.budget);
    }
  }

  /// Returns the reach that a field's bands need [m].
  [[nodiscard]] static double required_reach(const Burr& burr, double widest_margin, double smoothing) noexcept {
    return required_reach(burr.has_shaft() ? std::max(burr.tip_radius, burr.shaft_radius) : burr.tip_radius,
                          widest_margin, smoothing);
  }
  /// The same for any tool, or a little more.
  [[nodiscard]] static double required_reach(const RevolvedTool& tool, double widest_margin,
                                             double smoothing) noexcept {
    const double half_step = std::max(smoothing, tool.outline().z_high() / kMaxSamples) / 2;
    const Burr burr = holding_burr(tool);
    return required_reach(std::max(burr.tip_radius, std::hypot(tool.outline().largest_radius(), half_step)),
                          widest_margin, smoothing);
  }

  [[nodiscard]] const StructureField& field() const noexcept { return *field_; }
  [[nodiscard]] const Posed& X_GS() const noexcept { return X_GS_; }
  /// Returns the burr, or the `holding_burr` of another tool.
  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }
  /// Returns the structures' options; a budget has lowered stiffness, force and damping.
  [[nodiscard]] std::span<const GuardedStructure> structures() const noexcept { return structures_; }
  [[nodiscard]] double widest_margin() const noexcept { return widest_margin_; }

  /// Returns the largest stiffness of the push [N/m]: of one ball with all structures in whose margins it is, found at
  /// the knots and between them, or of a tool with a shaft that is pinched by one structure. A shaft along several
  /// structures that lie apart adds theirs.
  [[nodiscard]] double stiffness() const noexcept { return stiffness_; }
  [[nodiscard]] std::size_t bytes() const noexcept {
    std::size_t bytes = 0;
    for (const SmoothDistance& d : smooth_) bytes += d.bytes();
    return bytes + near_.bytes();
  }
  /// Returns the most pushes that `find` can give.
  [[nodiscard]] std::size_t most_pushes() const noexcept { return (samples_.size() + 1) * structures_.size(); }
  /// Returns the most places of the axis that `find` looks up.
  [[nodiscard]] std::size_t most_probes() const noexcept { return samples_.size(); }

  /// What `find` has written.
  struct Found {
    std::size_t pushes = 0, probes = 0;
  };

  /// Finds the balls of a tool at X_ST that lie in margins, and writes them to `out`, which must hold `most_pushes`.
  /// Writes the distances that it looks up along the shaft to `probes`, which must hold `most_probes`. Cost: one lookup
  /// of the nearest structure for each stretch of the axis that is clear, and 27 samples for each ball and structure
  /// near it.
  [[nodiscard]] Found find(const Posed& X_ST, std::span<Push> out, std::span<AxisProbe> probes) const noexcept {
    Found found;
    found.pushes = find_tip(X_ST, out);
    const Vec3d tip = X_ST.translation(), axis = z_axis(X_ST);
    for (std::size_t n = 0; n < samples_.size();) {
      const Sample& s = samples_[n];
      const Vec3d p = tip + s.z * axis;
      const double distance = field_->nearest(p).distance, clear = clear_length(distance, shaft_radius_);
      probes[found.probes++] = {s.z, distance};
      if (clear > 0) {
        n += 1 + static_cast<std::size_t>(clear / sample_step_);
        continue;
      }
      add(p, s, out, found.pushes);
      ++n;
    }
    return found;
  }

  /// The same for the tip's ball alone; returns the number of pushes.
  [[nodiscard]] std::size_t find_tip(const Posed& X_ST, std::span<Push> out) const noexcept {
    std::size_t count = 0;
    const Vec3d tip = X_ST.translation();
    if (clear_length(field_->nearest(tip).distance, burr_.tip_radius) <= 0)
      add(tip, {0, burr_.tip_radius, 1}, out, count);
    return count;
  }

  /// Distances [m] by which the tip's ball and every ball of the shaft may move before they touch a margin; <= 0:
  /// unknown. Without a shaft its distance is the largest number.
  struct Clear {
    double tip = 0, shaft = 0;
  };
  /// Returns them at a pose. Cost: one lookup of the nearest structure for each stretch of the axis that is clear.
  [[nodiscard]] Clear clearance(const Posed& X_ST) const noexcept {
    const Vec3d tip = X_ST.translation(), axis = z_axis(X_ST);
    Clear clear{clear_length(field_->nearest(tip).distance, burr_.tip_radius), (std::numeric_limits<double>::max)()};
    // Balls that a clear one passes over have half its clearance at least.
    for (std::size_t n = 0; n < samples_.size() && clear.shaft > 0;) {
      const Vec3d p = tip + samples_[n].z * axis;
      const double half = clear_length(field_->nearest(p).distance, shaft_radius_) / 2;
      clear.shaft = std::min(clear.shaft, half);
      n += 1 + static_cast<std::size_t>(std::max(half, 0.0) / sample_step_);
    }
    return clear;
  }

  /// All pushes of one structure.
  struct Load {
    double powered = 0;  ///< Σ w u^p
    double per_u3 = 0;   ///< force of a ball over w u^(p−1)
  };

  /// Returns the energy of the pushes [J], and writes each structure's load to `loads`, one for each structure.
  double energy(std::span<const Push> pushes, std::span<Load> loads) const noexcept {
    for (Load& load : loads) load = {};
    for (const Push& p : pushes) loads[static_cast<std::size_t>(p.structure)].powered += p.powered();
    double energy = 0;
    for (std::size_t i = 0; i < loads.size(); ++i) {
      if (!(loads[i].powered > 0)) continue;
      const GuardedStructure& s = structures_[i];
      const double v = std::sqrt(std::sqrt(loads[i].powered));
      const double linear_from = s.greatest_force / s.stiffness;
      const bool capped = v > linear_from;
      const double force = capped ? s.greatest_force : s.stiffness * v;
      energy += capped ? s.greatest_force * (v - linear_from / 2) : force * v / 2;
      loads[i].per_u3 = force / (v * v * v);
    }
    return energy;
  }

  /// Returns the smooth distance of a structure that pushes [m] at p_S, with its gradient; nothing beyond its margin.
  [[nodiscard]] std::optional<double> smooth_distance(int structure, const Vec3d& p_S, Vec3d& gradient) const noexcept {
    return smooth_[static_cast<std::size_t>(structure)].at(p_S, gradient);
  }

 private:
  struct Sample {
    double z, radius, weight;
  };

  [[nodiscard]] static double required_reach(double radius, double widest_margin, double smoothing) noexcept {
    return widest_margin + radius + 2.6 * smoothing;  // a knot of a spline is up to 1.5 √3 spacings away
  }
  [[nodiscard]] double largest_radius() const noexcept { return std::max(burr_.tip_radius, shaft_radius_); }

  /// Returns how far the centre of a ball at `distance` can move before it may touch a margin [m]; <= 0 if it may touch
  /// one.
  [[nodiscard]] double clear_length(double distance, double radius) const noexcept {
    return distance - radius - widest_margin_ - kSplineReach * H_ - field_->slack();
  }

  void add(const Vec3d& p_S, const Sample& s, std::span<Push> out, std::size_t& count) const noexcept {
    const SmoothDistance::Place place(p_S, H_);
    for (const std::uint8_t i : near_.at(place)) {
      Push push{i, s.z, 0, s.weight, Vec3d::Zero()};
      const std::optional<double> d = smooth_[i].at(place, push.gradient);
      if (!d) continue;
      push.depth = structures_[i].margin + s.radius - *d;
      if (push.depth > 0 && count < out.size()) out[count++] = push;
    }
  }

  void place_samples(const Burr& burr) {
    place_samples(burr.tip_radius, burr.shaft_length, [&](double, double) { return burr.shaft_radius; });
  }
  void place_samples(const RevolvedTool& tool) {
    // Up to there the tip's ball holds the tool.
    double from = 0, not_to = tool.outline().z_high();
    const double most = burr_.tip_radius * (1 + kRounding);
    for (int i = 0; i < kBisections; ++i) {
      const double z = (from + not_to) / 2;
      (tool.outline().largest_distance(0, z, 0) <= most ? from : not_to) = z;
    }
    place_samples(from, tool.outline().z_high(), [&](double z, double half_step) {
      return tool.outline().largest_distance(z - half_step, z + half_step, z);
    });
  }
  /// Places balls of the radius `radius_of(z, half a step)` between two heights.
  template <class Radius>
  void place_samples(double from, double to, Radius radius_of) {
    const double length = to - from;
    if (!burr_.has_shaft() || !(length > 0)) return;
    const int count = std::clamp(static_cast<int>(std::ceil(length / H_)), 1, kMaxSamples);
    sample_step_ = length / count;
    for (int n = 0; n < count; ++n) {
      const double z = from + (n + 0.5) * sample_step_;
      samples_.push_back({z, radius_of(z, sample_step_ / 2), 1.0 / count});
      shaft_radius_ = std::max(shaft_radius_, samples_.back().radius);
    }
  }
  /// A ball far from T turns with its lever.
  void weigh_samples(const StiffnessBudget& budget) {
    double stiffest = 0;
    for (const GuardedStructure& s : structures_) stiffest = std::max(stiffest, s.stiffness);
    for (Sample& s : samples_) {
      const double rocking = kPinch * stiffest * s.z * s.z;
      s.weight *= std::pow(std::min(1.0, budget.angular / rocking), kNorm / 2.0);
    }
  }

  /// Second derivative of the pushes' energy of one ball at p_S, without the shaft's other balls [N/m]:
  /// Σ k g gᵀ − F ∇²d. The second term is a tool's that lies between two parts, where the push turns over.
  [[nodiscard]] Mat3d stiffness_at(const Vec3d& p_S, double radius) const noexcept {
    Mat3d K = Mat3d::Zero();
    for (std::size_t i = 0; i < smooth_.size(); ++i) {
      if (smooth_[i].empty()) continue;
      const GuardedStructure& s = structures_[i];
      Vec3d g;
      const std::optional<double> d = smooth_[i].at(p_S, g);
      if (!d) continue;
      const double u = s.margin + radius - *d;
      if (!(u > 0)) continue;
      const double force = std::min(s.stiffness * u, s.greatest_force);
      if (force < s.greatest_force) K += std::sqrt(2.0) * s.stiffness * g * g.transpose();
      K -= force * smooth_[i].curvature(p_S, g);
    }
    return K;
  }

  /// Finds the largest stiffness of a ball, at the knots and midway between four of them.
  void find_stiffness() {
    stiffness_ = 0;
    const double tip = burr_.tip_radius, shaft = samples_.empty() ? tip : shaft_radius_;
    for (SmoothDistance& smooth : smooth_) {
      for (const Vec3d& knot : smooth.knots())
        for (const double shift : {0.0, 0.5 * H_})
          for (const double radius : {tip, shaft}) {
            const Mat3d K = stiffness_at(knot + Vec3d::Constant(shift), radius);
            if (K.trace() <= 0 && stiffness_ > 0) continue;
            const Eigen::SelfAdjointEigenSolver<Mat3d> solver(K, Eigen::EigenvaluesOnly);
            stiffness_ = std::max(stiffness_, solver.eigenvalues().maxCoeff());
          }
      smooth.release_knots();
    }
    if (!burr_.has_shaft()) return;
    for (const GuardedStructure& s : structures_)
      if (s.mode == GuardMode::kPush) stiffness_ = std::max(stiffness_, kPinch * s.stiffness);
  }

  void keep_to(const StiffnessBudget& budget) {
    const double factor = std::min(1.0, budget.linear / std::max(stiffness_, 1e-300));
    for (GuardedStructure& s : structures_) {
      s.stiffness *= factor;
      s.greatest_force *= factor;
      s.damping *= factor;
    }
    stiffness_ *= factor;
  }

  // A smooth distance is a mean of distances. Its points lie √3/2 knot spacings away, in root mean square.
  static constexpr double kSplineReach = 0.8661;
  static constexpr double kRounding = 1e-9;
  static constexpr int kBisections = 50;

  std::shared_ptr<const StructureField> field_;
  Posed X_GS_;
  Burr burr_;
  double H_;
  std::vector<GuardedStructure> structures_;
  std::vector<SmoothDistance> smooth_;  // of each structure
  NearSplines near_;
  std::vector<Sample> samples_;
  double shaft_radius_ = 0;  // largest of the samples [m]
  double sample_step_ = 1;
  double widest_margin_ = 0;
  double stiffness_ = 0;
};

}  // namespace trephine
