// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/spatial.hpp>
#include <trephine/render/coupled/broad_phase.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

namespace trephine {

/// Pressure of the foundation at a point that is ψ deep inside the tool, offset outward by `offset`: k times the mean
/// of max(ψ + offset − s, 0) over 0 <= s <= `ramp`. A point stands for a cell of the surface, over which the depth
/// varies by about `ramp` at the rim of a contact. With that mean, forces and stiffnesses are continuous when points
/// come and go, and hardly depend on where the points lie.
struct FoundationLaw {
  double stiffness;   ///< k [N/m³]
  double ramp;        ///< [m], > 0
  double offset = 0;  ///< [m]
};

/// One point of the bone's surface that touches the tool.
struct FoundationPoint {
  Vec3d arm;              ///< from T's origin, in G [m]
  Vec3d normal;           ///< of the tool there, outward: bone pushes the tool along −normal
  double depth;           ///< pressure over k [m]
  double active;          ///< d depth / dψ, from 0 to 1
  double weight;          ///< area that the point stands for [m²]
  std::uint64_t element;  ///< its number (`NearBlock::key`)
  std::size_t sample;     ///< which of the element's points
};

/// The point after a small motion (δp, δθ) of the tool, to first order: its depth may have become 0.
[[nodiscard]] inline FoundationPoint after(FoundationPoint q, const Vec6d& motion) noexcept {
  q.depth = std::max(0.0, q.depth + q.active * with_moment(q.normal, q.arm).dot(motion));
  q.arm -= motion.head<3>();
  return q;
}

/// What contact amounts to at a pose: an energy and its derivatives by a small motion (δp, δθ) of the tool about T's
/// origin, G axes.
struct FoundationSum {
  double energy = 0;                ///< [J]
  Vec6d wrench = Vec6d::Zero();     ///< −∂E: force [N] and torque about T's origin [N·m] on the tool
  Mat6d stiffness = Mat6d::Zero();  ///< Σ k w a J Jᵀ, Gauss and Newton's part of ∂²E: its lower triangle
  Mat6d bending = Mat6d::Zero();    ///< the rest of ∂²E, how the tool's curvature turns the forces: likewise
  Clearance clearance;              ///< of the points that do not touch
  double depth = 0;                 ///< ψ of the deepest point, 0 where none is inside [m]

  [[nodiscard]] bool touches() const noexcept { return energy > 0; }
};

/// An elastic foundation on the bone's surface: E = k Σ w φ(ψ), ψ = −d(X⁻¹ q) how deep the surface point q of area w is
/// inside the tool's signed distance d. With u = max(ψ + offset, 0) and v = max(u − ramp, 0)
///
///     φ = (u³ − v³) / (6 ramp),    f = φ' = (u² − v²) / (2 ramp),    a = φ'' = (u − v) / ramp:
///
/// the pressure k f acts along the tool's normal. One-sided, C², and exactly differentiated twice: with J = (g, r × g),
/// g = ∇d at the arm r,
///
///     ∂E = Σ k w f J,    ∂²E = Σ k w a J Jᵀ − Σ k w f (κ m mᵀ + κ' t tᵀ) + turning,
///
/// m and t the moments of the level surface's principal directions, κ and κ' their curvatures.
class Foundation {
 public:
  /// Points of a element along each side at most.
  static constexpr std::size_t kMostSide = 4;
  static constexpr std::size_t kMostPoints = kMostSide * kMostSide;

  /// `side` points along each side of a element, evenly over it: lattices of points add up best so. At most
  /// `most_points` that touch are kept.
  explicit Foundation(std::size_t side = 2, std::size_t most_points = 0)
      : side_(std::clamp<std::size_t>(side, 1, kMostSide)) {
    points_.reserve(most_points);
  }

  [[nodiscard]] std::size_t side() const noexcept { return side_; }
  /// The points inside the tool that `sum` found last, at most as many as there is room for.
  [[nodiscard]] const std::vector<FoundationPoint>& points() const noexcept { return points_; }
  void clear() noexcept { points_.clear(); }

  template <ToolShape Shape>
  [[nodiscard]] FoundationSum sum(BroadPhase& near, const Shape& shape, const Posed& X,
                                  const FoundationLaw& law) noexcept {
    points_.clear();
    Sums sums;
    Batch batch;
    Candidates candidates;
    const Vec3d p = X.translation(), u = X.linear().col(2), x = X.linear().col(0);
    const Vec3<float> axis = u.template cast<float>();
    const auto touching = static_cast<float>(law.offset) + kRounding;
    float nearest = std::numeric_limits<float>::max();
    const auto add_candidates = [&] {
      add(candidates, shape, law, u, x, sums);
      candidates.count = 0;
    };
    const auto sort_out = [&] {
      batch.measure(shape, side_, axis);
      for (std::size_t n = 0; n < batch.count; ++n) {
        if (!(batch.least[n] < touching)) {
          nearest = std::min(nearest, batch.least[n] - touching);
          continue;
        }
        const auto [block, i] = batch.element[n];
        const SurfaceElement element = block->element(i);
        for (std::size_t j = 0; j < side_ * side_; ++j) {
          if (!(batch.distance[j][n] < touching)) continue;
          candidates.add(element, block->key(i), side_, j, p);
          if (candidates.count == kProfileLanes) add_candidates();
        }
      }
      batch.count = 0;
    };
    const Clearance others = near.for_each_touching(
        shape, X, place(side_ - 1, side_), [&](const NearBlock& block, std::size_t i, const Vec3<float>& shift) {
          batch.add(block, i, shift);
          if (batch.count == Batch::kSize) sort_out();
        });
    if (batch.count > 0) sort_out();
    if (candidates.count > 0) add_candidates();
    FoundationSum s = sums.total();
    s.clearance = others;
    s.clearance.near = std::max(0.0, std::min(static_cast<double>(nearest), others.near));
    return s;
  }

 private:
  /// What is nearer outside than this [m] is looked at in double precision.
  static constexpr float kRounding = 1e-8F;
  static constexpr double kOnAxis = 1e-9;  // [m]: nearer there is no direction away from the axis
  using Lanes = ProfileLanes<double>;

  /// Where row i of `side` lies [half sides].
  static constexpr double place(std::size_t i, std::size_t side) noexcept {
    return (2.0 * static_cast<double>(i) + 1 - static_cast<double>(side)) / static_cast<double>(side);
  }

  /// Elements whose points' distances from the tool are found together, in single precision, to leave out those that
  /// are outside. A point is r + i a + j c with r the arm of the element and a, c its sides, so that its height and its
  /// distance from the axis follow from theirs and from products of what of them is square to the axis.
  struct Batch {
    static constexpr std::size_t kSize = 2 * kProfileLanes;
    using Floats = std::array<float, kSize>;
    std::size_t count = 0;
    std::array<Floats, 3> position, along, across;
    std::array<Floats, kMostPoints> distance;
    Floats least;  // of a element's points
    std::array<std::pair<const NearBlock*, std::size_t>, kSize> element;

    void add(const NearBlock& block, std::size_t i, const Vec3<float>& shift) noexcept {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        position[axis][count] = block.elements->position[axis][i] + shift[static_cast<Eigen::Index>(axis)];
        along[axis][count] = block.elements->along[axis][i];
        across[axis][count] = block.elements->across[axis][i];
      }
      element[count++] = {&block, i};
    }

    template <ToolShape Shape>
    void measure(const Shape& shape, std::size_t side, const Vec3<float>& u) noexcept {
      for (std::size_t first = 0; first < count; first += kProfileLanes) measure_part(shape, side, u, first);
    }

   private:
    using Part = ProfileLanes<float>;
    using Parts = std::array<Part, 3>;

    // Results are local until they are whole: what may overlap with what is read keeps loops from being vectorised.
    template <ToolShape Shape>
    void measure_part(const Shape& shape, std::size_t side, const Vec3<float>& u, std::size_t first) noexcept {
      Parts r = part(position, first), a = part(along, first), c = part(across, first);
      const Part hr = take_height(r, u), ha = take_height(a, u), hc = take_height(c, u);
      const Part rr = product(r, r), ra = product(r, a), rc = product(r, c), aa = product(a, a), cc = product(c, c),
                 ac = product(a, c);
      Part low;
      low.fill(std::numeric_limits<float>::max());
      for (std::size_t j = 0; j < side * side; ++j) {
        const auto i = static_cast<float>(place(j / side, side)), k = static_cast<float>(place(j % side, side));
        Part z, rho, d;
        for (std::size_t l = 0; l < kProfileLanes; ++l) z[l] = hr[l] + i * ha[l] + k * hc[l];
        for (std::size_t l = 0; l < kProfileLanes; ++l) {
          const float square = rr[l] + 2 * (i * ra[l] + k * rc[l] + i * k * ac[l]) + i * i * aa[l] + k * k * cc[l];
          rho[l] = square > 0 ? square : 0.0F;
        }
        square_roots(rho);
        shape.distances(rho, z, d);
        for (std::size_t l = 0; l < kProfileLanes; ++l) low[l] = d[l] < low[l] ? d[l] : low[l];
        std::copy(d.begin(), d.end(), distance[j].begin() + static_cast<std::ptrdiff_t>(first));
      }
      std::copy(low.begin(), low.end(), least.begin() + static_cast<std::ptrdiff_t>(first));
    }

    [[nodiscard]] static Parts part(const std::array<Floats, 3>& v, std::size_t first) noexcept {
      Parts out;
      for (std::size_t axis = 0; axis < 3; ++axis) std::copy_n(v[axis].data() + first, kProfileLanes, out[axis].data());
      return out;
    }
    /// Components along u; what is left is square to it.
    [[nodiscard]] static Part take_height(Parts& v, const Vec3<float>& u) noexcept {
      const float ux = u.x(), uy = u.y(), uz = u.z();
      Part out;
      for (std::size_t l = 0; l < kProfileLanes; ++l) out[l] = v[0][l] * ux + v[1][l] * uy + v[2][l] * uz;
      for (std::size_t l = 0; l < kProfileLanes; ++l) v[0][l] -= out[l] * ux;
      for (std::size_t l = 0; l < kProfileLanes; ++l) v[1][l] -= out[l] * uy;
      for (std::size_t l = 0; l < kProfileLanes; ++l) v[2][l] -= out[l] * uz;
      return out;
    }
    [[nodiscard]] static Part product(const Parts& v, const Parts& w) noexcept {
      Part out;
      for (std::size_t l = 0; l < kProfileLanes; ++l)
        out[l] = v[0][l] * w[0][l] + v[1][l] * w[1][l] + v[2][l] * w[2][l];
      return out;
    }
  };

  /// Points that are inside the tool as far as single precision can say.
  struct Candidates {
    std::size_t count = 0;
    Lanes x, y, z, weight;  // arm in G [m], area [m²]
    std::array<std::uint64_t, kProfileLanes> element;
    std::array<std::size_t, kProfileLanes> sample;

    void add(const SurfaceElement& at, std::uint64_t key, std::size_t side, std::size_t j, const Vec3d& p) noexcept {
      const double a = place(j / side, side), c = place(j % side, side);
      x[count] = at.position.x() - p.x() + a * at.along.x() + c * at.across.x();
      y[count] = at.position.y() - p.y() + a * at.along.y() + c * at.across.y();
      z[count] = at.position.z() - p.z() + a * at.along.z() + c * at.across.z();
      weight[count] = at.area / static_cast<double>(side * side);
      element[count] = key;
      sample[count++] = j;
    }
  };

  /// What points add up to: lane by lane for those whose forces go through T's origin, one by one for the others.
  struct Sums {
    static constexpr std::size_t kEnergy = 0, kForce = 1, kRound = 4, kStraight = 5, kBent = 11, kTerms = 17;
    std::array<Lanes, kTerms> lanes{};
    FoundationSum rest;
    Mat3d moment = Mat3d::Zero();  // Σ f g rᵀ of the rest
    double depth = 0;

    [[nodiscard]] FoundationSum total() const noexcept {
      FoundationSum s = rest;
      add_turning(s);
      std::array<double, kTerms> t;
      for (std::size_t i = 0; i < kTerms; ++i)
        t[i] = Eigen::Map<const Eigen::Array<double, static_cast<int>(kProfileLanes), 1>>(lanes[i].data()).sum();
      const auto from = [&](std::size_t i) {
        Mat3d m;
        m << t[i], t[i + 1], t[i + 2], t[i + 1], t[i + 3], t[i + 4], t[i + 2], t[i + 4], t[i + 5];
        return m;
      };
      s.energy += t[kEnergy];
      s.wrench.head<3>() -= Vec3d(t[kForce], t[kForce + 1], t[kForce + 2]);
      s.stiffness.topLeftCorner<3, 3>() += from(kStraight);
      s.bending.topLeftCorner<3, 3>() += from(kBent) - t[kRound] * Mat3d::Identity();
      s.depth = depth;
      return s;
    }

    /// Turning moves points along arcs: with F = Σ f g and M = Σ f g rᵀ, ∂²E has [F]× where a turn meets a way, and
    /// tr M − (M + Mᵀ)/2 where turns meet.
    void add_turning(FoundationSum& s) const noexcept {
      const Vec3d f = -s.wrench.head<3>();
      Mat3d cross;
      cross << 0, -f.z(), f.y(), f.z(), 0, -f.x(), -f.y(), f.x(), 0;
      s.bending.block<3, 3>(3, 0) += cross;
      const double trace = moment.trace();
      for (Eigen::Index i = 0; i < 3; ++i)
        for (Eigen::Index j = 0; j < 3; ++j)
          s.bending(3 + i, 3 + j) += (i == j ? trace : 0.0) - 0.5 * (moment(i, j) + moment(j, i));
    }
  };

  template <ToolShape Shape>
  void add(Candidates& c, const Shape& shape, const FoundationLaw& law, const Vec3d& u, const Vec3d& x,
           Sums& sums) noexcept {
    for (std::size_t l = c.count; l < kProfileLanes; ++l) c.x[l] = c.y[l] = c.z[l] = c.weight[l] = 0;
    Lanes height, rho;
    const double ux = u.x(), uy = u.y(), uz = u.z();
    for (std::size_t l = 0; l < kProfileLanes; ++l) height[l] = c.x[l] * ux + c.y[l] * uy + c.z[l] * uz;
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const double qx = c.x[l] - height[l] * ux, qy = c.y[l] - height[l] * uy, qz = c.z[l] - height[l] * uz;
      rho[l] = qx * qx + qy * qy + qz * qz;
    }
    square_roots(rho);
    Profile at;
    shape.profile(rho, height, at);

    // The normal of a ball about T lies along the arm, and turning the ball changes nothing.
    const double k = law.stiffness, ramp = law.ramp, offset = law.offset;
    Lanes energy, depth, active, kw, f, bend, gx, gy, gz;
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const double in = offset - at.distance[l], over = in - ramp;
      const double uu = in > 0 ? in : 0.0, v = over > 0 ? over : 0.0;
      const double central = k * c.weight[l] * at.central[l];
      energy[l] = central * (uu * uu * uu - v * v * v) / (6 * ramp);
      depth[l] = (uu * uu - v * v) / (2 * ramp);
      active[l] = (uu - v) / ramp;
      kw[l] = central * active[l];
      f[l] = central * depth[l];
      bend[l] = f[l] * at.curvature[l];
      gx[l] = at.curvature[l] * c.x[l];
      gy[l] = at.curvature[l] * c.y[l];
      gz[l] = at.curvature[l] * c.z[l];
    }
    const auto add_products = [&](std::size_t term, const Lanes& a, const Lanes& b) {
      Lanes sum = sums.lanes[term];
      for (std::size_t l = 0; l < kProfileLanes; ++l) sum[l] += a[l] * b[l];
      sums.lanes[term] = sum;
    };
    add_products(Sums::kForce, f, gx);
    add_products(Sums::kForce + 1, f, gy);
    add_products(Sums::kForce + 2, f, gz);
    add_products(Sums::kRound, f, at.curvature);
    Lanes total = sums.lanes[Sums::kEnergy];
    for (std::size_t l = 0; l < kProfileLanes; ++l) total[l] += energy[l];
    sums.lanes[Sums::kEnergy] = total;
    const auto add_squares = [&](std::size_t term, const Lanes& weight) {
      Lanes wx, wy, wz;
      for (std::size_t l = 0; l < kProfileLanes; ++l) wx[l] = weight[l] * gx[l];
      for (std::size_t l = 0; l < kProfileLanes; ++l) wy[l] = weight[l] * gy[l];
      for (std::size_t l = 0; l < kProfileLanes; ++l) wz[l] = weight[l] * gz[l];
      add_products(term, wx, gx);
      add_products(term + 1, wx, gy);
      add_products(term + 2, wx, gz);
      add_products(term + 3, wy, gy);
      add_products(term + 4, wy, gz);
      add_products(term + 5, wz, gz);
    };
    add_squares(Sums::kStraight, kw);
    add_squares(Sums::kBent, bend);

    for (std::size_t l = 0; l < c.count; ++l) {
      if (!(depth[l] > 0) || points_.size() == points_.capacity()) continue;
      sums.depth = std::max(sums.depth, -at.distance[l]);
      FoundationPoint& q = points_.emplace_back();
      q = {
          {c.x[l], c.y[l], c.z[l]}, {gx[l], gy[l], gz[l]}, depth[l], active[l], c.weight[l], c.element[l], c.sample[l]};
      if (at.central[l] == 0) add_off_centre(q, at, l, rho[l], height[l], law, u, x, sums);
    }
  }

  static void add_off_centre(FoundationPoint& q, const Profile& at, std::size_t l, double rho, double height,
                             const FoundationLaw& law, const Vec3d& u, const Vec3d& x, Sums& sums) noexcept {
    const Vec3d out = rho > kOnAxis ? Vec3d((q.arm - height * u) / rho) : x;
    q.normal = at.normal_rho[l] * out + at.normal_z[l] * u;
    const double kw = law.stiffness * q.weight, f = kw * q.depth;
    const double in = law.offset - at.distance[l], over = std::max(in - law.ramp, 0.0);
    FoundationSum& s = sums.rest;
    s.energy += kw * (in * in * in - over * over * over) / (6 * law.ramp);
    const Vec6d J = with_moment(q.normal, q.arm);
    s.wrench -= f * J;
    add_square(s.stiffness, kw * q.active, J);
    if (at.curvature[l] != 0) {
      const Vec6d m = with_moment(at.normal_rho[l] * u - at.normal_z[l] * out, q.arm);
      add_square(s.bending, -f * at.curvature[l], m);
    }
    const double round = rho > kOnAxis ? at.normal_rho[l] / rho : at.curvature[l];
    const Vec6d t = with_moment(u.cross(out), q.arm);
    add_square(s.bending, -f * round, t);
    sums.moment += outer(f, q.normal, q.arm);
  }

  std::size_t side_;
  std::vector<FoundationPoint> points_;
};

}  // namespace trephine
