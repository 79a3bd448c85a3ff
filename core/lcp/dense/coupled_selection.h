// SPDX-License-Identifier: Apache-2.0
// The coupled step with any selection: y is the selected solution of LCP(q + K y, M).

#ifndef DLCS_CORE_LCP_DENSE_COUPLED_SELECTION_H_
#define DLCS_CORE_LCP_DENSE_COUPLED_SELECTION_H_

#include <memory>

#include "core/lcp/dense/complementary_solver.h"

namespace dlcs {

// Solves y = SOL(q + K y, M) for the selection that a solver of M makes. Every such y solves LCP(q, M + K), but not
// the other way round. With the least norm this is the implicit step (1.9) of [Chen & Xiang].
//
// Newton's method with the bases of the selected solutions; then the fixed-point iteration y <- SOL(q + K y, M), a
// contraction where SOL is Lipschitz and K small; then the solution of LCP(q, M + K) that `fallback` finds, and for
// n <= kMaxEnumerationSize its other basic solutions, each replaced by the selected solution z of LCP(q + K y, M)
// where K z = K y. A solution of the coupled LCP that is no such fixed point is returned only where none was found
// (KeptSelection() is false then).
//
// With the least norm and M + K positive semidefinite, `fallback` is the least-norm solver of M + K, so what is
// returned then is the discrete solution of [Han, Tiwari, Camlibel & Pang], who take the least norm over the coupled
// problem: for M = 0 (ideal diodes) the least-norm element of SOL(N x + g, 0) is always zero, so (1.9) has no solution
// as soon as a constraint becomes active.
//
// Source: [Han, Tiwari, Camlibel & Pang 2009] L. Han, A. Tiwari, M. K. Camlibel, J.-S. Pang. Convergence of
// time-stepping schemes for passive and extended linear complementarity systems. SIAM J. Numer. Anal. 47, 3768-3796.
class CoupledSelectionSolver final : public LcpSolver {
 public:
  CoupledSelectionSolver(const Matrix& M, const Matrix& K, std::unique_ptr<LcpSolver> selection,
                         std::unique_ptr<LcpSolver> fallback);

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  bool KeptSelection() const override { return kept_selection_; }
  bool IsOnlyChoice() const override { return !kept_selection_ || selection_->IsOnlyChoice(); }
  LcpStats Account() const override { return account_; }
  std::unique_ptr<LcpSolver> Clone() const override;

 private:
  struct Step {
    const Eigen::Ref<const Vector>& q;
    const Eigen::Ref<const Vector>& tolerance;
  };

  bool Newton(const Step& step, Basis& basis, Vector& y);
  bool Iterate(const Step& step, Basis& basis, Vector& y);
  bool SearchSolutions(const Step& step, Basis& basis, Vector& y);
  bool SelectNear(const Step& step, const Vector& guess, Basis& basis, Vector& y);

  Matrix M_, K_;
  Matrix abs_sum_;  // |M| + |K|
  ScaledLcp coupled_;
  BasisPoint point_;
  std::unique_ptr<LcpSolver> selection_;  // of M
  std::unique_ptr<LcpSolver> fallback_;   // of M + K
  LcpStats account_;
  bool kept_selection_ = true;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_COUPLED_SELECTION_H_
