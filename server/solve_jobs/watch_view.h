// SPDX-License-Identifier: Apache-2.0
// How much a watcher of a job is told of its iterates.

#ifndef DLCS_SERVER_SOLVE_JOBS_WATCH_VIEW_H_
#define DLCS_SERVER_SOLVE_JOBS_WATCH_VIEW_H_

#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/observer.h"
#include "dlcs/v1/jobs.pb.h"
#include "server/store/event_detail.h"

namespace dlcs {

class WatchView {
 public:
  // Iterates without values: what a solve is told.
  WatchView() = default;
  // Errors: InvalidArgument with the field. Whether components exist is not known before the analysis: Admits().
  static absl::StatusOr<WatchView> Create(const v1::WatchSolveJobRequest& request);

  bool wants_progress_only() const { return progress_only_; }
  // What events must carry for Narrow() to find what was asked for.
  const jobs::EventDetail& detail() const { return detail_; }

  // Errors: InvalidArgument where a component that was asked for is none of the problem's.
  absl::Status Admits(const v1::Analysis& analysis) const;

  // Takes from an iterate the values that were not asked for; all of them where some that were are not there, since the
  // iterate was told before anybody wanted them.
  void Narrow(v1::Iterate& iterate) const;

 private:
  bool progress_only_ = false;
  std::vector<int> components_;  // as asked for
  jobs::EventDetail detail_;
};

// Brings the values that `detail` names into `iterate`: at no more times than fit into a message.
// Cost: a copy of them.
void AddValues(const IterateValues& values, const jobs::EventDetail& detail, v1::Iterate& iterate);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_WATCH_VIEW_H_
