// SPDX-License-Identifier: Apache-2.0
// The generalized Newton method for one implicit step.

#ifndef DLCS_CORE_STEPPING_NEWTON_STEP_H_
#define DLCS_CORE_STEPPING_NEWTON_STEP_H_

#include <memory>
#include <optional>
#include <vector>

#include "core/discretization/scheme.h"
#include "core/lcp/lcp.h"
#include "core/linalg/panel_lu.h"
#include "core/problem/problem.h"

namespace dlcs {

enum class NewtonVerdict {
  kConverged,
  kNoSolution,      // LCP(N u + g, M) has no (selected) solution at an iterate
  kSingular,        // M_JJ or V is singular to working precision
  kIterationLimit,  // 50 iterations: a cycle
};

// Solves one step of a scheme for u = x_j, with p = x_j - y_after y_j its explicit part:
//
//     F(u) = u - p - y_after y(u) = 0,     y(u) the selected solution of LCP(N u + g, M),
//     u^{k+1} = u^k - V_k⁻¹ F(u^k),     V_k = I + y_after (I - D_k + D_k M)⁻¹ D_k N,     D_k = diag(y(u^k) > 0),
//
// (3.3) of [Chen & Xiang 2013]. For the θ-scheme F and V are R F and R V of the paper, R = (I - h(1-θ)A)⁻¹, which
// leaves the iterates as they are: V = R (I - h[(1-θ)A - B(I - D + DM)⁻¹DN]). For θ = 1 R is I, and the step is
// still implicit, through y.
//
// F is linear as long as D does not change, so an iterate with the same D as the one before solves the step up to
// rounding: the method ends after finitely many iterations (with the least norm, whose pieces D does not fix, when ‖F‖
// is rounding), or cycles, which needs 3hκ >= 1 (Theorem 3.2). Convergence is superlinear
// since near the solution every D belongs to a linear piece through it. That V_k lies in ∂F(u^k), Theorem 3.1, is not
// needed, and false where N has no full row rank and y_i = w_i = 0: newton_step_test.cc has an example.
class NewtonStep {
 public:
  // Keeps a reference to `problem`; `choice` must make y a function of x, continuous along the iterates.
  NewtonStep(const Problem& problem, const Scheme& scheme, const SolutionChoice& choice);

  // The next solve starts from the basis of `y`, whatever was solved before.
  void StartFrom(const Eigen::Ref<const Vector>& y);

  // `p`          m entries, the explicit part of x_j.
  // `g`          g at the end of the step; `size_of_g`, n entries >= |g_i|: how large the numbers behind it are.
  // `u`          in: the start, x_{j-1}; out: x_j where converged.
  // `y`          out: y_j where converged.
  // Cost: an LCP and 2m² + 2mn an iteration, and O(m³ + n³) where D is not that of the last factors.
  NewtonVerdict Solve(const Eigen::Ref<const Vector>& p, const Eigen::Ref<const Vector>& g, const Vector& size_of_g,
                      Eigen::Ref<Vector> u, Eigen::Ref<Vector> y);

  // ‖F(u^k)‖_∞ of the last Solve(), k = 0, 1, ...; the number of iterations is one less.
  const std::vector<double>& residuals() const { return residuals_; }
  Index iterations() const { return residuals_.empty() ? 0 : static_cast<Index>(residuals_.size()) - 1; }

 private:
  bool Factor(const std::vector<Index>& active);

  const Problem& problem_;
  Matrix abs_N_;
  Matrix y_after_;
  Selection selection_;
  std::unique_ptr<LcpSolver> solver_;
  Basis basis_;
  Vector q_, tolerance_, residual_;
  std::vector<double> residuals_;
  std::vector<Index> active_, last_active_;  // J = { i : y_i > 0 } of this iterate and the one before
  bool factored_ = false;
  bool regular_ = false;
  std::vector<Index> factored_active_;  // J of lu_
  std::optional<PanelLu> lu_;           // of V
};

// V for J = `active`: I + y_after_J M_JJ⁻¹ N_J, since (I - D + DM)⁻¹D is M_JJ⁻¹ on J and zero elsewhere. Not finite
// where M_JJ is singular to working precision; but with the least norm M_JJ may be, and its pseudo-inverse is taken:
// that is the Jacobian where y_J = -M_JJ⁺ q_J (core/lcp/dense/least_norm.h).
Matrix NewtonMatrix(const Problem& problem, const Matrix& y_after, const std::vector<Index>& active,
                    Selection selection = Selection::kUnique);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_NEWTON_STEP_H_
