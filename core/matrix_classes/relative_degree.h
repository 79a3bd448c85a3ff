// SPDX-License-Identifier: Apache-2.0
// How many integrations lie between y and w = N x + g + M y.

#ifndef DLCS_CORE_MATRIX_CLASSES_RELATIVE_DEGREE_H_
#define DLCS_CORE_MATRIX_CLASSES_RELATIVE_DEGREE_H_

#include <optional>
#include <string>
#include <vector>

#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

// For each row i of w = N x + g + M y: how many integrations lie between y and w_i. 0 where row i of M is not zero;
// else the smallest k in 1, …, m with N_i A^{k-1} B != 0; absent where there is none, and none beyond m either
// (Cayley-Hamilton): then y never affects w_i, and the data alone decide whether w_i >= 0.
//
// An entry counts as zero when it is below the rounding of its own sum, (|N| |A|^{k-1} |B|)_ij, so the answer does not
// depend on units. From degree 2 on, impulses are needed to keep w_i >= 0 when w_i reaches zero. If all rows have such
// a degree, the methods refuse the problem; if some have, they warn. 1 for all rows of M = 0 means index one, which is
// not yet enough for solutions to exist (see strict semicopositivity in [Shen & Pang 2007]).
//
// `A` m × m, `B` m × n, `N` n × m, `M` n × n, finite. Cost: O(m (m + n)) for each row and each of its integrations.
std::vector<std::optional<int>> RelativeDegrees(const Matrix& A, const Matrix& B, const Matrix& N, const Matrix& M);

// The same for structured matrices, without making them dense.
std::vector<std::optional<int>> RelativeDegrees(const StructuredMatrix& A, const StructuredMatrix& B,
                                                const StructuredMatrix& N, const StructuredMatrix& M);

// The relative degree of a system with M = 0: the least degree of its rows, absent where y never acts on w.
std::optional<int> RelativeDegree(const Matrix& A, const Matrix& B, const Matrix& N);

// The rows of degree two and more, increasing.
std::vector<Index> ImpulsiveRows(const std::vector<std::optional<int>>& degrees);

// The rows that y never affects, increasing.
std::vector<Index> UnreachedRows(const std::vector<std::optional<int>>& degrees);

// "constraint 2 (relative degree 3)", "constraints 0 (relative degree 2), 3 (relative degree 2)"; without a degree
// where it is absent. At most five of `rows` are named.
std::string DescribeRows(const std::vector<Index>& rows, const std::vector<std::optional<int>>& degrees);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_RELATIVE_DEGREE_H_
