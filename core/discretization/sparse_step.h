// SPDX-License-Identifier: Apache-2.0
// A step for a large sparse A, with one sparse factorization per step length.

#ifndef DLCS_CORE_DISCRETIZATION_SPARSE_STEP_H_
#define DLCS_CORE_DISCRETIZATION_SPARSE_STEP_H_

#include "core/discretization/scheme.h"
#include "core/discretization/segment.h"
#include "core/linalg/sparse_factor.h"
#include "core/parallel/parallel.h"
#include "core/problem/problem.h"

namespace dlcs {

// How x_{j-1} becomes x_j; E is the mass matrix, or the identity.
enum class SparseRule {
  // (1.3) of [Chen & Xiang], R = (E - h(1-θ)A)⁻¹:  x_j = R (E x_{j-1} + hθ A x_{j-1} + h f_j) + h R B y_j.
  kTheta,
  // The trapezoidal rule, R = (E - hA/2)⁻¹:
  //     x_j = R (E x_{j-1} + h/2 A x_{j-1} + h/2 (f_{j-1} + B y_{j-1} + f_j)) + h/2 R B y_j.
  // Second order where y is Lipschitz; fast components oscillate, since the rule is not L-stable.
  kAveraged,
  // Two implicit stages, γ = 1 - 1/√2, R = (E - γhA)⁻¹; the first at t = t_{j-1} + γh, with the Y of its own LCP,
  // N X + g(t) + M Y:
  //     X   = R (E x_{j-1} + γh f(t)) + γh R B Y,
  //     x_j = R (E (x_{j-1} + (1-γ)/γ (X - x_{j-1})) + γh f_j) + γh R B y_j.
  // Second order where y is Lipschitz, also across its kinks, and L-stable: fast components decay within one step.
  // Between nodes f and g are linear. Source: [Alexander 1977] R. Alexander. Diagonally implicit Runge-Kutta methods
  // for stiff O.D.E.'s. SIAM J. Numer. Anal. 14, 1006-1021.
  kTwoStages,
};

// R⁻¹ is factored once. R B is computed by n solves and kept as a dense m × n matrix if that fits into memory. Threads:
// const calls may run concurrently; the n solves use `workers`, with the same bits for any number of threads.
class SparseStep {
 public:
  // `problem` must outlive it; `theta` is that of kTheta. A singular R⁻¹ gives numbers that are not finite.
  SparseStep(const Problem& problem, double step, SparseRule rule, double theta, Workers& workers);

  // The scheme without its matrices: how x and y are interpolated between nodes, and the order.
  Scheme Description() const;

  // The three parts of a step. StartWithSources() sets the columns 1.. of x to the terms of f. AddBefore() adds to x_j
  // all other terms except that of y_j, and AddAfter() adds that one. `stage` is the finished first stage, used only
  // with has_stage().
  void StartWithSources(Segment& segment) const;
  void AddBefore(Segment& segment, Index j, const Segment& stage) const;
  void AddAfter(Segment& segment, Index j) const;

  // Whether a step has a first stage. StartStage() prepares it as step 1 of `stage`: its sources, and all terms of X
  // except that of Y, which AddAfter() adds.
  bool has_stage() const { return rule_ == SparseRule::kTwoStages; }
  void StartStage(const Segment& segment, Index j, Segment& stage) const;

  // N times the factor of y_j in x_j: K_0 of the coupled step.
  const Matrix& CoupledTerm() const { return coupled_term_; }

 private:
  const Problem& problem_;
  double step_;
  SparseRule rule_;
  double theta_;
  double weight_;  // of s_j: h, h/2 or γh
  SparseFactor<double> factor_;
  Matrix response_;  // weight R B; empty where it does not fit
  Matrix coupled_term_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_SPARSE_STEP_H_
