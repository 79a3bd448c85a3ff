// SPDX-License-Identifier: Apache-2.0
// The facts about a matrix M of a linear complementarity problem that a solve depends on.

#ifndef DLCS_CORE_MATRIX_CLASSES_CLASS_FACTS_H_
#define DLCS_CORE_MATRIX_CLASSES_CLASS_FACTS_H_

#include <optional>
#include <string>

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

struct MatrixClass {
  Fact z;                      // off-diagonal entries <= 0
  Fact p;                      // all principal minors > 0
  Fact positive_semidefinite;  // yᵀMy >= 0 for all y (M need not be symmetric)
  Fact hidden_z;               // tested only if the rule needs it; the witness holds X, Y, r and s
  Index size = 0;              // n
  bool zero = false;           // M = 0
  bool zero_row = false;       // some row of M is zero: a constraint on the state alone
  // max ‖(M_SS)⁻¹‖_∞ over nonsingular principal submatrices: the Lipschitz constant L (2.3) of [Chen & Xiang
  // 2013] of the solution (P) or least-element solution (Z, hidden Z); absent for other matrices. Exact for n <= 12 and
  // for M-matrices; beyond, a bound for H-matrices (diagonally dominant ones among them) and positive
  // definite ones, otherwise absent. See core/matrix_classes/lipschitz.h.
  std::optional<double> lipschitz;
  // As text, the strongest statement first: "P- and Z-matrix (nonsingular M-matrix)".
  std::string description;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_CLASS_FACTS_H_
