// SPDX-License-Identifier: Apache-2.0

#include "core/context/solve_context.h"

#include <algorithm>

#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

void Impulses::Note(const Grid& grid, const Segment& segment, Index begin, Index end) {
  for (Index j = begin + 1; j <= end && !first; ++j) {
    for (const Index i : rows) {
      if (segment.y(i, j) > 0) first = grid.times[segment.first_node + j];
    }
  }
}

void SolveContext::Add(const Segment& segment, const Scheme& scheme) {
  const bool splines = solution.method == Method::kWuChenIteration && options.interpolation != Interpolation::kLinear;
  if (grid.output_nodes.size() == grid.times.size() && !splines) {
    solution.dense_output = {.x_is_linear = scheme.x_is_linear, .y_is_linear = scheme.y_is_linear};
  }
  const Index m = most_states(), n = most_pairs();
  // Where A is sparse, few columns at a time stay in the cache until they are summed up.
  constexpr Index kNumbersInCache = Index{1} << 15, kFewest = 16;
  const Index in_cache = problem.A.is_dense() ? segment.steps : std::max(kFewest, kNumbersInCache / (m + n));
  const Index panel = std::min(in_cache, PanelWidth(4 * ((problem.A.is_dense() ? m * m : m) + n * n)));
  Matrix w;
  Index begin = 0;
  do {
    if (begin > 0) LookForStop();
    const StopScope to_the_end(nullptr);  // a step is filed as a whole
    const Index end = std::min(begin + panel, segment.steps);
    w = segment.g.middleCols(begin, end - begin + 1);
    w.noalias() += problem.N * segment.x.middleCols(begin, end - begin + 1);
    w.noalias() += problem.M * segment.y.middleCols(begin, end - begin + 1);
    certificate.Add(segment, w, scheme, begin, end);
    recorder.Add(segment, w, begin, end);
    impulses.Note(grid, segment, begin, end);
    if (limit_watch) limit_watch->Add(grid, segment, begin, end, solution.reached_limits);
    begin = end;
  } while (begin < segment.steps);
}

bool FailLcp(SolveContext& context, LcpStatus verdict, double time, const std::string& which) {
  const std::string at = which + " at t = " + FormatNumber(time);
  switch (verdict) {
    case LcpStatus::kInfeasible:
      return context.Fail(Termination::kInfeasible, time, at + " has no solution.");
    case LcpStatus::kRay:
      return context.Fail(Termination::kUnsupported, time,
                          at + ": Lemke's method ended in a ray. No solution was found, and for this class of "
                               "matrix this does not prove that there is none; a smaller step may help.");
    case LcpStatus::kPivotLimit:
      return context.Fail(Termination::kIterationLimit, time, at + ": the limit of pivots was reached.");
    case LcpStatus::kSingular:
      return context.Fail(Termination::kIterationLimit, time, at + ": the basis is singular to working precision.");
    case LcpStatus::kNonFinite:
      return context.Fail(Termination::kNonFinite, time,
                          "The state, or a product of it with A, B, N or M, is no longer finite at t = " +
                              FormatNumber(time) + ": it grew beyond the range of numbers, or the step is too long.");
    case LcpStatus::kSolved:
      break;
  }
  return context.Fail(Termination::kNotSolved, time, at + ": solved, but reported as failed.");
}

}  // namespace dlcs
