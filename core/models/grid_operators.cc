// SPDX-License-Identifier: Apache-2.0
#include "core/models/grid_operators.h"

#include <cmath>

#include "core/format_number.h"

namespace dlcs {

SparseMatrix SparseIdentity(Index size) {
  SparseMatrix identity(size, size);
  identity.setIdentity();
  return identity;
}

SparseMatrix Tridiagonal(Index size, double diagonal, double off) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Index i = 0; i < size; ++i) {
    entries.emplace_back(i, i, diagonal);
    if (i > 0) entries.emplace_back(i, i - 1, off);
    if (i + 1 < size) entries.emplace_back(i, i + 1, off);
  }
  SparseMatrix matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

SparseMatrix UnitColumns(Index size, const std::vector<Index>& rows, double weight) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < rows.size(); ++k) entries.emplace_back(rows[k], static_cast<Index>(k), weight);
  SparseMatrix matrix(size, static_cast<Index>(rows.size()));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

std::vector<Violation> CheckGrid(const GridFields& fields, Index least) {
  const auto [cells, dimensions, horizon] = fields;
  std::vector<Violation> violations;
  if (dimensions < least || dimensions > least + 1) {
    violations.push_back({"dimensions", "is " + std::to_string(dimensions) + ", must be " + std::to_string(least) +
                                            " or " + std::to_string(least + 1)});
  }
  const Index most = dimensions == 1 ? 1'000'000 : dimensions == 2 ? 4096 : 256;
  if (cells < 2 || cells > most) {
    violations.push_back({"cells", "is " + std::to_string(cells) + ", must be from 2 to " + std::to_string(most)});
  }
  CheckPositive("horizon", horizon, violations);
  return violations;
}

void CheckPositive(const std::string& field, double value, std::vector<Violation>& violations) {
  if (value > 0 && std::isfinite(value)) return;
  violations.push_back({field, "is " + NumberText(value) + ", must be positive and finite"});
}

}  // namespace dlcs
