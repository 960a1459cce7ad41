// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/lane_sum.hpp>
#include <trephine/core/spatial.hpp>
#include <trephine/core/square_roots.hpp>
#include <trephine/render/coupled/clearance.hpp>
#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/element_batch.hpp>
#include <trephine/render/coupled/element_list.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Pressure of the foundation at a point with penetration depth ψ: k times the mean of max(ψ + offset − s, 0) over
/// 0 <= s <= `ramp`.
///
/// A point stands for a cell of the surface. The depth varies by about `ramp` over a cell at the rim of a contact. With
/// the mean, forces and stiffnesses are continuous as points enter and leave, and hardly depend on the points' places.
struct FoundationLaw {
  double stiffness;   ///< k [N/m³]
  double ramp;        ///< [m], > 0
  double offset = 0;  ///< distance outside the tool at which contact begins [m]
};

/// A point of the bone's surface in contact with the tool.
struct FoundationPoint {
  Vec3d arm;              ///< from T's origin, in G [m]
  Vec3d normal;           ///< gradient of the tool's signed distance: bone pushes the tool along −normal
  double depth;           ///< pressure over k [m]
  double depth_slope;     ///< d depth / dψ, from 0 to 1
  double weight;          ///< area that the point stands for [m²]
  std::uint64_t element;  ///< number of its surface element (`NearBlock::key`)
  std::size_t sample;     ///< index among the element's points
};

/// Returns a point's depth [m] after a small motion (δp, δθ) of the tool, to first order.
[[nodiscard]] inline double depth_after_motion(const FoundationPoint& q, const Vec6d& motion) noexcept {
  const Vec3d moved = linear_part(motion) + angular_part(motion).cross(q.arm);
  return std::max(0.0, q.depth + q.depth_slope * q.normal.dot(moved));
}

/// Energy of the contact at a pose, and its derivatives by a small motion (δp, δθ) of the tool about T's origin, in G
/// axes. The Hessian ∂²E is `stiffness` + `geometric_stiffness`, of which the lower triangles are stored.
struct FoundationSum {
  double energy = 0;                          ///< [J]
  Vec6d wrench = Vec6d::Zero();               ///< −∂E: force [N] and torque about T's origin [N·m] on the tool
  Mat6d stiffness = Mat6d::Zero();            ///< Gauss–Newton part Σ k w a J Jᵀ
  Mat6d geometric_stiffness = Mat6d::Zero();  ///< the rest, by which motion turns the contact normals
  Clearance clearance;                        ///< of the points that are free
  double depth = 0;                           ///< largest penetration depth ψ [m], 0 if no point is inside

  [[nodiscard]] bool has_contact() const noexcept { return energy > 0; }
};

/// Elastic foundation on the bone's surface: quadrature points that press on the tool in proportion to their depth.
///
/// The energy is E = k Σ w φ(ψ). A surface point q of area w has the penetration depth ψ = −d(X⁻¹ q), with d the tool's
/// signed distance. With u = max(ψ + offset, 0) and v = max(u − ramp, 0)
///
///     φ = (u³ − v³) / (6 ramp),    f = φ' = (u² − v²) / (2 ramp),    a = φ'' = (u − v) / ramp.
///
/// The pressure k f acts along the tool's normal. φ is one-sided and C², and is differentiated twice exactly. With
/// J = (g, r × g), g = ∇d at the arm r,
///
///     ∂E = Σ k w f J,    ∂²E = Σ k w a J Jᵀ − Σ k w f (κ m mᵀ + κ' t tᵀ) + rotation terms,
///
/// m and t the principal directions of the level surface with their moments, κ and κ' their curvatures.
class Foundation {
 public:
  static constexpr std::size_t kMaxSide = PointLattice::kMaxSide;

  /// `side` points lie along each side of an element, evenly over it: a lattice has the smallest quadrature error. At
  /// most `max_points` points in contact are stored. Allocates.
  explicit Foundation(std::size_t side = 2, std::size_t max_points = 0) : lattice_(side) {
    points_.reserve(max_points);
  }
  void set_side(std::size_t side) noexcept { lattice_ = PointLattice(side); }

  /// Points in contact at the last `sum`, as many as there is room for.
  [[nodiscard]] const std::vector<FoundationPoint>& points() const noexcept { return points_; }
  /// Returns false if there was no room for more points. The sum has them all.
  [[nodiscard]] bool has_all_points() const noexcept { return points_.size() < points_.capacity(); }
  void clear() noexcept { points_.clear(); }

  /// Narrow phase: returns the sum over the elements' points for a tool at X (G axes), and stores the points in
  /// contact.
  template <ToolShape Shape>
  [[nodiscard]] FoundationSum sum(ElementList& elements, const Shape& shape, const Posed& X,
                                  const FoundationLaw& law) noexcept {
    points_.clear();
    Sums sums;
    ElementBatch batch;
    Candidates candidates;
    const Vec3d p = X.translation(), u = z_axis(X), x = X.linear().col(0);
    const Vec3<float> axis = to_float(u);
    const auto contact_distance = static_cast<float>(law.offset) + CoupledConstants::kSinglePrecision;
    float nearest = std::numeric_limits<float>::max();  // of the free elements in the batches
    const auto flush_candidates = [&] {
      evaluate(candidates, shape, law, u, x, sums);
      candidates.count = 0;
    };
    const auto filter_batch = [&] {
      batch.compute_distances(shape, lattice_, axis);
      for (std::size_t n = 0; n < batch.count; ++n) {
        const auto [block, i] = batch.element[n];
        const float distance = batch.min_distance[n];
        if (!(distance < contact_distance)) {
          nearest = std::min(nearest, distance - contact_distance);
          continue;
        }
        const SurfaceElement element = block->element(i);
        for (std::size_t j = 0; j < lattice_.points; ++j) {
          if (!(batch.distance[j][n] < contact_distance)) continue;
          candidates.add(element, block->key(i), lattice_, j, p);
          if (candidates.count == kProfileLanes) flush_candidates();
        }
      }
      batch.count = 0;
    };
    const auto visit = [&](const NearBlock& block, std::size_t i, const Vec3<float>& shift) {
      if (lattice_.points == 1) {
        // The list has measured an element's only point, at its position, already.
        candidates.add(block.element(i), block.key(i), lattice_, 0, p);
        if (candidates.count == kProfileLanes) flush_candidates();
        return;
      }
      batch.add(block, i, shift);
      if (batch.count == ElementBatch::kSize) filter_batch();
    };
    const Clearance clearance = elements.for_each_candidate(shape, X, lattice_.outermost, visit);
    if (batch.count > 0) filter_batch();
    if (candidates.count > 0) flush_candidates();
    FoundationSum s = sums.total();
    s.clearance = clearance;
    s.clearance.listed_distance = std::max(0.0, std::min(static_cast<double>(nearest), clearance.listed_distance));
    return s;
  }

 private:
  using Lanes = ProfileLanes<double>;

  /// Points that are in contact as far as single precision can decide.
  struct Candidates {
    std::size_t count = 0;
    Lanes x, y, z, weight;  // arm in G [m], area [m²]
    std::array<std::uint64_t, kProfileLanes> element;
    std::array<std::size_t, kProfileLanes> sample;

    void add(const SurfaceElement& e, std::uint64_t key, const PointLattice& lattice, std::size_t j,
             const Vec3d& p) noexcept {
      const double a = lattice.along[j], c = lattice.across[j];
      x[count] = e.position.x() - p.x() + a * e.along.x() + c * e.across.x();
      y[count] = e.position.y() - p.y() + a * e.along.y() + c * e.across.y();
      z[count] = e.position.z() - p.z() + a * e.along.z() + c * e.across.z();
      weight[count] = e.area / static_cast<double>(lattice.points);
      element[count] = key;
      sample[count++] = j;
    }
  };

  using SpatialLanes = std::array<Lanes, 6>;

  /// Sums over points, lane by lane: of central points, whose forces pass through T's origin, and of the others.
  struct Sums {
    static constexpr std::size_t kEnergy = 0, kForce = 1, kIsotropic = 4, kGaussNewton = 5, kGeometric = 11,
                                 kTerms = 17;
    static constexpr std::size_t kWrench = 1, kMoment = 7, kStiffness = 16, kTurning = 37, kOtherTerms = 58;
    std::array<Lanes, kTerms> lanes{};
    std::array<Lanes, kOtherTerms> others;  // once `has_others`
    bool has_others = false;
    double depth = 0;

    void start_others() noexcept {
      if (has_others) return;
      for (Lanes& term : others) term.fill(0);
      has_others = true;
    }
    /// Adds weight · v vᵀ to the lower triangle that begins at a term.
    void add_square(std::size_t term, const Lanes& weight, const SpatialLanes& v) noexcept {
      for (std::size_t j = 0; j < 6; ++j) {
        Lanes weighted;
        for (std::size_t l = 0; l < kProfileLanes; ++l) weighted[l] = weight[l] * v[j][l];
        for (std::size_t i = j; i < 6; ++i) add_product(others[term++], weighted, v[i]);
      }
    }
    // Always inline: in large programs g++ would call it, which takes as long as the sum.
    [[gnu::always_inline]] static void add_product(Lanes& __restrict sum, const Lanes& a, const Lanes& b) noexcept {
      for (std::size_t l = 0; l < kProfileLanes; ++l) sum[l] += a[l] * b[l];
    }

    [[nodiscard]] FoundationSum total() const noexcept {
      FoundationSum s;
      if (has_others) add_others(s);
      std::array<double, kTerms> t;
      for (std::size_t i = 0; i < kTerms; ++i) t[i] = lane_sum(lanes[i]);
      const auto symmetric_at = [&](std::size_t i) {
        Mat3d m;
        m << t[i], t[i + 1], t[i + 2], t[i + 1], t[i + 3], t[i + 4], t[i + 2], t[i + 4], t[i + 5];
        return m;
      };
      s.energy += t[kEnergy];
      for (std::size_t i = 0; i < 3; ++i) s.wrench[static_cast<Eigen::Index>(i)] -= t[kForce + i];
      add_block(s.stiffness, 0, 0, symmetric_at(kGaussNewton));
      add_block(s.geometric_stiffness, 0, 0, symmetric_at(kGeometric));
      add_to_diagonal(s.geometric_stiffness, 0, -t[kIsotropic]);
      s.depth = depth;
      return s;
    }

   private:
    void add_others(FoundationSum& s) const noexcept {
      std::array<double, kOtherTerms> t;
      for (std::size_t i = 0; i < kOtherTerms; ++i) t[i] = lane_sum(others[i]);
      s.energy = t[kEnergy];
      for (std::size_t i = 0; i < 6; ++i) s.wrench[static_cast<Eigen::Index>(i)] = -t[kWrench + i];
      std::size_t term = kStiffness;
      for (Mat6d* const part : {&s.stiffness, &s.geometric_stiffness})
        for (Eigen::Index j = 0; j < 6; ++j)
          for (Eigen::Index i = j; i < 6; ++i) (*part)(i, j) = t[term++];
      Mat3d moment;
      for (std::size_t i = 0; i < 9; ++i) moment.data()[i] = t[kMoment + i];
      add_rotation_terms(s, moment);
    }

    /// Adds the part of ∂²E by which rotations move points along arcs. With F = Σ f g and M = Σ f g rᵀ it is [F]× in
    /// the rotation–translation block, and tr M − (M + Mᵀ)/2 in the rotation block.
    static void add_rotation_terms(FoundationSum& s, const Mat3d& moment) noexcept {
      const Vec3d f = -linear_part(s.wrench);
      Mat3d cross;
      cross << 0, -f.z(), f.y(), f.z(), 0, -f.x(), -f.y(), f.x(), 0;
      add_block(s.geometric_stiffness, 3, 0, cross);
      const double trace = moment(0, 0) + moment(1, 1) + moment(2, 2);
      for (Eigen::Index i = 0; i < 3; ++i)
        for (Eigen::Index j = 0; j < 3; ++j)
          s.geometric_stiffness(3 + i, 3 + j) += (i == j ? trace : 0.0) - 0.5 * (moment(i, j) + moment(j, i));
    }
  };

  /// Adds the candidates to the sums, in double precision, and stores those in contact.
  template <ToolShape Shape>
  void evaluate(Candidates& c, const Shape& shape, const FoundationLaw& law, const Vec3d& u, const Vec3d& x,
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

    // A central point's normal lies along its arm, and a rotation of the ball changes nothing.
    const double k = law.stiffness, ramp = law.ramp, offset = law.offset;
    Lanes all_u, all_v, potential, energy, depth, depth_slope, kw, f, geometric, gx, gy, gz;
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const double raw_u = offset - at.distance[l], raw_v = raw_u - ramp;
      all_u[l] = raw_u > 0 ? raw_u : 0.0;
      all_v[l] = raw_v > 0 ? raw_v : 0.0;
    }
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const double central = k * c.weight[l] * at.central[l], uu = all_u[l], v = all_v[l];
      potential[l] = (uu * uu * uu - v * v * v) / (6 * ramp);
      energy[l] = central * potential[l];
      depth[l] = (uu * uu - v * v) / (2 * ramp);
      depth_slope[l] = (uu - v) / ramp;
      kw[l] = central * depth_slope[l];
      f[l] = central * depth[l];
      geometric[l] = f[l] * at.curvature[l];
      gx[l] = at.curvature[l] * c.x[l];
      gy[l] = at.curvature[l] * c.y[l];
      gz[l] = at.curvature[l] * c.z[l];
    }
    const auto add_products = [&](std::size_t term, const Lanes& a, const Lanes& b) {
      Sums::add_product(sums.lanes[term], a, b);
    };
    add_products(Sums::kForce, f, gx);
    add_products(Sums::kForce + 1, f, gy);
    add_products(Sums::kForce + 2, f, gz);
    add_products(Sums::kIsotropic, f, at.curvature);
    for (std::size_t l = 0; l < kProfileLanes; ++l) sums.lanes[Sums::kEnergy][l] += energy[l];
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
    add_squares(Sums::kGaussNewton, kw);
    add_squares(Sums::kGeometric, geometric);

    double others = 0;
    for (std::size_t l = 0; l < kProfileLanes; ++l) others += depth[l] * c.weight[l] * (1 - at.central[l]);
    if (others > 0) add_others(c, at, rho, height, k, potential, depth, depth_slope, u, x, {&gx, &gy, &gz}, sums);

    for (std::size_t l = 0; l < c.count; ++l) {
      if (!(depth[l] > 0)) continue;
      sums.depth = std::max(sums.depth, -at.distance[l]);
      if (points_.size() == points_.capacity()) continue;
      points_.push_back({{c.x[l], c.y[l], c.z[l]},
                         {gx[l], gy[l], gz[l]},
                         depth[l],
                         depth_slope[l],
                         c.weight[l],
                         c.element[l],
                         c.sample[l]});
    }
  }

  /// Adds the points whose nearest part of the tool is no ball about T's origin, and writes their normals.
  static void add_others(const Candidates& c, const Profile& at, const Lanes& rho, const Lanes& height, double k,
                         const Lanes& potential, const Lanes& depth, const Lanes& depth_slope, const Vec3d& u,
                         const Vec3d& x, const std::array<Lanes*, 3>& normals, Sums& sums) noexcept {
    const std::array<const Lanes*, 3> arm{&c.x, &c.y, &c.z};
    // Directions: the normal, along the outline, about the axis. The last two are the principal ones.
    SpatialLanes normal, along, around;
    Lanes per_rho, on_axis, off_axis;
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      on_axis[l] = rho[l] > CoupledConstants::kOnAxis ? 0.0 : 1.0;
      off_axis[l] = rho[l] > CoupledConstants::kOnAxis ? rho[l] : CoupledConstants::kOnAxis;
    }
    for (std::size_t l = 0; l < kProfileLanes; ++l) per_rho[l] = (1 - on_axis[l]) / off_axis[l];
    std::array<Lanes, 3> radial;
    for (std::size_t a = 0; a < 3; ++a) {
      const double ua = u[static_cast<Eigen::Index>(a)], xa = x[static_cast<Eigen::Index>(a)];
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        radial[a][l] = ((*arm[a])[l] - height[l] * ua) * per_rho[l] + on_axis[l] * xa;
        normal[a][l] = at.normal_rho[l] * radial[a][l] + at.normal_z[l] * ua;
        along[a][l] = at.normal_rho[l] * ua - at.normal_z[l] * radial[a][l];
      }
    }
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t b = (a + 1) % 3, d = (a + 2) % 3;
      const double ub = u[static_cast<Eigen::Index>(b)], ud = u[static_cast<Eigen::Index>(d)];
      for (std::size_t l = 0; l < kProfileLanes; ++l) around[a][l] = ub * radial[d][l] - ud * radial[b][l];
    }
    for (SpatialLanes* const v : {&normal, &along, &around})
      for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t b = (a + 1) % 3, d = (a + 2) % 3;
        for (std::size_t l = 0; l < kProfileLanes; ++l)
          (*v)[3 + a][l] = (*arm[b])[l] * (*v)[d][l] - (*arm[d])[l] * (*v)[b][l];
      }

    Lanes kw, f, stiffness, along_curvature, around_curvature;
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      kw[l] = k * c.weight[l] * (1 - at.central[l]);
      f[l] = kw[l] * depth[l];
      stiffness[l] = kw[l] * depth_slope[l];
      along_curvature[l] = -f[l] * at.curvature[l];
      around_curvature[l] = -f[l] * (at.normal_rho[l] * per_rho[l] + on_axis[l] * at.curvature[l]);
    }
    sums.start_others();
    Sums::add_product(sums.others[Sums::kEnergy], kw, potential);
    for (std::size_t i = 0; i < 6; ++i) Sums::add_product(sums.others[Sums::kWrench + i], f, normal[i]);
    sums.add_square(Sums::kStiffness, stiffness, normal);
    sums.add_square(Sums::kTurning, along_curvature, along);
    sums.add_square(Sums::kTurning, around_curvature, around);
    for (std::size_t a = 0; a < 3; ++a) {
      Lanes pressed;
      for (std::size_t l = 0; l < kProfileLanes; ++l) pressed[l] = f[l] * (*arm[a])[l];
      for (std::size_t b = 0; b < 3; ++b) Sums::add_product(sums.others[Sums::kMoment + 3 * a + b], normal[b], pressed);
      for (std::size_t l = 0; l < kProfileLanes; ++l)
        (*normals[a])[l] = at.central[l] * (*normals[a])[l] + (1 - at.central[l]) * normal[a][l];
    }
  }

  PointLattice lattice_;
  std::vector<FoundationPoint> points_;
};

}  // namespace trephine
