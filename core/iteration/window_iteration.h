// SPDX-License-Identifier: Apache-2.0
// The iteration of Wu & Chen on one window.

#ifndef DLCS_CORE_ITERATION_WINDOW_ITERATION_H_
#define DLCS_CORE_ITERATION_WINDOW_ITERATION_H_

#include <optional>
#include <string>

#include "core/context/solve_context.h"
#include "core/iteration/window_model.h"
#include "core/lcp/batch.h"

namespace dlcs {

enum class WindowEnd {
  kConverged,
  kDiverged,
  kInfeasibleIterate,
  kJump,
  kIterationLimit,
  kCancelled,
  kFlightFailed,  // in the windows behind the one that was to converge
};

// Windows that are iterated on together: the first `steps` of what the iteration is given are to converge; those behind
// them are on their way, from `guess`, the y of some of the nodes 1, 2, ....
struct Flight {
  Index steps = 0;
  Matrix guess;
};

struct WindowResult {
  WindowEnd end;
  Index iterations = 0;
  std::string why;
};

class WindowIteration {
 public:
  // `context` must outlive it. Without `may_shrink` a window is iterated on although it seems to diverge.
  WindowIteration(SolveContext& context, bool may_shrink);

  // Iterates on `window`, the `number`-th, as core/iteration/laplace_iteration.h says. Leaves y of the last iterate in
  // the window and, when converged, has it finished. Reports each iterate; its bound only where the window has one of
  // its kernel, and the iteration is not accelerated.
  WindowResult Run(Index number, WindowModel& window) {
    return Run(number, window, {.steps = window.steps(), .guess = {}});
  }
  // The same for the first window of a `flight`; it is not finished.
  WindowResult Run(Index number, WindowModel& window, const Flight& flight);

 private:
  // What the first columns of two iterates tell, q and `next`, which follows from y: per row the change and the size of
  // `next`, and the natural residual of y and next + M y.
  struct Judgment {
    Vector row_change, row_size;
    double residual;
  };

  Index max_iterations() const;
  Judgment Judge(const Matrix& q, const Matrix& next, const Matrix& y, Index columns) const;
  std::optional<std::string> FindJump(const Matrix& q, const WindowModel& window) const;
  // `columns` of the window's y are of this iterate.
  void Report(IterateReport report, double log_bound, const WindowModel& window, Index columns);

  SolveContext& context_;
  const Problem& problem_;
  bool may_shrink_;
  LcpBatch batch_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_WINDOW_ITERATION_H_
