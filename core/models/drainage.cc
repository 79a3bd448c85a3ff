// SPDX-License-Identifier: Apache-2.0
#include "core/models/drainage.h"

#include <cmath>
#include <vector>

#include "core/models/grid_operators.h"

namespace dlcs {
namespace {

// Drain k of `drains` lies in the middle of its part of the field.
std::vector<Index> CellsOfDrains(const DrainageModel& model) {
  const auto cell = [&](Index k) { return (2 * k + 1) * model.cells / (2 * model.drains); };
  std::vector<Index> cells;
  for (Index r = 0; r < (model.dimensions == 1 ? 1 : model.drains); ++r) {
    for (Index k = 0; k < model.drains; ++k) {
      cells.push_back(model.dimensions == 1 ? cell(k) : cell(r) * model.cells + cell(k));
    }
  }
  return cells;
}

}  // namespace

absl::StatusOr<Problem> MakeDrainageProblem(const DrainageModel& model) {
  std::vector<Violation> violations = CheckGrid({model.cells, model.dimensions, model.horizon}, 1);
  if (model.drains < 1 || model.drains > model.cells) {
    violations.push_back({"drains", "is " + std::to_string(model.drains) + ", must be from 1 to the " +
                                        std::to_string(model.cells) + " cells"});
  }
  CheckPositive("coefficient", model.coefficient, violations);
  CheckPositive("conductance", model.conductance, violations);
  if (const absl::Status status = StatusOf(violations); !status.ok()) return status;

  const auto cells = static_cast<double>(model.cells);
  const double weight = model.coefficient * cells * cells;
  const Index size = model.dimensions == 1 ? model.cells : model.cells * model.cells;
  SparseMatrix difference = Tridiagonal(model.cells, -2 * weight, weight);
  difference.coeffRef(0, 0) = difference.coeffRef(model.cells - 1, model.cells - 1) = -weight;
  const std::vector<Index> drains = CellsOfDrains(model);
  const auto pairs = static_cast<Index>(drains.size());

  Problem problem;
  problem.A = model.dimensions == 1 ? KroneckerSum{{difference}} : KroneckerSum{{difference, difference}};
  problem.B = UnitColumns(size, drains, -std::pow(cells, static_cast<double>(model.dimensions)));
  problem.N = SparseMatrix(UnitColumns(size, drains, -1).transpose());
  problem.M = SparseMatrix(SparseIdentity(pairs) / model.conductance);
  problem.f = TimeFunction::Formulas({model.recharge});
  problem.f.lift = SparseMatrix(Matrix::Ones(size, 1).sparseView());
  problem.g = TimeFunction::Zero(pairs);
  problem.x0 = Vector::Constant(size, 0.5);
  problem.horizon = model.horizon;
  // Only the formula of the recharge can still be wrong.
  if (const absl::Status status = StatusOf(Validate(problem)); !status.ok()) return status;
  return problem;
}

}  // namespace dlcs
