// SPDX-License-Identifier: Apache-2.0
#include "core/models/obstacle.h"

#include <vector>

#include "core/models/grid_operators.h"

namespace dlcs {

absl::StatusOr<Problem> MakeObstacleProblem(const ObstacleModel& model) {
  std::vector<Violation> violations = CheckGrid({model.cells, model.dimensions, model.horizon}, 1);
  CheckPositive("coefficient", model.coefficient, violations);
  if (const absl::Status status = StatusOf(violations); !status.ok()) return status;

  const Index points = model.cells - 1, size = model.dimensions == 1 ? points : points * points;
  const auto cells = static_cast<double>(model.cells);
  const double weight = model.coefficient * cells * cells;
  Problem problem;
  const SparseMatrix difference = Tridiagonal(points, -2 * weight, weight);
  problem.A = model.dimensions == 1 ? KroneckerSum{{difference}} : KroneckerSum{{difference, difference}};
  problem.B = problem.N = SparseIdentity(size);
  problem.M = SparseMatrix(size, size);
  Vector psi(size);
  for (Index k = 0; k < size; ++k) {
    const double s = static_cast<double>(k % points + 1) / cells - 0.5;
    const double r = model.dimensions == 1 ? 0 : static_cast<double>(k / points + 1) / cells - 0.5;
    psi[k] = 0.5 - 4 * (s * s + r * r);
  }
  problem.f = TimeFunction::Formulas({model.load});
  problem.f.lift = SparseMatrix(Matrix::Ones(size, 1).sparseView());
  problem.g = TimeFunction::Constant(-psi);
  problem.x0 = psi.cwiseMax(0);
  problem.horizon = model.horizon;
  // Only the formula of the load can still be wrong.
  if (const absl::Status status = StatusOf(Validate(problem)); !status.ok()) return status;
  return problem;
}

}  // namespace dlcs
