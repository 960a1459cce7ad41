// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/contact/surface_search.hpp>
#include <trephine/core/status.hpp>
#include <trephine/voxel/clearance_field.hpp>

namespace trephine {

/// When a proxy takes hold and lets go.
enum class Trigger {
  kSwept,   ///< on the path: takes hold of what the path crossed, holds until the straight way to the probe is free
  kThesis,  ///< by the probe alone: in contact if and only if the probe is in bone (walls crossed in a tick go unseen)
};

struct ProxyOptions {
  double step = 0.5;    ///< longest move and path step, in voxels
  int iterations = 16;  ///< tangential moves a tick beyond those of a straight slide, which are at most 8 times as many
  int path_steps = 512;  ///< samples along a path; a longer path gets longer steps
  /// A probe that moves farther than this between two ticks [m] has jumped (5 m/s at 1 kHz, no hand does that): contact
  /// starts anew, because a proxy left behind would pull the hand across the gap.
  double jump = 0.005;
  Trigger trigger = Trigger::kSwept;

  void validate() const {
    if (!(step > 0 && step <= 4)) refuse("ProxyOptions", "step must be > 0 and at most 4 voxels", step);
    if (!(iterations >= 1 && iterations <= 1000)) refuse("ProxyOptions", "iterations must be 1 to 1000", iterations);
    if (!(path_steps >= 8 && path_steps <= 100000))
      refuse("ProxyOptions", "path_steps must be 8 to 100000", path_steps);
    if (!(jump > 0)) refuse("ProxyOptions", "jump must be > 0 m", jump);
  }
};

/// A point that follows a probe but stays out of bone: thesis sections 2.1.3 and 3.1.4 (after Ruspini 1997, Salisbury &
/// Tarr 1997, Eriksson 2006). In contact it lies on the surface, just outside, where friction lets it come nearest to
/// the probe.
///
/// A tick: hold or let go (`Trigger`); then moves in the tangent plane toward the probe, each followed by a search
/// along the normal back to the surface. A move is kept if it brings the proxy nearer. Where normals are smooth
/// (`SplineGradient`) a move is also kept if it leaves less to slide, and turned down if it slides too far without
/// that: the proxy rests where the normal faces the probe, however slowly the probe moves. This rule ends the moves at
/// concave corners and in sockets without chatter. All sampling is at the proxy, so the probe may be arbitrarily deep,
/// where gradients vanish.
///
/// Where the bone under the proxy was carved away it falls on toward the probe; where bone appeared round it (start
/// inside, restored) it is pushed out along the normal, else along the nearest of 14 directions, and says so.
///
/// Work a tick: at most 2 + 2 · path_steps + 9 · iterations · 4 · (48 + 2 · path to the surface) samples, and 15 · 77
/// more where it has to be pushed out; typically 3–25. A slide that is cut short goes on at the next tick, and the tick
/// says `kWorkBound`.
template <RealScalar Scalar, Friction FrictionLaw = Frictionless>
class SurfaceProxy {
 public:
  explicit SurfaceProxy(const ProxyOptions& options = {}, const FrictionLaw& friction = FrictionLaw{})
      : options_(options), friction_(friction) {
    options.validate();
  }

  [[nodiscard]] bool in_contact() const noexcept { return state_ == State::kContact; }
  [[nodiscard]] bool sticks() const noexcept { return in_contact() && sticking_; }
  [[nodiscard]] const Vec3<Scalar>& position() const noexcept { return q_; }
  /// Outward unit normal under the proxy; meaningful in contact.
  [[nodiscard]] const Vec3<Scalar>& normal() const noexcept { return n_; }

  void reset() noexcept { state_ = State::kNone; }

  /// Sets a free proxy down at `p`, a place outside bone, as the start of the next call's path.
  void place_free(const Vec3<Scalar>& p) noexcept {
    release(p);
    probe_ = p;
    has_probe_ = true;
  }

  /// Takes hold at a surface point that someone else found (a first contact), `q` just outside the bone.
  template <PointField Field>
  void attach_at(const Field& field, const Vec3<Scalar>& q) noexcept {
    q_ = q;
    sticking_ = false;
    has_probe_ = false;
    state_ = State::kContact;
    if (!field.normal(q, n_)) n_.setZero();
  }

  /// Moves the proxy for a probe now at p. The probe of the previous call is where a free proxy stands.
  template <PointField Field>
  Status follow(const Field& field, const Vec3<Scalar>& p) noexcept {
    const Scalar step = static_cast<Scalar>(options_.step) * field.voxel();
    const bool jumped =
        state_ != State::kNone && has_probe_ && !((p - probe_).norm() <= static_cast<Scalar>(options_.jump));
    probe_ = p;
    has_probe_ = true;
    if (jumped) {
      begin(field, p);
      return Status::kJump;
    }
    if (state_ == State::kNone || state_ == State::kInside) {
      begin(field, p);
      if (state_ == State::kFree) return Status::kOk;
      if (state_ == State::kContact) slide(field, p, step);
      return Status::kStartedInside;
    }
    if (state_ == State::kFree) return enter(field, p, step);
    return stay(field, p, step);
  }

 private:
  enum class State { kNone, kFree, kContact, kInside };
  enum class Move { kOnSurface, kTooHigh, kFree };
  // Steps where a step would miss a wall: of a blurred voxel an image may show a tenth as bone.
  static constexpr Scalar kFiner = Scalar(8);
  static constexpr int kFinest = 16;                 // steps of a search along the normal
  static constexpr Scalar kProgress = Scalar(0.05);  // least share of a move's length that counts as progress
  static constexpr Scalar kSteepest = Scalar(0.5);   // climb over a move's length: twice the slope of noisy bone

  // No history: free where the probe is free; in bone, out of it by the shortest way found.
  template <PointField Field>
  void begin(const Field& field, const Vec3<Scalar>& p) noexcept {
    q_ = p;
    sticking_ = false;
    state_ = field.value(p) < Scalar(0) ? State::kFree : (project_out(field, q_) ? State::kContact : State::kInside);
  }

  template <PointField Field>
  Status enter(const Field& field, const Vec3<Scalar>& p, Scalar step) noexcept {
    const auto margin = static_cast<Scalar>(kClearanceMargin) * field.voxel();
    if (is_known_clear(field, p, Scalar((p - q_).norm() + margin))) {
      q_ = p;
      return Status::kOk;
    }
    if (options_.trigger == Trigger::kThesis && field.value(p) < Scalar(0)) {
      q_ = p;
      return Status::kOk;
    }
    const Scalar at_q = field.value(q_);
    if (!(at_q < Scalar(0))) {  // bone appeared where the free proxy stood
      begin(field, p);
      return state_ == State::kFree ? Status::kOk : Status::kStartedInside;
    }
    const auto hit = first_crossing(field, q_, at_q, p, step / kFiner, options_.path_steps);
    if (!hit.found) {
      q_ = p;
      return Status::kOk;
    }
    attach_at(field, q_ + hit.before * (p - q_));
    has_probe_ = true;
    return slide(field, p, step);
  }

  template <PointField Field>
  Status stay(const Field& field, const Vec3<Scalar>& p, Scalar step) noexcept {
    const bool probe_free = field.value(p) < Scalar(0);
    if (options_.trigger == Trigger::kThesis && probe_free) {
      release(p);
      return Status::kOk;
    }
    const Scalar at_q = field.value(q_);
    if (!(at_q < Scalar(0))) {
      if (!project_out(field, q_)) {
        begin(field, p);
        return state_ == State::kFree ? Status::kOk : Status::kStartedInside;
      }
    } else if (!supported(field) || (probe_free && !((p - q_).dot(n_) < Scalar(0)))) {
      if (!advance(field, at_q, p, step)) return Status::kOk;
    }
    return slide(field, p, step);
  }

  void release(const Vec3<Scalar>& p) noexcept {
    q_ = p;
    state_ = State::kFree;
  }

  // Is there still bone right under the proxy? (If not it was carved away.) A proxy that sticks must not be moved for
  // rounding, so this looks a little below the surface rather than at it.
  template <PointField Field>
  [[nodiscard]] bool supported(const Field& field) const noexcept {
    return field.value(q_ - (Scalar(0.02) * field.voxel()) * n_) >= Scalar(0);
  }

  // From air: in steps, and in finer ones before it is said that there is no bone.
  template <PointField Field>
  [[nodiscard]] static Crossing<Scalar> next_surface(const Field& field, const Vec3<Scalar>& a, Scalar at_a,
                                                     const Vec3<Scalar>& b, Scalar step, int most) noexcept {
    const auto hit = first_crossing(field, a, at_a, b, step, most);
    return hit.found ? hit : first_crossing(field, a, at_a, b, step / kFiner, most);
  }

  // Straight toward the probe up to the next surface; `at_q` is the field's value at the proxy. False: the way is free
  // and the contact ends.
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

  template <PointField Field>
  Status slide(const Field& field, const Vec3<Scalar>& p, Scalar step) noexcept {
    const Scalar enough = static_cast<Scalar>(kSurfaceTolerance) * field.voxel();
    int most = options_.iterations;
    bool slid = false;
    Vec3<Scalar> last = q_, last_but_one = q_;
    for (int i = 0; i < most; ++i) {
      static_cast<void>(field.normal(q_, n_));  // keeps the last normal where there is none
      const Vec3<Scalar> d = p - q_;
      const Scalar depth = -d.dot(n_);
      if (depth < Scalar(0)) {  // the probe is in front of the tangent plane: straight on
        const Vec3<Scalar> from = q_;
        if (!advance(field, field.value(q_), p, step)) return Status::kOk;
        if (!((q_ - from).norm() > enough)) return Status::kOk;
        continue;
      }
      const Vec3<Scalar> t = d + depth * n_;
      const Scalar tangential = t.norm();
      const Scalar slip =
          static_cast<Scalar>(friction_.slip(static_cast<double>(tangential), static_cast<double>(depth), sticking_));
      if (!(slip > enough)) {
        // A slide ends every tick on the kinetic cone; it has stopped only when a whole tick passes without slip. Slips
        // too short to carry out leave the state alone, or slow slides would stick at high rates.
        if (!(slip > Scalar(0)) && !slid) sticking_ = true;
        return Status::kOk;
      }
      const StepPlan straight =
          plan_steps(static_cast<double>(slip), static_cast<double>(step), 8 * options_.iterations);
      most = std::max(most, options_.iterations + straight.count);
      sticking_ = false;
      slid = true;
      last_but_one = last;
      last = q_;
      const Scalar distance = d.norm();
      Scalar length = std::min(slip, step);
      bool moved = false;
      for (int trial = 0; trial < 4 && !moved; ++trial) {
        Vec3<Scalar> q = q_ + (length / tangential) * t;
        const Scalar nearer = distance - kProgress * length * (tangential / distance);
        // A height h over q the probe is √((tangential − length)² + (depth + h)²) away.
        const Scalar farthest = kSmoothNormals<Field> ? distance + kSteepest * length : nearer;
        const Scalar left = tangential - length;
        const Scalar rise = std::sqrt(farthest * farthest - left * left) - depth + enough;
        const Move move = to_surface(field, q, p, step, rise);
        if (move == Move::kFree) {
          release(p);
          return Status::kOk;
        }
        Scalar shorter = Scalar(0.5);
        if (move == Move::kOnSurface) {
          moved = (p - q).norm() < nearer;
          if constexpr (kSmoothNormals<Field>) moved = settles(field, q, p, t, length, moved, shorter);
          if (moved) q_ = q;
        }
        length *= shorter;
      }
      if (!moved) return Status::kOk;
    }
    // Two moves that led on: it lags. In a corner they lead to and fro, and nowhere.
    return (q_ - last_but_one).norm() > step ? Status::kWorkBound : Status::kOk;
  }

  // Smooth normals are not quite those of the surface of voxels, whose ripple the proxy has to climb to where the
  // normal faces the probe. So a move counts by what it leaves to slide, and by coming nearer only while it leads on:
  // a move too far is shortened to where the two slides would meet.
  template <PointField Field>
  [[nodiscard]] bool settles(const Field& field, const Vec3<Scalar>& q, const Vec3<Scalar>& p, const Vec3<Scalar>& t,
                             Scalar length, bool nearer, Scalar& shorter) const noexcept {
    Vec3<Scalar> n = n_;
    static_cast<void>(field.normal(q, n));
    const Vec3<Scalar> d = p - q;
    const Scalar depth = -d.dot(n);
    const Vec3<Scalar> left = d + depth * n;
    const Scalar tangential = t.norm();
    if (depth > Scalar(0) && left.norm() <= tangential - kProgress * length) return true;
    const Scalar on = left.dot(t) / tangential;
    if (on < Scalar(0)) shorter = std::max(Scalar(0.1), std::min(shorter, tangential / (tangential - on)));
    return nearer && !(on < Scalar(0));
  }

  // Puts q back just outside the surface along the normal; where the surface falls away, on toward the probe. A surface
  // higher than `rise` is too high for the move to be kept, and where it is its height is not sought: a proxy that
  // nothing moves is turned down so four times a tick.
  template <PointField Field>
  Move to_surface(const Field& field, Vec3<Scalar>& q, const Vec3<Scalar>& p, Scalar step, Scalar rise) const noexcept {
    const Scalar reach = Scalar(2) * step;
    const Scalar at_q = field.value(q);
    if (at_q >= Scalar(0)) {
      if (rise <= step && field.value(q + rise * n_) >= Scalar(0)) return Move::kTooHigh;
      const Vec3<Scalar> out = q + reach * n_;
      const auto hit = first_crossing(field, q, at_q, out, step, 8);
      if (!hit.found) return Move::kTooHigh;
      q += hit.after * (out - q);
      return Move::kOnSurface;
    }
    const Vec3<Scalar> in = q - reach * n_;
    auto hit = next_surface(field, q, at_q, in, step, kFinest);
    if (hit.found) {
      q += hit.before * (in - q);
      return Move::kOnSurface;
    }
    hit = next_surface(field, q, at_q, p, step, options_.path_steps);
    if (!hit.found) return Move::kFree;
    q += hit.before * (p - q);
    return Move::kOnSurface;
  }

  // Out of bone: along the normal if there is one, else along the nearest exit of 14 directions, at most 32 voxels.
  template <PointField Field>
  bool project_out(const Field& field, Vec3<Scalar>& q) noexcept {
    const Scalar voxel = field.voxel();
    const Scalar reach = Scalar(32) * voxel;
    const auto exit_along = [&](const Vec3<Scalar>& n) {
      return first_crossing(field, q, Vec3<Scalar>(q + reach * n), voxel / Scalar(2), 64);
    };
    Vec3<Scalar> best = Vec3<Scalar>::Zero();
    Scalar nearest = Scalar(2);
    Vec3<Scalar> n;
    if (field.normal(q, n)) {
      const auto hit = exit_along(n);
      if (hit.found) {
        best = n;
        nearest = hit.after;
      }
    }
    const bool by_normal = nearest <= Scalar(1);
    for (int i = 0; i < 14 && !by_normal; ++i) {
      const Vec3<Scalar> way = direction(i);
      const auto hit = exit_along(way);
      if (hit.found && hit.after < nearest) {
        best = way;
        nearest = hit.after;
      }
    }
    if (nearest > Scalar(1)) return false;
    q += (nearest * reach) * best;
    if (!field.normal(q, n_)) n_ = best;
    return true;
  }

  // Six faces and eight corners of a cube.
  [[nodiscard]] static Vec3<Scalar> direction(int i) noexcept {
    Vec3<Scalar> d = Vec3<Scalar>::Zero();
    if (i < 6) {
      d[i / 2] = i % 2 == 0 ? Scalar(1) : Scalar(-1);
      return d;
    }
    const Scalar s = Scalar(0.57735026918962576);
    const int corner = i - 6;
    return {(corner & 1) != 0 ? s : -s, (corner & 2) != 0 ? s : -s, (corner & 4) != 0 ? s : -s};
  }

  ProxyOptions options_;
  [[no_unique_address]] FrictionLaw friction_;
  State state_ = State::kNone;
  bool sticking_ = false;
  bool has_probe_ = false;
  Vec3<Scalar> probe_ = Vec3<Scalar>::Zero();
  Vec3<Scalar> q_ = Vec3<Scalar>::Zero();
  Vec3<Scalar> n_ = Vec3<Scalar>::Zero();
};

}  // namespace trephine
