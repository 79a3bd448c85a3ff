// SPDX-License-Identifier: Apache-2.0
#include "core/context/limit_watch.h"

#include <algorithm>
#include <utility>

#include "core/format_number.h"

namespace dlcs {

void NoteReachedLimit(const Problem& problem, const OutputLimit& limit, double after, double time,
                      std::vector<std::string>& reached) {
  const std::string begin = problem.outputs.names[static_cast<std::size_t>(limit.output)] + " reaches its limit " +
                            NumberText(limit.value) + " ";
  if (std::ranges::any_of(reached, [&](const std::string& one) { return one.starts_with(begin); })) return;
  const std::string from = FormatNumber(after), to = FormatNumber(time);
  reached.push_back(begin + (from == to ? "at t = " + to : "between t = " + from + " and t = " + to) +
                    ": from there on the result is not that of the model.");
}

absl::StatusOr<LimitWatch> LimitWatch::Create(const Problem& problem) {
  std::vector<Index> outputs;
  for (const OutputLimit& limit : problem.outputs.limits) outputs.push_back(limit.output);
  auto evaluator = OutputEvaluator::Create(problem, outputs);
  if (!evaluator.ok()) return evaluator.status();
  return LimitWatch(problem, *std::move(evaluator));
}

LimitWatch::LimitWatch(const Problem& problem, OutputEvaluator evaluator)
    : problem_(problem), evaluator_(std::move(evaluator)) {}

void LimitWatch::Add(const Grid& grid, const Segment& segment, Index begin, Index end,
                     std::vector<std::string>& reached) {
  const Vector times = Eigen::Map<const Vector>(grid.times.data() + segment.first_node + begin, end - begin + 1);
  const Matrix z =
      evaluator_.Between(times, segment.x.middleCols(begin, times.size()), segment.y.middleCols(begin, times.size()));
  for (Index k = 0; k < z.rows(); ++k) {
    const OutputLimit& limit = problem_.outputs.limits[static_cast<std::size_t>(k)];
    for (Index j = 0; j < z.cols(); ++j) {
      if (!ReachesLimit(z(k, j), limit)) continue;
      NoteReachedLimit(problem_, limit, times[std::max<Index>(j - 1, 0)], times[j], reached);
      break;
    }
  }
}

}  // namespace dlcs
