// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/contact/proxy_options.hpp>
#include <trephine/contact/surface_search.hpp>
#include <trephine/core/status.hpp>

#include <algorithm>
#include <limits>

namespace trephine::inline TREPHINE_ALIGNED {

/// A point that follows a probe but stays outside bone: thesis sections 2.1.3 and 3.1.4 (after Ruspini 1997, Salisbury
/// & Tarr 1997, Eriksson 2006). In contact it is on the surface, just outside bone, as near to the probe as friction
/// allows.
///
/// Contact starts where the probe's path crosses the surface, and ends when the path to the probe is free. A tick moves
/// the proxy in the tangent plane toward the probe. A projection along the normal back to the surface follows each
/// move. A move is accepted if the proxy gets nearer to the probe. With smooth normals (`SplineGradient`) a move is
/// also accepted if it leaves less tangential distance, and rejected if it overshoots without that. The proxy then
/// rests at the point whose normal faces the probe, at any speed of the probe. This rule ends the moves at concave
/// corners and in sockets without chatter. All samples are at the proxy, so the probe may be at any depth, even where
/// gradients vanish.
///
/// A proxy moves on toward the probe if the bone under it was removed. A proxy in bone (start inside, restored bone) is
/// projected out along the normal, else along the nearest of 14 directions. A start in bone returns `kStartedInside`.
///
/// Work per tick: at most 2 + 2 · path_steps + 9 · iterations · 4 · (48 + 2 · path to the surface) samples, and 15 · 77
/// more for a projection out of bone; typically 3–25. A slide cut short continues in the next tick, and the tick
/// returns `kWorkBound`.
template <RealScalar Scalar, Friction FrictionLaw = Frictionless>
class SurfaceProxy {
  // Divisor of the search step where a step could miss a thin wall: of a blurred voxel an image may show a tenth as
  // bone.
  static constexpr Scalar kFineSteps = Scalar(8);
  // Steps of a search along the normal: kNormalReach in fine steps.
  static constexpr int kNormalSteps = 16;
  static constexpr int kProjectionSteps = 8;            // of a projection out of bone after a move
  static constexpr Scalar kNormalReach = Scalar(2);     // reach of a search along the normal, in steps
  static constexpr Scalar kMinProgress = Scalar(0.05);  // smallest gain of an accepted move, over its length
  static constexpr Scalar kMaxClimb = Scalar(0.5);      // largest climb over a move's length: twice noisy bone's slope
  static constexpr int kMaxTrials = 4;             // of a move, each shorter than the last: to an eighth by halving
  static constexpr Scalar kHalving = Scalar(0.5);  // length of a trial over the last, unless slides meet nearer
  static constexpr Scalar kMinShortening = Scalar(0.1);  // smallest length of a trial over the last
  static constexpr int kMaxStraightMoves = 8;            // moves of a straight slide, over `iterations`
  // Depth under the proxy at which bone must support it, in voxels: well above the search tolerance, so that rounding
  // does not move a sticking proxy.
  static constexpr Scalar kSupportDepth = Scalar(0.02);
  // Search for an exit from bone: reach and step in voxels, and a count that covers the reach.
  static constexpr Scalar kExitReach = Scalar(32);
  static constexpr Scalar kExitStep = Scalar(0.5);
  static constexpr int kExitSteps = 64;
  static constexpr int kExitDirections = 14;  // faces and corners of a cube

 public:
  explicit SurfaceProxy(const ProxyOptions& options = {}, const FrictionLaw& friction = FrictionLaw{})
      : options_(options), friction_(friction) {
    options.validate();
  }

  [[nodiscard]] bool in_contact() const noexcept { return state_ == State::kContact; }
  /// True in contact with static friction.
  [[nodiscard]] bool sticks() const noexcept { return in_contact() && sticking_; }
  /// The proxy's position [m], in the field's frame.
  [[nodiscard]] const Vec3<Scalar>& position() const noexcept { return q_; }
  /// Outward unit normal of the bone at the proxy; valid in contact.
  [[nodiscard]] const Vec3<Scalar>& normal() const noexcept { return n_; }

  /// Clears contact and the previous probe.
  void reset() noexcept { state_ = State::kNone; }

  /// Places a free proxy at `p`, a point outside bone, from which the next call's path starts.
  void place_free(const Vec3<Scalar>& p) noexcept {
    release(p);
    probe_ = p;
    has_probe_ = true;
  }

  /// Starts contact at a surface point `q` just outside the bone, found by the caller.
  template <PointField Field>
  void attach_at(const Field& field, const Vec3<Scalar>& q) noexcept {
    q_ = q;
    sticking_ = false;
    has_probe_ = false;
    state_ = State::kContact;
    if (!field.normal(q, n_)) n_.setZero();
  }

  /// Moves the proxy for a probe at p. A free proxy's path starts at the probe of the previous call.
  template <PointField Field>
  Status follow(const Field& field, const Vec3<Scalar>& p) noexcept {
    const Scalar step = static_cast<Scalar>(options_.step) * field.voxel();
    const bool jumped =
        state_ != State::kNone && has_probe_ && !((p - probe_).norm() <= static_cast<Scalar>(options_.jump));
    allow_slide(field, p);
    probe_ = p;
    has_probe_ = true;
    if (jumped) {
      start(field, p);
      return Status::kJump;
    }
    if (state_ == State::kNone || state_ == State::kInside) {
      start(field, p);
      if (state_ == State::kFree) return Status::kOk;
      if (state_ == State::kContact) slide(field, p, step);
      return Status::kStartedInside;
    }
    if (state_ == State::kFree) return follow_free(field, p, step);
    return follow_in_contact(field, p, step);
  }

 private:
  enum class State { kNone, kFree, kContact, kInside };
  enum class Projection { kOnSurface, kTooHigh, kFree };

  // Sets how far the proxy may slide in this tick. A rest below the search tolerance is carried over, so that slow
  // probes move it too.
  template <PointField Field>
  void allow_slide(const Field& field, const Vec3<Scalar>& p) noexcept {
    may_slide_ = options_.slide ? std::min(may_slide_, static_cast<Scalar>(kSurfaceTolerance) * field.voxel())
                                : std::numeric_limits<Scalar>::max();
    if (options_.slide && has_probe_) may_slide_ += static_cast<Scalar>(*options_.slide) * (p - probe_).norm();
  }

  // Starts without history: free if the probe is free, else projected out of bone.
  template <PointField Field>
  void start(const Field& field, const Vec3<Scalar>& p) noexcept {
    q_ = p;
    sticking_ = false;
    may_slide_ = std::numeric_limits<Scalar>::max();
    state_ = field.value(p) < Scalar(0) ? State::kFree : (project_out(field, q_) ? State::kContact : State::kInside);
  }

  template <PointField Field>
  Status follow_free(const Field& field, const Vec3<Scalar>& p, Scalar step) noexcept {
    const auto margin = static_cast<Scalar>(kBeyondMargin) * field.voxel();
    if (is_known_beyond(field, p, Scalar((p - q_).norm() + margin))) {
      q_ = p;
      return Status::kOk;
    }
    const Scalar at_q = field.value(q_);
    if (!(at_q < Scalar(0))) {  // bone appeared at the free proxy
      start(field, p);
      return state_ == State::kFree ? Status::kOk : Status::kStartedInside;
    }
    const auto hit = first_crossing(field, q_, at_q, p, step / kFineSteps, options_.path_steps);
    if (!hit.found) {
      q_ = p;
      return Status::kOk;
    }
    attach_at(field, q_ + hit.before * (p - q_));
    has_probe_ = true;
    return slide(field, p, step);
  }

  template <PointField Field>
  Status follow_in_contact(const Field& field, const Vec3<Scalar>& p, Scalar step) noexcept {
    const bool probe_free = field.value(p) < Scalar(0);
    const Scalar at_q = field.value(q_);
    if (!(at_q < Scalar(0))) {
      if (!project_out(field, q_)) {
        start(field, p);
        return state_ == State::kFree ? Status::kOk : Status::kStartedInside;
      }
    } else if (!is_supported(field) || (probe_free && !((p - q_).dot(n_) < Scalar(0)))) {
      if (!advance(field, at_q, p, step)) return Status::kOk;
    }
    return slide(field, p, step);
  }

  void release(const Vec3<Scalar>& p) noexcept {
    q_ = p;
    state_ = State::kFree;
  }

  // True if bone is right under the proxy; false if it was removed.
  template <PointField Field>
  [[nodiscard]] bool is_supported(const Field& field) const noexcept {
    return field.value(q_ - (kSupportDepth * field.voxel()) * n_) >= Scalar(0);
  }

  // First surface from a, outside bone, to b: in steps, then in fine steps if these find none.
  template <PointField Field>
  [[nodiscard]] static Crossing<Scalar> next_surface(const Field& field, const Vec3<Scalar>& a, Scalar at_a,
                                                     const Vec3<Scalar>& b, Scalar step, int max_steps) noexcept {
    const auto hit = first_crossing(field, a, at_a, b, step, max_steps);
    return hit.found ? hit : first_crossing(field, a, at_a, b, step / kFineSteps, max_steps);
  }

  // Moves the proxy straight toward the probe up to the next surface; `at_q` is the field's value at the proxy. Returns
  // false if the path is free, which ends the contact.
  template <PointField Field>
  bool advance(const Field& field, Scalar at_q, const Vec3<Scalar>& p, Scalar step) noexcept {
    const auto hit = next_surface(field, q_, at_q, p, step, options_.path_steps);
    if (!hit.found) {
      release(p);
      return false;
    }
    q_ += hit.before * (p - q_);
    return true;
  }

  // Slides the proxy in tangential moves until friction stops it or no move is accepted.
  template <PointField Field>
  Status slide(const Field& field, const Vec3<Scalar>& p, Scalar step) noexcept {
    const Scalar tolerance = static_cast<Scalar>(kSurfaceTolerance) * field.voxel();
    int max_moves = options_.iterations;
    bool has_slid = false;
    Vec3<Scalar> previous = q_, before_previous = q_;
    for (int i = 0; i < max_moves; ++i) {
      static_cast<void>(field.normal(q_, n_));  // keeps the last normal if the field has none here
      const Vec3<Scalar> d = p - q_;
      const Scalar depth = -d.dot(n_);
      if (depth < Scalar(0)) {  // the probe is in front of the tangent plane: move straight toward it
        const Vec3<Scalar> from = q_;
        if (!advance(field, field.value(q_), p, step)) return Status::kOk;
        if (!((q_ - from).norm() > tolerance)) return Status::kOk;
        continue;
      }
      const Vec3<Scalar> t = d + depth * n_;
      const Scalar tangential = t.norm();
      const Scalar slip =
          static_cast<Scalar>(friction_.slip(static_cast<double>(tangential), static_cast<double>(depth), sticking_));
      if (!(slip > tolerance)) {
        // A sliding proxy ends every tick on the kinetic cone. It sticks only after a whole tick without slip. A slip
        // below the tolerance leaves the state unchanged: else slow slides would stick at high rates.
        if (!(slip > Scalar(0)) && !has_slid) sticking_ = true;
        return Status::kOk;
      }
      const StepPlan straight =
          plan_steps(static_cast<double>(slip), static_cast<double>(step), kMaxStraightMoves * options_.iterations);
      max_moves = std::max(max_moves, options_.iterations + straight.count);
      sticking_ = false;
      has_slid = true;
      before_previous = previous;
      previous = q_;
      const Scalar distance = d.norm();
      if (!(may_slide_ > tolerance)) return Status::kOk;
      Scalar length = std::min({slip, step, may_slide_});
      bool moved = false;
      for (int trial = 0; trial < kMaxTrials && !moved; ++trial) {
        Vec3<Scalar> q = q_ + (length / tangential) * t;
        const Scalar nearer = distance - kMinProgress * length * (tangential / distance);
        // At a height h over q the probe is √((tangential − length)² + (depth + h)²) away.
        const Scalar farthest = kSmoothNormals<Field> ? distance + kMaxClimb * length : nearer;
        const Scalar rest = tangential - length;
        const Scalar max_height = std::sqrt(farthest * farthest - rest * rest) - depth + tolerance;
        const Projection projection = project_to_surface(field, q, p, step, max_height);
        if (projection == Projection::kFree) {
          release(p);
          return Status::kOk;
        }
        Scalar shortening = kHalving;
        if (projection == Projection::kOnSurface) {
          moved = (p - q).norm() < nearer;
          if constexpr (kSmoothNormals<Field>) moved = accepts_move(field, q, p, t, length, moved, shortening);
          if (moved) q_ = q;
        }
        length *= shortening;
      }
      if (!moved) return Status::kOk;
      may_slide_ -= (q_ - previous).norm();
    }
    // The work limit ended the slide. The proxy lags behind if its last two moves add up; in a corner they cancel.
    return (q_ - before_previous).norm() > step ? Status::kWorkBound : Status::kOk;
  }

  // Acceptance of a move to q with smooth normals. These differ a little from the normals of the voxels' isosurface, so
  // the proxy must climb the isosurface's ripple to reach the point whose normal faces the probe. The test therefore
  // compares the tangential distance left. `nearer`, a shorter distance to the probe, counts only without overshoot.
  // After an overshoot `shortening` is set to the length at which the two slides would meet.
  template <PointField Field>
  [[nodiscard]] bool accepts_move(const Field& field, const Vec3<Scalar>& q, const Vec3<Scalar>& p,
                                  const Vec3<Scalar>& t, Scalar length, bool nearer,
                                  Scalar& shortening) const noexcept {
    Vec3<Scalar> n = n_;
    static_cast<void>(field.normal(q, n));
    const Vec3<Scalar> d = p - q;
    const Scalar depth = -d.dot(n);
    const Vec3<Scalar> rest = d + depth * n;
    const Scalar tangential = t.norm();
    if (depth > Scalar(0) && rest.norm() <= tangential - kMinProgress * length) return true;
    const Scalar forward = rest.dot(t) / tangential;
    if (forward < Scalar(0))
      shortening = std::max(kMinShortening, std::min(shortening, tangential / (tangential - forward)));
    return nearer && !(forward < Scalar(0));
  }

  // Projects q to just outside the surface along the normal. If the surface drops away, it moves q on toward the probe.
  // A surface higher than `max_height` over q is too high for the move. Its height is then not searched: a resting
  // proxy has such moves four times a tick.
  template <PointField Field>
  Projection project_to_surface(const Field& field, Vec3<Scalar>& q, const Vec3<Scalar>& p, Scalar step,
                                Scalar max_height) const noexcept {
    const Scalar reach = kNormalReach * step;
    const Scalar at_q = field.value(q);
    if (at_q >= Scalar(0)) {
      if (max_height <= step && field.value(q + max_height * n_) >= Scalar(0)) return Projection::kTooHigh;
      const Vec3<Scalar> outside = q + reach * n_;
      const auto hit = first_crossing(field, q, at_q, outside, step, kProjectionSteps);
      if (!hit.found) return Projection::kTooHigh;
      q += hit.after * (outside - q);
      return Projection::kOnSurface;
    }
    const Vec3<Scalar> inside = q - reach * n_;
    auto hit = next_surface(field, q, at_q, inside, step, kNormalSteps);
    if (hit.found) {
      q += hit.before * (inside - q);
      return Projection::kOnSurface;
    }
    hit = next_surface(field, q, at_q, p, step, options_.path_steps);
    if (!hit.found) return Projection::kFree;
    q += hit.before * (p - q);
    return Projection::kOnSurface;
  }

  // Projects q out of bone: along the normal if that finds an exit within reach, else along the direction of the
  // nearest exit. Returns false, with q unchanged, if no direction has an exit.
  template <PointField Field>
  bool project_out(const Field& field, Vec3<Scalar>& q) noexcept {
    const Scalar voxel = field.voxel();
    const Scalar reach = kExitReach * voxel;
    const auto exit_along = [&](const Vec3<Scalar>& n) {
      return first_crossing(field, q, Vec3<Scalar>(q + reach * n), kExitStep * voxel, kExitSteps);
    };
    Vec3<Scalar> best = Vec3<Scalar>::Zero();
    Scalar nearest = Scalar(2);  // as a fraction of the reach; above 1: none found
    Vec3<Scalar> n;
    if (field.normal(q, n)) {
      const auto hit = exit_along(n);
      if (hit.found) {
        best = n;
        nearest = hit.after;
      }
    }
    const bool by_normal = nearest <= Scalar(1);
    for (int i = 0; i < kExitDirections && !by_normal; ++i) {
      const Vec3<Scalar> candidate = exit_direction(i);
      const auto hit = exit_along(candidate);
      if (hit.found && hit.after < nearest) {
        best = candidate;
        nearest = hit.after;
      }
    }
    if (nearest > Scalar(1)) return false;
    q += (nearest * reach) * best;
    if (!field.normal(q, n_)) n_ = best;
    return true;
  }

  // Unit directions to the six faces and eight corners of a cube.
  [[nodiscard]] static Vec3<Scalar> exit_direction(int i) noexcept {
    Vec3<Scalar> d = Vec3<Scalar>::Zero();
    if (i < 6) {
      d[i / 2] = i % 2 == 0 ? Scalar(1) : Scalar(-1);
      return d;
    }
    const Scalar s = Scalar(0.57735026918962576);  // 1/√3
    const int corner = i - 6;
    return {(corner & 1) != 0 ? s : -s, (corner & 2) != 0 ? s : -s, (corner & 4) != 0 ? s : -s};
  }

  ProxyOptions options_;
  [[no_unique_address]] FrictionLaw friction_;
  State state_ = State::kNone;
  bool sticking_ = false;
  bool has_probe_ = false;
  Scalar may_slide_ = Scalar(0);  // way along the surface that `ProxyOptions::slide` leaves [m]
  Vec3<Scalar> probe_ = Vec3<Scalar>::Zero();
  Vec3<Scalar> q_ = Vec3<Scalar>::Zero();  // the proxy
  Vec3<Scalar> n_ = Vec3<Scalar>::Zero();  // outward unit normal at the proxy
};

}  // namespace trephine
