// SPDX-License-Identifier: Apache-2.0
// The solution of LCP(q, M) that minimizes ‖C y - b‖₂, as in Example 2.1 of [Chen & Xiang].

#ifndef DLCS_CORE_LCP_DENSE_MINIMIZER_H_
#define DLCS_CORE_LCP_DENSE_MINIMIZER_H_

#include <memory>
#include <optional>

#include "core/lcp/dense/complementary_solver.h"
#include "core/problem/problem.h"

namespace dlcs {

// For positive semidefinite M the solutions are a polyhedron, and the minimizer is the nearest point of it
// (core/lcp/dense/nearest_point.h). For other M, n <= kMaxSolutionEnumeration, they are a union of polyhedra, of which
// most are points: all are looked at (core/lcp/dense/basic_solutions.h), so a solve costs 2ⁿ factorizations.
//
// Several solutions may attain the minimum. Then the one of least norm is taken, of these the first in the order of
// bases, and IsOnlyChoice() is false: as a function of q the solution may jump there.
class MinimizerSolver final : public LcpSolver {
 public:
  MinimizerSolver(const Matrix& M, const Selector& selector);

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  bool IsOnlyChoice() const override { return only_choice_; }
  LcpStats Account() const override { return account_; }
  std::unique_ptr<LcpSolver> Clone() const override { return std::make_unique<MinimizerSolver>(*this); }

 private:
  LcpStatus MinimizeConvex(const Vector& q, const Vector& tolerance, Basis& basis, Vector& y);
  LcpStatus MinimizeByEnumeration(const Vector& q, const Vector& tolerance, Vector& y);

  Matrix M_;
  Selector selector_;
  std::optional<ComplementarySolver> any_;  // where M is positive semidefinite
  LcpStats account_;
  bool only_choice_ = true;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_MINIMIZER_H_
