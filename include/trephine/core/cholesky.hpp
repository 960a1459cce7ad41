// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <cmath>

namespace trephine {

/// Solves H x = b for a symmetric positive definite matrix of fixed size by Cholesky's factorisation; reads H's lower
/// triangle. Returns false, with x as it was, where H is not positive definite (or not finite). Eigen's takes a
/// compiler three seconds.
template <int kSize>
[[nodiscard]] bool solve_positive_definite(const Eigen::Matrix<double, kSize, kSize>& H,
                                           const Eigen::Matrix<double, kSize, 1>& b,
                                           Eigen::Matrix<double, kSize, 1>& x) noexcept {
  double L[kSize][kSize];
  double y[kSize];
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < i; ++j) {
      double sum = H(i, j);
      for (int k = 0; k < j; ++k) sum -= L[i][k] * L[j][k];
      L[i][j] = sum * L[j][j];
    }
    double rest = H(i, i);
    for (int k = 0; k < i; ++k) rest -= L[i][k] * L[i][k];
    if (!(rest > 0) || !std::isfinite(rest)) return false;
    L[i][i] = 1 / std::sqrt(rest);  // the diagonal's reciprocal
    y[i] = b[i];
    for (int k = 0; k < i; ++k) y[i] -= L[i][k] * y[k];
    y[i] *= L[i][i];
  }
  for (int i = kSize - 1; i >= 0; --i) {
    for (int k = i + 1; k < kSize; ++k) y[i] -= L[k][i] * y[k];
    y[i] *= L[i][i];
  }
  for (int i = 0; i < kSize; ++i) x[i] = y[i];
  return true;
}

}  // namespace trephine
