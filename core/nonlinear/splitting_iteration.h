// SPDX-License-Identifier: Apache-2.0
// The iteration (5.2) of [Wu & Chen] for nonlinear problems, window by window.

#ifndef DLCS_CORE_NONLINEAR_SPLITTING_ITERATION_H_
#define DLCS_CORE_NONLINEAR_SPLITTING_ITERATION_H_

#include <chrono>
#include <stop_token>
#include <string>
#include <vector>

#include "core/context/recorder.h"
#include "core/discretization/grid.h"
#include "core/discretization/scheme.h"
#include "core/discretization/segment.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/nonlinear/functions.h"
#include "core/parallel/parallel.h"
#include "core/problem/nonlinear_problem.h"
#include "core/problem/observer.h"
#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// The inputs and outputs of the iteration.
struct NonlinearContext {
  const NonlinearProblem& problem;
  const Options& options;
  Selection selection;  // judged on g_y at the start
  const Vector& y_guess;
  const Grid& grid;
  NonlinearFunctions functions;  // of the calling thread
  Workers& workers;
  Observer& observer;
  std::stop_token stop;
  Recorder recorder;
  Solution& solution;
  std::chrono::steady_clock::time_point started;

  double Seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count(); }
  // Ends the solve: sets termination, time and message, and returns false.
  bool Fail(Termination termination, double time, std::string message) {
    solution.termination = termination;
    solution.failure_time = time;
    solution.message = std::move(message);
    return false;
  }
  bool FailCancelled(double time) {
    return Fail(Termination::kCancelled, time, "Stopped on request before the end was reached.");
  }
};

// Solves the problem of `context` as core/nonlinear/solve_nonlinear.h describes, and records segments, certificate and
// costs. Returns whether T was reached; otherwise context.Fail() has been called. Sets solution.reason to the choice of
// W.
bool SplittingIteration(NonlinearContext& context);

// Raises `certificate` (all NaN before the first segment) by the nodes and midpoints of `segment`, with f and g
// evaluated anew at x and y. segment.f holds the sources s = f - W x that the states follow by `scheme`; `times` the
// node times. Returns g(t, x, y) at the nodes, a column for each. At midpoints x solves x' = W x + s with s linear over
// the step, and y is linear. Not for the inner loop.
Matrix AddToCertificate(NonlinearFunctions& functions, const Scheme& scheme, const Matrix& W, const Segment& segment,
                        const std::vector<double>& times, Certificate& certificate);

// The derivative of x ↦ f(t, x, y(x)) with y(x) the solution of 0 <= y ⟂ g(t, x, y) >= 0 near `y`:
//
//     f_x - f_yS (g_y)_SS⁻¹ g_xS,   S = { i : y_i > 0, y_i >= g_i },
//
// With this W, f - W x minus its value at the start is of second order in x - x_a, and the iteration contracts in
// proportion to the distance from x_a. f_x alone where (g_y)_SS is singular. Not finite where a formula has no
// derivative.
// Cost: the Jacobians and O(m² n).
Matrix ReducedJacobian(NonlinearFunctions& functions, double t, const Vector& x, const Vector& y);

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_SPLITTING_ITERATION_H_
