// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/hidden_least_element.h"

#include <algorithm>
#include <limits>

#include "core/lcp/basis/principal_pivoting.h"
#include "core/lcp/basis/solution_function.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/dense/enumeration.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"

namespace dlcs {

HiddenLeastElementSolver::HiddenLeastElementSolver(const Matrix& M, const Matrix& X)
    : M_(M),
      cost_(X.transpose().partialPivLu().solve(Vector::Ones(M.rows()))),
      program_(MakeLinearProgram(M.rows(), M.rows())),
      lcp_(M),
      point_(lcp_, Elimination::kPivoting) {
  cost_.array() *= lcp_.matrix->scale.column.array();
  program_.rows = lcp_.M();
  program_.cost = cost_ / cost_.lpNorm<Eigen::Infinity>();
}

LcpStatus HiddenLeastElementSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                          Basis& basis, Eigen::Ref<Vector> y) {
  account_ = {.pivots = 0, .method = "linear programming (least element of pos X)", .message = ""};
  const auto fail = [&](LcpStatus verdict, const char* why) {
    y.setZero();
    account_.message = why;
    return verdict;
  };
  if (!lcp_.Load(q, tolerance)) return fail(LcpStatus::kNonFinite, "q has an entry that is not finite");
  if (TryBasis(basis, y)) return LcpStatus::kSolved;

  const double size = std::max(lcp_.q.lpNorm<Eigen::Infinity>(), std::numeric_limits<double>::min());
  program_.row_lower = -(lcp_.q + lcp_.tolerance) / size;
  const LinearProgramSolution solution = SolveLinearProgram(program_);
  if (solution.verdict == LinearProgramVerdict::kInfeasible) {
    return fail(LcpStatus::kInfeasible, "no y >= 0 has q + M y >= 0 (found by linear programming)");
  }
  if (solution.verdict != LinearProgramVerdict::kOptimal) {
    return fail(LcpStatus::kPivotLimit, "the linear program of the least element was not solved");
  }
  // Smaller entries are found by pivoting.
  const double positive = kProgramMargin * std::max(1.0, solution.z.lpNorm<Eigen::Infinity>());
  for (Index i = 0; i < q.size(); ++i) basis[i] = solution.z[i] > positive;
  constexpr int kRounds = 5;
  PivotPrincipally(lcp_, kRounds, Exchange::kBlocksThenLeast, point_, basis, account_.pivots);
  if (TryBasis(basis, y) || TryOtherBases(q, basis, y)) return LcpStatus::kSolved;
  return fail(LcpStatus::kSingular,
              "the basis of the least element in the order of pos X is singular, or not optimal, to working precision");
}

bool HiddenLeastElementSolver::TryBasis(const Basis& basis, Eigen::Ref<Vector> y) {
  if (!point_.Compute(lcp_, basis) || !point_.solved() || !HasFeasibleMultipliers(basis)) return false;
  point_.Write(lcp_, y);
  return true;
}

// A degenerate solution has several bases, and the multipliers of one may be feasible where those of another are not.
bool HiddenLeastElementSolver::TryOtherBases(const Vector& q, Basis& basis, Eigen::Ref<Vector> y) {
  if (!point_.Compute(lcp_, basis) || !point_.solved()) return false;
  point_.Write(lcp_, y);
  const IndexSets sets = FindIndexSets(M_, q, y);
  if (static_cast<Index>(sets.K.size()) > kMaxEnumerationSize) return false;
  for (unsigned subset = 0; subset < 1u << sets.K.size(); ++subset) {
    Basis other(basis.size(), 0);
    for (const Index i : sets.J) other[i] = 1;
    for (std::size_t k = 0; k < sets.K.size(); ++k) other[sets.K[k]] = subset >> k & 1u;
    if (!TryBasis(other, y)) continue;
    basis = other;
    return true;
  }
  return false;
}

bool HiddenLeastElementSolver::HasFeasibleMultipliers(const Basis& basis) const {
  const std::vector<Index> S = IndicesOf(basis);
  const Matrix& M = lcp_.M();
  Vector multipliers = Vector::Zero(M.rows());
  if (!S.empty()) {
    const Matrix block = M(S, S).transpose();
    const Vector cost = cost_(S);
    const Vector of_basis = block.partialPivLu().solve(cost);
    multipliers(S) = of_basis;
  }
  const BoundedSums<Vector> reduced{cost_ - M.transpose() * multipliers,
                                    cost_.cwiseAbs() + M.cwiseAbs().transpose() * multipliers.cwiseAbs()};
  const double largest = multipliers.lpNorm<Eigen::Infinity>();
  return multipliers.minCoeff() >= -kMaybeZero * largest && reduced.NoneNegative(kMaybeZero);
}

}  // namespace dlcs
