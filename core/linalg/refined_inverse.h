// SPDX-License-Identifier: Apache-2.0
// An inverse that is accurate where the matrix is not well conditioned.

#ifndef DLCS_CORE_LINALG_REFINED_INVERSE_H_
#define DLCS_CORE_LINALG_REFINED_INVERSE_H_

#include "core/types.h"

namespace dlcs {

// matrix⁻¹ = value + rest. An inverse from factors alone has the condition times the rounding of its largest entries,
// which large right-hand sides show: two diodes in parallel across 10 kΩ, of 20 mΩ each, then share a current of 22 A
// with a difference of 1 mA. So the residual I - matrix · value is computed in twice the digits and solved for, until
// `value` is the inverse to rounding; one more residual gives `rest`. Its error is the condition times its rounding:
// the sum has some four digits more than `value` at a condition of 1e12. A matrix whose condition is below 1,000 is not
// refined.
//
// Source: [Higham 2002] N. J. Higham. Accuracy and Stability of Numerical Algorithms. SIAM. Section 12.1.
class RefinedInverse {
 public:
  // Not finite where the matrix is singular. Checks for a stop. Cost: 2 n³ operations; some 20 n for each nonzero entry
  // of the matrix in each of two to four steps of refinement.
  explicit RefinedInverse(const Matrix& matrix);

  const Matrix& value() const { return value_; }
  bool is_refined() const { return rest_.size() > 0; }

  // Sets entries to zero that are known to be zero.
  template <typename Condition>
  void SetZeroWhere(const Condition& is_zero) {
    value_ = is_zero.select(0, value_);
    if (is_refined()) rest_ = is_zero.select(0, rest_);
  }

  // rows · matrix⁻¹, each entry to its own rounding: the product with `value` has the rounding of its terms, of which
  // little may be left. What may be the error of the inverse alone is zero. Cost: that of the product; where the
  // inverse is refined, some 40 operations for each nonzero entry of `rows` and each column.
  Matrix Quotient(const Matrix& rows) const;
  // The sizes that the entries of that have some ulps of as errors.
  Matrix TermsOfQuotient(const Matrix& rows, const Matrix& quotient) const {
    return is_refined() ? Matrix(quotient.cwiseAbs()) : Matrix(rows.cwiseAbs() * value_.cwiseAbs());
  }

 private:
  Matrix value_;
  Matrix rest_;       // empty if not refined
  double error_ = 0;  // of value + rest, relative to `value`
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_REFINED_INVERSE_H_
