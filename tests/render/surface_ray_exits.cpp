// SPDX-License-Identifier: MIT
#include "support/fields.hpp"
#include "support/near.hpp"

#include <trephine/contact/surface_search.hpp>
#include <trephine/render/surface/ray_exits.hpp>

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;

TEST_CASE_TEMPLATE("ways out in batches against one segment at a time", Scalar, float, double) {
  const RasterOptions o{.size = {48, 48, 48}};
  const double h = o.spacing.x();
  Random random(83);
  for (const Image image : {Image::kCtBlur, Image::kBinary}) {
    RasterOptions of = o;
    of.image = image;
    const auto grid = rasterise<std::uint8_t>(
        Either{Ball{o.middle(), 10 * h}, Plate{o.middle(), Vec3d(1, 2, 3).normalized(), 3 * h}}, of);
    const auto field = field_of<Scalar>(grid, of);
    const Pose<Scalar> X = make_pose<double>(random.rotation(), Vec3d(0.001, 0.002, 0.0005)).template cast<Scalar>();
    for (const int rays : {1, 2, 31, 32, 33, 100}) {
      RayExits<Scalar> ways(rays);
      struct Ray {
        Vec3<Scalar> from, direction;
        Scalar length;
      };
      std::vector<Ray> all;
      while (static_cast<int>(all.size()) < rays) {
        const Vec3<Scalar> p_G = (o.middle() + h * random.arrow(0, 11)).template cast<Scalar>();
        if (field.value(p_G) < 0) continue;
        const Vec3<Scalar> p = X.inverse(Eigen::Isometry) * p_G;
        const Scalar value = field.value(X * p);
        if (!(value >= 0)) continue;
        all.push_back({p, random.unit().template cast<Scalar>(), static_cast<Scalar>(random.uniform(2, 25) * h)});
        ways.add(p, all.back().direction, all.back().length, value);
      }
      ways.search(field, X, static_cast<Scalar>(0.5 * h));
      REQUIRE(ways.count() == rays);
      for (int i = 0; i < rays; ++i) {
        const Ray& ray = all[static_cast<std::size_t>(i)];
        const Vec3<Scalar> a = X * ray.from, b = X * Vec3<Scalar>(ray.from + ray.length * ray.direction);
        const auto hit = first_crossing(field, a, b, static_cast<Scalar>(0.05 * h), 100000);
        const double exact = static_cast<double>(hit.found ? (hit.before + hit.after) / 2 * ray.length : ray.length);
        const double way = static_cast<double>(ways[i]);
        CAPTURE(i);
        // Steps of half a voxel may pass over a sliver that a finer search sees; then the way found is longer and ends
        // on a surface too.
        if (way > exact + 0.01 * h) {
          if (way < static_cast<double>(ray.length) * 0.999) {
            const Scalar before =
                field.value(X * Vec3<Scalar>(ray.from + static_cast<Scalar>(way - 0.01 * h) * ray.direction));
            const Scalar after =
                field.value(X * Vec3<Scalar>(ray.from + static_cast<Scalar>(way + 0.01 * h) * ray.direction));
            CHECK((before >= 0) != (after >= 0));
          }
        } else {
          CHECK(std::abs(way - exact) <= 3e-3 * h);
        }
      }
    }
  }
}

TEST_CASE("a ray that never leaves the bone answers its length; an empty list asks nothing") {
  const ShapeField<double, Ball> field(Ball{Vec3d::Zero(), 1.0}, 1e-3);
  const CountingField counted(field);
  RayExits<double> ways(4);
  ways.search(counted, Posed::Identity(), 5e-4);
  CHECK(counted.samples == 0);
  ways.add(Vec3d::Zero(), Vec3d::UnitX(), 0.01, 1000.0);
  ways.add(Vec3d(0.999, 0, 0), Vec3d::UnitX(), 0.01, 1.0);
  ways.search(counted, Posed::Identity(), 5e-4);
  CHECK(ways[0] == 0.01);
  CHECK(ways[1] == near(0.001, 1.3e-13));
  ways.clear();
  CHECK(ways.count() == 0);
}

}  // namespace
