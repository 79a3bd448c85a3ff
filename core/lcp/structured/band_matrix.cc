// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/band_matrix.h"

#include <algorithm>
#include <cmath>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/simd/simd.h"

namespace dlcs {
namespace {

Vector AbsRowSums(const Matrix& K) {
  Vector sums = Vector::Zero(K.rows());
  for (Index j = 0; j < K.cols(); ++j) sums += K.col(j).cwiseAbs();
  return sums;
}

// t of a reflected K, or nothing. The middle row is the one that the ends reflect least into.
std::vector<double> FindReflected(const Matrix& K, Index bandwidth) {
  const Index n = K.rows(), middle = n / 2;
  if (n < 2 * bandwidth + 2) return {};
  std::vector<double> t(static_cast<std::size_t>(2 * n + 1), 0);
  for (Index d = 0; d <= bandwidth; ++d) t[static_cast<std::size_t>(d)] = K(middle, middle - d);
  const auto at = [&](Index d) { return t[static_cast<std::size_t>(d)]; };
  const double allowed = RoundingOf(16) * K.row(middle).cwiseAbs().sum();
  for (Index j = 0; j < n; ++j) {
    for (Index i = std::max<Index>(0, j - bandwidth); i <= std::min(n - 1, j + bandwidth); ++i) {
      const double reflected = at(std::abs(i - j)) - at(i + j + 2) - at(2 * n - i - j);
      if (!(std::abs(K(i, j) - reflected) <= allowed)) return {};
    }
  }
  t.resize(static_cast<std::size_t>(bandwidth + 1));
  return t;
}

// product_i = t_0 y_i + Σ_d t_d (y_{i-d} + y_{i+d}) for kVectors vectors of entries, which stay in registers.
template <typename V, int kVectors>
DLCS_INLINE void SumNeighbors(const double* t, Index bandwidth, const double* y, double* product) {
  constexpr Index kWidth = sizeof(V) / sizeof(double);
  V sums[kVectors];
  for (int v = 0; v < kVectors; ++v) sums[v] = Load<V>(y + v * kWidth) * t[0];
  for (Index d = 1; d <= bandwidth; ++d) {
    for (int v = 0; v < kVectors; ++v) {
      sums[v] += t[d] * (Load<V>(y + v * kWidth - d) + Load<V>(y + v * kWidth + d));
    }
  }
  for (int v = 0; v < kVectors; ++v) Store(sums[v], product + v * kWidth);
}

template <typename V>
DLCS_INLINE void SumAllNeighbors(const double* t, Index bandwidth, const double* y, Index n, double* product) {
  constexpr int kVectors = 4;
  constexpr Index kWidth = sizeof(V) / sizeof(double);
  constexpr Index kAtOnce = kVectors * kWidth;
  Index i = 0;
  for (; i + kAtOnce <= n; i += kAtOnce) SumNeighbors<V, kVectors>(t, bandwidth, y + i, product + i);
  if (i < n && n >= kAtOnce) {  // some once more
    i = n;
    SumNeighbors<V, kVectors>(t, bandwidth, y + n - kAtOnce, product + n - kAtOnce);
  }
  for (; i < n; ++i) SumNeighbors<double, 1>(t, bandwidth, y + i, product + i);
}

void SumBaseline(const double* t, Index bandwidth, const double* y, Index n, double* product) {
  SumAllNeighbors<Double2>(t, bandwidth, y, n, product);
}
DLCS_TARGET("avx2") void SumAvx2(const double* t, Index bandwidth, const double* y, Index n, double* product) {
  SumAllNeighbors<Double4>(t, bandwidth, y, n, product);
}
DLCS_TARGET("avx512f") void SumAvx512(const double* t, Index bandwidth, const double* y, Index n, double* product) {
  SumAllNeighbors<Double8>(t, bandwidth, y, n, product);
}

}  // namespace

Index BandwidthUpToRounding(const Matrix& K) {
  const Index n = K.rows();
  const Vector allowed = RoundingOf(16) * AbsRowSums(K);
  const auto counts = [&](Index i, Index j) { return !(std::abs(K(i, j)) <= allowed[i]); };
  Index bandwidth = 1;
  for (Index j = 0; j < n; ++j) {
    for (Index i = 0; i < j - bandwidth; ++i) {
      if (counts(i, j)) bandwidth = j - i;
    }
    for (Index i = n - 1; i > j + bandwidth; --i) {
      if (counts(i, j)) bandwidth = i - j;
    }
  }
  return bandwidth;
}

BandMatrix::BandMatrix(const Matrix& K, Index bandwidth)
    : size_(K.rows()), bandwidth_(bandwidth), entries_(static_cast<std::size_t>(K.rows() * (2 * bandwidth + 1)), 0) {
  for (Index j = 0; j < size_; ++j) {
    const Index last = std::min(size_ - 1, j + bandwidth);
    for (Index i = std::max<Index>(0, j - bandwidth); i <= last; ++i) Row(i)[j - i] = K(i, j);
  }
}

BandProduct::BandProduct(const Matrix& K, Index bandwidth)
    : n_(K.rows()),
      bandwidth_(std::min(bandwidth, K.rows() - 1)),
      reflected_(FindReflected(K, bandwidth_)),
      padded_y_(Vector::Zero(n_ + 2 * bandwidth_ + 2)) {
  if (is_reflected()) return;
  diagonal_ = K.diagonal();
  above_ = below_ = Matrix::Zero(n_, bandwidth_);
  for (Index d = 1; d <= bandwidth_; ++d) {
    above_.col(d - 1).head(n_ - d) = K.diagonal(d);
    below_.col(d - 1).tail(n_ - d) = K.diagonal(-d);
  }
}

void BandProduct::operator()(const Vector& y, Vector& product) {
  padded_y_.segment(bandwidth_ + 1, n_) = y;
  product.resize(n_);
  double* const first = padded_y_.data() + bandwidth_ + 1;
  if (is_reflected()) {
    for (Index d = 0; d < bandwidth_; ++d) {
      first[-2 - d] = -first[d];
      first[n_ + 1 + d] = -first[n_ - 1 - d];
    }
    static const auto sum = ChooseVersion(SumBaseline, SumAvx2, SumAvx512);
    return sum(reflected_.data(), bandwidth_, first, n_, product.data());
  }
  product = diagonal_.cwiseProduct(y);
  const Index n = n_;
  for (Index d = 1; d <= bandwidth_; ++d) {
    RunWide([n, sums = product.data(), above_d = above_.col(d - 1).data(), below_d = below_.col(d - 1).data(),
             after = first + d, before = first - d]() DLCS_WIDE {
      double* __restrict sum = sums;
      const double* __restrict above = above_d;
      const double* __restrict below = below_d;
      for (Index i = 0; i < n; ++i) sum[i] += above[i] * after[i] + below[i] * before[i];
    });
  }
}

}  // namespace dlcs
