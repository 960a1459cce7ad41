// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <utility>

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

/// Solves A x = b by elimination with row pivots. Returns false, with x as it was, where A is singular (or not finite).
template <int kSize>
[[nodiscard]] bool solve_linear(const Eigen::Matrix<double, kSize, kSize>& A, const Eigen::Matrix<double, kSize, 1>& b,
                                Eigen::Matrix<double, kSize, 1>& x) noexcept {
  double M[kSize][kSize + 1];
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) M[i][j] = A(i, j);
    M[i][kSize] = b[i];
  }
  for (int i = 0; i < kSize; ++i) {
    int pivot = i;
    for (int r = i + 1; r < kSize; ++r)
      if (std::abs(M[r][i]) > std::abs(M[pivot][i])) pivot = r;
    if (!(std::abs(M[pivot][i]) > 0) || !std::isfinite(M[pivot][i])) return false;
    if (pivot != i)
      for (int c = i; c <= kSize; ++c) std::swap(M[i][c], M[pivot][c]);
    for (int r = i + 1; r < kSize; ++r) {
      const double share = M[r][i] / M[i][i];
      for (int c = i + 1; c <= kSize; ++c) M[r][c] -= share * M[i][c];
    }
  }
  Eigen::Matrix<double, kSize, 1> y;
  for (int i = kSize - 1; i >= 0; --i) {
    double rest = M[i][kSize];
    for (int c = i + 1; c < kSize; ++c) rest -= M[i][c] * y[c];
    y[i] = rest / M[i][i];
    if (!std::isfinite(y[i])) return false;
  }
  x = y;
  return true;
}

}  // namespace trephine
