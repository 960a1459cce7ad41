// SPDX-License-Identifier: MIT
#include "structure/label_shapes.hpp"
#include "support/cases.hpp"
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/random.hpp"

#include <trephine/structure/build_structure_field.hpp>

#include <doctest/doctest.h>

#include <iomanip>
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
  documented("labels", "Distance, raw labels, p99", raw_p99);
  documented("labels", "Distance, smoothed labels, p99", smoothed_p99);
  CHECK(raw_p99 < kRaw);
  CHECK(smoothed_p99 < kSmoothed);
  CHECK(smoothed.all.share(0.99) < kSmoothed);
  CHECK(smoothed.band.share(0.99) < kSmoothed);
  CHECK(raw.all.worst() < 1.5);
  CHECK(smoothed.all.worst() < 1.2);
  CHECK(smoothed.band.worst() < 1.2);
  CHECK(raw.excess.worst() < kSlack);
  CHECK(smoothed.excess.worst() < kSlack);
  // The band of a lone structure is the nearest structure's distance, but for the volume's end.
  CHECK(smoothed.own.worst() < 1e-13);
}

TEST_CASE("The search among cells gives what all surfels give") {
  constexpr unsigned kSeed = 21;
  constexpr double kReach = 1e-3;
  // Beyond reach the structure is that of the nearest surfel's centre. Another's disc may be nearer, by its radius.
  const double disc = detail::SurfelDistance::kDisc * detail::SurfelDistance::kNear / (kReach / 5e-4);
  Random rng(kSeed);
  Figures errors, beyond;
  for (const Vec3d& h : {Vec3d(3e-4, 3e-4, 3e-4), Vec3d(2e-4, 2e-4, 5e-4)})
    for (const bool smooth : {false, true}) {
      Labels labels({45, 40, 28}, h);
      for (int s = 0; s < 4; ++s) {
        const Vec3d centre = labels.end().cwiseProduct(Vec3d{rng.uniform(), rng.uniform(), rng.uniform()});
        labels.fill(random_shape(rng.below(kShapes), centre, 0.4 * h.maxCoeff(), rng).distance, s + 1);
      }
      const auto field = build_structure_field(labels.view(), {.smooth = smooth, .reach = kReach, .threads = 1});
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
          errors.add(std::abs(band - std::clamp(d, -kReach, kReach)) / h.maxCoeff());
        }
        const double error = std::abs(field->nearest(p).distance - truth) / h.maxCoeff();
        (truth < kReach ? errors : beyond).add(error);
      }
    }
  std::cout << "search against all surfels [longest spacings]: " << errors << "; beyond reach: " << beyond << '\n';
  CHECK(errors.worst() < 0.0058);
  CHECK(beyond.share(0.99) < 0.0057);
  CHECK(beyond.worst() < disc);
}

TEST_CASE("Tubes thinner than three voxels, at random places between the voxels and in random directions") {
  constexpr unsigned kSeed = 22;
  // Where the axis misses voxel centres, labels of so thin a tube come apart: no surface within their edges is nearer.
  struct Bound {
    double radius, p99, worst;  // [longest spacings]
  };
  constexpr double kMedian = 0.1;
  for (const Bound& bound : {Bound{0.7, 0.42, 0.75}, Bound{0.8, 0.40, 0.75}, Bound{1.0, 0.36, 0.65},
                             Bound{1.2, 0.33, 0.6}, Bound{1.4, 0.32, 0.6}}) {
    Random rng(kSeed);
    Figures errors;
    for (int c = 0; c < cases(40); ++c) {
      const double h = 3e-4, half = 9 * h;
      Labels labels({32, 32, 32}, Vec3d::Constant(h));
      const Vec3d centre = 0.5 * labels.end() + rng.arrow(0, h), axis = rng.unit();
      const auto shape = [&](const Vec3d& p) {
        const Vec3d q = p - centre;
        return (q - std::clamp(q.dot(axis), -half, half) * axis).norm() - bound.radius * h;
      };
      labels.fill(shape, 1);
      const auto field = build_structure_field(labels.view(), {.threads = 1});
      for (int n = 0; n < 3000; ++n) {
        const Vec3d p = labels.end().cwiseProduct(Vec3d{rng.uniform(), rng.uniform(), rng.uniform()});
        if (std::abs((p - centre).dot(axis)) > half || shape(p) < 0) continue;
        errors.add(std::abs(field->nearest(p).distance - shape(p)) / h);
      }
    }
    std::cout << "tube of radius " << bound.radius << " voxels: ";
    print("error", errors);
    std::ostringstream column;
    column << " / Radius " << std::fixed << std::setprecision(1) << bound.radius;
    documented("tubes", "Median" + column.str(), errors.median());
    documented("tubes", "p99" + column.str(), errors.share(0.99));
    documented("tubes", "Worst" + column.str(), errors.worst());
    if (!kSanitized) CHECK(errors.share(0.99) < bound.p99);  // of all the cases
    CHECK(errors.worst() < 1.5);
    CHECK(errors.worst() < bound.worst);
    CHECK(errors.median() < kMedian);
  }
}

TEST_CASE("Plates of one voxel, single voxels and structures that touch keep their surfaces") {
  const double h = 3e-4;
  Labels labels({32, 30, 28}, Vec3d::Constant(h));
  labels.set([](int i, int j, int k) {
    if (k == 10 && i > 3 && i < 28 && j > 3 && j < 26) return 1;  // a plate
    if (i == 20 && j == 15 && k == 20) return 2;                  // a voxel
    if (i >= 0 && i < 6 && j < 6 && k < 5) return 3;              // in the volume's corner
    if (i >= 6 && i < 12 && j < 6 && k < 5) return 4;             // beside it
    return 0;
  });
  for (const bool smooth : {false, true}) {
    const auto field = build_structure_field(labels.view(), {.smooth = smooth, .reach = 5 * h, .threads = 1});
    REQUIRE(field->structures() == 4);
    int wrong = 0;
    for (int k = -1; k <= 28; ++k)
      for (int j = -1; j <= 30; ++j)
        for (int i = -1; i <= 32; ++i) {
          const Vec3d p = h * Vec3d(i, j, k);
          const int label = labels.view().at(i, j, k);
          const NearestStructure d = field->nearest(p);
          wrong += (d.distance < 0) != (label > 0) || (label > 0 && d.structure != label - 1) ? 1 : 0;
          for (int s = 0; s < 4; ++s) wrong += (field->distance(s, p) < 0) != (label == s + 1) ? 1 : 0;
        }
    CHECK(wrong == 0);
    const auto at = [&](double i, double j, double k) { return field->nearest(h * Vec3d(i, j, k)).distance / h; };
    CHECK(at(15, 15, 12) == near(1.5, 0.02));     // above the plate
    CHECK(at(15, 15, 10) == near(-0.5, 0.02));    // in it
    CHECK(at(20, 15, 23) == near(2.5, 8.5e-15));  // above the voxel
    CHECK(at(3, 3, -0.5) < 1e-9);                 // the volume's end
    CHECK(at(3, 3, -2.5) < 2.1);                  // below it
    CHECK(at(3, 3, -2.5) > 1.4);
    // Where two structures touch, each ends.
    CHECK(field->distance(2, h * Vec3d(5, 2, 2)) / h == within(-0.5, 0.1));
    CHECK(field->distance(2, h * Vec3d(8, 2, 2)) / h == near(2.5, 0.1));
    CHECK(field->distance(3, h * Vec3d(3, 2, 2)) / h == near(2.5, 0.1));
  }
}

TEST_CASE("Beyond the volume distances are lower bounds") {
  constexpr unsigned kSeed = 23;
  Random rng(kSeed);
  const double h = 3e-4;
  Labels labels({24, 20, 16}, Vec3d::Constant(h));
  const Vec3d centre = h * Vec3d(11.3, 9.6, 8.2);
  const double radius = 5.5 * h;
  labels.fill([&](const Vec3d& p) { return (p - centre).norm() - radius; }, 1);
  const auto field = build_structure_field(labels.view(), {.reach = 4 * h, .threads = 1});
  constexpr double kError = 0.25;  // of the field in the volume [voxels]
  for (int n = 0; n < 20000; ++n) {
    const Vec3d p = centre + rng.arrow(0, 60 * h), q = p + rng.arrow(0, 2 * h);
    const double d = field->nearest(p).distance;
    const bool in_volume = (p.array() > -h).all() && (p.array() < labels.end().array() + h).all();
    if (!in_volume) CHECK_UNARY(d < (p - centre).norm() - radius + kError * h);
    CHECK_UNARY(std::abs(field->nearest(q).distance - d) < (q - p).norm() + field->slack());
    Vec3d gradient;
    CHECK_UNARY(field->nearest(p, gradient).distance == d);
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  CHECK(field->nearest(Vec3d(kInfinity, 0, 0)).structure == -1);
  CHECK(field->nearest(Vec3d(0, std::numeric_limits<double>::quiet_NaN(), 0)).structure == -1);
  CHECK(field->distance(0, Vec3d(0, 0, -kInfinity)) == 0);
}

TEST_CASE("Gradients are those of the interpolant") {
  constexpr unsigned kSeed = 24;
  Random rng(kSeed);
  Labels labels({24, 24, 12}, Vec3d(2e-4, 2e-4, 5e-4));
  labels.fill(random_shape(1, 0.5 * labels.end(), 3e-4, rng).distance, 1);
  const auto field = build_structure_field(labels.view(), {.threads = 1});
  constexpr double kStep = 1e-8;  // [m]
  int kinks = 0;
  for (int n = 0; n < 3000; ++n) {
    const Vec3d p =
        labels.end().cwiseProduct(Vec3d{rng.uniform(-0.3, 1.3), rng.uniform(-0.3, 1.3), rng.uniform(-0.3, 1.3)});
    Vec3d nearest, own, by_step, own_by_step;
    (void)field->nearest(p, nearest);
    (void)field->distance(0, p, own);
    for (Eigen::Index a = 0; a < 3; ++a) {
      const Vec3d step = kStep * Vec3d::Unit(a);
      by_step[a] = (field->nearest(p + step).distance - field->nearest(p - step).distance) / (2 * kStep);
      own_by_step[a] = (field->distance(0, p + step) - field->distance(0, p - step)) / (2 * kStep);
    }
    kinks += (by_step - nearest).norm() > 1e-4 || (own_by_step - own).norm() > 1e-4 ? 1 : 0;
  }
  CHECK(kinks < 3);  // points within a step of a cell's face
}

TEST_CASE("A structure's bricks hold every sample within reach") {
  constexpr unsigned kSeed = 25;
  Random rng(kSeed);
  Labels labels({40, 36, 30}, Vec3d::Constant(3e-4));
  for (int s = 0; s < 3; ++s)
    labels.fill(random_shape(s, 0.5 * labels.end() + rng.arrow(1e-3, 3e-3), 2e-4, rng).distance, s + 1);
  const auto field = build_structure_field(labels.view(), {.reach = 1e-3, .threads = 2});
  for (int s = 0; s < field->structures(); ++s) {
    std::size_t in_bricks = 0, found = 0;
    for (std::size_t b = 0; b < field->brick_count(s); ++b) {
      const std::array<int, 3> first = field->brick(s, b);
      for (int k = 0; k < 8; ++k)
        for (int j = 0; j < 8; ++j)
          for (int i = 0; i < 8; ++i)
            if (std::abs(field->sample(s, first[0] + i, first[1] + j, first[2] + k)) < field->reach()) ++in_bricks;
      bool listed = false;
      field->structures_near(first[0], first[1], first[2], [&](int t) { listed = listed || t == s; });
      CHECK(listed);
    }
    for (int k = -16; k < 48; ++k)
      for (int j = -16; j < 56; ++j)
        for (int i = -16; i < 56; ++i) found += std::abs(field->sample(s, i, j, k)) < field->reach() ? 1U : 0U;
    CHECK(in_bricks == found);
    CHECK(in_bricks > 500);
  }
}

TEST_CASE("Distances of a structure among others are those that it has alone, bit for bit") {
  constexpr unsigned kSeed = 27;
  Random rng(kSeed);
  Labels labels({60, 56, 50}, Vec3d::Constant(3e-4));
  constexpr int kCount = 4;
  for (int s = 0; s < kCount; ++s)
    labels.fill(random_shape(s, 0.5 * labels.end() + rng.arrow(2e-3, 5e-3), 2e-4, rng).distance, s + 1);
  const StructureFieldOptions options{.reach = 2e-3, .threads = 2};
  const auto together = build_structure_field(labels.view(), options);
  std::size_t own = 0, all = 0;
  for (int s = 0; s < kCount; ++s) {
    Labels lone(labels.size, labels.spacing);
    std::size_t n = 0;
    lone.set([&](int, int, int) { return labels.structure[n++] == s + 1 ? 1 : 0; });
    const auto alone = build_structure_field(lone.view(), options);
    std::size_t others = 0;
    for (int k = -12; k < 62; ++k)
      for (int j = -12; j < 68; ++j)
        for (int i = -12; i < 72; ++i) others += together->sample(s, i, j, k) != alone->sample(0, i, j, k) ? 1U : 0U;
    CHECK(others == 0);
    own += together->bytes();
    all += alone->brick_count(0);
  }
  // Most bricks have no samples of their own, and some do: both are looked up above.
  const std::size_t dense = 3 * 62 * 58 * 52, bands = own / kCount - dense;
  CHECK(bands > 20 * 1024);
  CHECK(bands < all * 512);
}

TEST_CASE("Labels at their edges: refused, all one, one voxel, 255 structures") {
  const Vec3d h = Vec3d::Constant(3e-4);
  Labels empty({8, 8, 8}, h);
  CHECK_THROWS_AS((void)build_structure_field(empty.view()), std::invalid_argument);
  LabelVolume wrong = empty.view();
  wrong.size[0] = 9;
  CHECK_THROWS_AS((void)build_structure_field(wrong), std::invalid_argument);
  Labels full({9, 8, 7}, h);
  full.set([](int, int, int) { return 1; });
  LabelVolume bad = full.view();
  bad.spacing.y() = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS((void)build_structure_field(bad), std::invalid_argument);
  CHECK_THROWS_AS((void)build_structure_field(full.view(), {.reach = 0}), std::invalid_argument);
  CHECK_THROWS_AS((void)build_structure_field(full.view(), {.reach = 1}), std::invalid_argument);
  CHECK_THROWS_AS((void)build_structure_field(full.view(), {.threads = -1}), std::invalid_argument);
  const auto block = build_structure_field(full.view());
  CHECK(block->nearest(h.cwiseProduct(Vec3d(4, 4, 3))).distance / h.x() == near(-3.5, 0.0033));
  CHECK(block->nearest(h.cwiseProduct(Vec3d(4, 4, -5))).distance / h.x() == near(4.25, 0.06));
  Labels voxel({1, 1, 1}, h);
  voxel.set([](int, int, int) { return 7; });
  const auto one = build_structure_field(voxel.view());
  CHECK(one->structures() == 7);
  CHECK(one->nearest(Vec3d::Zero()).structure == 6);
  CHECK(one->nearest(h.cwiseProduct(Vec3d(3, 0, 0))).distance / h.x() == near(2.25, 0.12));
  CHECK(one->distance(6, h.cwiseProduct(Vec3d(3, 0, 0))) / h.x() == near(2.5, 0.1));
  CHECK(one->distance(0, Vec3d::Zero()) == one->reach());  // a structure without voxels is nowhere near
  CHECK(one->brick_count(0) == 0);
  constexpr unsigned kSeed = 26;
  Random rng(kSeed);
  Labels noise({24, 24, 24}, h);
  noise.set([&](int, int, int) { return rng.below(256); });
  const auto many = build_structure_field(noise.view(), {.reach = 6e-4, .threads = 2});
  CHECK(many->structures() == 255);
  int wrong_signs = 0;
  for (int k = 0; k < 24; ++k)
    for (int j = 0; j < 24; ++j)
      for (int i = 0; i < 24; ++i) {
        const NearestStructure d = many->nearest(h.cwiseProduct(Vec3d(i, j, k)));
        const int label = noise.view().at(i, j, k);
        wrong_signs += (d.distance < 0) != (label > 0) || (label > 0 && d.structure != label - 1) ? 1 : 0;
      }
  CHECK(wrong_signs == 0);
}

TEST_CASE("Lookups take no memory, and a build does not depend on its threads") {
  constexpr unsigned kSeed = 27;
  Random rng(kSeed);
  Labels labels({50, 40, 70}, Vec3d(2e-4, 2e-4, 3e-4));
  for (int s = 0; s < 4; ++s)
    labels.fill(random_shape(s, 0.5 * labels.end() + rng.arrow(1e-3, 3e-3), 2e-4, rng).distance, s + 1);
  const auto one = build_structure_field(labels.view(), {.threads = 1}),
             three = build_structure_field(labels.view(), {.threads = 3});
  CHECK(one->bytes() == three->bytes());
  int differ = 0;
  for (int n = 0; n < 20000; ++n) {
    const Vec3d p =
        labels.end().cwiseProduct(Vec3d{rng.uniform(-0.2, 1.2), rng.uniform(-0.2, 1.2), rng.uniform(-0.2, 1.2)});
    differ += one->nearest(p).distance != three->nearest(p).distance ? 1 : 0;
    for (int s = 0; s < 4; ++s) differ += one->distance(s, p) != three->distance(s, p) ? 1 : 0;
  }
  CHECK(differ == 0);
  Vec3d gradient;
  const Vec3d p = 0.4 * labels.end();
  const auto calls = heap_calls([&] {
    (void)one->nearest(p);
    (void)one->nearest(p, gradient);
    (void)one->distance(1, p, gradient);
    (void)one->reaches(1, p);
  });
  CHECK(calls == 0);
  static_assert(noexcept(one->nearest(p))&& noexcept(one->nearest(p, gradient)));
  static_assert(noexcept(one->distance(0, p))&& noexcept(one->distance(0, p, gradient))&& noexcept(one->reaches(0, p)));
}
