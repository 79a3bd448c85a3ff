// SPDX-License-Identifier: Apache-2.0

#include "core/discretization/sources.h"

#include <cmath>
#include <cstdio>

#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

std::optional<Sources::NonFinite> FindNonFinite(const char* name, const Matrix& values, double time, Index column) {
  for (Index i = 0; i < values.rows(); ++i) {
    if (std::isfinite(values(i, column))) continue;
    char message[96];
    std::snprintf(message, sizeof message, "%s[%ld] is %g at t = %.12g", name, static_cast<long>(i), values(i, column),
                  time);
    return Sources::NonFinite{time, message};
  }
  return std::nullopt;
}

}  // namespace

absl::StatusOr<Sources> Sources::Create(const Problem& problem) {
  const TimeAxis axis = AxisOf(problem);
  auto f = TimeFunctionEvaluator::Create(problem.f, problem.num_states(), axis);
  if (!f.ok()) return f.status();
  auto g = TimeFunctionEvaluator::Create(problem.g, problem.num_constraints(), axis);
  if (!g.ok()) return g.status();
  return Sources(*std::move(f), *std::move(g));
}

std::optional<Sources::NonFinite> Sources::Sample(const Grid& grid, const Run& run, Index first_step, Index steps,
                                                  Segment& segment) {
  segment.first_node = run.first_node + first_step;
  segment.steps = steps;
  segment.step = run.step;
  segment.f.resize(f_.size(), steps + 1);
  segment.g.resize(g_.size(), steps + 1);
  segment.f_mid.resize(f_.size(), steps);
  segment.g_mid.resize(g_.size(), steps);
  const double* times = grid.times.data() + segment.first_node;
  for (Index k = 0; k <= steps; ++k) {
    LookForStop();
    const Side side = k == 0 ? Side::kRight : Side::kLeft;
    f_.Evaluate(times[k], side, segment.f.col(k));
    g_.Evaluate(times[k], side, segment.g.col(k));
    if (k == steps) break;
    const double middle = (times[k] + times[k + 1]) / 2;
    f_.Evaluate(middle, Side::kRight, segment.f_mid.col(k));
    g_.Evaluate(middle, Side::kRight, segment.g_mid.col(k));
  }
  if (segment.f.allFinite() && segment.g.allFinite() && segment.f_mid.allFinite() && segment.g_mid.allFinite()) {
    return std::nullopt;
  }
  for (Index k = 0; k <= steps; ++k) {
    if (auto bad = FindNonFinite("f", segment.f, times[k], k)) return bad;
    if (auto bad = FindNonFinite("g", segment.g, times[k], k)) return bad;
    if (k == steps) break;
    const double middle = (times[k] + times[k + 1]) / 2;
    if (auto bad = FindNonFinite("f", segment.f_mid, middle, k)) return bad;
    if (auto bad = FindNonFinite("g", segment.g_mid, middle, k)) return bad;
  }
  return std::nullopt;
}

}  // namespace dlcs
