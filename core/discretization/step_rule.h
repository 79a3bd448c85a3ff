// SPDX-License-Identifier: Apache-2.0
// Implicit steps for a large sparse A: what one system of equations with E - sA has on its right.

#ifndef DLCS_CORE_DISCRETIZATION_STEP_RULE_H_
#define DLCS_CORE_DISCRETIZATION_STEP_RULE_H_

#include "core/discretization/scheme.h"
#include "core/discretization/segment.h"
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

// Every rule is, with one shift s and one weight w,
//     (E - sA) x_j = r_j + w B y_j.
class StepRule {
 public:
  // `problem` must outlive it; `theta` is that of kTheta.
  StepRule(const Problem& problem, double step, SparseRule rule, double theta);

  const Problem& problem() const { return problem_; }
  double shift() const { return shift_; }
  double weight() const { return weight_; }

  // The scheme without its matrices: how x and y are interpolated between nodes, and the order.
  Scheme Description() const;

  // Sets the columns 1.. of x to the terms of f in r.
  void StartWithSources(Segment& segment) const;
  // r_j, where x_j holds those terms. `stage` is the finished first stage, used only with has_stage().
  Vector RightHandSide(const Segment& segment, Index j, const Segment& stage) const;

  // Whether a step has a first stage, at t_{j-1} + kStage h. StartStage() sets its g, in column 1 of `stage`, which
  // then has room for one step, and returns its r.
  static const double kStage;
  bool has_stage() const { return rule_ == SparseRule::kTwoStages; }
  Vector StartStage(const Segment& segment, Index j, Segment& stage) const;

 private:
  const Problem& problem_;
  double step_;
  SparseRule rule_;
  double theta_;
  double weight_;  // h, h/2 or γh
  double shift_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_STEP_RULE_H_
