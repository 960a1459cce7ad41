// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/core/square_roots.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/tool/outline_piece.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// Outline of a surface of revolution in the half plane (ρ, z): lines and circular arcs from the tip up to the handle's
/// end [m]. The radius ρ is a function of the height z, so pieces ascend or are level. The body lies between the
/// outline and the axis. The distance is exact, inside and outside.
/// \code
/// ToolOutline bullet(0, -2e-3);  // foremost point, on the axis
/// bullet.arc_to(2e-3, 0, 0, 0);  // a quarter of a ball
/// bullet.line_to(2e-3, 8e-3).line_to(1e-3, 8e-3).line_to(1e-3, 40e-3).close();
/// \endcode
/// No allocation: an outline is a value. Construction throws std::invalid_argument; evaluation is noexcept.
class ToolOutline {
 public:
  static constexpr std::size_t kMaxPieces = 24;

  using Place = OutlinePlace;
  using Piece = OutlinePiece;

  /// Starts at height z [m]. If ρ > 0 the body begins with a flat end.
  ToolOutline(double rho, double z) : low_(z), rho_(0), z_(z) {
    check_point(rho, z);
    if (rho > 0) line_to(rho, z);
  }

  /// Adds a straight piece. A piece shorter than 1 nm is left out. With a `rounding` [m] an arc of this radius replaces
  /// the corner between the last piece, a straight one, and this one; the corner must bulge outward.
  ToolOutline& line_to(double rho, double z, double rounding = 0) {
    check_point(rho, z);
    if (rounding != 0) round_corner(rho, z, rounding);
    const double length = std::hypot(rho - rho_, z - z_);
    if (length > kShortest) add(Piece::line(rho_, z_, rho, z));
    move_to(rho, z);
    return *this;
  }

  /// Adds an arc about the centre (ρ, z), which must lie equally far from both ends. The arc bulges outward if the
  /// centre's ρ is not larger than those of the ends, and inward if it is not smaller; else the arc is refused.
  ToolOutline& arc_to(double rho, double z, double centre_rho, double centre_z) {
    check_point(rho, z);
    const double radius = std::hypot(rho - centre_rho, z - centre_z);
    if (!(std::abs(std::hypot(rho_ - centre_rho, z_ - centre_z) - radius) <= kSameRadius * radius) ||
        !(radius > kShortest))
      refuse("ToolOutline", "an arc's ends must be equally far from its centre, which is not the case at rho", rho);
    const double side = centre_rho <= std::min(rho, rho_) + kShortest ? 1.0 : -1.0;
    if (side < 0 && !(centre_rho >= std::max(rho, rho_) - kShortest))
      refuse("ToolOutline", "an arc's centre must lie on one side of it, got rho", centre_rho);
    if (std::hypot(rho - rho_, z - z_) > kShortest)
      add({.rho = rho_,
           .z = z_,
           .end_rho = rho,
           .end_z = z,
           .centre_rho = centre_rho,
           .centre_z = centre_z,
           .radius = radius,
           .side = side});
    move_to(rho, z);
    return *this;
  }

  /// Ends the body with a flat end at the last height, if it does not end on the axis. Call it last.
  ToolOutline& close() {
    if (rho_ > 0) line_to(0, z_);
    if (!(z_ > low_)) refuse("ToolOutline", "the outline must ascend, it ends at z", z_);
    closed_ = true;
    return *this;
  }

  /// The pieces, from the tip up.
  [[nodiscard]] std::span<const Piece> pieces() const noexcept { return {pieces_.data(), count_}; }
  /// The same without a flat end at the top.
  [[nodiscard]] std::span<const Piece> sides() const noexcept {
    return {pieces_.data(), count_ > 0 && is_top(pieces_[count_ - 1]) ? count_ - 1 : count_};
  }
  [[nodiscard]] bool is_closed() const noexcept { return closed_; }
  [[nodiscard]] double z_low() const noexcept { return low_; }
  [[nodiscard]] double z_high() const noexcept { return z_; }
  /// ρ where the last piece ends [m].
  [[nodiscard]] double rho_high() const noexcept { return rho_; }
  /// Largest ρ [m].
  [[nodiscard]] double largest_radius() const noexcept { return largest_; }

  /// ρ of the outline at height z [m]: the smallest, where a level piece has several. 0 beyond the ends.
  [[nodiscard]] double radius_at(double z) const noexcept { return smallest_radius(z, z); }

  /// Smallest ρ between two heights [m]; 0 if an end of the body lies between them.
  [[nodiscard]] double smallest_radius(double from, double to) const noexcept {
    if (!(from > low_) || !(to < z_)) return 0;
    double least = std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < count_; ++i) {
      const Piece& p = pieces_[i];
      if (p.end_z < from || p.z > to) continue;
      const double lo = std::max(p.z, from), hi = std::min(p.end_z, to);
      least = std::min({least, p.radius_at(lo), p.radius_at(hi)});
      if (p.side < 0 && lo < p.centre_z && p.centre_z < hi) least = std::min(least, p.centre_rho - p.radius);
    }
    return least;
  }

  /// Length of the outline from the foremost point, without a flat end at the top [m].
  [[nodiscard]] double side_length() const noexcept {
    double length = 0;
    for (const Piece& p : sides()) length += p.length_along();
    return length;
  }
  /// The place this length [m] along the outline from the foremost point, at most `side_length()`.
  [[nodiscard]] Place place_at(double length) const noexcept {
    const std::span<const Piece> all = sides();
    std::size_t i = 0;
    for (; i + 1 < all.size() && length > all[i].length_along(); ++i) length -= all[i].length_along();
    return all[i].place_at(std::clamp(length, 0.0, all[i].length_along()));
  }

  /// Area of the body's surface between two lengths [m] along the outline [m²].
  [[nodiscard]] double area(double from, double to) const noexcept {
    double sum = 0;
    for (const Piece& p : sides()) {
      const double whole = p.length_along();
      if (from < whole && to > 0) sum += p.area(std::max(from, 0.0), std::min(to, whole));
      from -= whole;
      to -= whole;
    }
    return sum;
  }

  /// Largest distance of the body between two heights from the axis' point at a third height [m].
  [[nodiscard]] double largest_distance(double from, double to, double centre) const noexcept {
    double most = 0;
    for (const Piece& p : pieces()) {
      if (p.end_z < from || p.z > to) continue;
      const auto offer = [&](double rho, double z) { most = std::max(most, std::hypot(rho, z - centre)); };
      p.z < from ? offer(p.radius_at(from), from) : offer(p.rho, p.z);
      p.end_z > to ? offer(p.radius_at(to), to) : offer(p.end_rho, p.end_z);
      const double away = std::hypot(p.centre_rho, p.centre_z - centre);
      if (!(p.side > 0) || !(away > 0) || !(p.centre_rho >= 0)) continue;
      const double z = p.centre_z + p.radius * (p.centre_z - centre) / away;
      if (std::max(p.z, from) < z && z < std::min(p.end_z, to)) most = std::max(most, away + p.radius);
    }
    return most;
  }

  /// The body below a height, with a flat end there: the part of a tool that cuts.
  [[nodiscard]] ToolOutline below(double z) const {
    ToolOutline out(0, low_);
    for (std::size_t i = 0; i < count_ && !(out.z_ >= z && i > 0 && pieces_[i].z >= z); ++i) {
      Piece p = pieces_[i];
      if (p.end_z > z) {
        p.end_rho = p.radius_at(z);
        p.end_z = z;
      }
      if (p.side != 0)
        out.arc_to(p.end_rho, p.end_z, p.centre_rho, p.centre_z);
      else
        out.line_to(p.end_rho, p.end_z);
    }
    return out.close();
  }

  /// The height up to which the outline goes on at the largest radius, parallel to the axis, from a height on it [m].
  [[nodiscard]] double widest_to(double z) const noexcept {
    for (const Piece& p : sides())
      if (p.side == 0 && std::min(p.rho, p.end_rho) >= largest_ - kShortest && p.z <= z && z < p.end_z) z = p.end_z;
    return z;
  }
  /// The body with its flat end moved up parallel to the axis [m]. The body it was cut from goes on there.
  [[nodiscard]] ToolOutline raised(double by) const noexcept {
    ToolOutline out(*this);
    const double rho = pieces_[count_ - 1].rho;
    --out.count_;
    out.append(Piece::line(rho, z_, rho, z_ + by));
    out.append(Piece::line(rho, z_ + by, 0, z_ + by));
    out.z_ += by;
    return out;
  }

  /// Signed distance of a point [m], negative inside.
  [[nodiscard]] double signed_distance(double rho, double z) const noexcept {
    const std::array<double, 1> r{rho}, h{z};
    std::array<double, 1> out;
    distances(r, h, out);
    return out[0];
  }

  /// Signed distances of some points [m]. Any number of lanes, single or double precision.
  template <RealScalar S, std::size_t kLanes>
  void distances(const std::array<S, kLanes>& rho, const std::array<S, kLanes>& z,
                 std::array<S, kLanes>& __restrict out) const noexcept {
    detail::NearestOnPiece<S, kLanes> nearest(rho, z);
    std::array<S, kLanes> best, inside;
    best.fill(std::numeric_limits<S>::max());
    inside.fill(S(0));
    for (const Piece& p : pieces()) {
      if (nearest.is_beyond(p, best)) continue;
      nearest.find(p);
      for (std::size_t l = 0; l < kLanes; ++l) best[l] = nearest.square[l] < best[l] ? nearest.square[l] : best[l];
      for (std::size_t l = 0; l < kLanes; ++l) inside[l] += nearest.inside[l];
    }
    square_roots(best);
    for (std::size_t l = 0; l < kLanes; ++l) out[l] = inside[l] > S(0) ? -best[l] : best[l];
  }

  /// Distances with gradients and curvatures, see `Profile`.
  void profile(const ProfileLanes<double>& rho, const ProfileLanes<double>& z, Profile& out) const noexcept {
    detail::NearestOnPiece<double, kProfileLanes> nearest(rho, z);
    ProfileLanes<double> best, inside{}, x{}, y{}, bend{}, corner{};
    best.fill(std::numeric_limits<double>::max());
    out.central.fill(0);
    for (const Piece& p : pieces()) {
      if (nearest.is_beyond(p, best)) continue;
      nearest.find(p);
      const double is_central = p.centre_rho == 0 && p.centre_z == 0 && p.side > 0 ? 1.0 : 0.0;
      ProfileLanes<double> own_x, own_y, own_bend, central;
      if (p.side != 0) {
        for (std::size_t l = 0; l < kProfileLanes; ++l) {
          const double per = p.side / std::max(nearest.to_centre[l], kCentre);
          own_x[l] = nearest.at_end[l] > 0 ? nearest.rho[l] : (rho[l] - p.centre_rho) * per;
          own_y[l] = nearest.at_end[l] > 0 ? nearest.z[l] : (z[l] - p.centre_z) * per;
          own_bend[l] = per;
          central[l] = nearest.at_end[l] > 0 ? 0.0 : is_central;
        }
      } else {
        for (std::size_t l = 0; l < kProfileLanes; ++l) {
          own_x[l] = nearest.at_end[l] > 0 ? nearest.rho[l] : p.along_z;
          own_y[l] = nearest.at_end[l] > 0 ? nearest.z[l] : -p.along_rho;
          own_bend[l] = 0;
          central[l] = 0;
        }
      }
      // Where two pieces meet smoothly, the inner part of one counts, not the end of the other.
      // Weights of 0 and 1 instead of choices, as in `BallAndShaft`.
      ProfileLanes<double> square, nearer;
      for (std::size_t l = 0; l < kProfileLanes; ++l) square[l] = nearest.square[l] * (1 + kAtEnd * nearest.at_end[l]);
      for (std::size_t l = 0; l < kProfileLanes; ++l) nearer[l] = square[l] < best[l] ? 1.0 : 0.0;
      for (std::size_t l = 0; l < kProfileLanes; ++l) best[l] = square[l] < best[l] ? square[l] : best[l];
      const auto choose = [&](ProfileLanes<double>& chosen, const ProfileLanes<double>& own) {
        for (std::size_t l = 0; l < kProfileLanes; ++l) chosen[l] = nearer[l] * own[l] + (1 - nearer[l]) * chosen[l];
      };
      choose(x, own_x);
      choose(y, own_y);
      choose(bend, own_bend);
      choose(corner, nearest.at_end);
      choose(out.central, central);
      for (std::size_t l = 0; l < kProfileLanes; ++l) inside[l] += nearest.inside[l];
    }
    square_roots(best);
    ProfileLanes<double> sign, divisor;
    for (std::size_t l = 0; l < kProfileLanes; ++l) sign[l] = inside[l] > 0 ? -1.0 : 1.0;
    for (std::size_t l = 0; l < kProfileLanes; ++l) divisor[l] = best[l] > kCentre ? best[l] : kCentre;
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const double per = sign[l] / divisor[l], length = corner[l] * per + (1 - corner[l]);
      out.distance[l] = sign[l] * best[l];
      out.normal_rho[l] = x[l] * length;
      out.normal_z[l] = y[l] * length;
      out.curvature[l] = corner[l] * per + (1 - corner[l]) * bend[l];
    }
  }

 private:
  friend ToolOutline with_sharper_rims(const ToolOutline& outline, double h) noexcept;

  static constexpr double kShortest = 1e-9;        // [m]
  static constexpr double kSameRadius = 1e-6;      // an arc's ends, relative to its radius
  static constexpr double kCentre = 1e-9;          // [m] below it a gradient has no direction
  static constexpr double kSameDirection = 1e-12;  // of the cosine between two lines
  static constexpr double kAtEnd = 1e-12;          // a rounding error's part of a squared distance

  /// Appends a piece that begins where the last one ends. A straight one that goes on lengthens it.
  void append(const Piece& p) noexcept {
    if (count_ > 0 && p.side == 0) {
      Piece& last = pieces_[count_ - 1];
      if (last.side == 0 && last.along_rho * p.along_rho + last.along_z * p.along_z > 1 - kSameDirection) {
        last = Piece::line(last.rho, last.z, p.end_rho, p.end_z);
        return;
      }
    }
    pieces_[count_++] = p;
  }
  /// Whether a piece is a flat end at the top.
  [[nodiscard]] bool is_top(const Piece& p) const noexcept {
    return p.side == 0 && p.z == p.end_z && p.end_rho == 0 && p.end_z == z_;
  }

  void check_point(double rho, double z) const {
    if (closed_) refuse("ToolOutline", "a closed outline has no further piece, got z", z);
    if (!(rho >= 0) || !is_finite(rho)) refuse("ToolOutline", "rho must be >= 0 m", rho);
    refuse_beyond("ToolOutline", "rho", kLargestRadius, rho);
    if (!(z >= z_) || !is_finite(z)) refuse("ToolOutline", "heights must not descend, got z", z);
    refuse_beyond("ToolOutline", "z", kLongestShaft, std::abs(z));
  }
  /// Shortens the last line and adds the arc that leads on toward (ρ, z).
  void round_corner(double rho, double z, double r) {
    const double length = std::hypot(rho - rho_, z - z_);
    if (count_ == 0 || pieces_[count_ - 1].side != 0 || !(length > kShortest))
      refuse("ToolOutline", "only a corner between two lines can be rounded, got rho", rho_);
    Piece& last = pieces_[count_ - 1];
    const double b_rho = (rho - rho_) / length, b_z = (z - z_) / length;
    const double cross = last.along_rho * b_z - last.along_z * b_rho, dot = last.along_rho * b_rho + last.along_z * b_z;
    if (!(cross > 0)) refuse("ToolOutline", "a rounded corner must bulge outward, got rho", rho_);
    const double cut = r * cross / (1 + dot);  // r tan(half the turn)
    if (!(r > 0) || !(cut < last.length) || !(cut < length))
      refuse("ToolOutline", "a rounding must fit both lines and be > 0 m", r);
    last.length -= cut;
    last.end_rho -= cut * last.along_rho;
    last.end_z -= cut * last.along_z;
    move_to(last.end_rho, last.end_z);
    const double centre_rho = rho_ - r * last.along_z, centre_z = z_ + r * last.along_rho;
    arc_to(centre_rho + r * b_z, centre_z - r * b_rho, centre_rho, centre_z);
  }
  void move_to(double rho, double z) noexcept {
    rho_ = rho;
    z_ = z;
  }
  void add(Piece p) {
    if (count_ == kMaxPieces)
      refuse("ToolOutline", "an outline has at most 24 pieces; the next one ends at z", p.end_z);
    if (p.side != 0) {
      // From the centre across the chord, to the side that the arc bulges to.
      const double a = p.end_rho - p.rho, b = p.end_z - p.z, length = std::hypot(a, b);
      p.middle_rho = p.side * b / length;
      p.middle_z = -p.side * a / length;
      p.cosine = ((p.rho - p.centre_rho) * p.middle_rho + (p.z - p.centre_z) * p.middle_z) / p.radius;
    }
    pieces_[count_++] = p;
    largest_ = 0;
    for (std::size_t i = 0; i < count_; ++i) largest_ = std::max(largest_, pieces_[i].largest_radius());
  }

  double low_;
  double rho_, z_;  // end of the last piece
  double largest_ = 0;
  bool closed_ = false;
  std::size_t count_ = 0;
  std::array<Piece, kMaxPieces> pieces_{};
};

}  // namespace trephine
