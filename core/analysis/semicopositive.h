// SPDX-License-Identifier: Apache-2.0
// Strictly semicopositive matrices (completely S, strictly semimonotone), and those of type I.

#ifndef DLCS_CORE_ANALYSIS_SEMICOPOSITIVE_H_
#define DLCS_CORE_ANALYSIS_SEMICOPOSITIVE_H_

#include "core/analysis/fact.h"
#include "core/types.h"

namespace dlcs {

// The largest n for which every index set gets its linear program.
inline constexpr Index kMaxLinearProgramSize = 12;

// Whether z >= 0 and z ∘ Mz <= 0 imply z = 0: (1) of [Shen & Pang 2007]. `M` square, finite, n >= 1.
//
// Yes for nonnegative matrices with positive diagonal and for P-matrices of any size; else, for n <=
// kMaxLinearProgramSize, by the value of the matrix game min_z max_i (M_SS z)_i over the simplex for every
// index set S. No comes with `witness.indices` = S and `witness.z` >= 0, z != 0, of |S| entries, with
// M_SS z <= 0. Unknown beyond that size, and where a value is within 1e-7 of zero (for rows and columns
// scaled to size one): rounding could decide there. 2ⁿ small linear programs.
Fact TestStrictlySemicopositive(const Matrix& M);

// Whether M is strictly semicopositive of type I, section 4 of [Shen & Pang 2007]. Yes by Proposition 3 (a)
// (nonnegative with positive diagonal), 3 (b)-(d) (symmetric and strictly semicopositive), or Proposition 4
// (n <= 2 and strictly semicopositive); no, with its witness, when M is not strictly semicopositive, which
// type I implies; otherwise unknown.
Fact TestSemicopositiveTypeI(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_SEMICOPOSITIVE_H_
