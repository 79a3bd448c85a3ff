// SPDX-License-Identifier: Apache-2.0

#include "core/discretization/legendre.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// P_{k+1} = (2k+1)/(k+1) s P_k - k/(k+1) P_{k-1}.
struct Recurrence {
  std::array<double, kLegendreSize> of_last{}, of_before{};
};
constexpr Recurrence MakeRecurrence() {
  Recurrence recurrence;
  for (Index k = 1; k < kLegendreDegree; ++k) {
    const auto degree = static_cast<double>(k);
    recurrence.of_last[k] = (2 * degree + 1) / (degree + 1);
    recurrence.of_before[k] = degree / (degree + 1);
  }
  return recurrence;
}
constexpr Recurrence kRecurrence = MakeRecurrence();

double Binomial(Index n, Index k) {
  double value = 1;
  for (Index i = 1; i <= k; ++i) value = value * static_cast<double>(n - k + i) / static_cast<double>(i);
  return std::round(value);
}

// P_k = Σ_i (-1)^{k+i} C(k, i) B_i^k, raised to degree K: B_i^k = Σ_j C(k, i) C(K-k, j-i) / C(K, j) B_j^K.
LegendreMatrix BernsteinCoefficients() {
  LegendreMatrix matrix = LegendreMatrix::Zero();
  for (Index k = 0; k < kLegendreSize; ++k) {
    for (Index j = 0; j < kLegendreSize; ++j) {
      for (Index i = std::max<Index>(0, j - (kLegendreDegree - k)); i <= std::min(k, j); ++i) {
        const double raised = Binomial(k, i) * Binomial(kLegendreDegree - k, j - i) / Binomial(kLegendreDegree, j);
        matrix(k, j) += ((k + i) % 2 ? -1 : 1) * Binomial(k, i) * raised;
      }
    }
  }
  return matrix;
}

LegendreBasis MakeBasis() {
  LegendreBasis basis;
  for (Index j = 0; j < kLegendreSize; ++j) {
    // sin, not cos: symmetric, and exactly 0 in the middle.
    const double angle = std::numbers::pi * static_cast<double>(2 * j - kLegendreDegree) / (2 * kLegendreDegree);
    basis.nodes[j] = std::sin(angle);
    basis.at_nodes.col(j) = LegendreValues(basis.nodes[j]);
  }
  basis.from_nodes = basis.at_nodes.fullPivLu().inverse();
  basis.to_bernstein = BernsteinCoefficients();
  return basis;
}

}  // namespace

const LegendreBasis& GetLegendreBasis() {
  static const LegendreBasis basis = MakeBasis();
  return basis;
}

LegendreVector LegendreValues(double s) {
  LegendreVector values;
  values[0] = 1;
  values[1] = s;
  for (Index k = 1; k < kLegendreDegree; ++k) {
    values[k + 1] = kRecurrence.of_last[k] * s * values[k] - kRecurrence.of_before[k] * values[k - 1];
  }
  return values;
}

void LegendreValuesAt(const Eigen::Ref<const Vector>& s, LegendreRows& values) {
  values.resize(s.size(), kLegendreSize);
  values.col(0).setOnes();
  values.col(1) = s;
  for (Index k = 1; k < kLegendreDegree; ++k) {
    values.col(k + 1).array() = kRecurrence.of_last[k] * s.array() * values.col(k).array() -
                                kRecurrence.of_before[k] * values.col(k - 1).array();
  }
}

LegendreVector LegendreSlopes(const LegendreVector& at) {
  LegendreVector slopes;
  slopes[0] = 0;
  slopes[1] = 1;
  for (Index k = 1; k < kLegendreDegree; ++k) slopes[k + 1] = slopes[k - 1] + static_cast<double>(2 * k + 1) * at[k];
  return slopes;
}

LegendreSeries InterpolateAtNodes(const LegendreSeries& values) {
  const Vector first = values.col(0);
  const LegendreSeries differences = values.colwise() - first;
  LegendreSeries series(values.rows(), kLegendreSize);
  if (values.rows() <= kSmallProduct / 2) {
    series = differences.lazyProduct(GetLegendreBasis().from_nodes);
  } else {
    series.noalias() = differences * GetLegendreBasis().from_nodes;
  }
  series.col(0) += first;
  return series;
}

Vector EstimateTail(const LegendreSeries& series) {
  return EstimateTail(series, RoundingOf(16) * series.cwiseAbs().rowwise().sum());
}

Vector EstimateTail(const LegendreSeries& series, const Vector& rounding) {
  constexpr Index K = kLegendreDegree;
  Vector tail(series.rows());
  for (Index i = 0; i < tail.size(); ++i) {
    const double last = NanMax(0, NanMax(std::abs(series(i, K)), std::abs(series(i, K - 1))) - rounding[i]);
    const double before = NanMax(std::abs(series(i, K - 2)), std::abs(series(i, K - 3)));
    const double ratio = std::clamp(last / before, 1e-2, 0.8);
    const double left = 1 - std::sqrt(ratio);
    tail[i] = last == 0 ? 0 : last * ratio / (left * left);
  }
  return tail;
}

}  // namespace dlcs
