// SPDX-License-Identifier: Apache-2.0
// Tests one matrix for every matrix class of the theory.

#ifndef DLCS_CORE_MATRIX_CLASSES_CLASS_PROFILE_H_
#define DLCS_CORE_MATRIX_CLASSES_CLASS_PROFILE_H_

#include "core/matrix_classes/copositive.h"
#include "core/matrix_classes/fact.h"
#include "core/matrix_classes/minor_classes.h"
#include "core/matrix_classes/quadratic_form.h"
#include "core/matrix_classes/semicopositive.h"
#include "core/types.h"

namespace dlcs {

// The definitions and the witnesses stand with the functions named.
struct ClassProfile {
  MinorClasses minors;                   // nondegenerate, P, P0, N, NP, PN: ClassifyByMinors()
  QuadraticFormClasses quadratic_form;   // positive definite and semidefinite: ClassifyQuadraticForm()
  Fact z;                                // no off-diagonal entry is positive: TestZMatrix()
  Fact hidden_z;                         // M X = Y with Z-matrices X, Y: TestHiddenZ()
  Fact m;                                // Z and P, that is Z and S: TestMMatrix()
  Fact s;                                // some z >= 0 has Mz > 0: TestSMatrix()
  SemicopositiveClasses semicopositive;  // strictly and weakly: ClassifySemicopositive()
  CopositiveClasses copositive;          // strictly and not: ClassifyCopositive()
  Fact type_one, type_two, type_three;   // section 4 of [Shen & Pang 2007]: TestSemicopositiveTypeI()
  // What follows for LCP(q, M) from the classes above, with their witness; where nothing follows, by definition for
  // small n (core/matrix_classes/exact_classes.h).
  Fact r0;  // y = 0 is the only solution of LCP(0, M): nondegenerate or strictly semicopositive
  Fact q;   // LCP(q, M) has a solution for every q: P or strictly semicopositive; never where M is not S
  Fact q0;  // every feasible LCP(q, M) has a solution: Q, Z, or positive semidefinite
};

// Tests `M`, square and finite, n >= 1, for all of them. Where rounding could decide, the answer is unknown: Classify()
// of core/matrix_classes/matrix_class.h, which has to choose a rule for the solver, decides there. Where a class is
// implied by another that is known, it is known too. Cost: up to three times 2ⁿ minors for n <= 20, else polynomial.
ClassProfile ProfileOf(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_CLASS_PROFILE_H_
