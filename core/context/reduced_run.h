// SPDX-License-Identifier: Apache-2.0
// Solves run by run of the grid for y alone, with a propagator and without states between output nodes.

#ifndef DLCS_CORE_CONTEXT_REDUCED_RUN_H_
#define DLCS_CORE_CONTEXT_REDUCED_RUN_H_

#include <functional>
#include <memory>
#include <optional>

#include "core/context/checkpointing.h"
#include "core/context/solve_context.h"
#include "core/propagator/propagator.h"

namespace dlcs {

// What a method needs to find y on one run. Columns are the nodes 0..J or the midpoints of the steps.
struct ReducedRun {
  const Run& run;
  RunSources sources;
  Matrix g, g_mid;
  double f_defect = 0;  // max over the midpoints of ‖f - its linear interpolant‖_∞
  FreeMotion free;
  std::shared_ptr<const ReducedKernel> kernel;
  Matrix y;  // column 0 is given
  // The number of steps whose y comes from a checkpoint, and N x after them if the method saved it.
  Index first_step = 0;
  Vector N_x = {};
  // To be called when y is final up to step `steps`; may make a checkpoint.
  std::function<void(Index steps, const Vector& N_x)> offer_checkpoint = {};

  Index steps() const { return run.steps; }
  double Time(const Grid& grid, Index j) const { return grid.times[run.first_node + j]; }
  // For each row of N x + g the size of the terms that it is the sum of; the same for all rows if the propagator mixes
  // them.
  Vector Sizes() const;
};

// Solves the grid run by run with context.choices.propagator: samples the sources, starts smooth intervals, calls
// `solve` to find y of a run, adds to certificate and output, and computes the states at output nodes and the one that
// the next run starts from. `carry` saves and restores what `solve` keeps between runs (core/context/checkpointing.h).
// `solve` begins after run.first_step, counts its steps in the cost, and returns the number of steps done; fewer than
// all if it has ended the solve. Returns whether the end was reached. Memory: about 8 n J numbers for the longest run,
// besides the output.
bool SolveRunByRun(SolveContext& context, Hold hold, const CarryMethod& carry,
                   const std::function<Index(ReducedRun&)>& solve);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_REDUCED_RUN_H_
