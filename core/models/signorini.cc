// SPDX-License-Identifier: Apache-2.0
#include "core/models/signorini.h"

#include <cmath>
#include <utility>
#include <vector>

#include "core/models/grid_operators.h"

namespace dlcs {
namespace {

// ψ at the points of the membrane.
TimeFunction Obstacle(const SignoriniModel& model) {
  // |x - 1/2| <= 1/4 for x = (k+1)/cells, in integers.
  const auto is_middle = [&](Index k) { return 2 * std::abs(2 * (k + 1) - model.cells) <= model.cells; };
  const Index size = model.cells - 1;
  std::vector<std::string> psi;
  for (Index r = 0; r < (model.dimensions == 2 ? 1 : size); ++r) {
    for (Index q = 0; q < size; ++q) {
      const bool middle = is_middle(q) && (model.dimensions == 2 || is_middle(r));
      psi.push_back(middle ? model.psi_middle : model.psi_sides);
    }
  }
  return TimeFunction::Formulas(std::move(psi));
}

}  // namespace

absl::StatusOr<Problem> MakeSignoriniProblem(const SignoriniModel& model) {
  std::vector<Violation> violations = CheckGrid({model.cells, model.dimensions, model.horizon}, 2);
  CheckPositive("coefficient", model.coefficient, violations);
  if (const absl::Status status = StatusOf(violations); !status.ok()) return status;
  const bool is_cube = model.dimensions == 3;
  const Index size = model.cells - 1, pairs = is_cube ? size * size : size;
  const auto cells = static_cast<double>(model.cells);
  const double weight = model.coefficient * cells * cells;
  std::vector<Index> at_membrane;
  for (Index k = 0; k < pairs; ++k) at_membrane.push_back(k * size);

  Problem problem;
  const SparseMatrix difference = Tridiagonal(size, -2 * weight, weight);
  problem.A = is_cube ? KroneckerSum{{difference, difference, difference}} : KroneckerSum{{difference, difference}};
  problem.B = UnitColumns(pairs * size, at_membrane, weight);
  problem.N = SparseMatrix(UnitColumns(pairs * size, at_membrane, -2).transpose());
  problem.M = is_cube ? KroneckerSum{{Tridiagonal(size, 3, -1), Tridiagonal(size, 3, -1)}}.Assemble()
                      : Tridiagonal(size, 4, -1);
  problem.f = Obstacle(model);
  problem.f.lift = problem.B;
  problem.g = Obstacle(model);
  problem.g.lift = problem.M;
  problem.x0.resize(pairs * size);
  for (Index k = 0; k < pairs; ++k) {
    for (Index p = 0; p < size; ++p) {
      const double x1 = static_cast<double>(p + 1) / cells, x2 = static_cast<double>(k % size + 1) / cells;
      const double x3 = static_cast<double>(k / size + 1) / cells;
      const double of_square = 20 * x1 * x2 * (1 - x1) * (1 - x2);
      problem.x0(k * size + p) = is_cube ? 5 * of_square * x3 * (1 - x3) : of_square;
    }
  }
  problem.horizon = model.horizon;
  // Only the formulas of ψ can still be wrong.
  if (const absl::Status status = StatusOf(Validate(problem)); !status.ok()) return status;
  return problem;
}

}  // namespace dlcs
