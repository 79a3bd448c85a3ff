// SPDX-License-Identifier: Apache-2.0
// The iteration of Wu & Chen on one window.

#ifndef DLCS_CORE_METHODS_WINDOW_ITERATION_H_
#define DLCS_CORE_METHODS_WINDOW_ITERATION_H_

#include <optional>
#include <string>

#include "core/lcp/batch.h"
#include "core/methods/window.h"

namespace dlcs {

enum class WindowEnd { kConverged, kDiverged, kInfeasibleIterate, kJump, kIterationLimit, kCancelled };

struct WindowResult {
  WindowEnd end;
  Index iterations = 0;
  std::string why;
};

class WindowIteration {
 public:
  // `context` must outlive it. Without `may_shrink` a window is iterated on although it seems to diverge.
  WindowIteration(SolveContext& context, bool may_shrink);

  // Iterates on `window`, the `number`-th, from the state `x` and the multiplier `y` at its start, as
  // core/methods/laplace_iteration.h says. Leaves y of the last iterate in the window and, when converged, x and y
  // in its pieces. Reports each iterate; its bound only where all steps have one length.
  WindowResult Run(Index number, const Vector& x, const Vector& y, Window& window);

 private:
  Index max_iterations() const;
  std::optional<std::string> FindJump(const Matrix& q, const Window& window) const;
  void Report(Index number, Index k, double change, double residual, double log_bound);

  SolveContext& context_;
  const Problem& problem_;
  bool may_shrink_;
  LcpBatch batch_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_WINDOW_ITERATION_H_
