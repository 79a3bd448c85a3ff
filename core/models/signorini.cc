// SPDX-License-Identifier: Apache-2.0
#include "core/models/signorini.h"

#include <cmath>
#include <utility>
#include <vector>

#include "core/format_number.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

// tridiag(off, diagonal, off)
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

// weight (I ⊗ e_1), Q² × Q.
SparseMatrix OnMembrane(Index size, double weight) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Index q = 0; q < size; ++q) entries.emplace_back(q * size, q, weight);
  SparseMatrix matrix(size * size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

std::vector<Violation> ValidateModel(const SignoriniModel& model) {
  // x0 has Q² entries, and so has every requested state.
  constexpr Index kMaxCells = 4096;
  std::vector<Violation> violations;
  if (model.cells < 2 || model.cells > kMaxCells) {
    violations.push_back(
        {"cells", "is " + std::to_string(model.cells) + ", must be from 2 to " + std::to_string(kMaxCells)});
  }
  if (!(model.coefficient > 0) || !std::isfinite(model.coefficient)) {
    violations.push_back({"coefficient", "is " + NumberText(model.coefficient) + ", must be positive and finite"});
  }
  if (!(model.horizon > 0) || !std::isfinite(model.horizon)) {
    violations.push_back({"horizon", "is " + NumberText(model.horizon) + ", must be positive and finite"});
  }
  return violations;
}

// ψ at the points of the membrane.
TimeFunction Obstacle(const SignoriniModel& model) {
  std::vector<std::string> psi;
  for (Index q = 0; q + 1 < model.cells; ++q) {
    // |x2 - 1/2| <= 1/4 for x2 = (q+1)/cells, in integers.
    const bool middle = 2 * std::abs(2 * (q + 1) - model.cells) <= model.cells;
    psi.push_back(middle ? model.psi_middle : model.psi_sides);
  }
  return TimeFunction::Formulas(std::move(psi));
}

}  // namespace

absl::StatusOr<Problem> MakeSignoriniProblem(const SignoriniModel& model) {
  if (const absl::Status status = StatusOf(ValidateModel(model)); !status.ok()) return status;
  const Index size = model.cells - 1;
  const auto cells = static_cast<double>(model.cells);
  const double weight = model.coefficient * cells * cells;

  Problem problem;
  const SparseMatrix difference = Tridiagonal(size, -2 * weight, weight);
  problem.A = KroneckerSum{{difference, difference}};
  problem.B = OnMembrane(size, weight);
  problem.N = SparseMatrix(OnMembrane(size, -2).transpose());
  problem.M = Tridiagonal(size, 4, -1);
  problem.f = Obstacle(model);
  problem.f.lift = problem.B;
  problem.g = Obstacle(model);
  problem.g.lift = problem.M;
  problem.x0.resize(size * size);
  for (Index q = 0; q < size; ++q) {
    for (Index p = 0; p < size; ++p) {
      const double x1 = static_cast<double>(p + 1) / cells, x2 = static_cast<double>(q + 1) / cells;
      problem.x0(q * size + p) = 20 * x1 * x2 * (1 - x1) * (1 - x2);
    }
  }
  problem.horizon = model.horizon;
  // Only the formulas of ψ can still be wrong.
  if (const absl::Status status = StatusOf(Validate(problem)); !status.ok()) return status;
  return problem;
}

}  // namespace dlcs
