// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/ways_out.hpp>
#include <trephine/render/deep_contact.hpp>
#include <trephine/render/patch_ways.hpp>
#include <trephine/render/renderer.hpp>
#include <trephine/render/shaft_force.hpp>
#include <trephine/render/surface_options.hpp>
#include <trephine/render/weighting.hpp>
#include <trephine/voxel/density_field.hpp>
#include <trephine/voxel/known_air.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

namespace trephine {

/// The Surface approximation: thesis 3.2. Each vertex of the ball and of the shaft's slices that is in bone pulls
/// toward its group's centre with a spring as long as its way out of bone along that direction (Eq. 15–17); a group
/// whose centre is in bone gives what `Deep` says (Eq. 18, 19); slices give torque about the ball's centre (Eq. 20,
/// 21). Vertices are at the device's pose: there is no proxy, no friction, and the tool sinks in as far as its springs
/// let it.
///
/// Work a tick: `padded` samples where a vertex may touch, none where the field says that all is clear, and for each
/// vertex in bone what `WaysOut` says; a group whose centre is in bone costs what `Deep` costs instead. With
/// `PatchWeights` one gradient more for each vertex in bone and for those next to them.
template <RealScalar S, Weighting Weights = AreaWeights, DeepContact Deep = ExtendAlongSurface,
          ShaftForce Shaft = FullWrench, GradientPolicy GradientChoice = AnalyticGradient>
class SurfaceApproxRenderer {
 public:
  using Scalar = S;
  using Gradient = GradientChoice;
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  /// Throws std::invalid_argument for options outside their range.
  explicit SurfaceApproxRenderer(Tool tool, const SurfaceOptions& options = {})
      : tool_(std::move(tool)),
        options_(options),
        values_(static_cast<std::size_t>(tool_.padded())),
        ways_out_(tool_.periphery()),
        hits_(static_cast<std::size_t>(tool_.periphery())),
        way_(static_cast<std::size_t>(tool_.periphery())),
        patches_(tool_),
        hit_(tool_.groups().size()),
        deep_(tool_.groups().size()),
        reports_(tool_.groups().size()) {
    options.validate();
    contacts_.resize(static_cast<std::size_t>(tool_.periphery()) + tool_.groups().size());
    k_per_stiffness_ = burr().tip_radius / 2 / mean_plane_force(0, 0.5);
    k_ = options.thesis_stiffness.value_or(options.stiffness * k_per_stiffness_);
    // A law that overflows with nothing touching would answer nothing else than that it did.
    const auto representable = [&](double v) {
      if (v <= static_cast<double>(std::numeric_limits<Scalar>::max())) return static_cast<Scalar>(v);
      refuse("SurfaceApproxRenderer", "stiffness must be finite in the renderer's precision", options.stiffness);
    };
    static_cast<void>(representable(k_));
    const auto& last = tool_.groups().back();
    middle_ = (last.height - static_cast<Scalar>(burr().tip_radius)) / Scalar(2);
    for (int i = 0; i < tool_.count(); ++i)
      around_middle_ =
          std::max(around_middle_, (tool_.points()[i] - Vec3<Scalar>(Scalar(0), Scalar(0), middle_)).norm());
    around_middle_ *= Scalar(1.0001);
    for (std::size_t g = 0; g < tool_.groups().size(); ++g)
      edge_forces_.push_back(representable(k_ * mean_plane_force(g, 1.0)));
    if (options.budget) plan_sharing(*options.budget);
  }

  template <ContactField Field>
  Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT) noexcept {
    Rendered<Scalar> out;
    out.status = begin(X_GT);
    if (!look(field) || !find_ways_out(field)) {
      if (!idle_) go_idle();
      X_idle_ = X_GT;
      return out;
    }
    if (idle_) catch_up();
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      SliceReport<Scalar>& r = reports_[g];
      r = {};
      out.status = worse(out.status, touch(field, g, r, out.contact));
    }
    if (shared_) share_stiffness();
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      SliceReport<Scalar>& r = reports_[g];
      if (g == 0) {
        out.wrench.force += r.force;
        out.contact.tip = r.contacts > 0 || r.deep;
        continue;
      }
      r.lever_m = tool_.groups()[g].height;
      if (r.contacts == 0 && !r.deep) continue;
      r.lever_m += r.deep ? Scalar(0) : along(g, r.force);
      r.torque = (r.lever_m * X_GT.linear().col(2)).cross(r.force);  // Eq. 20
      out.wrench.torque += r.torque;                                 // Eq. 21
      if constexpr (Shaft::kForce) out.wrench.force += r.force;
      out.contact.shaft = out.contact.shaft || r.contacts > 0 || r.deep;
    }
    out.contact.count = static_cast<int>(contact_count_);
    return out;
  }

  void reset() noexcept {
    for (auto& d : deep_) d.reset();
    for (auto& r : reports_) r = {};
    contact_count_ = 0;
    has_previous_ = false;
    idle_ = false;
  }

  /// A scene whose answers are forces alone asks for this before its first tick: a shaft that gives none has no
  /// vertices then and is not looked at. (With a budget it stays: the shaft's energy is part of what the ball gets.)
  void forces_alone() requires(!Shaft::kForce) {
    if (!options_.budget) *this = SurfaceApproxRenderer(tool_.without_shaft(), options_);
  }

  /// All groups: the ball first, then the slices from the tip up.
  [[nodiscard]] std::span<const SliceReport<Scalar>> groups() const noexcept { return reports_; }
  /// The slices alone.
  [[nodiscard]] std::span<const SliceReport<Scalar>> slices() const noexcept {
    return std::span<const SliceReport<Scalar>>(reports_).subspan(1);
  }
  /// The literal k of Eq. 15 in use, whichever way it was given.
  [[nodiscard]] double thesis_stiffness() const noexcept { return k_; }
  [[nodiscard]] const SurfaceOptions& options() const noexcept { return options_; }
  [[nodiscard]] const Tool& tool() const noexcept { return tool_; }
  [[nodiscard]] const Burr& shape() const noexcept { return tool_.burr(); }
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept {
    return {contacts_.data(), contact_count_};
  }
  /// Secant stiffness [N/m] of the tip at δ = R/2, however it was given.
  [[nodiscard]] double stiffness() const noexcept { return k_ / k_per_stiffness_; }
  /// Surface has no proxy: all three are the device's pose.
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept { return X_GT_; }
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept { return X_GT_; }
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept { return X_GT_; }

 private:
  struct NoPatches {
    explicit NoPatches(const Tool&) noexcept {}
  };

  [[nodiscard]] const Burr& burr() const noexcept { return tool_.burr(); }

  // Force per k of group g pressed `depth` radii into a plane, averaged over the plane's directions (for a slice those
  // square to the shaft): a stated stiffness must hold for a tool however it is turned.
  [[nodiscard]] double mean_plane_force(std::size_t g, double depth) const {
    const auto& group = tool_.groups()[g];
    const double radius = static_cast<double>(group.radius);
    constexpr int kDirections = 720;
    const SphereLayout around = spread_over_sphere(kDirections);
    double sum = 0;
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2 * std::numbers::pi * i / kDirections;
      const Vec3d n =
          g == 0 ? around.directions[static_cast<std::size_t>(i)] : Vec3d(std::cos(angle), std::sin(angle), 0);
      sum += plane_law<Weights>(tool_, g, depth * radius, n).dot(n);
    }
    return sum / kDirections;
  }

  // Largest tangent stiffness of each group: pressed into a plane as far as its centre, or with all its vertices in
  // bone.
  void plan_sharing(const StiffnessBudget& budget) {
    constexpr int kDepths = 10;
    std::vector<SpringGroup> springs;
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      const auto& group = tool_.groups()[g];
      const double radius = static_cast<double>(group.radius);
      const bool same =
          g > 1 && group.count == tool_.groups()[g - 1].count && group.radius == tool_.groups()[g - 1].radius;
      double steepest = same ? springs.back().stiffness : 0, work = 0, below = 0;
      for (int i = 1; i <= kDepths && !same; ++i) {
        const double force = k_ * mean_plane_force(g, static_cast<double>(i) / kDepths);
        steepest = std::max(steepest, (force - below) * kDepths / radius);
        work += 0.5 * (force + below) * radius / kDepths;
        below = force;
      }
      edge_energies_.push_back(same ? edge_energies_.back() : static_cast<Scalar>(work));
      springs.push_back({steepest, static_cast<double>(group.height), g == 0 || Shaft::kForce});
    }
    if (!fits(budget, springs)) shared_.emplace(budget, springs);
  }

  // Scales what the groups give so that they stay within the budget together.
  void share_stiffness() noexcept {
    std::size_t contact = 0;
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      const SliceReport<Scalar>& r = reports_[g];
      const auto& group = tool_.groups()[g];
      Scalar energy = Scalar(0);
      if (r.deep) {
        ++contact;
        const Scalar beyond = std::max(Scalar(0), r.force.norm() - edge_forces_[g]);  // of F = edge (1 + depth / R)
        const Scalar depth = edge_forces_[g] > Scalar(0) ? group.radius * beyond / edge_forces_[g] : Scalar(0);
        energy = edge_energies_[g] + (edge_forces_[g] + Scalar(0.5) * beyond) * depth;
      } else if (r.contacts > 0) {
        for (int i = group.first; i < group.first + group.count; ++i)
          if (const Scalar a = way_[static_cast<std::size_t>(i)]; a > Scalar(0))
            energy += Scalar(0.5) * contacts_[contact++].force.norm() * a;
      }
      shared_->set_energy(g, energy);
    }
    shared_->share();
    contact = 0;
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      SliceReport<Scalar>& r = reports_[g];
      const Scalar factor = shared_->factor(g);
      r.force *= factor;
      for (int i = r.deep ? 1 : r.contacts; i > 0; --i) contacts_[contact++].force *= factor;
    }
  }

  // A pose out of a hand's reach within a tick starts deep contact anew and asks for a ramp.
  [[nodiscard]] Status begin(const Pose<Scalar>& X_GT) noexcept {
    const bool jumped =
        has_previous_ && !((X_GT.translation() - X_GT_.translation()).norm() <= static_cast<Scalar>(options_.jump));
    if (jumped) reset();
    X_GT_ = X_GT;
    has_previous_ = true;
    contact_count_ = 0;
    return jumped ? Status::kJump : Status::kOk;
  }

  // Samples the vertices that may touch; whether any does. With patches a vertex outside may stand for some inside.
  template <ContactField Field>
  [[nodiscard]] bool look(const Field& field) noexcept {
    const Vec3<Scalar> middle = X_GT_ * Vec3<Scalar>(Scalar(0), Scalar(0), middle_);
    if constexpr (KnowsBeyond<Field>)
      if (!kUsesPatches<Weights> && field.is_beyond(middle, around_middle_)) return false;
    if constexpr (kUsesPatches<Weights> || !KnowsAir<Field>) {
      sample(field, 0, tool_.padded());
    } else {
      // Groups stand in a row: from the first that is near to the last. What one's air reaches beyond it, it clears
      // too.
      const auto& groups = tool_.groups();
      std::size_t first = 0;
      std::size_t last = groups.size();
      const auto clears = [&](Scalar air, Scalar from, const typename Tool::Group& g) {
        return air > std::abs(g.height - from) + g.radius * Scalar(1.0001);
      };
      while (first < last) {
        const Scalar from = groups[first].height;
        const Scalar air = field.air_around(Vec3<Scalar>(X_GT_ * Vec3<Scalar>(Scalar(0), Scalar(0), from)));
        if (!clears(air, from, groups[first])) break;
        while (first < last && clears(air, from, groups[first])) ++first;
      }
      while (last > first) {
        const Scalar from = groups[last - 1].height;
        const Scalar air = field.air_around(Vec3<Scalar>(X_GT_ * Vec3<Scalar>(Scalar(0), Scalar(0), from)));
        if (!clears(air, from, groups[last - 1])) break;
        while (last > first && clears(air, from, groups[last - 1])) --last;
      }
      if (first == last) return false;
      std::fill(values_.begin(), values_.end(), std::numeric_limits<Scalar>::lowest());
      sample(field, groups[first].first, groups[last - 1].first + groups[last - 1].count);
      sample(field, groups[first].centre, groups[last - 1].centre + 1);
    }
    if constexpr (kUsesPatches<Weights>) return true;
    std::array<Scalar, kLane> most;
    most.fill(std::numeric_limits<Scalar>::lowest());
    for (std::size_t i = 0; i < values_.size(); i += kLane)
      for (std::size_t l = 0; l < kLane; ++l) most[l] = values_[i + l] > most[l] ? values_[i + l] : most[l];
    return *std::max_element(most.begin(), most.end()) >= Scalar(0);
  }

  // Vertices first … last − 1, and others where a lane has room for them.
  template <ContactField Field>
  void sample(const Field& field, int first, int last) noexcept {
    const auto& p = tool_.points();
    const int count = padded_to_lane(last - first);
    const int from = std::min(first, tool_.padded() - count);
    field.values(X_GT_, p.x.data() + from, p.y.data() + from, p.z.data() + from, values_.data() + from, count);
  }

  // Nothing touches: what groups found is cleared once, and where their centres stand is told them when they need it.
  void go_idle() noexcept {
    idle_ = true;
    for (std::size_t g = 0; g < reports_.size(); ++g) {
      reports_[g] = {};
      if (g > 0) reports_[g].lever_m = tool_.groups()[g].height;
    }
  }
  void catch_up() noexcept {
    idle_ = false;
    for (std::size_t g = 0; g < deep_.size(); ++g)
      deep_[g].outside(X_idle_ * tool_.points()[tool_.groups()[g].centre], Vec3<Scalar>::Zero());
  }

  template <ContactField Field>
  Status touch(const Field& field, std::size_t g, SliceReport<Scalar>& r, ContactSummary& summary) noexcept {
    const auto& group = tool_.groups()[g];
    const Vec3<Scalar> c = X_GT_ * tool_.points()[group.centre];
    r.deep = values_[static_cast<std::size_t>(group.centre)] >= Scalar(0);
    if (r.deep) {
      const Status status = deep_[g].inside(field, c, group.radius, edge_forces_[g], r.force);
      summary.depth = std::max(summary.depth, static_cast<double>(group.radius));
      contacts_[contact_count_++] = {c, safe_direction(r.force), r.force};
      return status;
    }
    if (hit_[g] == 0) {
      deep_[g].outside(c, Vec3<Scalar>::Zero());
      return Status::kOk;
    }
    WeightedSum<Weights, Scalar> sum;
    const std::size_t first_contact = contact_count_;
    for (int i = group.first; i < group.first + group.count; ++i) {
      const Scalar a = way_[static_cast<std::size_t>(i)];
      if (!(a > Scalar(0))) continue;
      const Vec3<Scalar> d = X_GT_.linear() * toward(i);
      const Scalar area = tool_.areas()[static_cast<std::size_t>(i)];
      sum.add(d, a, area, group.radius);
      summary.depth = std::max(summary.depth, static_cast<double>(a));
      // The vertex' share of the sum, to be scaled once the divisor is known.
      contacts_[contact_count_++] = {c - (group.radius - a) * d, d, (Weights::weight(area, a, group.radius) * a) * d};
      ++r.contacts;
    }
    r.force = static_cast<Scalar>(k_) * sum.result(group.count);  // Eq. 17
    scale_contacts(first_contact, r.force);
    deep_[g].outside(c, r.force);
    return Status::kOk;
  }

  // Where vertex i pulls to, a unit vector in T.
  [[nodiscard]] Vec3<Scalar> toward(int i) const noexcept {
    if constexpr (kUsesPatches<Weights>)
      return patches_.pull(i).toward;
    else
      return tool_.inward()[i];
  }

  // How far along the shaft from its slice's plane the force of group g acts: 0 but for patches.
  [[nodiscard]] Scalar along(std::size_t g, const Vec3<Scalar>& force) const noexcept {
    if constexpr (!kUsesPatches<Weights>) {
      return Scalar(0);
    } else {
      const auto& group = tool_.groups()[g];
      const Vec3<Scalar> direction = safe_direction(force);
      Scalar sum = Scalar(0), moment = Scalar(0);
      for (int i = group.first; i < group.first + group.count; ++i) {
        const Scalar a = way_[static_cast<std::size_t>(i)];
        if (!(a > Scalar(0))) continue;
        const PatchPull<Scalar>& pull = patches_.pull(i);
        const Scalar share =
            tool_.areas()[static_cast<std::size_t>(i)] * a * direction.dot(X_GT_.linear() * pull.toward);
        sum += share;
        moment += share * pull.along;
      }
      return sum > Scalar(0) ? moment / sum : Scalar(0);
    }
  }

  // a_i of Eq. 15 for every vertex of the groups whose centre is outside: from the vertex, which is in bone, toward the
  // centre, which is not, to the first surface. Zero for vertices that do not touch. False: nothing does.
  template <ContactField Field>
  [[nodiscard]] bool find_ways_out(const Field& field) noexcept {
    std::fill(way_.begin(), way_.end(), Scalar(0));
    ways_out_.clear();
    bool deep = false;
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      const auto& group = tool_.groups()[g];
      const int before = ways_out_.count();
      hit_[g] = 0;
      if (values_[static_cast<std::size_t>(group.centre)] >= Scalar(0)) {
        deep = true;
        continue;
      }
      for (int i = group.first; i < group.first + group.count; ++i) {
        const Scalar value = values_[static_cast<std::size_t>(i)];
        if (!(value >= Scalar(0))) continue;
        hits_[static_cast<std::size_t>(ways_out_.count())] = i;
        ways_out_.add(tool_.points()[i], tool_.inward()[i], group.radius, value);
      }
      hit_[g] = ways_out_.count() > before ? 1 : 0;
    }
    ways_out_.search(field, X_GT_, static_cast<Scalar>(options_.search_step) * field.voxel());
    for (int j = 0; j < ways_out_.count(); ++j)
      way_[static_cast<std::size_t>(hits_[static_cast<std::size_t>(j)])] = ways_out_[j];
    if constexpr (kUsesPatches<Weights>) {
      const std::span<const int> hits(hits_.data(), static_cast<std::size_t>(ways_out_.count()));
      patches_.spread(field, tool_, X_GT_, values_, hits, way_, hit_);
    }
    return deep || std::find(hit_.begin(), hit_.end(), std::uint8_t{1}) != hit_.end();
  }

  // Contact forces of a group are its springs' shares of the group's force.
  void scale_contacts(std::size_t first, const Vec3<Scalar>& force) noexcept {
    Vec3<Scalar> sum = Vec3<Scalar>::Zero();
    for (std::size_t i = first; i < contact_count_; ++i) sum += contacts_[i].force;
    const Scalar norm2 = sum.squaredNorm();
    const Scalar scale = norm2 > Scalar(0) ? force.dot(sum) / norm2 : Scalar(0);
    for (std::size_t i = first; i < contact_count_; ++i) contacts_[i].force *= scale;
  }

  [[nodiscard]] static Vec3<Scalar> safe_direction(const Vec3<Scalar>& v) noexcept {
    const Scalar n = v.norm();
    return n > Scalar(0) ? Vec3<Scalar>(v / n) : Vec3<Scalar>::Zero();
  }

  Tool tool_;
  SurfaceOptions options_;
  double k_ = 0;
  double k_per_stiffness_ = 1;
  std::vector<Scalar> edge_forces_;
  std::vector<Scalar> edge_energies_;  // of the same place; with a budget alone
  std::optional<SharedStiffness<Scalar>> shared_;
  std::vector<Scalar> values_;
  WaysOut<Scalar> ways_out_;
  std::vector<int> hits_;    // vertex of each way out
  std::vector<Scalar> way_;  // of each vertex of the periphery
  [[no_unique_address]] std::conditional_t<kUsesPatches<Weights>, PatchWays<Scalar>, NoPatches> patches_;
  std::vector<std::uint8_t> hit_;  // of each group: whether any of its vertices is in bone
  std::vector<typename Deep::template State<Scalar>> deep_;
  std::vector<SliceReport<Scalar>> reports_;
  std::vector<ContactPoint<Scalar>> contacts_;
  std::size_t contact_count_ = 0;
  // Since when nothing touches, and where the tool was last.
  bool idle_ = false;
  Pose<Scalar> X_idle_ = Pose<Scalar>::Identity();
  // A ball round all vertices, its centre on the shaft's axis.
  Scalar middle_ = Scalar(0);
  Scalar around_middle_ = Scalar(0);
  bool has_previous_ = false;
  Pose<Scalar> X_GT_ = Pose<Scalar>::Identity();
};

template <class S>
SurfaceApproxRenderer(ToolDiscretization<SurfaceCounts, S>) -> SurfaceApproxRenderer<S>;
template <class S>
SurfaceApproxRenderer(ToolDiscretization<SurfaceCounts, S>, SurfaceOptions) -> SurfaceApproxRenderer<S>;

}  // namespace trephine
