// SPDX-License-Identifier: Apache-2.0
// What counts as zero in an LCP: parts of the terms that a number is the sum of (core/linalg/bounded_sum.h). Each row
// and each column has its own terms, since they may have different units (volts and amperes).

#ifndef DLCS_CORE_LCP_BASIS_TOLERANCE_H_
#define DLCS_CORE_LCP_BASIS_TOLERANCE_H_

#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

// For each row the size of the terms that q = N x + g is the sum of, the maximum over the columns: the rounding in q_i
// is 1e-16 times this size, and w_i smaller than kLcpTolerance times it counts as zero.
Vector SizeOfSums(const StructuredMatrix& N, const Eigen::Ref<const Matrix>& x, const Eigen::Ref<const Matrix>& g);

// The rounding of w = q + M y for a y that stands as it is: that of 90 operations on each term. Errors do not all have
// one sign, so that it serves for thousands of terms.
inline constexpr double kRowRounding = 1e-14;
// A row may be off by so many times that where factors of a nearly singular basis do not reach it.
inline constexpr double kTimesLooser = 50;
// The rounding of numbers that went through one solve with a basis, and of q = N x + g with such an x.
inline constexpr double kLcpTolerance = 1e-13;
// The rounding of numbers that came from an elimination, whatever the condition of the basis was.
inline constexpr double kWorkingPrecision = 1e-11;
// A number between the parts above and this one may be zero: only another look at it tells.
inline constexpr double kMaybeZero = 1e-10;
// Two results of different solves that differ by less than this part are the same.
inline constexpr double kSameResult = 1e-9;
// Results that differ by more than this part are different, whatever rounding did on the way.
inline constexpr double kClearDifference = 1e-6;

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BASIS_TOLERANCE_H_
