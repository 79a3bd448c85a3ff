// SPDX-License-Identifier: Apache-2.0
#include "tests/support/random_systems.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/linalg/norms.h"

namespace dlcs::testing {
namespace {

enum class Kind { kPositiveDefinite, kIndefiniteP, kMMatrix, kPassiveSkew, kPassiveSingular, kZero };
constexpr int kKinds = 6;

std::string Wave(LcpGenerator& random, bool kinked) {
  const std::string wave =
      "sin(" + std::to_string(random.Uniform(1, 9)) + "*t+" + std::to_string(random.Uniform(0, 6)) + ")";
  return std::to_string(random.Normal()) + "*" + (kinked ? "abs(" + wave + ")" : wave);
}

Matrix RandomM(LcpGenerator& random, Kind kind, Index n) {
  switch (kind) {
    case Kind::kPositiveDefinite:
      return random.PositiveDefinite(n);
    case Kind::kIndefiniteP:
      return random.IndefinitePMatrix(n);
    case Kind::kMMatrix:
      return random.MMatrix(n);
    case Kind::kPassiveSkew:
      return random.Skew(n);
    case Kind::kPassiveSingular:
      return random.PositiveSemidefinite(n, n / 2);
    case Kind::kZero:
      return Matrix::Zero(n, n);
  }
  return {};
}

}  // namespace

Problem RandomSystem(LcpGenerator& random) {
  const Kind kind = static_cast<Kind>(random.Integer(0, kKinds - 1));
  const bool passive = kind == Kind::kPassiveSkew || kind == Kind::kPassiveSingular || kind == Kind::kZero;
  const bool kinked = random.Integer(0, 3) == 0;
  const Index m = random.Integer(2, 5);
  const Index n = std::min(m, random.Integer(1, 4));
  Problem problem;
  const Matrix G = random.Gaussian(m, m);
  problem.A = passive ? Matrix(-G * G.transpose() / static_cast<double>(m) + 2 * random.Skew(m))
                      : Matrix(G - 2 * Matrix::Identity(m, m));
  problem.B = random.Gaussian(m, n);
  problem.N = passive ? Matrix(problem.B.Dense().transpose()) : random.Gaussian(n, m);
  problem.M = RandomM(random, kind, n);
  problem.x0 = random.GaussianVector(m);
  problem.horizon = std::pow(10, random.Uniform(0, 1));
  std::vector<std::string> f, g;
  for (Index i = 0; i < m; ++i) f.push_back(Wave(random, kinked));
  for (Index i = 0; i < n; ++i) {
    // Starts where N x0 + g(0) > 0.
    const double level = 0.1 - (problem.N.Dense().row(i) * problem.x0)(0) + std::abs(random.Normal());
    g.push_back(std::to_string(level) + "+0.8*(" + Wave(random, kinked) + ")*t");
  }
  problem.f = TimeFunction::Formulas(std::move(f));
  problem.g = TimeFunction::Formulas(std::move(g));
  return problem;
}

double TrueError(const Solution& solution, const Solution& exact, bool y_counts) {
  const auto is_named = [&solution](const Component& component) {
    return std::any_of(solution.accuracy.named.begin(), solution.accuracy.named.end(), [&](const auto& named) {
      return named.component == component && named.knowledge != Knowledge::kMissed;
    });
  };
  const auto largest = [&](ComponentKind kind, const Matrix& computed, const Matrix& known) {
    const Vector size = RowMaxAbs(known), difference = RowMaxAbs(computed - known);
    double error = 0;
    for (Index i = 0; i < size.size(); ++i) {
      if (difference[i] > 0 && !is_named({kind, i})) error = NanMax(error, difference[i] / size[i]);
    }
    return error;
  };
  const double error = largest(ComponentKind::kState, solution.x, exact.x);
  if (!y_counts) return error;
  return NanMax(error, NanMax(largest(ComponentKind::kPair, solution.y, exact.y),
                              largest(ComponentKind::kSlack, solution.w, exact.w)));
}

}  // namespace dlcs::testing
