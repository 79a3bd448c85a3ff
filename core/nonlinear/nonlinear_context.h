// SPDX-License-Identifier: Apache-2.0
// The inputs and outputs of the splitting iteration.

#ifndef DLCS_CORE_NONLINEAR_NONLINEAR_CONTEXT_H_
#define DLCS_CORE_NONLINEAR_NONLINEAR_CONTEXT_H_

#include <chrono>
#include <stop_token>
#include <string>
#include <utility>

#include "core/context/recorder.h"
#include "core/discretization/grid.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/nonlinear/functions.h"
#include "core/parallel/parallel.h"
#include "core/problem/nonlinear_problem.h"
#include "core/problem/observer.h"
#include "core/problem/options.h"
#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

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

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_NONLINEAR_CONTEXT_H_
