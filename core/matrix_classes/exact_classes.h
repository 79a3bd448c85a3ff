// SPDX-License-Identifier: Apache-2.0
// Classes of small matrices, decided in exact arithmetic.

#ifndef DLCS_CORE_MATRIX_CLASSES_EXACT_CLASSES_H_
#define DLCS_CORE_MATRIX_CLASSES_EXACT_CLASSES_H_

#include <optional>

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// Decided by definition, with the entries taken as exact, in integers of any length (core/linalg/exact_program.h), for
// matrices of up to these sizes whose entries have less than 128 bits in common. All these classes are kept when rows
// and columns are multiplied by positive numbers. Unknown beyond.
inline constexpr Index kMaxExactS = 12;
inline constexpr Index kMaxExactR0 = 6;
inline constexpr Index kMaxExactQ = 4;
inline constexpr Index kMaxExactHiddenZ = 4;

// Some z >= 0 has M z > 0 (the witness z); otherwise some z >= 0, z != 0, has Mᵀz <= 0 (the witness). One linear
// program.
Fact ExactlyS(const Matrix& M);

// LCP(0, M) has the solution 0 alone; the witness of a no is another. 2ⁿ linear programs: is there a z >= 0, z != 0,
// zero beside S, with (M z)_S = 0 and M z >= 0?
Fact ExactlyR0(const Matrix& M);

// LCP(q, M) has a solution for every q, and for every q for which it is feasible. LCP(q, M) is solvable for q in the
// complementary cones, one for each S, of the columns -M_j, j in S, and e_j beside it. Where M_SS is nonsingular the
// cone is full; the union of the full ones is closed, so that it is enough to cover all but a set of measure zero. Only
// beside facets beyond which the neighbor is missing can there be a hole: what the other cones leave there is cut into
// polyhedral cones of one dimension less. The witness z of a no is a q. Unknown after several thousand linear programs.
Fact ExactlyQ(const Matrix& M);
Fact ExactlyQ0(const Matrix& M);

// (4.10) of [Chen & Xiang]; X is the witness of a yes. By the choices of core/matrix_classes/hidden_z_choices.h, 2ⁿ
// linear programs.
Fact ExactlyHiddenZ(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_EXACT_CLASSES_H_
