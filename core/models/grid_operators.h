// SPDX-License-Identifier: Apache-2.0
// Matrices on regular grids, and the rules that models on grids share.

#ifndef DLCS_CORE_MODELS_GRID_OPERATORS_H_
#define DLCS_CORE_MODELS_GRID_OPERATORS_H_

#include <string>
#include <vector>

#include "core/linalg/structured_matrix.h"
#include "core/problem/violation_list.h"
#include "core/types.h"

namespace dlcs {

// tridiag(off, diagonal, off)
SparseMatrix Tridiagonal(Index size, double diagonal, double off);

// `weight` times a unit vector for each of `rows`, as the columns of a matrix of `size` rows.
SparseMatrix UnitColumns(Index size, const std::vector<Index>& rows, double weight);

// The most cells of a grid in each direction: x0 then has some 16 million entries.
inline Index MaxCells(Index dimensions) { return dimensions == 1 ? 1'000'000 : dimensions == 2 ? 4096 : 256; }

// Adds what is wrong with these fields of a model.
void CheckDimensions(Index dimensions, Index least, Index most, std::vector<Violation>& violations);
void CheckCells(Index cells, Index dimensions, std::vector<Violation>& violations);
void CheckPositive(const std::string& field, double value, std::vector<Violation>& violations);

}  // namespace dlcs

#endif  // DLCS_CORE_MODELS_GRID_OPERATORS_H_
