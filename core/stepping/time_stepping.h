// SPDX-License-Identifier: Apache-2.0
// The θ-scheme: the implicit time stepping of [Chen & Xiang 2013].

#ifndef DLCS_CORE_STEPPING_TIME_STEPPING_H_
#define DLCS_CORE_STEPPING_TIME_STEPPING_H_

#include <memory>

#include "core/context/solve_context.h"
#include "core/discretization/sparse_step.h"

namespace dlcs {

// Whether steps use sparse factors: if the options ask for it, or if A is large and not dense. Newton's method and
// inelastic impacts need dense matrices.
bool StepsSparsely(const Problem& problem, const Options& options);

// The scheme of time_stepping for `options`: the θ-scheme (1.3), or with average_y the trapezoidal rule; and the same
// for sparse A, where it may also have `two_stages`. `problem` must outlive them.
Scheme TimeSteppingScheme(const Problem& problem, const Options& options, double step);
std::unique_ptr<const SparseStep> TimeSteppingStep(const Problem& problem, const Options& options, bool two_stages,
                                                   double step);

// M^h = M + K_0, the matrix of the coupled step, with either.
Matrix CoupledStepMatrix(const Problem& problem, const Options& options, bool two_stages, double step);

// Solves by the θ-scheme (1.3) of [Chen & Xiang 2013]; with θ = 0 and the least element it is ILETS (1.8).
//
// By substitution: one LCP(q, M^h) a step with M^h = h N (I - h(1-θ)A)⁻¹ B + M. It works for every class of M. The
// solution rule refers to M: if M^h is not of the class of M, the solution has a warning.
//
// By Newton's method (3.3), core/stepping/newton_step.h, if y is a function of x. The solution holds its rate of
// convergence, and warnings if h exceeds 1/(3κ) or if steps had to be solved by substitution.
//
// In two stages (core/discretization/sparse_step.h), if context.choices.two_stages is set.
//
// First order, second with average_y and in two stages. Returns whether the end was reached. One thread.
bool TimeStepping(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_TIME_STEPPING_H_
