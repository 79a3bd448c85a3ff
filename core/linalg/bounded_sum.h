// SPDX-License-Identifier: Apache-2.0
// Sums together with the sums of the absolute values of their terms, and what rounding can make of them.
//
// Every operation of doubles has a relative error of at most u = 2⁻⁵³. If each term of a sum goes through at most k
// operations on its way, in whatever order, the computed sum differs from the exact one by at most
//
//     γ_k Σ |terms|,     γ_k = k u / (1 - k u),                                       [Higham 2002], (3.2) and (3.3)
//
// and by k u Σ |terms| if it is a sum or a dot product [Jeannerod 2013]. The number k of operations is
//
//     n - 1     for a sum of n numbers,
//     n         for a dot product of n pairs, and so for each entry of a product A x with n columns: (3.5),
//     n + 1     for c + A x,
//     n + m     for B (A x) with n columns of A and m of B, the terms being those of |B| |A| |x|,
//     3 n       for the residual b - A x of a solve with the LU factors of an n × n matrix A, the terms being those of
//               |L| |U| |x|: Theorem 9.4.
//
// k u is used for all of them. Σ |terms| is computed with rounding, too, and may be too small by the same factor: twice
// as many operations allow for that, and for the difference between γ_k and k u. No bound holds where terms underflow.
//
// Sources: [Higham 2002] N. J. Higham. Accuracy and stability of numerical algorithms. Second edition. SIAM.
//          [Jeannerod 2013] C.-P. Jeannerod, S. M. Rump. Improved error bounds for inner products in floating-point
//          arithmetic. SIAM Journal on Matrix Analysis and Applications 34, 338-344.

#ifndef DLCS_CORE_LINALG_BOUNDED_SUM_H_
#define DLCS_CORE_LINALG_BOUNDED_SUM_H_

#include <cmath>
#include <limits>

#include "core/types.h"

namespace dlcs {

// The factor k u.
constexpr double RoundingOf(Index operations) {
  return static_cast<double>(operations) * (std::numeric_limits<double>::epsilon() / 2);
}

// An ulp: the largest distance of neighbors, as a part of them.
inline constexpr double kUlp = RoundingOf(2);

// The factor for c + A x, where A has so many columns, and the sum of the sizes of the terms is rounded, too.
constexpr double RoundingOfProduct(Index columns) { return RoundingOf(2 * (columns + 1)); }

struct BoundedSum {
  double value = 0;
  double terms = 0;  // the sum of the absolute values

  void Add(double term) {
    value += term;
    terms += std::abs(term);
  }

  // At most by how much rounding has changed the value, where each term went through so many operations.
  double Rounding(Index operations) const { return RoundingOf(operations) * terms; }
  // Returns whether the value may be rounding alone; false for NaN.
  bool IsZero(Index operations) const { return std::abs(value) <= Rounding(operations); }
  // -1 or 1 if the exact sum has that sign, and 0 if rounding may decide.
  int Sign(Index operations) const {
    if (value > Rounding(operations)) return 1;
    return value < -Rounding(operations) ? -1 : 0;
  }
};

// Sums that make a vector or a matrix.
template <typename Values>
struct BoundedSums {
  Values value;
  Values terms;

  // The parts of terms that count as rounding are RoundingOf() some operations, or more. None of the three holds where
  // a value is NaN.
  bool AllPositive(double part) const { return (value.array() > part * terms.array()).all(); }
  bool AllNegative(double part) const { return (value.array() < -part * terms.array()).all(); }
  bool NoneNegative(double part) const { return (value.array() >= -part * terms.array()).all(); }
  // Returns the values, with zeros in place of those that may be rounding alone.
  Values WithoutRounding(double part) const { return (value.array().abs() <= part * terms.array()).select(0, value); }
};

// Returns A x, for A dense or sparse, x a vector or a matrix.
template <typename AnyMatrix, typename Values>
BoundedSums<Values> BoundedProduct(const AnyMatrix& A, const Values& x) {
  return {A * x, A.cwiseAbs() * x.cwiseAbs()};
}

// Returns c + A x.
template <typename AnyMatrix>
BoundedSums<Vector> BoundedProduct(const AnyMatrix& A, const Vector& x, const Vector& c) {
  return {c + A * x, c.cwiseAbs() + A.cwiseAbs() * x.cwiseAbs()};
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_BOUNDED_SUM_H_
