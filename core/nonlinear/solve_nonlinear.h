// SPDX-License-Identifier: Apache-2.0
// The entry point for nonlinear problems.

#ifndef DLCS_CORE_NONLINEAR_SOLVE_NONLINEAR_H_
#define DLCS_CORE_NONLINEAR_SOLVE_NONLINEAR_H_

#include <stop_token>

#include "absl/status/statusor.h"
#include "core/problem/nonlinear_problem.h"
#include "core/problem/observer.h"
#include "core/problem/options.h"
#include "core/problem/solution.h"

namespace dlcs {

// Solves (5.1) of [Wu & Chen] by the splitting (5.2), window by window: with start x_a, y_a,
//
//     0 <= y^{k+1}(t_j) ⟂ g(t_j, x^k(t_j), y^{k+1}(t_j)) >= 0       all j at once, in parallel (JosephyNewton),
//     (x^{k+1})' = W x^{k+1} + s^k,   s^k = f(t, x^k, y^{k+1}) - W x^k   linear between nodes, solved exactly,
//
// the linear system by the matrices that invert its Laplace transform (core/discretization/scheme.h, exp-PL). The first
// x is the solution with s frozen at the start. Windows shrink where the iteration does not converge and grow where it
// does; a single step that fails is solved with x and y together, and counted in cost.coupled_steps. Second order for
// any W: W determines how fast the iteration converges, and the constant of the error.
//
// y must be determined by g(t, x, ·): its Jacobian g_y at the start selects the solution as M does for linear systems
// (the one of a P-matrix, the least one of a Z-matrix, any for other matrices); Solution::reason says which. If g does
// not depend on some y_i, that y_i is undetermined: kUnsupported.
//
// If an error tolerance or no step is given, the step comes from trials (core/driver/error_control.h).
//
// Verdicts and errors as Solve(); a formula without a finite value ends the solve as kNonFinite with the formula and
// the time. Certificate: as documented there with A x + B y + f(t) read as f(t, x, y). Threads: the result has the same
// bits for any number.
absl::StatusOr<Solution> SolveNonlinear(const NonlinearProblem& problem, const Options& options, Observer& observer,
                                        std::stop_token stop);

// The same for a problem and options in which Validate() has found nothing: it is not called again.
absl::StatusOr<Solution> SolveNonlinearValidated(const NonlinearProblem& problem, const Options& options,
                                                 Observer& observer, std::stop_token stop);

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_SOLVE_NONLINEAR_H_
