// SPDX-License-Identifier: Apache-2.0
// Vector-valued polynomials on one step, as Legendre series.

#ifndef DLCS_CORE_DISCRETIZATION_LEGENDRE_H_
#define DLCS_CORE_DISCRETIZATION_LEGENDRE_H_

#include "core/types.h"

namespace dlcs {

// Every function of time on a step [t, t + H] is a polynomial of this degree K in s in [-1, 1], time = t + H (1 + s) /
// 2. Twelve: 13 values on a third of its period give a sine to 1e-10, and a higher degree would be wasted on steps that
// an event cuts short. Even, so that the midpoint of the step is a node.
constexpr Index kLegendreDegree = 12;
constexpr Index kLegendreSize = kLegendreDegree + 1;

// Row i holds component i; column k is its coefficient of P_k.
using LegendreSeries = Eigen::Matrix<double, Eigen::Dynamic, kLegendreSize>;
// One number for each node, or for each coefficient.
using LegendreVector = Eigen::Matrix<double, kLegendreSize, 1>;
using LegendreMatrix = Eigen::Matrix<double, kLegendreSize, kLegendreSize>;

struct LegendreBasis {
  // The K + 1 Chebyshev points -cos(πj/K), from -1 to 1.
  LegendreVector nodes;
  // Column j holds P_0 ... P_K at node j: series * at_nodes = values.
  LegendreMatrix at_nodes;
  // values * from_nodes = series.
  LegendreMatrix from_nodes;
  // series * to_bernstein = coefficients of the Bernstein polynomials of degree K on [-1, 1].
  LegendreMatrix to_bernstein;
};

// Made once; safe from any thread.
const LegendreBasis& GetLegendreBasis();

// P_0(s) ... P_K(s): series * LegendreValues(s) is the value at s.
LegendreVector LegendreValues(double s);

// The same at many points: row i holds the values at s[i], with the bits of LegendreValues(s[i]).
using LegendreRows = Eigen::Matrix<double, Eigen::Dynamic, kLegendreSize>;
void LegendreValuesAt(const Eigen::Ref<const Vector>& s, LegendreRows& values);

// The value of `series` at s, for `at` = LegendreValues(s).
inline Vector ValueOf(const LegendreSeries& series, const LegendreVector& at) { return series.lazyProduct(at); }

// Up to this many rows and columns a product is faster without the blocking of large ones.
constexpr Index kSmallProduct = 24;

// matrix · series.
inline LegendreSeries Apply(const Matrix& matrix, const LegendreSeries& series) {
  if (matrix.rows() + matrix.cols() <= kSmallProduct) return matrix.lazyProduct(series);
  return matrix * series;
}

// Adds matrix · series to `sum`. With `is_steady`, the series is its first coefficient.
inline void AddApplied(const Matrix& matrix, const LegendreSeries& series, bool is_steady, LegendreSeries& sum) {
  if (is_steady) {
    sum.col(0) += matrix * series.col(0);
  } else {
    sum += Apply(matrix, series);
  }
}

// P_0'(s) ... P_K'(s), for `at` = LegendreValues(s).
LegendreVector LegendreSlopes(const LegendreVector& at);

// The series of the derivative by s, of each row: P_k' = (2k-1) P_{k-1} + (2k-5) P_{k-3} + ...
template <typename Series>
Series DerivativeOf(const Series& series) {
  constexpr Index K = kLegendreDegree;
  Series derivative(series.rows(), series.cols());
  derivative.col(K).setZero();
  derivative.col(K - 1) = series.col(K);
  for (Index k = K - 2; k >= 0; --k) derivative.col(k) = derivative.col(k + 2) + series.col(k + 1);
  for (Index k = 1; k < K; ++k) derivative.col(k) *= static_cast<double>(2 * k + 1);
  return derivative;
}
inline LegendreVector DerivativeOf(const LegendreVector& series) {
  return DerivativeOf<Eigen::Matrix<double, 1, kLegendreSize>>(series.transpose()).transpose();
}

// The series through `values`, one column for each node. A row of equal values has exactly one coefficient.
LegendreSeries InterpolateAtNodes(const LegendreSeries& values);

// Estimates for each row the truncation error of its series: the sum of the coefficients that would follow.
// Coefficients are taken in pairs, since every other one vanishes for an even or odd function. With ρ the ratio of the
// last two pairs, the estimate is ρ/(1-√ρ)² times the last pair: little more than the next pair if coefficients decay
// fast, and many times the last one if they decay algebraically because of a kink.
//
// `rounding` bounds the rounding error in a coefficient of each row; coefficients below it are not evidence of an
// error. If it is not given, it is that of interpolation, 8ε times the size of the row.
Vector EstimateTail(const LegendreSeries& series, const Vector& rounding);
Vector EstimateTail(const LegendreSeries& series);

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_LEGENDRE_H_
