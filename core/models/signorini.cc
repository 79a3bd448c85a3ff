// SPDX-License-Identifier: Apache-2.0
#include "core/models/signorini.h"

#include <cmath>
#include <utility>
#include <vector>

#include "core/number_text.h"
#include "core/soundness.h"

namespace dlcs {
namespace {

// D = tridiag(1, -2, 1).
Matrix SecondDifference(Index size) {
  Matrix D = -2 * Matrix::Identity(size, size);
  D.diagonal(1).setOnes();
  D.diagonal(-1).setOnes();
  return D;
}

std::vector<Violation> ValidateModel(const SignoriniModel& model) {
  // A has Q⁴ entries: 200 cells are 12 GB.
  constexpr Index kMostCells = 200;
  std::vector<Violation> violations;
  if (model.cells < 2 || model.cells > kMostCells) {
    violations.push_back(
        {"cells", "is " + std::to_string(model.cells) + ", must be from 2 to " + std::to_string(kMostCells)});
  }
  if (!(model.coefficient > 0) || !std::isfinite(model.coefficient)) {
    violations.push_back(
        {"coefficient", "is " + NumberText(model.coefficient) + ", must be positive and finite"});
  }
  if (!(model.horizon > 0) || !std::isfinite(model.horizon)) {
    violations.push_back({"horizon", "is " + NumberText(model.horizon) + ", must be positive and finite"});
  }
  return violations;
}

// The formulas of B ψ and of M ψ.
struct Sources {
  std::vector<std::string> f, g;
};

Sources MakeSources(const SignoriniModel& model) {
  const Index size = model.cells - 1;
  const auto cells = static_cast<double>(model.cells);
  const auto psi = [&](Index q) {
    // |x2 - 1/2| <= 1/4 for x2 = (q+1)/cells, in integers.
    const bool middle = 2 * std::abs(2 * (q + 1) - model.cells) <= model.cells;
    return "(" + (middle ? model.psi_middle : model.psi_sides) + ")";
  };
  const std::string weight = NumberText(model.coefficient * cells * cells);
  Sources sources{std::vector<std::string>(size * size, "0"), std::vector<std::string>(size)};
  for (Index q = 0; q < size; ++q) {
    sources.f[q * size] = weight + "*" + psi(q);
    sources.g[q] = "4*" + psi(q);
    if (q > 0) sources.g[q] += " - " + psi(q - 1);
    if (q + 1 < size) sources.g[q] += " - " + psi(q + 1);
  }
  return sources;
}

}  // namespace

absl::StatusOr<Problem> MakeSignoriniProblem(const SignoriniModel& model) {
  if (const absl::Status status = StatusOf(ValidateModel(model)); !status.ok()) return status;
  const Index size = model.cells - 1;
  const auto cells = static_cast<double>(model.cells);
  const double weight = model.coefficient * cells * cells;
  const Matrix D = SecondDifference(size);

  Problem problem;
  problem.A = Matrix::Zero(size * size, size * size);
  problem.B = Matrix::Zero(size * size, size);
  problem.x0.resize(size * size);
  for (Index q = 0; q < size; ++q) {
    problem.A.block(q * size, q * size, size, size) += weight * D;
    for (Index r = 0; r < size; ++r)
      problem.A.block(q * size, r * size, size, size).diagonal().array() += weight * D(q, r);
    problem.B(q * size, q) = weight;
    for (Index p = 0; p < size; ++p) {
      const double x1 = static_cast<double>(p + 1) / cells, x2 = static_cast<double>(q + 1) / cells;
      problem.x0(q * size + p) = 20 * x1 * x2 * (1 - x1) * (1 - x2);
    }
  }
  problem.N = -2 / weight * problem.B.transpose();
  problem.M = 2 * Matrix::Identity(size, size) - D;
  Sources sources = MakeSources(model);
  problem.f = TimeFunction::Formulas(std::move(sources.f));
  problem.g = TimeFunction::Formulas(std::move(sources.g));
  problem.horizon = model.horizon;
  // What is left to be wrong are the formulas of ψ.
  if (const absl::Status status = StatusOf(Validate(problem)); !status.ok()) return status;
  return problem;
}

}  // namespace dlcs
