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
  kFlightFailed,  // the failure was in a later window than the one that was to converge
};

// Several windows that are iterated together (Options::windows_in_flight). The first `steps` steps have to converge;
// later ones are iterated at the same time. `guess` holds y at some of the nodes 1, 2, ... to start from.
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
  // the window and, if it converged, calls window.Finish(). Reports each iterate, with the a-priori bound if the window
  // has a bound of its kernel and the iteration is not accelerated.
  WindowResult Run(Index number, WindowModel& window) {
    return Run(number, window, {.steps = window.steps(), .guess = {}});
  }
  // The same for the first window of a `flight`; Finish() is not called.
  WindowResult Run(Index number, WindowModel& window, const Flight& flight);

 private:
  // The comparison of two iterates, q and `next` (computed from y), on the columns [begin, end): for each row the
  // change and the size of `next`, and the natural residual of y and next + M y (not that of y_0, which is given).
  struct Judgment {
    Vector row_change, row_size;
    double residual = 0;

    void Raise(const Judgment& other);
  };

  // The iteration from `q`. The first `first` steps of the window have to converge.
  WindowResult Iterate(Index number, WindowModel& window, Index first, Matrix q);
  // y of the window at all nodes but the first, from `q`, in parallel.
  LcpBatchOutcome SolveLcps(const Matrix& q, const Vector& size, WindowModel& window);
  // Sets `next` to the q that follows from y of the window, and compares it with `q` on the first `first` steps, block
  // by block as they are computed.
  Judgment FollowAndJudge(const Matrix& q, WindowModel& window, Index first, Matrix& next);
  Index max_iterations() const;
  Judgment Judge(const Matrix& q, const Matrix& next, const Matrix& y, Index begin, Index end) const;
  std::optional<std::string> FindJump(const Matrix& q, const WindowModel& window) const;
  // The first `columns` columns of the window's y belong to this iterate.
  void Report(IterateReport report, double log_bound, const WindowModel& window, Index columns);

  SolveContext& context_;
  const Problem& problem_;
  bool may_shrink_;
  LcpBatch batch_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_WINDOW_ITERATION_H_
