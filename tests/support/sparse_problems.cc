// SPDX-License-Identifier: Apache-2.0
#include "tests/support/sparse_problems.h"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace dlcs::testing {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

SparseMatrix Assemble(Index rows, Index columns, const Triplets& entries) {
  SparseMatrix matrix(rows, columns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// D u'' - v u' on `side` inner points of the unit interval.
SparseMatrix Line(Index side, double diffusion, double speed) {
  const double points = static_cast<double>(side + 1);
  Triplets entries;
  for (Index i = 0; i < side; ++i) {
    entries.emplace_back(i, i, -2 * diffusion * points * points);
    if (i > 0) entries.emplace_back(i, i - 1, diffusion * points * points + speed * points / 2);
    if (i + 1 < side) entries.emplace_back(i, i + 1, diffusion * points * points - speed * points / 2);
  }
  return Assemble(side, side, entries);
}

}  // namespace

Problem AdvectedGrid(const GridShape& shape) {
  KroneckerSum sum;
  for (int d = 0; d < shape.dimensions; ++d) sum.factors.push_back(Line(shape.side, shape.diffusion, shape.speed));
  Problem problem;
  problem.A = StructuredMatrix(sum.Assemble());
  const Index m = problem.num_states(), n = shape.constraints;

  Triplets B, N, M;
  constexpr Index kPatch = 2;
  for (Index i = 0; i < n; ++i) {
    const Index center = (2 * i + 1) * m / (2 * n);
    B.emplace_back(center, i, 4.0);
    for (Index k = 0; k < kPatch; ++k) N.emplace_back(i, (center + k) % m, 1.0 / kPatch);
    M.emplace_back(i, i, 4.0);
    if (i > 0) M.emplace_back(i, i - 1, -1.0);
    if (i + 1 < n) M.emplace_back(i, i + 1, -1.0);
  }
  problem.B = StructuredMatrix(Assemble(m, n, B));
  problem.N = StructuredMatrix(Assemble(n, m, N));
  problem.M = StructuredMatrix(Assemble(n, n, M));

  problem.f = TimeFunction::Formulas({"-1 - sin(5*t)"});
  problem.f.lift = Matrix::Ones(m, 1);
  std::vector<std::string> levels;
  for (Index i = 0; i < n; ++i) levels.push_back("-0.4 + 0.3*cos(6*t + " + std::to_string(i % 7) + ")");
  problem.g = TimeFunction::Formulas(levels);
  problem.x0 = Vector::Ones(m);
  problem.horizon = 1;
  return problem;
}

Problem WithDenseMatrices(const Problem& problem) {
  Problem dense = problem;
  for (StructuredMatrix* matrix : {&dense.A, &dense.B, &dense.N, &dense.M}) *matrix = Matrix(matrix->Sparse());
  return dense;
}

}  // namespace dlcs::testing
