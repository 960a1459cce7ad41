// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/cutting_planes.hpp>
#include <trephine/contact/fading_places.hpp>
#include <trephine/contact/near_vertices.hpp>
#include <trephine/contact/patch_shares.hpp>
#include <trephine/contact/smooth_depth.hpp>
#include <trephine/core/tick.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace trephine {

/// A place where the tool is in bone. With φ its depth and X the tool's pose, its spring has the energy ½ k φ², and
/// pushes with k φ along `out` = −∇φ there: the energy's gradient, in translation and in rotation.
struct VertexContact {
  int vertex = 0;
  double depth = 0;                        ///< φ [m]; > 0 where it touches
  Vec3d out = Vec3d::Zero();               ///< −∇φ in G axes; of length 1 up to interpolation
  Vec3d lever = Vec3d::Zero();             ///< from T's origin to the place, in G axes [m]
  bool turns = true;                       ///< a turn of the tool moves it
  std::array<Rolling<double>, 2> rolls{};  ///< over an edge one, over round bone or in a hollow two
  double weight = 1;                       ///< its spring's share of k: a place that several patches find counts once

  /// −∂φ/∂(rotation about T's origin), in G axes [m].
  [[nodiscard]] Vec3d moment() const noexcept { return turns ? Vec3d(lever.cross(out)) : Vec3d(Vec3d::Zero()); }
};

/// A contact of a tool whose origin is at p_GT, with the force on the tool there, for logs and drawings.
template <RealScalar Scalar>
[[nodiscard]] ContactPoint<Scalar> contact_point(const VertexContact& c, const Vec3d& p_GT,
                                                 const Vec3d& force) noexcept {
  const double length = c.out.norm();
  const Vec3d normal = length > 0 ? Vec3d(c.out / length) : Vec3d(Vec3d::Zero());
  return {(p_GT + c.lever).template cast<Scalar>(), normal.template cast<Scalar>(), force.template cast<Scalar>()};
}

/// Where a vertex looks for bone: at itself, with the interpolant's own gradient, so that forces are exactly those of
/// an energy …
struct FixedVertices {
  static constexpr bool kGlide = false;
};
/// … or at the deepest place of the patch of tool that it stands for, found from the gradient at the vertex: a ball of
/// few vertices touches as a ball does and not as their polyhedron, and they stay where they are in G when it turns.
/// Depths and gradients are smoothed but in thin walls: with those of single cells places and normals would jump
/// between cells, and a search go to and fro. By the envelope theorem the force at a deepest place is the energy's
/// gradient there as well.
struct GlidingVertices {
  static constexpr bool kGlide = true;
};

/// What of a tool is in bone, a place per vertex at most, found by a sample or two a vertex without search or ray.
/// Vertices known to be far from bone are passed over. Allocates at construction alone.
template <RealScalar Scalar, class Vertices = GlidingVertices>
class VertexContacts {
 public:
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  explicit VertexContacts(const Tool& tool)
      : ball_(tool.groups()[0].count),
        ball_reach_(ball_patch(tool)),
        ring_reach_(ring_patch(tool)),
        ball_edge_(ball_reach_, static_cast<Scalar>(tool.burr().tip_radius)),
        ring_edge_(ring_reach_, static_cast<Scalar>(tool.burr().shaft_radius)),
        near_(tool, !Vertices::kGlide, ball_reach_ * static_cast<Scalar>(tool.burr().tip_radius),
              ring_reach_ * static_cast<Scalar>(tool.burr().shaft_radius)),
        shares_(static_cast<Scalar>(tool.burr().tip_radius), ball_reach_, tool.groups()[0].count),
        fading_(ball_),
        clearances_(tool.groups().size()),
        beside_(tool.groups().size()) {
    const auto padded = static_cast<std::size_t>(padded_to_lane(tool.periphery()));
    for (PointArrays<Scalar>* points : {&places_, &gradients_, &vertex_gradients_})
      for (auto* v : {&points->x, &points->y, &points->z}) v->resize(padded);
    values_.resize(padded);
    led_values_.resize(padded);
    rolls_.resize(padded);
    vertex_values_.resize(padded);
    place_vertices_.resize(padded);
    found_.resize(static_cast<std::size_t>(tool.periphery() + (Vertices::kGlide ? ball_ : 0)));
    if constexpr (Vertices::kGlide) {
      for (auto* v : {&old_places_.x, &old_places_.y, &old_places_.z, &old_values_}) v->resize(padded);
      others_.resize(padded);
      for (auto* v : {&before_, &now_}) v->places.resize(static_cast<std::size_t>(tool.periphery()));
    }
  }

  /// Contacts that there are at most.
  [[nodiscard]] std::size_t most() const noexcept { return found_.size(); }
  [[nodiscard]] std::span<const VertexContact> found() const noexcept { return {found_.data(), touching_}; }
  /// Those and, after them, the places up to half a voxel outside (`depth` < 0; gliding vertices alone): where a step
  /// may touch. Their `out` is the interpolant's own.
  [[nodiscard]] std::span<const VertexContact> near() const noexcept { return {found_.data(), found_count_}; }
  /// Adds a contact to a tick's summary.
  void tell(const VertexContact& c, ContactSummary& summary) const noexcept {
    ++summary.count;
    const bool tip = c.vertex < ball_;
    summary.tip = summary.tip || tip;
    summary.shaft = summary.shaft || !tip;
  }
  /// The share of a motion by `step` [m] and `turn` [rad] that takes no vertex that does not touch farther than `more`
  /// [m] beyond what is known to be free; at most 1. What is known of vertices that were passed over is made sure of
  /// before it shortens a motion.
  template <PenetrationField Field>
  [[nodiscard]] double free_share(const Field& field, const Tool& tool, double step, double turn,
                                  double more) noexcept {
    return group_share(field, tool, step, turn, more, clearances_);
  }
  /// The same of a steady slide by `way` [m] and `turn` [rad], in G axes, which goes on along what is near: no place
  /// beside bone comes deeper than `more` as its gradient tells, nor goes farther than twice `more` beyond what is
  /// known to be free.
  template <PenetrationField Field>
  [[nodiscard]] double slide_share(const Field& field, const Tool& tool, const Vec3d& way, const Vec3d& turn,
                                   double more) noexcept {
    double share = group_share(field, tool, way.norm(), turn.norm(), more, beside_);
    const Mat3<Scalar> R = near_.pose().linear().template cast<Scalar>();
    for (int j = 0; j < place_count_; ++j) {
      const Scalar value = nearest(j);
      if (value > Scalar(0)) continue;
      Vec3d move = way;
      if (near_.turns(place_vertices_[static_cast<std::size_t>(j)]))
        move += turn.cross(Vec3d((R * places_[j]).template cast<double>()));
      const double toward = static_cast<double>(metres_) * gradients_[j].template cast<double>().dot(move);
      if (toward > 0) share = std::min(share, (more - static_cast<double>(metres_ * value)) / toward);
      share = std::min(share, (2 * more + static_cast<double>(field.clearance(value))) / move.norm());
    }
    return share;
  }
  [[nodiscard]] double deepest() const noexcept { return deepest_; }

  /// The places in bone at pose X_GT.
  template <PenetrationField Field>
  void look(const Field& field, const Tool& tool, const Posed& X_GT) noexcept {
    metres_ = field.metres();
    voxel_ = field.voxel() / metres_;
    near_.look(field, tool, X_GT);
    std::swap(before_, now_);
    touch(field, tool);
  }

  /// A tick begins: what the last one ended with is let go over ticks.
  void begin() noexcept {
    if constexpr (Vertices::kGlide) fading_.begin(found(), ball_);
  }

  /// Looks at every vertex next time.
  void forget() noexcept { near_.forget(); }
  /// Forgets where patches were deepest, too.
  void reset() noexcept {
    forget();
    fading_.forget();
    now_.count = 0;
  }

 private:
  /// Of a motion, by what is known of groups: `clearances`, taken once it was made sure of.
  template <PenetrationField Field>
  [[nodiscard]] double group_share(const Field& field, const Tool& tool, double step, double turn, double more,
                                   const std::vector<double>& clearances) noexcept {
    using Group = typename NearVertices<Scalar>::Group;
    const auto motion = [&](const Group& g) { return step + turn * g.lever; };
    if (near_.look_closer(field, tool, [&](const Group& g) { return motion(g) - more; })) see_closer(field, tool);
    double share = 1;
    for (std::size_t g = 0; g < clearances.size(); ++g)
      share = std::min(share, (clearances[g] + more) / motion(near_.groups()[g]));
    return share;
  }

  template <PenetrationField Field>
  void touch(const Field& field, const Tool& tool) noexcept {
    const Pose<Scalar> X = near_.pose().template cast<Scalar>();
    found_count_ = 0;
    touching_ = 0;
    now_.count = 0;
    deepest_ = 0;
    for (std::size_t g = 0; g < clearances_.size(); ++g) clearances_[g] = beside_[g] = near_.groups()[g].far_clearance;
    place_count_ = 0;
    for (int j = 0; j < near_.count(); ++j) {
      if (is_clear(field, j)) continue;
      place_vertices_[static_cast<std::size_t>(place_count_)] = near_.vertex(j);
      vertex_values_[static_cast<std::size_t>(place_count_)] = near_.value(j);
      places_.put(place_count_++, near_.point(j));
    }
    if (place_count_ == 0) return;
    places_.fill_lane(place_count_);
    gradients(field, X);
    collect(field, tool, X);
  }

  /// What groups tell that were looked at again at the same pose. Without a place among them all places stay.
  template <PenetrationField Field>
  void see_closer(const Field& field, const Tool& tool) noexcept {
    for (std::size_t g = 0; g < clearances_.size(); ++g)
      if (near_.groups()[g].closer) clearances_[g] = beside_[g] = near_.groups()[g].far_clearance;
    for (int j = 0; j < near_.count(); ++j)
      if (near_.groups()[near_.group_of(near_.vertex(j))].closer && !is_clear(field, j)) return touch(field, tool);
  }

  /// Whether the j-th vertex near touches nothing, nor any of its patch; then its group is no clearer than it.
  template <PenetrationField Field>
  [[gnu::always_inline]] bool is_clear(const Field& field, int j) noexcept {
    const std::size_t g = near_.group_of(near_.vertex(j));
    const Scalar reach = near_.groups()[g].reach;
    const Scalar clear = field.clearance(near_.value(j));
    if (near_.value(j) > Scalar(0) || (Vertices::kGlide && clear < reach)) return false;
    for (auto* of : {&clearances_, &beside_}) (*of)[g] = std::min((*of)[g], static_cast<double>(clear - reach));
    return true;
  }

  static constexpr Scalar kOutside = Scalar(-0.5);     // [voxels]: depth of the farthest of near places
  static constexpr Scalar kBeyondEdge = Scalar(0.25);  // [voxels] less deep than expected: a place beyond an edge
  static constexpr Scalar kBlunt = Scalar(0.8);        // of smoothed gradients, squared: below, an edge is near
  static constexpr Scalar kSharpest = Scalar(0.25);    // of the slope across an edge: one of 30 degrees
  static constexpr Scalar kNoWayOut = Scalar(1e-6);    // gradient squared: deeper than depths are known, rounding alone
  static constexpr Scalar kApart = Scalar(0.1);        // [voxels]: nearer, an old place is the same as the new …
  static constexpr Scalar kDeeper = Scalar(0.01);      // [voxels]: … and no deeper than by this
  static constexpr double kClose = 0.5;                // [voxels]: farther off, a place holds nothing of what one did
  static constexpr Scalar kCutTo = Scalar(1e-3);       // [voxels]
  static constexpr int kSteps = 3;                     // Newton's, to where a patch is deepest
  static constexpr int kCuts = 6;                      // fewer leave edges of 30 degrees open
  static constexpr Scalar kWithin = Scalar(1.001);     // of the cosine at a patch' edge: a place inside

  struct PatchEdge {
    PatchEdge(Scalar angle, Scalar r) noexcept : radius(r), cosine(std::cos(angle)), sine(std::sin(angle)) {}
    Scalar radius;  // of ball or shaft [m]
    Scalar cosine, sine;
  };

  /// Angle from a vertex to its patch's edge [rad]. The ball's is a quarter wider than a disc of the same area, so that
  /// patches leave no gaps.
  [[nodiscard]] static Scalar ball_patch(const Tool& tool) noexcept {
    if constexpr (!Vertices::kGlide) return Scalar(0);
    const auto count = static_cast<Scalar>(tool.groups()[0].count);
    return std::min(Scalar(1), Scalar(1.25) * std::sqrt(Scalar(4) / count));
  }
  [[nodiscard]] static Scalar ring_patch(const Tool& tool) noexcept {
    if (!Vertices::kGlide || tool.groups().size() < 2) return Scalar(0);
    return std::numbers::pi_v<Scalar> / static_cast<Scalar>(tool.groups()[1].count);
  }

  template <PenetrationField Field>
  void gradients(const Field& field, const Pose<Scalar>& X) noexcept {
    field.gradients(X, places_.x.data(), places_.y.data(), places_.z.data(), gradients_.x.data(), gradients_.y.data(),
                    gradients_.z.data(), padded_to_lane(place_count_));
  }

  /// The smoothed gradient at a point, given the cell's own there. In walls of a voxel or two both faces are in what is
  /// smoothed, and it points out at the wrong one before their middle: there the cell's own.
  template <PenetrationField Field>
  [[nodiscard]] static Vec3<Scalar> steady(const Field& field, const Vec3<Scalar>& p_G,
                                           const Vec3<Scalar>& plain) noexcept {
    const Vec3<Scalar> smooth = field.smooth_gradient(p_G);
    return in_wall(smooth, plain) ? plain : smooth;
  }
  [[nodiscard]] static bool in_wall(const Vec3<Scalar>& smooth, const Vec3<Scalar>& plain) noexcept {
    return smooth.dot(plain) < Scalar(0.5) * plain.squaredNorm();
  }

  /// What a vertex stands for.
  [[nodiscard]] VertexPatch<Scalar> patch(const Tool& tool, int vertex) const noexcept {
    const bool ball = vertex < ball_;
    const PatchEdge& edge = ball ? ball_edge_ : ring_edge_;
    Vec3<Scalar> axis = -tool.inward()[vertex];
    if (ball) axis = near_.standing(vertex) / edge.radius;
    return {axis, edge.radius, edge.cosine, edge.sine, ball, near_.standing(vertex).z()};
  }

  /// The point of the vertex' patch that lies farthest along `gradient` (G axes), into the bone; in T. On the shaft, in
  /// the vertex' slice. The vertex' own where no direction is told.
  [[nodiscard]] Vec3<Scalar> glided(const Tool& tool, const Mat3<Scalar>& R, int vertex,
                                    const Vec3<Scalar>& gradient) const noexcept {
    return patch(tool, vertex).farthest(R.transpose() * gradient);
  }

  /// On a sharp edge or corner no one gradient tells where a patch is deepest, but cutting planes do: from the vertex,
  /// from where its gradient led, and from where those so far meet; and Newton's step from the deepest of these. Depths
  /// are smoothed ones: crests of cells are notched, and a ball lies in the notches, 20 degrees aslant on an edge of 90
  /// degrees. Depth divided by the gradient's length, which is short there, is the way out, and an edge about as stiff
  /// as a face. Returns whether the place is on one. `gradients_` are the interpolant's own at the places.
  template <PenetrationField Field>
  bool hold_on_edge(const Field& field, const Tool& tool, const Pose<Scalar>& X, int place) noexcept {
    const auto j = static_cast<std::size_t>(place);
    const int vertex = place_vertices_[j];
    const Mat3<Scalar> R = X.linear();
    const Vec3<Scalar> from = near_.standing(vertex);
    const Vec3<Scalar> led = vertex_gradients_[place];
    const Scalar voxel = field.voxel() / field.metres();
    const Scalar expected = vertex_values_[j] + led.dot(R * (places_[place] - from));
    if (expected < kOutside * voxel) return false;
    if (!(expected - values_[j] > kBeyondEdge * voxel || led.squaredNorm() * field.metres() * field.metres() < kBlunt))
      return false;

    const VertexPatch<Scalar> around = patch(tool, vertex);
    CuttingPlanes<Scalar> planes;
    SmoothDepth<Scalar> best;
    const auto look_at = [&](const Vec3<Scalar>& p) {
      const SmoothDepth<Scalar> there = sharpened(field, X, p);
      planes.lift(p, there.value);
      planes.add({p, there.value, there.rise});
      if (there.value > best.value) best = there;
      return there.value;
    };
    static_cast<void>(look_at(from));
    static_cast<void>(look_at(places_[place]));
    for (int round = 1;; ++round) {
      const Vec3<Scalar> p = planes.deepest(around);
      const Scalar bound = planes.mixture()(p);
      if (bound < kOutside * voxel) return false;
      if (round == kCuts || bound - best.value < kCutTo * voxel) break;
      if (std::abs(bound - look_at(p)) < kCutTo * voxel) break;
    }
    // Of a thin wall's two sides the mixture tells nothing.
    const Vec3<Scalar> slope = planes.mixture().gradient;
    if ((slope * field.metres()).squaredNorm() < kSharpest * kSharpest) return false;
    const bool within = is_within(around, best.place);
    if (SmoothDepth<Scalar> next = best; around.ball && within && settle(around, R, voxel, next, rolls_[j]))
      best = next;
    // Within its patch a deepest place has the slope along its radius, whatever the planes still leave open.
    const Vec3<Scalar> out = around.across(best.place) / around.radius;
    const Scalar share = slope_of(best);
    places_.put(place, best.place);
    values_[j] = best.value / share;
    gradients_.put(place, R * (within ? Vec3<Scalar>(out.dot(slope) * out) : slope) / share);
    return true;
  }

  [[nodiscard]] static bool is_within(const VertexPatch<Scalar>& around, const Vec3<Scalar>& p) noexcept {
    return around.axis.dot(around.across(p)) > Scalar(kWithin) * around.radius * around.cosine;
  }

  /// The gradient at the vertex is that of bone a patch' width away, which may be curved: from where it led Newton's
  /// steps lead on (`put`). In walls as thin as what smoothing sees, and on the shaft, the gradient there leads once
  /// more. Places just outside glide too: where only those in bone did, a place would jump into it.
  template <PenetrationField Field>
  void glide_again(const Field& field, const Tool& tool, const Pose<Scalar>& X, int place) noexcept {
    const auto j = static_cast<std::size_t>(place);
    const Vec3<Scalar> plain = gradients_[place];
    if (place_vertices_[j] < ball_) {
      SmoothDepth<Scalar> deep = sharpened(field, X, places_[place]);
      if (!in_wall(deep.smooth, plain) && metres_ * metres_ * deep.smooth.squaredNorm() > kBlunt)
        return put(field, tool, X, place, deep);
    }
    const Vec3<Scalar> smooth = steady(field, X * places_[place], plain);
    const Vec3<Scalar> better = glided(tool, X.linear(), place_vertices_[j], smooth);
    const Vec3<Scalar> there = field.gradient(X * better);
    if (SmoothDepth<Scalar> deep = sharpened(field, X, better); !in_wall(deep.smooth, there)) {
      if (metres_ * metres_ * deep.smooth.squaredNorm() > kBlunt) return put(field, tool, X, place, deep);
      places_.put(place, better);
      values_[j] = deep.plain;
      gradients_.put(place, deep.smooth);
    } else if (const Scalar value = field.value(X * better); value > values_[j]) {
      places_.put(place, better);
      values_[j] = value;
      gradients_.put(place, there);
    } else if (values_[j] > Scalar(0)) {
      gradients_.put(place, smooth);
    }
  }

  /// A vertex' place is where Newton's steps lead from there: on the ball to its deepest, be that beyond the patch.
  template <PenetrationField Field>
  void put(const Field& field, const Tool& tool, const Pose<Scalar>& X, int place,
           SmoothDepth<Scalar>& there) noexcept {
    const auto j = static_cast<std::size_t>(place);
    const VertexPatch<Scalar> around = patch(tool, place_vertices_[j]);
    const Mat3<Scalar> R = X.linear();
    rolls_[j].fill({});
    const auto keep_at = [&](const SmoothDepth<Scalar>& at, const Vec3<Scalar>& slope) {
      const Scalar share = slope_of(at);
      places_.put(place, at.place);
      values_[j] = at.value / share;
      gradients_.put(place, R * slope / share);
    };
    if (!around.ball) return keep_at(there, there.rise);
    for (int step = 1;; ++step) {
      SmoothDepth<Scalar> next = there;
      const bool whole = settle(around, R, voxel_, next, rolls_[j]);
      const Vec3<Scalar> u = next.place / around.radius;
      if (whole || around.axis.dot(u) < around.cosine) return keep_at(next, u.dot(there.rise) * u);
      if (step == kSteps) break;
      next = sharpened(field, X, next.place);
      if (!(next.value > there.value)) break;
      there = next;
    }
    keep_at(there, there.rise);
  }

  /// The places that are in bone; before them, where vertices glide, each goes where its patch is deepest.
  template <PenetrationField Field>
  void collect(const Field& field, const Tool& tool, const Pose<Scalar>& X) noexcept {
    const Scalar metres = field.metres();
    const Mat3<Scalar> R = X.linear();
    if constexpr (Vertices::kGlide) {
      for (int j = 0; j < place_count_; ++j) {
        gradients_.put(j, steady(field, X * places_[j], gradients_[j]));
        places_.put(j, glided(tool, R, place_vertices_[static_cast<std::size_t>(j)], gradients_[j]));
        vertex_gradients_.put(j, gradients_[j]);
        rolls_[static_cast<std::size_t>(j)].fill({});
      }
      places_.fill_lane(place_count_);
    }
    field.values(X, places_.x.data(), places_.y.data(), places_.z.data(), values_.data(), padded_to_lane(place_count_));
    if constexpr (Vertices::kGlide) gradients(field, X);
    const Scalar outside = kOutside * field.voxel() / metres;  // of the near ones the farthest
    if constexpr (Vertices::kGlide) {
      std::copy_n(values_.begin(), place_count_, led_values_.begin());
      for (int j = 0; j < place_count_; ++j) {
        if (hold_on_edge(field, tool, X, j)) continue;
        if (values_[static_cast<std::size_t>(j)] > outside / Scalar(4)) glide_again(field, tool, X, j);
      }
      remember(field, tool, X);
      int on_ball = 0;
      while (on_ball < place_count_ && place_vertices_[static_cast<std::size_t>(on_ball)] < ball_) ++on_ball;
      shares_.divide(places_, values_, on_ball, outside,
                     [&](int j) { return near_.standing(place_vertices_[static_cast<std::size_t>(j)]); });
      note(R, outside);
    }
    for (int j = 0; j < place_count_; ++j) {
      const Scalar value = values_[static_cast<std::size_t>(j)];
      if (value > Scalar(0)) {
        const Scalar w = weight(j);
        if (w > Scalar(0)) keep(j, value * metres, Vec3<Scalar>(-metres * gradients_[j]), R * places_[j], w);
      } else {
        double& clearance = clearances_[near_.group_of(place_vertices_[static_cast<std::size_t>(j)])];
        clearance = std::min(clearance, static_cast<double>(field.clearance(nearest(j))));
      }
    }
    touching_ = found_count_;
    if constexpr (Vertices::kGlide) {
      hold_on(field, X);
      for (int j = 0; j < place_count_; ++j) {
        const Scalar value = values_[static_cast<std::size_t>(j)];
        if (value > Scalar(0) || value < outside) continue;
        const Scalar w = weight(j);
        if (w > Scalar(0)) keep(j, value * metres, Vec3<Scalar>(-metres * gradients_[j]), R * places_[j], w);
      }
    }
  }

  /// Places that were held and are deepest no more; in thin walls, where smoothed depths may tell the wrong way out,
  /// none.
  template <PenetrationField Field>
  void hold_on(const Field& field, const Pose<Scalar>& X) noexcept {
    const Mat3<Scalar> R = X.linear();
    fading_.each(found(), kClose * static_cast<double>(field.voxel()), [&](const FadingPlaces::Place& p, double w) {
      const Vec3<Scalar> lever = p.lever.cast<Scalar>(), at = R.transpose() * lever;
      const SmoothDepth<Scalar> there = sharpened(field, X, at);
      if (!(there.value > Scalar(0)) || in_wall(there.smooth, field.gradient(X * at))) return;
      const Scalar by_slope = metres_ / slope_of(there);
      add(p.vertex, w, by_slope * there.value, -by_slope * (R * there.rise), lever);
    });
    touching_ = found_count_;
  }

  /// On rough bone a patch has several deepest places, and a look finds the one that its gradients lead to. That of the
  /// look before is not lost: contacts that come and go with the gradients are depths that no step leads out of.
  template <PenetrationField Field>
  void remember(const Field& field, const Tool& tool, const Pose<Scalar>& X) noexcept {
    const Mat3<Scalar> R = X.linear();
    const Scalar apart = kApart * field.voxel();
    int others = 0;
    const Deepest* old = before_.places.data();
    const Deepest* const end = old + before_.count;
    for (int j = 0; j < place_count_ && old != end; ++j) {
      const int vertex = place_vertices_[static_cast<std::size_t>(j)];
      while (old != end && old->vertex < vertex) ++old;
      if (old == end || old->vertex != vertex) continue;
      const Vec3<Scalar> there = near_.turns(vertex) ? old->place : Vec3<Scalar>(R.transpose() * old->place);
      if (!((there - places_[j]).squaredNorm() > apart * apart)) continue;
      others_[static_cast<std::size_t>(others)] = j;
      old_places_.put(others++, there);
    }
    if (others > 0) {
      old_places_.fill_lane(others);
      field.values(X, old_places_.x.data(), old_places_.y.data(), old_places_.z.data(), old_values_.data(),
                   padded_to_lane(others));
      for (std::size_t i = 0; i < static_cast<std::size_t>(others); ++i)
        if (old_values_[i] > values_[static_cast<std::size_t>(others_[i])])
          go_back(field, tool, X, others_[i], old_places_[static_cast<int>(i)]);
    }
  }

  /// To the old place, if that is deeper.
  template <PenetrationField Field>
  void go_back(const Field& field, const Tool& tool, const Pose<Scalar>& X, int place,
               const Vec3<Scalar>& old_place) noexcept {
    const auto j = static_cast<std::size_t>(place);
    SmoothDepth<Scalar> old = sharpened(field, X, old_place);
    if (!(old.value / slope_of(old) > values_[j] + kDeeper * field.voxel() / field.metres())) return;
    if (!in_wall(old.smooth, field.gradient(X * old_place))) put(field, tool, X, place, old);
  }

  /// Where patches are deepest, for the next look.
  void note(const Mat3<Scalar>& R, Scalar outside) noexcept {
    for (int j = 0; j < place_count_; ++j) {
      if (values_[static_cast<std::size_t>(j)] < outside || !(weight(j) > Scalar(0))) continue;
      const int vertex = place_vertices_[static_cast<std::size_t>(j)];
      now_.places[now_.count++] = {vertex, near_.turns(vertex) ? places_[j] : Vec3<Scalar>(R * places_[j])};
    }
  }

  /// Depth of the j-th place; of one outside what the cells tell, as smoothed depths say nothing of what is near.
  [[nodiscard]] Scalar nearest(int place) const noexcept {
    const auto j = static_cast<std::size_t>(place);
    return Vertices::kGlide ? std::max(values_[j], led_values_[j]) : values_[j];
  }

  /// Of smoothed depth, by which what it tells is divided: less than 1 where smoothing blunts.
  [[nodiscard]] Scalar slope_of(const SmoothDepth<Scalar>& there) const noexcept {
    return std::clamp(metres_ * there.smooth.norm(), kSharpest, Scalar(1));
  }

  [[nodiscard]] Scalar weight(int place) const noexcept {
    const bool shared = Vertices::kGlide && place_vertices_[static_cast<std::size_t>(place)] < ball_;
    return shared ? shares_.of(place) : Scalar(1);
  }

  void keep(int place, Scalar depth, const Vec3<Scalar>& out, const Vec3<Scalar>& lever, Scalar w = 1) noexcept {
    const auto j = static_cast<std::size_t>(place);
    VertexContact& c = add(place_vertices_[j], static_cast<double>(w), depth, out, lever);
    for (std::size_t i = 0; i < c.rolls.size(); ++i)
      c.rolls[i] = {rolls_[j][i].way.template cast<double>(), static_cast<double>(rolls_[j][i].bend)};
  }

  VertexContact& add(int vertex, double weight, Scalar depth, const Vec3<Scalar>& out,
                     const Vec3<Scalar>& lever) noexcept {
    VertexContact& c = found_[found_count_++];
    c.weight = weight;
    c.vertex = vertex;
    c.depth = static_cast<double>(depth);
    c.out =
        !Vertices::kGlide || out.squaredNorm() > kNoWayOut ? Vec3d(out.template cast<double>()) : Vec3d(Vec3d::Zero());
    c.lever = lever.template cast<double>();
    c.turns = near_.turns(vertex);
    c.rolls.fill({});
    deepest_ = std::max(deepest_, c.depth);
    return c;
  }

  int ball_;
  Scalar ball_reach_;  // [rad] from a vertex to its patch's edge
  Scalar ring_reach_;
  PatchEdge ball_edge_, ring_edge_;
  NearVertices<Scalar> near_;
  PatchShares<Scalar> shares_;
  FadingPlaces fading_;
  std::vector<double> clearances_;  // of each group's vertices that do not touch [m]
  std::vector<double> beside_;      // of those among them that have no place
  Scalar metres_ = 1, voxel_ = 1;   // of the field: per unit of depth, and in such units
  double deepest_ = 0;
  std::size_t touching_ = 0;
  std::size_t found_count_ = 0;
  int place_count_ = 0;
  std::vector<Scalar> values_;         // at the places
  std::vector<Scalar> led_values_;     // at the places that their vertices' gradients led to
  std::vector<Scalar> vertex_values_;  // at their vertices
  std::vector<int> place_vertices_;    // whose patch may be in bone
  PointArrays<Scalar> places_, gradients_;
  PointArrays<Scalar> vertex_gradients_;               // at the places' vertices, steady
  std::vector<std::array<Rolling<Scalar>, 2>> rolls_;  // of each place
  // Where patches were deepest, of those that may touch, in the order of their vertices: about T's origin, in G axes
  // for a ball's, in T else. In the look before, and in this one.
  struct Deepest {
    int vertex = 0;
    Vec3<Scalar> place = Vec3<Scalar>::Zero();
  };
  struct Look {
    std::vector<Deepest> places;  // the first `count`; of one size, which copies keep
    std::size_t count = 0;
  };
  Look before_, now_;
  PointArrays<Scalar> old_places_;
  std::vector<Scalar> old_values_;
  std::vector<int> others_;  // the place of each
  std::vector<VertexContact> found_;
};

}  // namespace trephine
