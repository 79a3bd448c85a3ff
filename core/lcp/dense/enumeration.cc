// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/enumeration.h"

#include <optional>
#include <vector>

#include "core/linalg/exact_program.h"

namespace dlcs {
namespace {

// Finds solutions with support in S where M_SS is singular or nearly so. This is a linear program in y_S in which each
// equation becomes two inequalities.
FeasiblePoint SolveOnFace(const ScaledLcp& lcp, const std::vector<Index>& S) {
  const Index n = lcp.size();
  const Index size = static_cast<Index>(S.size());
  Matrix C(n + size, size);
  Vector c(n + size);
  C.topRows(n) = lcp.M()(Eigen::all, S);
  C.bottomRows(size) = -lcp.M()(S, S);
  c.head(n) = lcp.q;
  c.tail(size) = -lcp.q(S);
  Vector tolerance(n + size);
  tolerance << lcp.tolerance, lcp.tolerance(S);
  return FindFeasiblePoint(C, c, tolerance, kFewUlps);
}

}  // namespace

FeasiblePoint SolveFaceExactly(const Matrix& M, const Vector& q, const std::vector<Index>& S) {
  const auto n = static_cast<std::size_t>(q.size());
  Matrix rows(q.size(), static_cast<Index>(S.size()) + 1);
  rows << M(Eigen::all, S), q;
  const std::optional<IntegerForm> form = AsIntegers(rows);
  if (!form) return {};
  BigMatrix A(n, BigVector(S.size() + n, 0));
  BigVector b(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t p = 0; p < S.size(); ++p) A[i][p] = form->entries[i][p];
    A[i][S.size() + i] = -1;
    b[i] = -form->entries[i][S.size()];
  }
  for (const Index i : S) A[static_cast<std::size_t>(i)][S.size() + static_cast<std::size_t>(i)] = 0;
  const ExactFeasibility found = SolveExactly(A, b);
  if (!found.feasible) return {Feasibility::kInfeasible, {}};
  Vector y(static_cast<Index>(S.size()));
  for (Index p = 0; p < y.size(); ++p) {
    const boost::multiprecision::cpp_rational value(found.z[static_cast<std::size_t>(p)], found.factor);
    y[p] = static_cast<double>(value) * form->column[p] / form->column[y.size()];
  }
  return {Feasibility::kFeasible, y};
}

Basis BasisOf(unsigned subset, Index n) {
  Basis basis(n);
  for (Index i = 0; i < n; ++i) basis[i] = subset >> i & 1u;
  return basis;
}

LcpStatus Enumerate(const ScaledLcp& lcp, const std::function<bool(const Basis&)>& preferred, BasisPoint& point,
                    Basis& basis, Eigen::Ref<Vector> y) {
  const Index n = lcp.size();
  std::vector<unsigned> undecided;  // bases without a point, or with one that is not accurate
  bool found = false;
  std::vector<unsigned> doubtful;  // bases whose violations do not exceed rounding
  for (unsigned subset = 0; subset < (1u << n); ++subset) {
    const Basis candidate = BasisOf(subset, n);
    if (!point.Compute(lcp, candidate) || !point.accurate()) {
      undecided.push_back(subset);
    } else if (point.violations().empty() && (!found || preferred(candidate))) {
      found = true;
      basis = candidate;
      point.Write(lcp, y);
      if (preferred(candidate)) return LcpStatus::kSolved;
    } else if (!point.solved() && point.AreWithinRounding(lcp, candidate)) {
      doubtful.push_back(subset);
    }
  }
  if (found) return LcpStatus::kSolved;
  bool proven = true;
  const std::size_t num_singular = undecided.size();
  undecided.insert(undecided.end(), doubtful.begin(), doubtful.end());
  const bool exactly = (lcp.tolerance.array() == 0).all();
  for (std::size_t k = 0; k < undecided.size(); ++k) {
    basis = BasisOf(undecided[k], n);
    const std::vector<Index> S = IndicesOf(basis);
    FeasiblePoint face;
    if (k < num_singular) face = SolveOnFace(lcp, S);
    if (face.answer == Feasibility::kUnknown && exactly) face = SolveFaceExactly(lcp.M(), lcp.q, S);
    if (face.answer == Feasibility::kFeasible) {
      y.setZero();
      for (std::size_t p = 0; p < S.size(); ++p) y[S[p]] = lcp.Original(S[p], face.y[static_cast<Index>(p)]);
      return LcpStatus::kSolved;
    }
    proven = proven && face.answer == Feasibility::kInfeasible;
  }
  return proven ? LcpStatus::kInfeasible : LcpStatus::kSingular;
}

}  // namespace dlcs
