// SPDX-License-Identifier: MIT
#include "structure/label_shapes.hpp"
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/random.hpp"

#include <trephine/structure/build_structure_field.hpp>

#include <doctest/doctest.h>

#include <iostream>
#include <limits>
#include <map>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr int kSmallest = 8;  // voxels beside shapes

struct Errors {
  std::map<std::string, Figures> by_shape;
  Figures all, band, excess, own;
};

/// Errors of fields at random points [longest spacings], for labels of random shapes.
Errors errors_of_shapes(bool smooth, unsigned seed) {
  Random rng(seed);
  Errors errors;
  constexpr int kCases = 8 * kShapes, kPoints = 4000;
  for (int c = 0; c < kCases; ++c) {
    const double edge = rng.uniform(2e-4, 5e-4);
    const Vec3d h = c / kShapes % 2 == 0 ? Vec3d(Vec3d::Constant(edge)) : Vec3d(2e-4, 2e-4, 5e-4);
    const double longest = h.maxCoeff(), reach = 6 * longest;
    std::array<int, 3> size{};
    Vec3d centre;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      size[a] = static_cast<int>(38 * longest / h[axis]) + kSmallest;
      centre[axis] = h[axis] * (0.5 * (size[a] - 1) + rng.uniform(-1, 1));
    }
    const Shape shape = random_shape(c % kShapes, centre, longest, rng);
    Labels labels(size, h);
    labels.fill(shape.distance, 1);
    const auto field = build_structure_field(labels.view(), {.smooth = smooth, .reach = reach, .threads = 2});
    for (int n = 0; n < kPoints; ++n) {
      const Vec3d p{rng.uniform() * labels.end().x(), rng.uniform() * labels.end().y(),
                    rng.uniform() * labels.end().z()};
      const double truth = shape.distance(p), d = field->nearest(p).distance, own = field->distance(0, p);
      errors.all.add(std::abs(d - truth) / longest);
      errors.by_shape[shape.name].add(std::abs(d - truth) / longest);
      if (std::abs(truth) < reach) errors.band.add(std::abs(own - std::clamp(truth, -reach, reach)) / longest);
      if (std::abs(d) < reach - 2 * longest) errors.own.add(std::abs(own - d) / longest);
      const Vec3d q = p + rng.arrow(0, 3 * longest);
      errors.excess.add((std::abs(field->nearest(q).distance - d) - (q - p).norm()) / longest);
    }
  }
  return errors;
}

void print(const std::string& name, const Figures& f) {
  std::cout << "  " << name << ": median " << f.median() << ", p99 " << f.share(0.99) << ", worst " << f.worst()
            << '\n';
}

double print(const std::string& title, const Errors& e) {
  std::cout << title << ", errors [longest spacings]\n";
  double p99 = 0;
  for (const auto& [name, f] : e.by_shape) {
    print(name, f);
    p99 = std::max(p99, f.share(0.99));
  }
  print("all", e.all);
  print("in the band", e.band);
  std::cout << "  excess over the points' distance: worst " << e.excess.worst() << '\n';
  return p99;
}

/// All surfels of a volume, fitted or not.
std::vector<detail::Surfel> surfels_of(const LabelVolume& volume, int structures, bool smooth) {
  std::vector<detail::Surfel> surfels;
  detail::LabelSurface surface(volume);
  constexpr int kBlock = detail::LabelSurface::kBlock;
  for (int s = 0; s < structures; ++s)
    for (int z = 0; z < volume.size[2]; z += kBlock)
      for (int y = 0; y < volume.size[1]; y += kBlock)
        for (int x = 0; x < volume.size[0]; x += kBlock) surface.find(s, {x, y, z}, surfels);
  if (!smooth) return surfels;
  detail::SurfaceFit fit(std::move(surfels), volume.spacing);
  CHECK(fit.run(1, {nullptr, 0, 1}));
  return fit.take();
}

/// The average that `SurfelDistance` describes, over all surfels.
double plain_distance(const std::vector<detail::Surfel>& surfels, const Vec3d& p, double h) {
  const auto at = [](const std::array<float, 3>& v) { return Vec3d(v[0], v[1], v[2]); };
  double least = std::numeric_limits<double>::max();
  const detail::Surfel* nearest = nullptr;
  for (const auto& s : surfels)
    if (const double d = (p - at(s.position)).squaredNorm(); d < least) {
      least = d;
      nearest = &s;
    }
  using detail::SurfelDistance;
  const double blend = SurfelDistance::kBlend * SurfelDistance::kBlend * h * h;
  const double near = SurfelDistance::kNear * h;
  const double disc = SurfelDistance::kDisc * h * near / std::max(std::sqrt(least), near);
  double sum = 0, weights = 0;
  for (const auto& s : surfels) {
    const Vec3d to = p - at(s.position);
    const double more = to.squaredNorm() - least;
    if (more >= blend || s.structure != nearest->structure) continue;
    const double height = to.dot(at(s.normal)), across = std::sqrt(std::max(to.squaredNorm() - height * height, 0.0));
    const double weight = (1 - more / blend) * (1 - more / blend);
    sum += weight * std::hypot(height, std::max(across - disc, 0.0));
    weights += weight;
  }
  return sum / weights;
}

}  // namespace

TEST_CASE("Distances to analytic shapes sampled as labels, raw and smoothed") {
  constexpr unsigned kSeed = 20;
  constexpr double kRaw = 0.5, kSmoothed = 0.28;  // p99 of the error [longest spacings]
  constexpr double kSlack = 0.25;                 // as StructureField::slack() says
  const Errors raw = errors_of_shapes(false, kSeed), smoothed = errors_of_shapes(true, kSeed);
  const double raw_p99 = print("raw labels", raw), smoothed_p99 = print("smoothed labels", smoothed);
  CHECK(raw_p99 < kRaw);
  CHECK(smoothed_p99 < kSmoothed);
  CHECK(smoothed.all.share(0.99) < kSmoothed);
  CHECK(smoothed.band.share(0.99) < kSmoothed);
  CHECK(raw.excess.worst() < kSlack);
  CHECK(smoothed.excess.worst() < kSlack);
  // The band of a lone structure is the nearest structure's distance, but for the volume's end.
  CHECK(smoothed.own.worst() < 1e-9);
}

TEST_CASE("The search among cells gives what all surfels give") {
  constexpr unsigned kSeed = 21;
  Random rng(kSeed);
  Figures errors, nearest;
  for (const Vec3d& h : {Vec3d(3e-4, 3e-4, 3e-4), Vec3d(2e-4, 2e-4, 5e-4)})
    for (const bool smooth : {false, true}) {
      Labels labels({45, 40, 28}, h);
      for (int s = 0; s < 4; ++s) {
        const Vec3d centre = labels.end().cwiseProduct(Vec3d{rng.uniform(), rng.uniform(), rng.uniform()});
        labels.fill(random_shape(rng.below(kShapes), centre, 0.4 * h.maxCoeff(), rng).distance, s + 1);
      }
      const auto field = build_structure_field(labels.view(), {.smooth = smooth, .reach = 1e-3, .threads = 1});
      const auto surfels = surfels_of(labels.view(), 4, smooth);
      std::vector<std::vector<detail::Surfel>> own(4);
      for (const auto& s : surfels) own[s.structure].push_back(s);
      for (int n = 0; n < 600; ++n) {
        const std::array<int, 3> v{rng.below(45), rng.below(40), rng.below(28)};
        const Vec3d p = h.cwiseProduct(Vec3d(v[0], v[1], v[2]));
        const int label = labels.view().at(v[0], v[1], v[2]);
        double truth = 1;
        for (std::size_t s = 0; s < 4; ++s) {
          if (own[s].empty()) continue;
          const double d = plain_distance(own[s], p, h.maxCoeff()) * (label == static_cast<int>(s) + 1 ? -1 : 1);
          truth = std::min(truth, d);
          const double band = field->sample(static_cast<int>(s), v[0], v[1], v[2]);
          errors.add(std::abs(band - std::clamp(d, -1e-3, 1e-3)) / h.maxCoeff());
        }
        nearest.add(std::abs(field->nearest(p).distance - truth) / h.maxCoeff());
      }
    }
  std::cout << "search against all surfels [longest spacings]: " << errors << "; nearest structure: " << nearest
            << '\n';
  CHECK(errors.worst() < 0.02);
  CHECK(nearest.worst() < 0.02);
}
