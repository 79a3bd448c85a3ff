// SPDX-License-Identifier: Apache-2.0
#include "core/models/american_option.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/format_number.h"
#include "core/models/grid_operators.h"

namespace dlcs {
namespace {

struct Neighbor {
  Index first, second;  // offsets in the two directions
  double weight;
};

// The differences of the equation at one point; `step` is that of z.
std::vector<Neighbor> StencilOf(const AmericanOptionModel& model, double step) {
  const double variance = model.volatility * model.volatility;
  const double diffusion = variance / (2 * step * step), drift = (model.rate - variance / 2) / (2 * step);
  std::vector<Neighbor> stencil = {{-1, 0, diffusion - drift}, {1, 0, diffusion + drift}};
  if (model.dimensions == 2) {
    const Index sign = model.correlation < 0 ? -1 : 1;
    const double mixed = std::abs(model.correlation) * diffusion;
    for (Neighbor& neighbor : stencil) neighbor.weight -= mixed;
    stencil.push_back({0, -1, diffusion - drift - mixed});
    stencil.push_back({0, 1, diffusion + drift - mixed});
    stencil.push_back({-1, -sign, mixed});
    stencil.push_back({1, sign, mixed});
  }
  double sum = 0;
  for (const Neighbor& neighbor : stencil) sum += neighbor.weight;
  stencil.push_back({0, 0, -sum - model.rate});
  return stencil;
}

}  // namespace

absl::StatusOr<Problem> MakeAmericanOptionProblem(const AmericanOptionModel& model) {
  std::vector<Violation> violations = CheckGrid({model.cells, model.dimensions, model.horizon}, 1);
  if (!(model.rate >= 0) || !std::isfinite(model.rate)) {
    violations.push_back({"rate", "is " + NumberText(model.rate) + ", must be finite and not negative"});
  }
  CheckPositive("volatility", model.volatility, violations);
  if (!(std::abs(model.correlation) <= 1)) {
    violations.push_back({"correlation", "is " + NumberText(model.correlation) + ", must be from -1 to 1"});
  }
  if (const absl::Status status = StatusOf(violations); !status.ok()) return status;

  const Index points = model.cells - 1, rows = model.dimensions == 1 ? 1 : points, size = points * rows;
  const double width = std::max(1.0, 5 * model.volatility * std::sqrt(model.horizon));
  const double step = 2 * width / static_cast<double>(model.cells);
  const auto price = [&](Index k) { return std::exp(static_cast<double>(k + 1) * step - width); };
  const auto payoff = [&](Index i, Index j) {
    return std::max(0.0, 1 - (model.dimensions == 1 ? price(i) : (price(i) + price(j)) / 2));
  };

  Vector boundary = Vector::Zero(size), payoffs(size);
  std::vector<Eigen::Triplet<double>> entries;
  const std::vector<Neighbor> stencil = StencilOf(model, step);
  for (Index j = 0; j < rows; ++j) {
    for (Index i = 0; i < points; ++i) {
      const Index row = j * points + i;
      payoffs[row] = payoff(i, j);
      for (const auto& [first, second, weight] : stencil) {
        const Index to_i = i + first, to_j = j + second;
        if (to_i >= 0 && to_i < points && to_j >= 0 && to_j < rows) {
          entries.emplace_back(row, to_j * points + to_i, weight);
        } else {
          boundary[row] += weight * payoff(to_i, to_j);
        }
      }
    }
  }
  SparseMatrix A(size, size);
  A.setFromTriplets(entries.begin(), entries.end());
  Problem problem;
  problem.A = std::move(A);
  problem.B = problem.N = SparseIdentity(size);
  problem.M = SparseMatrix(size, size);
  problem.f = TimeFunction::Constant(boundary);
  problem.g = TimeFunction::Constant(-payoffs);
  problem.x0 = payoffs;
  problem.horizon = model.horizon;
  if (const absl::Status status = StatusOf(Validate(problem)); !status.ok()) return status;
  return problem;
}

}  // namespace dlcs
