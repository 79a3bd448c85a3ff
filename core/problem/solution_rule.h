// SPDX-License-Identifier: Apache-2.0
// Which solution of a linear complementarity problem is meant.

#ifndef DLCS_CORE_PROBLEM_SOLUTION_RULE_H_
#define DLCS_CORE_PROBLEM_SOLUTION_RULE_H_

#include "core/types.h"

namespace dlcs {

// Which solution of LCP(N x + g, M) is meant if there are several. Whether a rule is allowed depends on M.
enum class SolutionRule {
  kAuto,          // unique for a P-matrix, least element for a Z-matrix, otherwise any solution of the coupled step
  kUnique,        // M must be a P-matrix
  kLeastElement,  // M must be a Z-matrix
  kHiddenLeastElement,  // least in the order of pos X, (4.11) of [Chen & Xiang]; M must be a hidden Z-matrix
  kLeastNorm,           // least ‖y‖₂; M positive semidefinite, or of any class for n <= 12
  kMinimizer,           // least ‖C y - b‖₂ with `Problem::selector`; the same M
  kSparsest,            // fewest y_i > 0, then least ‖y‖₂; M a P- or Z-matrix, or of any class for n <= 12
  kHistory,             // the one that continues the solution before, from `Problem::y0` on; event_driven only
};

// What kMinimizer minimizes over all solutions: ‖C y - b‖₂, as in Example 2.1 of [Chen & Xiang]. Where
// several solutions attain the minimum, the one of least norm is taken.
struct Selector {
  Matrix C;  // k × n, k >= 1, of any rank
  Vector b;  // k
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_SOLUTION_RULE_H_
