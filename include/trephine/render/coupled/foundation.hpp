// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/near_patches.hpp>

#include <Eigen/Core>

#include <array>
#include <cmath>

namespace trephine {

using Vec6d = Eigen::Matrix<double, 6, 1>;
using Mat6d = Eigen::Matrix<double, 6, 6>;

/// The moment of a vector at an arm, below the vector: how a point's motion depends on the tool's (δp, δθ).
[[nodiscard]] inline Vec6d with_moment(const Vec3d& v, const Vec3d& arm) noexcept {
  Vec6d out;
  out << v, arm.cross(v);
  return out;
}

/// One point of the bone's surface inside the tool.
struct FoundationPoint {
  Vec3d arm;           ///< from T's origin, in G [m]
  Vec3d normal;        ///< of the tool there, outward: bone pushes the tool along −normal
  double depth;        ///< ψ > 0 [m]
  double weight;       ///< area that the point stands for [m²]
  std::size_t patch;   ///< of the near patches
  std::size_t sample;  ///< which of the patch's points
  bool central;        ///< the tool's part there is a ball about T's origin
};

/// What contact amounts to at a pose: an energy and its derivatives by a small motion (δp, δθ) of the tool about T's
/// origin, G axes.
struct FoundationSum {
  double energy = 0;                ///< [J]
  Vec6d wrench = Vec6d::Zero();     ///< −∂E: force [N] and torque about T's origin [N·m] on the tool
  Mat6d stiffness = Mat6d::Zero();  ///< Σ k w J Jᵀ, Gauss and Newton's part of ∂²E
  Mat6d bending = Mat6d::Zero();    ///< the rest of ∂²E: how the tool's curvature turns the forces
  double nearest = 0;               ///< no surface that does not touch is nearer than this [m]
  double depth = 0;                 ///< of the deepest point [m]
};

/// An elastic foundation on the bone's surface: E = ½ k Σ w ψ², ψ = −d(X⁻¹ q) how deep the surface point q of area w is
/// inside the tool's signed distance d. The pressure k ψ acts along the tool's normal. One-sided, C¹, and exactly
/// differentiated twice.
class Foundation {
 public:
  /// Points of a patch along each side, evenly over the patch.
  static constexpr std::size_t kSide = 3;
  static constexpr std::size_t kPoints = kSide * kSide;

  explicit Foundation(std::size_t most_points = 0) { points_.reserve(most_points); }

  /// The points inside the tool that `sum` found last.
  [[nodiscard]] const std::vector<FoundationPoint>& points() const noexcept { return points_; }
  void clear() noexcept { points_.clear(); }

  template <ToolShape Shape>
  [[nodiscard]] FoundationSum sum(NearPatches& near, const Shape& shape, const Posed& X, double k) noexcept {
    points_.clear();
    FoundationSum s;
    Central central;
    Mat3d moment = Mat3d::Zero();  // Σ f g rᵀ
    Batch batch;
    const Vec3d p = X.translation(), u = X.linear().col(2), x = X.linear().col(0);
    const auto add_batch = [&] {
      batch.measure(shape);
      for (std::size_t n = 0; n < batch.count; ++n)
        for (std::size_t j = 0; j < kPoints; ++j)
          if (batch.distance[j][static_cast<Eigen::Index>(n)] < 0 && points_.size() < points_.capacity())
            add({near[batch.patch[n]], batch.patch[n], j, p, batch.z[j][static_cast<Eigen::Index>(n)], batch.rho[j][static_cast<Eigen::Index>(n)]}, shape, k, u, x, s, central,
                moment);
      batch.count = 0;
    };
    s.nearest = near.for_each_touching(shape, X, [&](std::size_t i) {
      batch.add(near[i], p, u, i);
      if (batch.count == Batch::kSize) add_batch();
    });
    if (batch.count > 0) add_batch();
    add_turning(-s.wrench.head<3>(), moment, s);
    central.add_to(s);
    return s;
  }

 private:
  static constexpr double place(std::size_t i) noexcept {
    return (2.0 * static_cast<double>(i) + 1 - kSide) / kSide;
  }

  /// Patches whose points' places about the tool's axis are found together. A point is r + i a + j c with r the arm of
  /// the patch and a, c its sides, so its height z and distance from T's origin follow from their products.
  struct Batch {
    static constexpr std::size_t kSize = 32;
    using Lanes = Eigen::Array<double, kSize, 1>;
    std::size_t count = 0;
    std::array<Lanes, 6> product;  // r·r, r·a, r·c, a·a, c·c, a·c
    std::array<Lanes, 3> height;   // of r, a, c along the axis
    std::array<Lanes, kPoints> z, rho, distance;
    std::array<std::size_t, kSize> patch;

    void add(const SurfacePatch& at, const Vec3d& p, const Vec3d& u, std::size_t i) noexcept {
      const auto n = static_cast<Eigen::Index>(count);
      const Vec3d r = at.position - p;
      product[0][n] = r.squaredNorm();
      product[1][n] = r.dot(at.along);
      product[2][n] = r.dot(at.across);
      product[3][n] = at.along.squaredNorm();
      product[4][n] = at.across.squaredNorm();
      product[5][n] = at.along.dot(at.across);
      height[0][n] = r.dot(u);
      height[1][n] = at.along.dot(u);
      height[2][n] = at.across.dot(u);
      patch[count++] = i;
    }

    template <ToolShape Shape>
    void measure(const Shape& shape) noexcept {
      using Part = Eigen::Array<double, 16, 1>;
      for (std::size_t first = 0; first < count; first += 16) {
        const auto of = [&](const Lanes& lanes) { return Eigen::Map<const Part>(lanes.data() + first); };
        for (std::size_t j = 0; j < kPoints; ++j) {
          const double a = place(j / kSide), c = place(j % kSide);
          Eigen::Map<Part> to_z(z[j].data() + first), to_rho(rho[j].data() + first);
          to_z = of(height[0]) + a * of(height[1]) + c * of(height[2]);
          to_rho = (of(product[0]) + (2 * a) * of(product[1]) + (2 * c) * of(product[2]) + (a * a) * of(product[3]) +
                    (c * c) * of(product[4]) + (2 * a * c) * of(product[5]) - to_z.square())
                       .max(0.0)
                       .sqrt();
          shape.distances(rho[j].data() + first, z[j].data() + first, distance[j].data() + first, std::size_t{16});
        }
      }
    }
  };

  struct Place {
    const SurfacePatch& patch;
    std::size_t index;
    std::size_t sample;
    const Vec3d& p;
    double z, rho;
  };

  /// Sums over points whose forces go through T's origin.
  struct Central {
    double energy = 0, depth = 0, round = 0;
    Vec3d force = Vec3d::Zero();
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // Σ (k w + f c) g gᵀ
    double gxx = 0, gxy = 0, gxz = 0, gyy = 0, gyz = 0, gzz = 0;  // Σ k w g gᵀ
    void add_to(FoundationSum& s) const noexcept {
      Mat3d all, plain;
      all << xx, xy, xz, xy, yy, yz, xz, yz, zz;
      plain << gxx, gxy, gxz, gxy, gyy, gyz, gxz, gyz, gzz;
      s.energy += energy;
      s.depth = std::max(s.depth, depth);
      s.wrench.head<3>() -= force;
      s.stiffness.topLeftCorner<3, 3>() += plain;
      s.bending.topLeftCorner<3, 3>() += all - plain - round * Mat3d::Identity();
    }
  };

  template <ToolShape Shape>
  void add(const Place& place, const Shape& shape, double k, const Vec3d& u, const Vec3d& x, FoundationSum& s,
           Central& central, Mat3d& moment) noexcept {
    const double rho = place.rho, h = place.z;
    const ProfilePoint at = shape.at(rho, h);
    if (!(at.distance < 0)) return;  // rounded otherwise
    const double a = Foundation::place(place.sample / kSide), c = Foundation::place(place.sample % kSide);
    FoundationPoint& q = points_.emplace_back();
    q.arm = place.patch.position - place.p + a * place.patch.along + c * place.patch.across;
    q.depth = -at.distance;
    q.weight = place.patch.area / kPoints;
    q.patch = place.index;
    q.sample = place.sample;
    q.central = at.central;
    const double kw = k * q.weight, f = kw * q.depth;
    if (at.central) {
      q.normal = at.curvature * q.arm;
      const double bend = f * at.curvature, all = kw + bend;
      const Vec3d& g = q.normal;
      central.energy += 0.5 * f * q.depth;
      central.depth = std::max(central.depth, q.depth);
      central.round += bend;
      central.force += f * g;
      const double x2 = g.x() * g.x(), xy = g.x() * g.y(), xz = g.x() * g.z(), y2 = g.y() * g.y(), yz = g.y() * g.z(),
                   z2 = g.z() * g.z();
      central.xx += all * x2, central.xy += all * xy, central.xz += all * xz;
      central.yy += all * y2, central.yz += all * yz, central.zz += all * z2;
      central.gxx += kw * x2, central.gxy += kw * xy, central.gxz += kw * xz;
      central.gyy += kw * y2, central.gyz += kw * yz, central.gzz += kw * z2;
      return;
    }
    const Vec3d out = rho > 1e-12 ? Vec3d((q.arm - h * u) / rho) : x;
    q.normal = at.normal_rho * out + at.normal_z * u;
    s.energy += 0.5 * f * q.depth;
    s.depth = std::max(s.depth, q.depth);
    const Vec6d J = with_moment(q.normal, q.arm);
    s.wrench -= f * J;
    s.stiffness.noalias() += (kw * J) * J.transpose();
    if (at.curvature != 0) {
      const Vec6d m = with_moment(at.normal_rho * u - at.normal_z * out, q.arm);
      s.bending.noalias() -= (f * at.curvature * m) * m.transpose();
    }
    const double round = rho > 1e-9 ? at.normal_rho / rho : at.curvature;
    const Vec6d t = with_moment(u.cross(out), q.arm);
    s.bending.noalias() -= (f * round * t) * t.transpose();
    moment.noalias() += (f * q.normal) * q.arm.transpose();
  }

  /// Turning moves points along arcs: with F = Σ f g and M = Σ f g rᵀ of the points off centre, ∂²E has [F]× where a
  /// turn meets a way, and tr M − (M + Mᵀ)/2 where turns meet.
  static void add_turning(const Vec3d& f, const Mat3d& moment, FoundationSum& s) noexcept {
    Mat3d cross;
    cross << 0, -f.z(), f.y(), f.z(), 0, -f.x(), -f.y(), f.x(), 0;
    s.bending.block<3, 3>(3, 0) += cross;
    s.bending.block<3, 3>(0, 3) -= cross;
    s.bending.block<3, 3>(3, 3) += moment.trace() * Mat3d::Identity() - 0.5 * (moment + moment.transpose());
  }

  std::vector<FoundationPoint> points_;
};

}  // namespace trephine
