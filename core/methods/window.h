// SPDX-License-Identifier: Apache-2.0
// A window of the iteration: consecutive steps, of one length or of several.

#ifndef DLCS_CORE_METHODS_WINDOW_H_
#define DLCS_CORE_METHODS_WINDOW_H_

#include <vector>

#include "core/laplace/kernel.h"
#include "core/methods/marching.h"
#include "core/methods/segment.h"
#include "core/methods/solve_context.h"

namespace dlcs {

// What depends on the step length alone.
struct StepTools {
  StepTools(SolveContext& context, double step)
      : marcher(context.problem, ExponentialPiecewiseLinear(context.problem, step), context.choice()),
        kernel(context.problem, marcher.scheme(), context.options.kernel, context.workers,
               *context.solution.kernel) {}
  const Scheme& scheme() const { return marcher.scheme(); }
  Marcher marcher;  // for the steps that must be marched
  Kernel kernel;
};

// The steps of one run that lie in a window.
struct WindowPiece {
  StepTools* tools;
  Segment segment;
};

struct Window {
  std::vector<WindowPiece> pieces;
  Index steps = 0;
  Matrix g, y;  // n × steps + 1, the columns of all pieces, each node once

  Index first_node() const { return pieces.front().segment.first_node; }

  // Appends a piece with its sources.
  void Append(StepTools& tools, Segment segment);

  // The tools that all pieces share; null where the steps have several lengths.
  StepTools* SharedTools() const;

  // Fills x and y of all pieces from `start`, the state at the start of the window, and y of the window by the
  // recursion of their schemes; returns N x + g at all columns. Cost: O(m²) a step.
  Matrix Propagate(const Problem& problem, const Vector& start);

  // SizeOfSums() of all pieces.
  Vector SizeOfSums(const Problem& problem) const;
};

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_WINDOW_H_
