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

SparseMatrix SparseIdentity(Index size);

// tridiag(off, diagonal, off)
SparseMatrix Tridiagonal(Index size, double diagonal, double off);

// `weight` times a unit vector for each of `rows`, as the columns of a matrix of `size` rows.
SparseMatrix UnitColumns(Index size, const std::vector<Index>& rows, double weight);

// The fields that all models on grids have.
struct GridFields {
  Index cells, dimensions;
  double horizon;
};

// What is wrong with them, if a grid of the model has `least` or `least` + 1 dimensions. x0 has at most some 16 million
// entries.
std::vector<Violation> CheckGrid(const GridFields& fields, Index least);
// Adds what is wrong with a field that must be positive.
void CheckPositive(const std::string& field, double value, std::vector<Violation>& violations);

}  // namespace dlcs

#endif  // DLCS_CORE_MODELS_GRID_OPERATORS_H_
