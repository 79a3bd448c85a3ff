// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/enumeration.h"

#include <vector>

#include "core/lcp/feasibility.h"

namespace dlcs {
namespace {

// Solutions with support in S, M_SS singular or nearly so: a linear program in y_S, equations as two
// inequalities.
FeasiblePoint SolveOnFace(const ScaledLcp& lcp, const std::vector<Index>& S) {
  const Index n = lcp.size();
  const Index size = static_cast<Index>(S.size());
  Matrix C(n + size, size);
  Vector c(n + size);
  C.topRows(n) = lcp.M()(Eigen::all, S);
  C.bottomRows(size) = -lcp.M()(S, S);
  c.head(n) = lcp.q;
  c.tail(size) = -lcp.q(S);
  // One tolerance for all rows of the scaled problem: the smallest is the safe one.
  return FindFeasiblePoint(C, c, lcp.tolerance.minCoeff());
}

}  // namespace

Basis BasisOf(unsigned subset, Index n) {
  Basis basis(n);
  for (Index i = 0; i < n; ++i) basis[i] = subset >> i & 1u;
  return basis;
}

std::vector<Index> IndicesOf(const Basis& basis) {
  std::vector<Index> S;
  for (std::size_t i = 0; i < basis.size(); ++i) {
    if (basis[i]) S.push_back(static_cast<Index>(i));
  }
  return S;
}

LcpVerdict Enumerate(const ScaledLcp& lcp, const std::function<bool(const Basis&)>& preferred,
                     BasisPoint& point, Basis& basis, Eigen::Ref<Vector> y) {
  const Index n = lcp.size();
  std::vector<unsigned> undecided;  // bases without a point, or with one that is not accurate
  bool found = false;
  for (unsigned subset = 0; subset < (1u << n); ++subset) {
    const Basis candidate = BasisOf(subset, n);
    if (!point.Compute(lcp, candidate) || !point.accurate()) {
      undecided.push_back(subset);
    } else if (point.violations().empty() && (!found || preferred(candidate))) {
      found = true;
      basis = candidate;
      point.Write(lcp, y);
      if (preferred(candidate)) return LcpVerdict::kSolved;
    }
  }
  if (found) return LcpVerdict::kSolved;
  bool proven = true;
  for (const unsigned subset : undecided) {
    basis = BasisOf(subset, n);
    const std::vector<Index> S = IndicesOf(basis);
    const FeasiblePoint face = SolveOnFace(lcp, S);
    if (face.answer == Feasibility::kFeasible) {
      y.setZero();
      for (std::size_t p = 0; p < S.size(); ++p)
        y[S[p]] = lcp.matrix->scale[S[p]] * face.y[static_cast<Index>(p)];
      return LcpVerdict::kSolved;
    }
    proven = proven && face.answer == Feasibility::kInfeasible;
  }
  return proven ? LcpVerdict::kInfeasible : LcpVerdict::kSingular;
}

}  // namespace dlcs
