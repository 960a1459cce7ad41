// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/renderer.hpp>
#include <trephine/render/surface/patch_quadrature.hpp>
#include <trephine/render/surface/ray_exits.hpp>
#include <trephine/render/surface/shared_groups.hpp>
#include <trephine/render/surface/surface_misuse.hpp>
#include <trephine/render/surface/surface_options.hpp>
#include <trephine/voxel/clearance_field.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
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
/// vertex in bone what `RayExits` says; a group whose centre is in bone costs what `Deep` costs instead. With
/// `PatchWeights` one gradient more for each vertex in bone and for those next to them, and for each group without one
/// a gradient and a sample, and if bone is within its patch's reach those of its neighbours.
template <RealScalar S, Weighting Weights, DeepContact Deep, ShaftForce Shaft, GradientPolicy GradientChoice>
class SurfaceApproxRenderer<S, Weights, Deep, Shaft, GradientChoice> {
 public:
  using Scalar = S;
  using Gradient = GradientChoice;
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  /// Throws std::invalid_argument for options outside their range.
  explicit SurfaceApproxRenderer(Tool tool, const SurfaceOptions& options = {})
      : tool_(std::move(tool)),
        options_(options),
        values_(static_cast<std::size_t>(tool_.padded())),
        exits_(tool_.periphery()),
        hits_(static_cast<std::size_t>(tool_.periphery())),
        way_(static_cast<std::size_t>(tool_.periphery())),
        patches_(tool_),
        hit_(tool_.groups().size()),
        deep_(tool_.groups().size()),
        reports_(tool_.groups().size()) {
    options.validate();
    contacts_.resize(static_cast<std::size_t>(tool_.periphery()) + tool_.groups().size());
    k_per_stiffness_ = burr().tip_radius / 2 / mean_plane_force<Weights>(tool_, 0, 0.5);
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
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      edge_forces_.push_back(representable(k_ * mean_plane_force<Weights>(tool_, g, 1.0)));
      reaches_.push_back(Scalar(1.0001) * (tool_.groups()[g].radius + patch_reach(g)));
    }
    clear_reports();
    if (options.budget) shared_.emplace(*options.budget, tool_, k_, edge_forces_, Shaft::kForce);
  }

  template <ContactField Field>
  Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT) noexcept {
    Rendered<Scalar> out;
    out.status = begin(X_GT);
    if (!look(field) || !find_exits(field)) {
      if (!idle_) go_idle();
      return out;
    }
    idle_ = false;
    for (std::size_t g = 0; g < tool_.groups().size(); ++g)
      if (!stays_quiet(g)) out.status = worse(out.status, touch(field, g, reports_[g], out.contact));
    if (shared_) shared_->share(tool_, way_, reports_, {contacts_.data(), contact_count_});
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      SliceReport<Scalar>& r = reports_[g];
      if (g == 0) {
        out.wrench.force += r.force;
        out.contact.tip = r.contacts > 0 || r.deep;
        continue;
      }
      if (r.contacts == 0 && !r.deep) continue;
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
    clear_reports();
    contact_count_ = 0;
    has_previous_ = false;
    idle_ = false;
  }

  /// A scene whose answers are forces alone asks for this before its first tick: a shaft that gives none has no
  /// vertices then and is not looked at. (With a budget it stays: the shaft's energy is part of what the ball gets.)
  void disable_torque() requires(!Shaft::kForce) {
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
  /// Tangent stiffness [N/m] of the tip that presses on a plane with `force` [N], within the budget; 0: at δ = R/2.
  [[nodiscard]] double tangent_stiffness(double force) const {
    const double k = plane_tangent<Weights>(tool_, k_, force);
    return options_.budget ? std::min(k, options_.budget->linear) : k;
  }
  /// Surface has no proxy: all three are the device's pose.
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept { return X_GT_; }
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept { return X_GT_; }
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept { return X_GT_; }

 private:
  struct NoPatches {
    explicit NoPatches(const Tool&) noexcept {}
  };

  [[nodiscard]] const Burr& burr() const noexcept { return tool_.burr(); }

  // A pose out of a hand's reach within a tick starts deep contact anew and asks for a ramp.
  [[nodiscard]] Status begin(const Pose<Scalar>& X_GT) noexcept {
    const bool jumped =
        has_previous_ && !((X_GT.translation() - X_GT_.translation()).norm() <= static_cast<Scalar>(options_.jump));
    if (jumped) reset();
    knows_before_ = has_previous_;
    X_before_ = X_GT_;
    X_GT_ = X_GT;
    has_previous_ = true;
    contact_count_ = 0;
    return jumped ? Status::kJump : Status::kOk;
  }

  // Samples the vertices that may touch; whether any does. With patches a vertex outside may stand for some inside.
  template <ContactField Field>
  [[nodiscard]] bool look(const Field& field) noexcept {
    const Vec3<Scalar> middle = X_GT_ * Vec3<Scalar>(Scalar(0), Scalar(0), middle_);
    if constexpr (BoundedField<Field>)
      if (field.is_beyond(middle, around_middle_)) return false;
    if constexpr (!ClearanceField<Field>) {
      sample(field, 0, tool_.padded());
    } else {
      // Groups stand in a row: from the first that is near to the last. What one's air reaches beyond it, it clears
      // too, most from the handle's end, where bone is farthest.
      const auto& groups = tool_.groups();
      std::size_t first = 0;
      std::size_t last = groups.size();
      const auto clears = [&](Scalar air, Scalar from, std::size_t g) {
        return air > std::abs(groups[g].height - from) + reaches_[g];
      };
      while (last > first) {
        const Scalar from = groups[last - 1].height;
        const Scalar air = field.clearance_at(Vec3<Scalar>(X_GT_ * Vec3<Scalar>(Scalar(0), Scalar(0), from)));
        if (!clears(air, from, last - 1)) break;
        while (last > first && clears(air, from, last - 1)) --last;
      }
      while (first < last) {
        const Scalar from = groups[first].height;
        const Scalar air = field.clearance_at(Vec3<Scalar>(X_GT_ * Vec3<Scalar>(Scalar(0), Scalar(0), from)));
        if (!clears(air, from, first)) break;
        while (first < last && clears(air, from, first)) ++first;
      }
      if (first == last) return false;
      if constexpr (kUsesPatches<Weights>) {  // patches in bone ask their neighbours
        first = first > 0 ? first - 1 : 0;
        last = std::min(last + 1, groups.size());
      }
      std::fill(values_.begin(), values_.end(), std::numeric_limits<Scalar>::lowest());
      sample(field, groups[first].first, groups[last - 1].first + groups[last - 1].count);
      sample(field, groups[first].centre, groups[last - 1].centre + 1);
    }
    // A plain count, which compilers vectorise. Bone beside vertices shows in air that is not flat.
    const std::size_t whole_lanes = values_.size() / kLane * kLane;
    const Scalar one = values_[0];
    int telling = 0;
    for (std::size_t i = 0; i < whole_lanes; ++i)
      telling += (kUsesPatches<Weights> ? values_[i] != one : values_[i] >= Scalar(0)) ? 1 : 0;
    return telling > 0 || one >= Scalar(0);
  }

  // Farthest that a patch of group g reaches from its vertex [m].
  [[nodiscard]] Scalar patch_reach(std::size_t g) const noexcept {
    Scalar most = Scalar(0);
    const auto& group = tool_.groups()[g];
    if constexpr (kUsesPatches<Weights>)
      for (int i = group.first; i < group.first + group.count; ++i) most = std::max(most, tool_.patch(i).reach());
    return most;
  }

  // Vertices first … last − 1, and others where a lane has room for them.
  template <ContactField Field>
  void sample(const Field& field, int first, int last) noexcept {
    const auto& p = tool_.points();
    const int count = padded_to_lane(last - first);
    const int from = std::min(first, tool_.padded() - count);
    field.values(X_GT_, p.x.data() + from, p.y.data() + from, p.z.data() + from, values_.data() + from, count);
  }

  // Nothing touches: what groups found is cleared once.
  void go_idle() noexcept {
    idle_ = true;
    clear_reports();
  }

  void clear_reports() noexcept {
    for (std::size_t g = 0; g < reports_.size(); ++g) reports_[g] = {.lever_m = tool_.groups()[g].height};
  }

  // Of most groups there is nothing to tell, nor was there in the tick before.
  [[nodiscard]] bool stays_quiet(std::size_t g) const noexcept {
    return hit_[g] == 0 && reports_[g].contacts == 0 && !reports_[g].deep && !is_deep(g);
  }

  // One group. Where the centre of a group that touched nothing stood is told to it once it is in bone, not every tick.
  template <ContactField Field>
  Status touch(const Field& field, std::size_t g, SliceReport<Scalar>& r, ContactSummary& summary) noexcept {
    const auto& group = tool_.groups()[g];
    const bool touched = r.contacts > 0 || r.deep;  // in the tick before
    r = {.deep = is_deep(g), .lever_m = group.height};
    if (!r.deep && hit_[g] == 0) return Status::kOk;
    const Vec3<Scalar> c = X_GT_ * tool_.points()[group.centre];
    if (r.deep) {
      if (!touched && knows_before_) deep_[g].outside(X_before_ * tool_.points()[group.centre], Vec3<Scalar>::Zero());
      const Status status = deep_[g].inside(field, c, group.radius, edge_forces_[g], r.force);
      summary.depth = std::max(summary.depth, static_cast<double>(group.radius));
      contacts_[contact_count_++] = {c, safe_direction(r.force), r.force};
      return status;
    }
    WeightedSum<Weights, Scalar> sum;
    Vec3<Scalar> along = Vec3<Scalar>::Zero();  // Σ of the sum's terms times how far along the shaft each acts
    const std::size_t first_contact = contact_count_;
    for (int i = group.first; i < group.first + group.count; ++i) {
      const Scalar a = way_[static_cast<std::size_t>(i)];
      if (!(a > Scalar(0))) continue;
      const Vec3<Scalar> d = X_GT_.linear() * toward(i);
      const Scalar area = tool_.areas()[static_cast<std::size_t>(i)];
      sum.add(d, a, area, group.radius);
      summary.depth = std::max(summary.depth, static_cast<double>(a));
      // The vertex' share of the sum, to be scaled once the divisor is known.
      const Vec3<Scalar> share = (Weights::weight(area, a, group.radius) * a) * d;
      Vec3<Scalar> at = c - (group.radius - a) * d;
      if constexpr (kUsesPatches<Weights>) {
        const PatchPull<Scalar>& pull = patches_.pull(i);
        at += (std::min(pull.contact, group.radius) - a) * d + pull.along * X_GT_.linear().col(2);
        along += pull.along * share;
      }
      contacts_[contact_count_++] = {at, d, share};
      ++r.contacts;
    }
    const Vec3<Scalar> total = sum.result(group.count);
    r.force = static_cast<Scalar>(k_) * total;  // Eq. 17
    if constexpr (kUsesPatches<Weights>) {
      const Vec3<Scalar> direction = safe_direction(r.force);
      if (const Scalar whole = direction.dot(total); whole > Scalar(0)) r.lever_m += direction.dot(along) / whole;
    }
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

  // a_i of Eq. 15 for every vertex of the groups whose centre is outside: from the vertex, which is in bone, toward the
  // centre, which is not, to the first surface. Zero for vertices that do not touch. False: nothing does.
  template <ContactField Field>
  [[nodiscard]] bool find_exits(const Field& field) noexcept {
    std::fill(way_.begin(), way_.end(), Scalar(0));
    exits_.clear();
    bool deep = false;
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      hit_[g] = 0;
      deep = deep || is_deep(g);
    }
    for (int first = 0; first < tool_.periphery(); first += kBatch) add_exits(first);
    exits_.search(field, X_GT_, static_cast<Scalar>(options_.search_step) * field.voxel());
    for (int j = 0; j < exits_.count(); ++j)
      way_[static_cast<std::size_t>(hits_[static_cast<std::size_t>(j)])] = exits_[j];
    if constexpr (kUsesPatches<Weights>) {
      const std::span<const int> hits(hits_.data(), static_cast<std::size_t>(exits_.count()));
      patches_.spread(field, tool_, X_GT_, values_, hits, way_, hit_);
    }
    return deep || std::find(hit_.begin(), hit_.end(), std::uint8_t{1}) != hit_.end();
  }

  // Those of a batch of vertices that touch, in groups whose centre is outside. Most do not: eight at a time are told.
  void add_exits(int first) noexcept {
    const auto from = static_cast<std::size_t>(first);
    const std::size_t m = std::min(values_.size() - from, std::size_t{kBatch}) / kLane * kLane;
    std::array<std::uint8_t, kBatch> in_bone;
    for (std::size_t i = 0; i < m; ++i) in_bone[i] = values_[from + i] >= Scalar(0) ? 1 : 0;
    for (std::size_t eight = 0; eight < m; eight += 8) {
      std::uint64_t any;
      std::memcpy(&any, in_bone.data() + eight, sizeof(any));
      if (any == 0) continue;
      for (std::size_t k = eight; k < eight + 8; ++k) {
        const int i = first + static_cast<int>(k);
        if (in_bone[k] == 0 || i >= tool_.periphery()) continue;
        const std::size_t g = tool_.group_of(i);
        if (is_deep(g)) continue;
        hits_[static_cast<std::size_t>(exits_.count())] = i;
        exits_.add(tool_.points()[i], tool_.inward()[i], tool_.groups()[g].radius, values_[from + k]);
        hit_[g] = 1;
      }
    }
  }

  [[nodiscard]] bool is_deep(std::size_t g) const noexcept {
    return values_[static_cast<std::size_t>(tool_.groups()[g].centre)] >= Scalar(0);
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
  std::vector<Scalar> reaches_;  // of each group, from its centre: bone farther off does not touch it [m]
  std::optional<SharedGroups<Weights, Scalar>> shared_;
  std::vector<Scalar> values_;
  RayExits<Scalar> exits_;
  std::vector<int> hits_;    // vertex of each way out
  std::vector<Scalar> way_;  // of each vertex of the periphery
  [[no_unique_address]] std::conditional_t<kUsesPatches<Weights>, PatchQuadrature<Scalar>, NoPatches> patches_;
  std::vector<std::uint8_t> hit_;  // of each group: whether any of its vertices is in bone
  std::vector<typename Deep::template State<Scalar>> deep_;
  std::vector<SliceReport<Scalar>> reports_;
  std::vector<ContactPoint<Scalar>> contacts_;
  std::size_t contact_count_ = 0;
  bool idle_ = false;  // nothing touched in the tick before
  // A ball round all vertices, its centre on the shaft's axis.
  Scalar middle_ = Scalar(0);
  Scalar around_middle_ = Scalar(0);
  bool has_previous_ = false;
  Pose<Scalar> X_GT_ = Pose<Scalar>::Identity();
  // Of the tick before, if there was one that led here.
  bool knows_before_ = false;
  Pose<Scalar> X_before_ = Pose<Scalar>::Identity();
};

template <class S>
SurfaceApproxRenderer(ToolDiscretization<SurfaceCounts, S>) -> SurfaceApproxRenderer<S>;
template <class S>
SurfaceApproxRenderer(ToolDiscretization<SurfaceCounts, S>, SurfaceOptions) -> SurfaceApproxRenderer<S>;
template <class... Arguments>
SurfaceApproxRenderer(const Arguments&...) -> SurfaceApproxRenderer<detail::Misused<Arguments...>>;

}  // namespace trephine
