// SPDX-License-Identifier: Apache-2.0
// y and the source of the splitting (5.2) at all nodes of a window, in parallel.

#ifndef DLCS_CORE_NONLINEAR_WINDOW_SOURCES_H_
#define DLCS_CORE_NONLINEAR_WINDOW_SOURCES_H_

#include <memory>
#include <string>
#include <vector>

#include "core/discretization/segment.h"
#include "core/nonlinear/functions.h"
#include "core/nonlinear/josephy_newton.h"
#include "core/nonlinear/nonlinear_context.h"
#include "core/problem/solution.h"

namespace dlcs {

// How a window, or a step of it, ended. `termination` is that of the solve if nothing else can be tried.
struct SplittingOutcome {
  bool converged = false;
  Termination termination = Termination::kIterationLimit;
  double time = 0;
  Index iterations = 0;
  std::string why;
};

// y with 0 <= y ⟂ g(t, x, y) >= 0, from the guess in `y`.
ComplementarityResult SolveForY(NonlinearFunctions& functions, JosephyNewton& newton, double t, const Vector& x,
                                Vector& y);

// The outcome of the window that follows from `result`, a failed attempt to find y at time t.
SplittingOutcome FailureOf(NonlinearContext& context, const ComplementarityResult& result, double t, const Vector& x,
                           const Vector& y);

class WindowSources {
 public:
  // `context` must outlive it.
  explicit WindowSources(NonlinearContext& context) : context_(context) {}

  // For x of `segment` at all nodes but the first: y, in `segment`, and the source s = f(t, x, y) - W x, in its f.
  // `times` are the nodes. Raises `residual` to the largest of the y. Returns the first failure, or success as
  // converged.
  SplittingOutcome Evaluate(const std::vector<double>& times, const Matrix& W, Segment& segment, double& residual);

 private:
  // What a block of times needs for itself: formulas and LCP solvers are not shared between threads.
  struct BlockTools {
    NonlinearFunctions functions;
    JosephyNewton newton;
  };

  NonlinearContext& context_;
  std::vector<std::unique_ptr<BlockTools>> tools_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_WINDOW_SOURCES_H_
