// SPDX-License-Identifier: Apache-2.0
// The implicit time stepping of Chen & Xiang.

#ifndef DLCS_CORE_STEPPING_TIME_STEPPING_H_
#define DLCS_CORE_STEPPING_TIME_STEPPING_H_

#include <memory>

#include "core/context/solve_context.h"
#include "core/discretization/sparse_step.h"

namespace dlcs {

// Whether the steps are solved by sparse factors: where that was asked for, or A is not dense and of some size.
// Newton's method and inelastic impacts need dense matrices.
bool StepsSparsely(const Problem& problem, const Options& options);

// The scheme that `options` ask of time_stepping: the θ-scheme (1.3), or with average_y the trapezoidal rule; and the
// same for sparse A, where it may also be `two_stages`. `problem` must outlive them.
Scheme TimeSteppingScheme(const Problem& problem, const Options& options, double step);
std::unique_ptr<const SparseStep> TimeSteppingStep(const Problem& problem, const Options& options, bool two_stages,
                                                   double step);

// M^h = M + K_0, the matrix of the coupled step, with either.
Matrix CoupledStepMatrix(const Problem& problem, const Options& options, bool two_stages, double step);

// Marches (1.3) of [Chen & Xiang 2013]; with θ = 0 and the least element it is ILETS (1.8).
//
// By substitution: one LCP(q, M^h) a step with M^h = h N (I - h(1-θ)A)⁻¹ B + M. It asks nothing of M, so it
// solves every class. The solution rule is judged on M: where M^h leaves the class of M, the solution has a warning.
//
// By Newton's method (3.3), core/stepping/newton_step.h, where y is a function of x; the solution carries its rate,
// and warnings where h is beyond 1/(3κ), and where steps had to be solved by substitution after all.
//
// In two stages (core/discretization/sparse_step.h), where context.two_stages says so.
//
// First order, second with average_y and in two stages. Returns whether the end was reached. One thread.
bool TimeStepping(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_TIME_STEPPING_H_
