// SPDX-License-Identifier: Apache-2.0
// A run of the grid seen from its constraints.

#ifndef DLCS_CORE_CONTEXT_REDUCED_RUN_H_
#define DLCS_CORE_CONTEXT_REDUCED_RUN_H_

#include <functional>
#include <memory>
#include <optional>

#include "core/context/solve_context.h"
#include "core/propagator/propagator.h"

namespace dlcs {

// The run between two states: what a method needs in order to find y. Columns are the nodes 0..J, or the middles of the
// steps.
struct ReducedRun {
  const Run& run;
  RunSources sources;
  Matrix g, g_mid;
  double f_defect = 0;  // max over the middles of ‖f - its linear interpolant‖_∞
  FreeMotion free;
  std::shared_ptr<const ReducedKernel> kernel;
  Matrix y;  // column 0 is given
  // Steps whose y a checkpoint has given, and N x behind them where the method offered it.
  Index first_step = 0;
  Vector N_x = {};
  // y is final up to a step: perhaps makes a checkpoint.
  std::function<void(Index steps, const Vector& N_x)> offer_checkpoint = {};

  Index steps() const { return run.steps; }
  double Time(const Grid& grid, Index j) const { return grid.times[run.first_node + j]; }
  // For each row, and for all where a propagator mixes them, the size of the numbers that N x + g is summed from.
  Vector Sizes() const;
};

// Goes from run to run of the grid with context.propagator: samples the sources, starts smooth intervals, lets `solve`
// find y of a run, files certificate and output, and makes the states that are asked for, and the one that the next run
// starts from. `carry` carries what `solve` keeps from run to run (core/context/checkpointing.h). `solve` begins behind
// run.first_step, counts its steps in the cost and returns the number of those done; fewer than all where it has ended
// the solve. Returns whether the end was reached. Memory: some 8 n J numbers for the longest run, besides the states of
// the output.
bool SolveRunByRun(SolveContext& context, Hold hold, const Checkpointing::CarryMethod& carry,
                   const std::function<Index(ReducedRun&)>& solve);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_REDUCED_RUN_H_
