// SPDX-License-Identifier: Apache-2.0
// The events of a running solve.

#ifndef DLCS_CORE_PROBLEM_OBSERVER_H_
#define DLCS_CORE_PROBLEM_OBSERVER_H_

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/problem/options.h"
#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// The final part of a running solve. Made at the end of windows, and by time-stepping methods after blocks of steps.
struct Checkpoint {
  double time;  // solved up to here
  // Columns first ... first + count - 1 of `solution` (times, x, y, w, left_limits) are new since the last checkpoint
  // and will not change any more. `count` may be 0.
  const Solution& solution;
  Index first;
  Index count;
  // Makes the state for ResumePoint, which may be as large as these columns: only where the solve will be resumed.
  std::function<std::string()> state;
};

// Where to resume: the state of a checkpoint, and at least the columns of the trajectory up to it.
struct ResumePoint {
  std::string state;
  Matrix x;  // m × columns
  Matrix y;  // n × columns
  Matrix w;  // n × columns
};

// The analysis of the problem before the first step.
struct AnalysisReport {
  std::string matrix_class;  // of M, as text: "P-matrix (all principal minors positive)"
  Method method = Method::kAuto;
  std::string reason;
  Index num_states = 0;
  Index num_constraints = 0;
  Index num_steps = 0;              // of the grid, with break points and output times
  double step = 0;                  // the longest
  std::optional<double> lipschitz;  // L of (2.3) in Chen & Xiang in the ∞-norm, where known
  std::vector<std::string> warnings;
};

struct WindowReport {
  Index window = 0;  // counted from 0; a rejected window and its successor have different numbers
  double begin = 0;
  double end = 0;
  Index steps = 0;
};

struct IterateReport {
  Index window = 0;
  Index iteration = 0;      // from 1 within the window
  double change = 0;        // max-norm over the window of the change of N x + g (wu_chen_iteration: of x)
  double lcp_residual = 0;  // max over time points of ‖min(y, w)‖_∞
  // log10 of the a-priori bound of `change`. Absent where no Lipschitz constant of the LCP is known; from
  // laplace_iteration for windows over several lengths of steps; from wu_chen_iteration for cubic splines and
  // where eigenvalues are split off; and where the bound is not finite.
  std::optional<double> log10_bound;
  double seconds = 0;  // since the solve began
};

// The function y of an iterate. The memory belongs to the method and is valid only during the call.
struct IterateValues {
  // Increasing; a time at which y has two limits occurs twice (wu_chen_iteration, where runs of the grid meet).
  std::span<const double> times;
  Eigen::Ref<const Matrix> y;  // n × times.size()
};

struct WindowOutcome {
  Index window = 0;
  double end = 0;
  Index iterations = 0;
  bool accepted = false;
  bool coupled = false;  // the single step was solved by the coupled LCP(q, M + K_0) instead of iterating
  std::string why;       // the reason of a rejection
};

// Called from the thread that called Solve(), one call at a time; must return quickly. Time-stepping methods report
// progress as windows without iterates, at most about ten times a second.
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void OnAnalysis(const AnalysisReport&) {}
  virtual void OnWindowStarted(const WindowReport&) {}
  virtual void OnIterate(const IterateReport&, const IterateValues&) {}
  virtual void OnWindowFinished(const WindowOutcome&) {}

  // Called at each point from which the solve could be resumed later, up to which the trajectory is final. The answer
  // may depend on the clock: the bits of the solution do not depend on it.
  virtual bool WantsCheckpoint() { return false; }
  virtual void OnCheckpoint(const Checkpoint&) {}
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_OBSERVER_H_
