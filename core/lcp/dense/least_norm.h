// SPDX-License-Identifier: Apache-2.0
// The solution of least Euclidean norm of LCP(q, M) for positive semidefinite M.

#ifndef DLCS_CORE_LCP_DENSE_LEAST_NORM_H_
#define DLCS_CORE_LCP_DENSE_LEAST_NORM_H_

#include <memory>
#include <vector>

#include "core/lcp/dense/complementary_solver.h"

namespace dlcs {

// SOL(q, M) is convex, so there is one solution of least norm, y* = lim y_ε as ε -> 0 with y_ε the one solution of
// LCP(q, M + εI). For small ε its basis S does not change any more, and then
//
//     y*_S = lim -(M_SS + εI)⁻¹ q_S = -M_SS⁺ q_S,     y* = 0 elsewhere,
//
// with the pseudo-inverse, since the range of a positive semidefinite matrix is orthogonal to its null space. So the
// regularized problems only guess S, for a few ε, and y* is computed from M and q. It is accepted where it solves
// LCP(q, M) and the next term of the expansion, y_ε = y* + ε y' + ..., proves it least: with y'_S = -M_SS⁺ y*_S and
// w' = y* + M y', every other solution v has
//
//     y*ᵀ(v - y*) = w'ᵀv + y'ᵀw(v) >= 0   if y'_i >= 0 for i in S with y*_i = 0, w'_i >= 0 for other i with w*_i = 0.
//
// That is sufficient, not necessary (S may have other y'): where no ε passes, the quadratic program over the whole
// solution set decides (core/lcp/dense/nearest_point.h). If IsPlainlyUnique(), none of this is needed.
//
// The least-norm solution need not depend continuously on q: see TestInteriorPoint() in
// core/lcp/basis/solution_function.h.
//
// Source: [Cottle, Pang & Stone 1992] R. W. Cottle, J.-S. Pang, R. E. Stone. The linear complementarity problem.
// Academic Press. Theorem 5.6.2 (the limit).
class LeastNormSolver final : public LcpSolver {
 public:
  explicit LeastNormSolver(const Matrix& M);  // positive semidefinite

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  LcpStats Account() const override { return account_; }
  std::unique_ptr<LcpSolver> Clone() const override { return std::make_unique<LeastNormSolver>(*this); }

 private:
  bool IsLimit(const Vector& q, const Vector& tolerance, const std::vector<Index>& S, Eigen::Ref<Vector> y) const;

  Matrix M_;
  ComplementarySolver any_;                       // of M
  std::vector<ComplementarySolver> regularized_;  // of M + εI, ε falling
  LcpStats account_;
};

// Whether the solution `y` of LCP(q, M), M positive semidefinite, is the only one because M_JJ is nonsingular and,
// where it is degenerate, the Schur complement of M_JJ on K is a P-matrix. (It may be the only one otherwise.)
bool IsPlainlyUnique(const Matrix& M, const Vector& q, const Vector& y);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_LEAST_NORM_H_
