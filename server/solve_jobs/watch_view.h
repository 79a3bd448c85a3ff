// SPDX-License-Identifier: Apache-2.0
// How much detail of the iterates a watcher of a job receives.

#ifndef DLCS_SERVER_SOLVE_JOBS_WATCH_VIEW_H_
#define DLCS_SERVER_SOLVE_JOBS_WATCH_VIEW_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/observer.h"
#include "dlcs/v1/jobs.pb.h"
#include "server/store/event_detail.h"

namespace dlcs {

class WatchView {
 public:
  // Iterates without values, as in SolverService::Solve.
  WatchView() = default;
  // Errors: InvalidArgument with the field. Whether components exist is not known before the analysis: Admits().
  static absl::StatusOr<WatchView> Create(const v1::WatchSolveJobRequest& request);

  bool wants_progress_only() const { return progress_only_; }
  // The detail that events must have for Narrow().
  const jobs::EventDetail& detail() const { return detail_; }

  // Errors: InvalidArgument if a requested component does not exist in the problem.
  absl::Status Admits(const v1::Analysis& analysis) const;

  // Removes the values that were not requested from an iterate. Removes all of them if some requested ones are missing,
  // because the iterate was emitted before the watch began.
  void Narrow(v1::Iterate& iterate) const;

 private:
  bool progress_only_ = false;
  std::vector<int> components_;  // as requested
  jobs::EventDetail detail_;
};

// Appends the values that `detail` names to `event`, a serialized SolveEvent with an iterate, at no more times than fit
// into a message. The values follow as a second part of the iterate, which parsers merge with the first, so that they
// are copied only once.
void AppendValues(const IterateValues& values, const jobs::EventDetail& detail, std::string& event);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_WATCH_VIEW_H_
