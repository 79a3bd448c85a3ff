// SPDX-License-Identifier: Apache-2.0
#include "core/driver/memory_prediction.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/discretization/step_cache.h"
#include "core/driver/step_memory.h"
#include "core/parallel/team.h"
#include "core/stepping/stepping.h"

namespace dlcs {
namespace {

constexpr Index kMatricesOfAStep = 12;           // of size m × m, with the work space of the matrix functions
constexpr Index kColumnsOfARun = 8;              // for each node: y, q, g, the free motion, ...
constexpr Index kMaxKernelDoubles = 84'000'000;  // blocks and their transforms, as core/laplace/kernel.h bounds them

// How many lengths of step have a set-up at the same time.
double LengthsKept(const Grid& grid, Index states) {
  std::vector<double> lengths;
  for (const Run& run : grid.runs) lengths.push_back(run.step);
  std::sort(lengths.begin(), lengths.end());
  lengths.erase(std::unique(lengths.begin(), lengths.end(), IsSameStep), lengths.end());
  return static_cast<double>(std::clamp(lengths.size(), std::size_t{1}, MostStepsKept(states)));
}

}  // namespace

double PredictBytes(const Problem& problem, const Grid& grid, Method method, const PropagatorChoice& propagator) {
  const double m = static_cast<double>(problem.num_states()), n = static_cast<double>(problem.num_constraints());
  const double steps = static_cast<double>(grid.num_steps());
  const double outputs = static_cast<double>(grid.output_nodes.size());
  const double psi = static_cast<double>(problem.f.inner_size(problem.num_states()));
  const double trajectory = ((m + 2 * n + 2) * outputs + steps + 1) * sizeof(double);  // with the grid
  const double couplings = 4 * n * n * sizeof(double);
  const double kernel =
      method == Method::kLaplaceIteration ? std::min<double>(5 * n * n * steps, kMaxKernelDoubles) * sizeof(double) : 0;
  const double run_columns = (kColumnsOfARun * n + 2 * psi) * steps * sizeof(double);
  // Steps on states keep blocks of some steps, of one at least.
  const Index most =
      propagator.record.used == PropagatorKind::kSparseStepping ? kMostNumbersOfAChunk : kMostNumbersOfALargeChunk;
  const double stretch = kColumnsOfARun * std::min(m * steps, std::max(m, static_cast<double>(most))) * sizeof(double);
  switch (propagator.record.used) {
    case PropagatorKind::kAuto:
    case PropagatorKind::kDense:
      return trajectory + couplings + kernel + kMatricesOfAStep * m * m * sizeof(double) +
             (method == Method::kWuChenIteration ? kColumnsOfARun * m * steps * sizeof(double) : stretch);
    case PropagatorKind::kSparseStepping: {
      const Index nonzeros = problem.A.Sparse().nonZeros() + problem.E.Sparse().nonZeros();
      const double in_the_plane = static_cast<double>(nonzeros) * std::max(1.0, std::log2(m));
      return trajectory + stretch +
             LengthsKept(grid, problem.num_states()) *
                 SparseStepBytes(problem, propagator.factor_nonzeros > 0 ? propagator.factor_nonzeros : in_the_plane);
    }
    case PropagatorKind::kIterativeStepping: {
      Team& team = Team::Current();
      const double processes = team.distributed_steps() ? team.size() : 1;
      // Blocks have eight steps at least.
      const double shared =
          LengthsKept(grid, problem.num_states()) * IterativeStepBytes(problem) +
          kColumnsOfARun * std::min(m * steps, std::max(8 * m, static_cast<double>(most))) * sizeof(double);
      return trajectory + shared / processes;
    }
    case PropagatorKind::kKroneckerSum:
    case PropagatorKind::kContour:
      return trajectory + couplings + kernel + run_columns + kColumnsOfARun * m * sizeof(double) +
             propagator.system->PredictBytes(grid);
  }
  return trajectory;
}

}  // namespace dlcs
