// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"

#include <doctest/doctest.h>

#include <algorithm>

/// Renderers that pass over what lies beyond the volume, beside the same ones on a field that does not know its end.
namespace {

using namespace trephine;
using namespace trephine::test;

constexpr Burr kBurr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0.03};

template <class Renderer>
void check_same(Renderer all, unsigned seed) {
  CAPTURE(seed);
  using Scalar = typename Renderer::Scalar;
  // A head, and bone that the volume's side cuts off.
  const RasterOptions o{.size = {90, 70, 60}};
  const auto grid = rasterise<std::uint8_t>(Either{Ball{o.middle(), 3e-3}, Ball{Vec3d(26e-3, 10e-3, 3e-3), 2e-3}}, o);
  const auto field = field_of<Scalar, typename Renderer::Gradient>(grid, o);
  const CountingField plain(field);
  static_assert(BoundedField<decltype(field)> && !BoundedField<decltype(plain)>);
  Renderer skips = all;
  Random random(seed);
  Posed X = Posed::Identity();
  double pace = 1;
  int touching = 0, differ = 0;
  for (int i = 0; i < 20000; ++i) {
    // Anywhere in and round the volume, and then seven ticks of a hand from there: slow or quick.
    if (i % 8 == 0) {
      X = make_pose<double>(random.rotation(),
                            o.middle() + 1.4 * random.uniform(-1, 1) * o.middle().norm() * random.unit());
      pace = std::pow(10.0, random.uniform(-2, 0));
    }
    X = make_pose<double>(rotation_from_vector(Vec3d(0.05 * pace * random.unit())) * X.linear(),
                          X.translation() + 2e-3 * pace * random.unit());
    const auto a = render_at(all, plain, X), b = render_at(skips, field, X);
    touching += a.contact.count > 0 ? 1 : 0;
    differ += a.wrench == b.wrench && a.status == b.status && a.contact.count == b.contact.count &&
                      a.contact.depth == b.contact.depth && all.proxy_pose().matrix() == skips.proxy_pose().matrix() &&
                      std::ranges::equal(
                          all.contacts(), skips.contacts(),
                          [](const auto& x, const auto& y) { return x.position == y.position && x.force == y.force; })
                  ? 0
                  : 1;
  }
  CHECK(differ == 0);
  CHECK(touching > 200);
}

TEST_CASE_TEMPLATE("what is passed over beyond the volume changes no bit", Scalar, float, double) {
  check_same(LineApproxRenderer<Scalar>(ToolDiscretization<LineCounts, Scalar>(kBurr, {})), 4);
  check_same(LineApproxRenderer<Scalar, RayCast, Coulomb>(ToolDiscretization<LineCounts, Scalar>(kBurr, {})), 5);
  check_same(SurfaceApproxRenderer<Scalar>(ToolDiscretization<SurfaceCounts, Scalar>(kBurr, SurfaceCounts::thesis())),
             1);
}

}  // namespace
