// SPDX-License-Identifier: MIT
#include <trephine/core/cholesky.hpp>

#include <doctest/doctest.h>

#include <Eigen/Dense>

#include <limits>
#include <random>

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

TEST_CASE("cholesky: solves positive definite systems, reading the lower triangle alone") {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  const auto any = [&] { return normal(random); };
  for (int c = 0; c < 100; ++c) {
    const Mat6 A = Mat6::NullaryExpr(any);
    const Mat6 H = A * A.transpose() + 0.1 * Mat6::Identity();
    const Vec6 b = Vec6::NullaryExpr(any);
    Vec6 x;
    REQUIRE(trephine::solve_positive_definite<6>(Mat6(H.triangularView<Eigen::Lower>()), b, x));
    constexpr double kRounding = 3e-16;  // stable: the condition does not enter
    CHECK((H * x - b).norm() < kRounding * H.norm() * x.norm());
  }
}

TEST_CASE("cholesky: refuses what is not positive definite or not finite") {
  Vec6 x = Vec6::Constant(7);
  const Vec6 b = Vec6::Ones();
  Mat6 H = Mat6::Identity();
  H(3, 3) = -1;
  CHECK_FALSE(trephine::solve_positive_definite<6>(H, b, x));
  H(3, 3) = std::nan("");
  CHECK_FALSE(trephine::solve_positive_definite<6>(H, b, x));
  CHECK(x == Vec6::Constant(7));
}

TEST_CASE("linear systems: elimination solves any that is regular, and refuses the others") {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto any = [&] { return normal(random); };
  for (int n = 0; n < 200; ++n) {
    Mat6 A = Mat6::NullaryExpr(any);
    const Vec6 x = Vec6::NullaryExpr(any);
    if (n % 2 == 0) A.diagonal().setZero();  // no pivot where it stands
    Vec6 solved = Vec6::Zero();
    REQUIRE(trephine::solve_linear<6>(A, Vec6(A * x), solved));
    constexpr double kRounding = 6e-16;
    CHECK((A * (solved - x)).norm() <= kRounding * A.norm() * x.norm());
    const Vec6 kept = solved;
    A.col(3).setZero();
    CHECK_FALSE(trephine::solve_linear<6>(A, x, solved));
    A.setIdentity();
    A(1, 5) = std::numeric_limits<double>::quiet_NaN();
    CHECK_FALSE(trephine::solve_linear<6>(A, x, solved));
    CHECK(solved == kept);
  }
}
