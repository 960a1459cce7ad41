// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Signed distance to the nearest structure's surface.
struct NearestStructure {
  double distance;  ///< [m], negative inside of the structure
  int structure;    ///< its number, from 0; -1 at a point that is not finite
};

/// The part of a line from a point to where it leaves the point's cell of eight samples.
struct LinePiece {
  double distance = 0;  ///< signed, at the point [m]
  double length = 0;    ///< of the part [m]
  double least = 0;     ///< least distance on the part [m] ...
  double at = 0;        ///< ... and its place, from the point [m]
  bool valid = false;   ///< false if the point is not finite
};

namespace detail {

/// Samples of one structure's distance in sparse bricks.
struct DistanceBand {
  static constexpr std::int32_t kOutside = -1;  // no brick: beyond reach, outside of the structure
  static constexpr std::int32_t kInside = -2;   // no brick: beyond reach, inside
  static constexpr std::int32_t kShared = -3;   // a brick whose samples follow from those of the nearest structure
  std::array<int, 3> first{};                   // brick coordinates of the table's first entry
  std::array<int, 3> count{};                   // bricks in the table along each axis
  std::vector<std::int32_t> table;              // number of a brick's own samples, x fastest
  std::vector<std::array<int, 3>> bricks;       // brick coordinates
  std::vector<std::int16_t> samples;            // 512 a brick that has its own [quanta]

  [[nodiscard]] std::int32_t brick(int bx, int by, int bz) const noexcept {
    const int x = bx - first[0], y = by - first[1], z = bz - first[2];
    if (x < 0 || y < 0 || z < 0 || x >= count[0] || y >= count[1] || z >= count[2]) return kOutside;
    return table[entry({bx, by, bz})];
  }
  /// Place in the table of a brick that it has.
  [[nodiscard]] std::size_t entry(const std::array<int, 3>& at) const noexcept {
    const auto along = [&](std::size_t a) { return static_cast<std::size_t>(at[a] - first[a]); };
    return along(0) + static_cast<std::size_t>(count[0]) * (along(1) + static_cast<std::size_t>(count[1]) * along(2));
  }
};

/// What a builder hands to a StructureField.
struct StructureFieldParts {
  std::array<int, 3> size{};  // of the label volume
  Vec3d spacing = Vec3d::Zero();
  double quantum = 0;
  double reach = 0;
  std::vector<std::int16_t> distance;   // (size + 2)³ samples from voxel (-1, -1, -1), x fastest [quanta]
  std::vector<std::uint8_t> structure;  // the same samples: the nearest structure
  std::vector<DistanceBand> bands;      // by structure

  /// Number of sample (i, j, k), each from -1 to the size along its axis.
  [[nodiscard]] std::size_t index(int i, int j, int k) const noexcept {
    return static_cast<std::size_t>(i + 1) +
           static_cast<std::size_t>(size[0] + 2) *
               (static_cast<std::size_t>(j + 1) +
                static_cast<std::size_t>(size[1] + 2) * static_cast<std::size_t>(k + 1));
  }
  /// Distance of a structure [quanta] in a brick that shares its samples: beyond reach where another one is nearer.
  [[nodiscard]] std::int16_t shared(std::uint8_t of, int i, int j, int k) const noexcept {
    const std::size_t n = index(i, j, k);
    return structure[n] == of ? distance[n] : std::numeric_limits<std::int16_t>::max();
  }
};

}  // namespace detail

/// Signed distances to structures that must not be cut. `build_structure_field` makes it from labels.
///
/// Frame S: the centre of voxel (i, j, k) of the labels lies at `spacing * (i, j, k)`. Distances are in metres,
/// negative inside of a structure. Samples are 16-bit multiples of `quantum`, which is 1/256 of the longest spacing.
/// They are clamped at ±127.99 longest spacings. A structure ends where the volume ends.
///
/// Memory: 3 bytes a voxel for the nearest structure, and 1 KiB for each brick of 8³ samples within reach of a
/// structure and of another that is nearer. Immutable: any number of threads may look up at a time. Lookups take no
/// memory and do not throw.
class StructureField {
 public:
  static constexpr int kBrick = 8;  ///< edge of a brick [samples]

  explicit StructureField(detail::StructureFieldParts parts) noexcept : parts_(std::move(parts)) {
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      per_metre_[axis] = 1 / parts_.spacing[axis];
      last_[axis] = parts_.size[a] + 1;
      pitch_[a] = a == 0 ? 1 : pitch_[a - 1] * static_cast<std::size_t>(parts_.size[a - 1] + 2);
    }
  }

  [[nodiscard]] std::array<int, 3> size() const noexcept { return parts_.size; }  ///< of the label volume [voxels]
  [[nodiscard]] const Vec3d& spacing() const noexcept { return parts_.spacing; }  ///< [m]
  [[nodiscard]] double quantum() const noexcept { return parts_.quantum; }        ///< step of a stored distance [m]
  [[nodiscard]] double reach() const noexcept { return parts_.reach; }            ///< half width of the bands [m]
  [[nodiscard]] int structures() const noexcept { return static_cast<int>(parts_.bands.size()); }
  [[nodiscard]] std::size_t bytes() const noexcept {
    std::size_t sum = parts_.distance.size() * sizeof(std::int16_t) + parts_.structure.size();
    for (const auto& b : parts_.bands)
      sum += b.table.size() * sizeof(std::int32_t) + b.bricks.size() * sizeof(b.bricks[0]) +
             b.samples.size() * sizeof(std::int16_t);
    return sum;
  }

  /// Signed distance at p_S [m] to the nearest structure's surface, trilinear between samples, and the structure that
  /// is nearest to the nearest sample.
  ///
  /// Beyond the volume: the root of the sum of squares of the distance from the volume and the distance at the volume's
  /// nearest point. It is a lower bound, because every structure lies in the volume and the volume is convex.
  [[nodiscard]] NearestStructure nearest(const Vec3d& p_S) const noexcept {
    Cell c;
    if (!locate(p_S, c)) return {0, -1};
    return {beyond(interpolate(c), c), parts_.structure[c.nearest]};
  }

  /// The same, and the gradient at p_S, of about unit length: the direction of increasing distance.
  [[nodiscard]] NearestStructure nearest(const Vec3d& p_S, Vec3d& gradient) const noexcept {
    Cell c;
    gradient.setZero();
    if (!locate(p_S, c)) return {0, -1};
    const double inside = interpolate(c), d = beyond(inside, c);
    slope(c, gradient);
    if (c.beyond.squaredNorm() > 0) {
      for (Eigen::Index a = 0; a < 3; ++a)
        if (c.beyond[a] != 0) gradient[a] = 0;
      gradient = d > 0 ? Vec3d((inside * gradient + c.beyond) / d) : Vec3d(c.beyond.normalized());
    }
    return {d, parts_.structure[c.nearest]};
  }

  /// Least distance on the line from p_S in the unit direction `u_S`, as far as it stays in a cell, and at most `reach`
  /// [m] far: exact for the trilinear interpolant in the volume. It is not computed, but is the distance at p_S, where
  /// it cannot be below `bound` [m] by `slack()`. Beyond the volume the part ends after four of the longest spacings,
  /// or where the volume's nearest point leaves its cell, and a cubic through four points gives the least distance.
  [[nodiscard]] LinePiece line_piece(const Vec3d& p_S, const Vec3d& u_S, double reach, double bound) const noexcept {
    Cell c;
    if (!locate(p_S, c)) return {};
    LinePiece piece{.distance = beyond(interpolate(c), c), .length = kLongestPiece * longest(), .valid = true};
    piece.least = piece.distance;
    Vec3d rate = u_S.cwiseProduct(per_metre_), outward = Vec3d::Zero();
    for (Eigen::Index a = 0; a < 3; ++a) {
      double travel = rate[a] > 0 ? 1 - c.t[a] : c.t[a], speed = std::abs(rate[a]);
      if (c.beyond[a] != 0) {  // the volume's nearest point does not move along this axis
        outward[a] = u_S[a];
        rate[a] = 0;
        travel = std::abs(c.beyond[a]);
        speed = -std::copysign(u_S[a], u_S[a] * c.beyond[a]);
      }
      if (travel < speed * piece.length) piece.length = travel / speed;
    }
    piece.length = std::min(piece.length, reach);
    if (piece.distance - bound <= piece.length + slack()) least_on(c, rate, outward, piece);
    return piece;
  }

  /// Most by which distances at two points differ beyond the points' own distance [m]: a quarter of the longest
  /// spacing.
  [[nodiscard]] double slack() const noexcept { return kSlack * longest(); }

  /// Signed distance at p_S [m] to the surface of `structure`, in [0, structures()), clamped to ±reach(). Trilinear
  /// between samples. 0 at a point that is not finite.
  [[nodiscard]] double distance(int structure, const Vec3d& p_S) const noexcept {
    Corners d;
    Vec3d t;
    if (!corners(structure, p_S, d, t)) return 0;
    return std::clamp(trilinear(d, t), -reach(), reach());
  }

  /// The same, and the gradient at p_S; zero where the distance is clamped.
  [[nodiscard]] double distance(int structure, const Vec3d& p_S, Vec3d& gradient) const noexcept {
    Corners d;
    Vec3d t;
    gradient.setZero();
    if (!corners(structure, p_S, d, t)) return 0;
    const double v = trilinear(d, t);
    if (!(std::abs(v) < reach())) return std::clamp(v, -reach(), reach());
    trilinear_slope(d, t, gradient);
    return v;
  }

  /// True if p_S is nearer than reach() to the surface of `structure`, from either side.
  [[nodiscard]] bool reaches(int structure, const Vec3d& p_S) const noexcept {
    return std::abs(distance(structure, p_S)) < reach();
  }

  /// Bricks of 8³ samples of `structure`, and the first sample (i, j, k) of one by its number: multiples of 8, possibly
  /// negative. Every sample nearer than reach() is in a brick.
  [[nodiscard]] std::size_t brick_count(int structure) const noexcept { return band(structure).bricks.size(); }
  [[nodiscard]] std::array<int, 3> brick(int structure, std::size_t number) const noexcept {
    const auto& at = band(structure).bricks[number];
    return {at[0] * kBrick, at[1] * kBrick, at[2] * kBrick};
  }

  /// Calls `visit(structure)` for each structure with samples in the brick of sample (i, j, k), in ascending order.
  template <class Visit>
  void structures_near(int i, int j, int k, const Visit& visit) const {
    for (int s = 0; s < structures(); ++s)
      if (const std::int32_t n = band(s).brick(i >> kShift, j >> kShift, k >> kShift);
          n >= 0 || n == detail::DistanceBand::kShared)
        visit(s);
  }

  /// Signed distance of `structure` at sample (i, j, k), at `spacing * (i, j, k)` [m]; ±reach() beyond the band.
  [[nodiscard]] double sample(int structure, int i, int j, int k) const noexcept {
    const detail::DistanceBand& b = band(structure);
    const std::int32_t n = b.brick(i >> kShift, j >> kShift, k >> kShift);
    if (n == detail::DistanceBand::kOutside) return reach();
    if (n == detail::DistanceBand::kInside) return -reach();
    const double d = n == detail::DistanceBand::kShared
                         ? parts_.shared(static_cast<std::uint8_t>(structure), i, j, k)
                         : b.samples[static_cast<std::size_t>(n) * kSamples + offset(i, j, k)];
    return std::clamp(d * parts_.quantum, -reach(), reach());
  }

 private:
  static constexpr int kShift = 3;  // log2 of kBrick
  static constexpr std::size_t kSamples = static_cast<std::size_t>(kBrick) * kBrick * kBrick;
  static constexpr double kQuanta = 256;      // in the longest spacing
  static constexpr double kSlack = 0.25;      // [longest spacings]
  static constexpr double kLongestPiece = 4;  // of a line [longest spacings]: more than a cell's diagonal
  static constexpr double kFarthest = 1e9;    // [samples] coordinates beyond it give no structure

  /// The eight samples about a point, of which 1 counts as `t` along an axis.
  using Corners = std::array<double, 8>;

  /// A point among the samples of the nearest structure.
  struct Cell {
    std::size_t base, nearest;  // samples: the cell's first, and the one nearest to the point
    Vec3d t;                    // place in the cell, 0 to 1
    Vec3d beyond;               // from the samples' box to the point [m]
    Corners d;                  // the cell's samples [quanta]
  };

  [[nodiscard]] double longest() const noexcept { return kQuanta * parts_.quantum; }  // spacing [m]
  [[nodiscard]] const detail::DistanceBand& band(int structure) const noexcept {
    return parts_.bands[static_cast<std::size_t>(structure)];
  }

  [[nodiscard]] bool locate(const Vec3d& p_S, Cell& c) const noexcept {
    c.base = 0;
    c.nearest = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      const double u = p_S[axis] * per_metre_[axis] + 1;
      if (!(std::abs(u) < kFarthest)) return false;
      const double inside = std::clamp(u, 0.0, last_[axis]);
      const int i = std::min(static_cast<int>(inside), static_cast<int>(last_[axis]) - 1);
      c.t[axis] = inside - i;
      c.beyond[axis] = (u - inside) * parts_.spacing[axis];
      c.base += static_cast<std::size_t>(i) * pitch_[a];
      c.nearest += static_cast<std::size_t>(c.t[axis] < 0.5 ? i : i + 1) * pitch_[a];
    }
    const std::int16_t* const first = parts_.distance.data() + c.base;
    for (std::size_t n = 0; n < 8; ++n) c.d[n] = first[(n & 1) + (n >> 1 & 1) * pitch_[1] + (n >> 2) * pitch_[2]];
    return true;
  }
  [[nodiscard]] double interpolate(const Cell& c) const noexcept { return trilinear(c.d, c.t) * parts_.quantum; }
  void slope(const Cell& c, Vec3d& gradient) const noexcept {
    trilinear_slope(c.d, c.t, gradient);
    gradient *= parts_.quantum;
  }
  [[nodiscard]] static double beyond(double inside, const Cell& c) noexcept {
    const double square = c.beyond.squaredNorm();
    return square > 0 ? std::sqrt(square + inside * inside) : inside;
  }

  /// Fills in the least distance on a piece of a line. Its place moves by `rate` cells a metre, and beyond the volume
  /// by `outward` metres a metre. The interpolant is a cubic on it.
  void least_on(const Cell& c, const Vec3d& rate, const Vec3d& outward, LinePiece& piece) const noexcept {
    const auto value = [&](double share) {
      const double travel = share * piece.length;
      const double inside = trilinear(c.d, Vec3d(c.t + travel * rate)) * parts_.quantum;
      const double square = (c.beyond + travel * outward).squaredNorm();
      return square > 0 ? std::sqrt(square + inside * inside) : inside;
    };
    const double v0 = piece.distance, v1 = value(1.0 / 3), v2 = value(2.0 / 3), v3 = value(1);
    const auto offer = [&](double share, double v) {
      if (!(v < piece.least)) return;
      piece.least = v;
      piece.at = share * piece.length;
    };
    offer(1, v3);
    // v = v0 + a x + b x² + e x³ with x = 3 share; extrema where a + 2 b x + 3 e x² = 0.
    const double first = v1 - v0, second = v2 - 2 * v1 + v0, third = v3 - 3 * v2 + 3 * v1 - v0;
    const double a = first - second / 2 + third / 3, b = second / 2 - third / 2, e = third / 6;
    const double root = b * b - 3 * a * e;
    if (!(root >= 0)) return;
    // The minimum: where the slope rises through 0.
    const double down = b + std::sqrt(root);
    const double x = b > 0 ? -a / down : (e != 0 ? (std::sqrt(root) - b) / (3 * e) : -1.0);
    if (x > 0 && x < 3) offer(x / 3, v0 + x * (a + x * (b + x * e)));
  }

  [[nodiscard]] static double trilinear(const Corners& d, const Vec3d& t) noexcept {
    const double x0 = d[0] + t.x() * (d[1] - d[0]), x1 = d[2] + t.x() * (d[3] - d[2]);
    const double x2 = d[4] + t.x() * (d[5] - d[4]), x3 = d[6] + t.x() * (d[7] - d[6]);
    const double y0 = x0 + t.y() * (x1 - x0), y1 = x2 + t.y() * (x3 - x2);
    return y0 + t.z() * (y1 - y0);
  }
  void trilinear_slope(const Corners& d, const Vec3d& t, Vec3d& gradient) const noexcept {
    const auto across = [](double a, double b, double c, double e, double u, double v) {
      const double low = a + u * (b - a), high = c + u * (e - c);
      return low + v * (high - low);
    };
    gradient.x() = across(d[1] - d[0], d[3] - d[2], d[5] - d[4], d[7] - d[6], t.y(), t.z()) * per_metre_.x();
    gradient.y() = across(d[2] - d[0], d[3] - d[1], d[6] - d[4], d[7] - d[5], t.x(), t.z()) * per_metre_.y();
    gradient.z() = across(d[4] - d[0], d[5] - d[1], d[6] - d[2], d[7] - d[3], t.x(), t.y()) * per_metre_.z();
  }

  [[nodiscard]] static std::size_t offset(int i, int j, int k) noexcept {
    constexpr int kMask = kBrick - 1;
    return static_cast<std::size_t>((i & kMask) + kBrick * ((j & kMask) + kBrick * (k & kMask)));
  }

  [[nodiscard]] bool corners(int structure, const Vec3d& p_S, Corners& d, Vec3d& t) const noexcept {
    std::array<int, 3> at{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      const double u = p_S[axis] * per_metre_[axis];
      if (!(std::abs(u) < kFarthest)) return false;
      const double low = std::floor(u);
      at[a] = static_cast<int>(low);
      t[axis] = u - low;
    }
    for (std::size_t n = 0; n < 8; ++n)
      d[n] = sample(structure, at[0] + static_cast<int>(n & 1), at[1] + static_cast<int>(n >> 1 & 1),
                    at[2] + static_cast<int>(n >> 2));
    return true;
  }

  detail::StructureFieldParts parts_;
  Vec3d per_metre_ = Vec3d::Zero();
  Vec3d last_ = Vec3d::Zero();  // largest coordinate among the samples
  std::array<std::size_t, 3> pitch_{};
};

}  // namespace trephine
