// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>

#include <Eigen/Core>

#include <cmath>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// Solves H x = b for a symmetric positive definite matrix of fixed size by Cholesky factorisation. Reads the lower
/// triangle of H. Returns false, and leaves x unchanged, if H is not positive definite or not finite. Eigen's own
/// factorisation adds three seconds of compile time.
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
    double pivot = H(i, i);
    for (int k = 0; k < i; ++k) pivot -= L[i][k] * L[i][k];
    if (!(pivot > 0) || !is_finite(pivot)) return false;
    L[i][i] = 1 / std::sqrt(pivot);  // the diagonal is stored as its reciprocal
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

/// Solves A x = b by Gaussian elimination with partial pivoting. Returns false, and leaves x unchanged, if A is
/// singular or not finite.
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
    if (!(std::abs(M[pivot][i]) > 0) || !is_finite(M[pivot][i])) return false;
    if (pivot != i)
      for (int c = i; c <= kSize; ++c) std::swap(M[i][c], M[pivot][c]);
    for (int r = i + 1; r < kSize; ++r) {
      const double factor = M[r][i] / M[i][i];
      for (int c = i + 1; c <= kSize; ++c) M[r][c] -= factor * M[i][c];
    }
  }
  Eigen::Matrix<double, kSize, 1> y;
  for (int i = kSize - 1; i >= 0; --i) {
    double residual = M[i][kSize];
    for (int c = i + 1; c < kSize; ++c) residual -= M[i][c] * y[c];
    y[i] = residual / M[i][i];
    if (!is_finite(y[i])) return false;
  }
  x = y;
  return true;
}

}  // namespace trephine
