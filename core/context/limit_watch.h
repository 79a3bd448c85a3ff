// SPDX-License-Identifier: Apache-2.0
// Compares outputs with their limits while a solve runs.

#ifndef DLCS_CORE_CONTEXT_LIMIT_WATCH_H_
#define DLCS_CORE_CONTEXT_LIMIT_WATCH_H_

#include <cmath>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/discretization/grid.h"
#include "core/discretization/segment.h"
#include "core/outputs/output_evaluator.h"
#include "core/problem/problem.h"

namespace dlcs {

// Adds to `reached` (Solution::reached_limits) that the output of `limit` reached it after `after` and by `time`; at
// `time` itself where the two are the same, or read the same. Does nothing if the limit was added before.
void NoteReachedLimit(const Problem& problem, const OutputLimit& limit, double after, double time,
                      std::vector<std::string>& reached);

// Whether |z| reaches the limit. True where z overflows.
inline bool ReachesLimit(double z, const OutputLimit& limit) { return !(std::abs(z) < kReachedLimit * limit.value); }

// For a valid `problem` with limits, which must outlive it.
class LimitWatch {
 public:
  // Errors: those of OutputEvaluator::Create().
  static absl::StatusOr<LimitWatch> Create(const Problem& problem);

  // Compares at the nodes begin...end of `segment`, which follow those of the last call. What happens between two nodes
  // is not seen. Cost: that of the outputs with limits at these nodes.
  void Add(const Grid& grid, const Segment& segment, Index begin, Index end, std::vector<std::string>& reached);

 private:
  LimitWatch(const Problem& problem, OutputEvaluator evaluator);

  const Problem& problem_;
  OutputEvaluator evaluator_;  // row k: the output of limit k
};

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_LIMIT_WATCH_H_
