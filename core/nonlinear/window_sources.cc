// SPDX-License-Identifier: Apache-2.0
#include "core/nonlinear/window_sources.h"

#include <algorithm>

#include "core/context/solve_context.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

using Verdict = ComplementarityResult::Verdict;

}  // namespace

ComplementarityResult SolveForY(NonlinearFunctions& functions, JosephyNewton& newton, double t, const Vector& x,
                                Vector& y) {
  return newton.Solve({[&](const Vector& at) { return functions.G(t, x, at); },
                       [&](const Vector& at) { return functions.GByY(t, x, at); }},
                      y);
}

SplittingOutcome FailureOf(NonlinearContext& context, const ComplementarityResult& result, double t, const Vector& x,
                           const Vector& y) {
  SplittingOutcome failure;
  failure.time = t;
  failure.why = result.no_state
                    ? result.why
                    : "0 <= y ⟂ g(t, x, y) >= 0 at t = " + FormatNumber(t) + " was not solved: " + result.why;
  if (result.verdict == Verdict::kInfeasible) failure.termination = Termination::kInfeasible;
  if (result.verdict == Verdict::kNonFinite || result.no_state) {
    if (result.verdict == Verdict::kNonFinite) failure.termination = Termination::kNonFinite;
    std::string where = DescribeNonFinite("g", context.problem.g, context.functions.G(t, x, y), t);
    if (where.empty()) where = DescribeNonFinite("f", context.problem.f, context.functions.F(t, x, y), t);
    if (!where.empty()) {
      failure.termination = Termination::kNonFinite;
      failure.why = where;
    }
  }
  return failure;
}

SplittingOutcome WindowSources::Evaluate(const std::vector<double>& times, const Matrix& W, Segment& segment,
                                         double& residual) {
  constexpr Index kTimesPerBlock = 32;
  constexpr Index kMaxBlocks = 64;
  const Index steps = segment.steps;
  const Index block_size = std::max(kTimesPerBlock, (steps + kMaxBlocks - 1) / kMaxBlocks);
  const auto blocks = static_cast<size_t>((steps + block_size - 1) / block_size);
  while (tools_.size() < blocks) {
    // The formulas were read before: they parse.
    tools_.push_back(std::make_unique<BlockTools>(
        BlockTools{*NonlinearFunctions::Create(context_.problem), JosephyNewton(context_.selection)}));
  }
  struct Outcome {
    ComplementarityResult last;
    Index node = 0, lcps = 0;
    double residual = 0;
    Vector source;  // where it is not finite
  };
  std::vector<Outcome> outcomes(blocks);
  context_.workers.ForBlocks(steps, block_size, [&](Index block, Index begin, Index end) {
    BlockTools& tools = *tools_[block];
    Outcome& outcome = outcomes[block];
    outcome.last.verdict = Verdict::kSolved;
    for (Index j = begin + 1; j <= end && !context_.stop.stop_requested(); ++j) {
      const Vector x = segment.x.col(j);
      Vector y = segment.y.col(j);
      outcome.node = j;
      outcome.last = SolveForY(tools.functions, tools.newton, times[j], x, y);
      outcome.lcps += outcome.last.lcps;
      outcome.residual = NanMax(outcome.residual, outcome.last.residual);
      segment.y.col(j) = y;
      if (outcome.last.verdict != Verdict::kSolved) return;
      const Vector source = tools.functions.F(times[j], x, y) - W * x;
      segment.f.col(j) = source;
      if (!source.allFinite()) {
        outcome.source = source;
        return;
      }
    }
  });
  SplittingOutcome result{.converged = true, .why = {}};
  for (const Outcome& outcome : outcomes) {
    context_.solution.cost.lcps += outcome.lcps;
    residual = NanMax(residual, outcome.residual);
    if (!result.converged) continue;
    const double t = times[outcome.node];
    if (outcome.last.verdict != Verdict::kSolved) {
      result = FailureOf(context_, outcome.last, t, segment.x.col(outcome.node), segment.y.col(outcome.node));
    } else if (outcome.source.size() > 0) {
      result = {.termination = Termination::kNonFinite,
                .time = t,
                .why = DescribeNonFinite("f", context_.problem.f, outcome.source, t)};
    }
  }
  return result;
}

}  // namespace dlcs
