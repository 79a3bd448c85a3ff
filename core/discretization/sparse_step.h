// SPDX-License-Identifier: Apache-2.0
// A step for a large sparse A, with one sparse factorization per step length.

#ifndef DLCS_CORE_DISCRETIZATION_SPARSE_STEP_H_
#define DLCS_CORE_DISCRETIZATION_SPARSE_STEP_H_

#include "core/discretization/scheme.h"
#include "core/discretization/segment.h"
#include "core/discretization/step_rule.h"
#include "core/linalg/sparse/sparse_factor.h"
#include "core/parallel/parallel.h"
#include "core/problem/problem.h"

namespace dlcs {

// R⁻¹ is factored once. The coupled LCP needs N R r before y is known, and then x takes R B y. What reads the least
// memory is chosen for that:
//
// - Where R⁻¹ = Pᵀ L U P, the LCP may come between the halves of the solve for the state, since N R r =
//   (U⁻ᵀ P Nᵀ)ᵀ (L⁻¹ P r). Then U⁻ᵀ P Nᵀ and L⁻¹ P B are kept, which are sparse where N and B are.
// - Else R B is kept, a dense m × n matrix.
// - Or each y takes a solve of its own.
//
// Cost: n solves. Threads: const calls may run concurrently; the n solves use `workers`, with the same bits for any
// number of threads.
class SparseStep {
 public:
  // `problem` must outlive it; `theta` is that of kTheta. A singular R⁻¹ gives numbers that are not finite.
  SparseStep(const Problem& problem, double step, SparseRule rule, double theta, Workers& workers);

  Scheme Description() const { return rule_.Description(); }

  // The parts of a step. StartWithSources() sets the columns 1.. of x to the terms of f. AddBefore() adds to x_j all
  // other terms except that of y_j, in a form that AddPairs() and AddAfter() know. AddPairs() adds N times those terms
  // to `q`, and to `size` the sizes of what was summed up. AddAfter() adds the term of y_j and makes x_j the state.
  // `stage` is the finished first stage, used only with has_stage().
  void StartWithSources(Segment& segment) const { rule_.StartWithSources(segment); }
  void AddBefore(Segment& segment, Index j, const Segment& stage) const;
  void AddPairs(const Segment& segment, Index j, Vector& q, Vector& size) const;
  void AddAfter(Segment& segment, Index j) const;

  // Whether a step has a first stage. StartStage() prepares it as step 1 of `stage`: its sources, and like AddBefore()
  // all terms of X except that of Y.
  bool has_stage() const { return rule_.has_stage(); }
  void StartStage(const Segment& segment, Index j, Segment& stage) const;

  // N times the factor of y_j in x_j: K_0 of the coupled step.
  const Matrix& CoupledTerm() const { return coupled_term_; }

 private:
  Vector Before(const Vector& right) const;

  StepRule rule_;
  SparseFactor<double> factor_;
  bool keeps_halves_;
  SparseMatrix half_of_N_, half_of_B_;  // U⁻ᵀ P Nᵀ and weight L⁻¹ P B, where it does
  Matrix response_;                     // weight R B, or empty
  Matrix coupled_term_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_SPARSE_STEP_H_
