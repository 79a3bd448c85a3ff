// SPDX-License-Identifier: Apache-2.0
// How many integrations lie between y and w = N x + g when M = 0.

#ifndef DLCS_CORE_ANALYSIS_RELATIVE_DEGREE_H_
#define DLCS_CORE_ANALYSIS_RELATIVE_DEGREE_H_

#include <optional>

#include "core/types.h"

namespace dlcs {

// The smallest k in 1, …, m with N A^{k-1} B != 0: the relative degree of a system with M = 0. Absent when
// all m Markov parameters vanish, and with them all (Cayley-Hamilton): then y never acts on w.
//
// An entry counts as zero when it is below the rounding of its own sum, (|N| |A|^{k-1} |B|)_ij, so the answer
// does not depend on units. 1 means index one (w' depends on y directly); from 2 on the solution holds
// Dirac impulses and their derivatives, and the methods of this engine must refuse.
//
// Not decided here: a system of which some rows of NB vanish and others do not has relative degree 1 in this
// sense although a single pair may have a higher one; nor is NB ≠ 0 enough for solutions to exist (see
// strict semicopositivity in [Shen & Pang 2007]).
//
// `A` m × m, `B` m × n, `N` n × m, finite. O(m²n) for each k.
std::optional<int> RelativeDegree(const Matrix& A, const Matrix& B, const Matrix& N);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_RELATIVE_DEGREE_H_
