// SPDX-License-Identifier: Apache-2.0
// Does the free motion start into the region C x >= 0? Decided by the first derivatives of C e^{At} x0 that
// do not vanish.

#ifndef DLCS_CORE_ANALYSIS_SEMIOBSERVABILITY_H_
#define DLCS_CORE_ANALYSIS_SEMIOBSERVABILITY_H_

#include <optional>
#include <string>
#include <vector>

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// Row i of (Cx0, CAx0, ..., CA^{m-1}x0), up to the entry that decides its lexicographic sign.
struct LexicographicRow {
  enum class Sign { kNegative, kZero, kPositive, kUndecided };
  Sign sign = Sign::kZero;
  int power = 0;     // k of the deciding entry (C A^k x0)_i; m in a row of sign kZero
  double value = 0;  // that entry, divided by 2^{ek}, 2^e the power of two next above ‖A‖_∞
  double error = 0;  // bound of the rounding error of the computed entry, in the same unit
};

struct Semiobservability {
  std::vector<LexicographicRow> rows;  // n rows: the details of the lexicographic test
  Fact in_cone;                        // x0 in Y = { x : (Cx, CAx, ..., CA^{m-1}x) lexicographically >= 0 }
  Fact in_unobservable_space;          // x0 in Ō(C, A) = { x : CA^k x = 0, k = 0, ..., m-1 }; a no names its row in
                                       // `witness`
};

// Decides both memberships, taking the numbers as exact. `C` is n × m, `A` m × m, `x0` has m entries, all finite.
//
// Every product and sum is done with its rounding error (error-free transformations), and the errors are carried along:
// an entry counts as positive or negative if it is larger than its error, and as zero only if value and error are both
// exactly zero (always so for small integers). Otherwise the row, and what depends on it, is unknown. If `in_cone` is
// no, `witness.indices` holds the row and `witness.value` its entry. Cost: O(m²) for each of the at most m powers.
// Source: section 5.2 of [Shen & Pang 2007].
Semiobservability TestSemiobservability(const Matrix& C, const Matrix& A, const Vector& x0);

// One line for each row: "row 2: (C A x0)[2] = -1 ± 1e-16 (scaled)", with the bound of its rounding error.
std::string DescribeRow(const LexicographicRow& row, Index index);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_SEMIOBSERVABILITY_H_
