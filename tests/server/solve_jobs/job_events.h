// SPDX-License-Identifier: Apache-2.0
// Checks of the events of one job.

#ifndef DLCS_TESTS_SERVER_SOLVE_JOBS_JOB_EVENTS_H_
#define DLCS_TESTS_SERVER_SOLVE_JOBS_JOB_EVENTS_H_

#include <string>
#include <vector>

#include "dlcs/v1/jobs.pb.h"

namespace dlcs::testing {

// Checks that numbers increase, that missing numbers are in a gap, that stored times increase, and that the end is
// last. Returns what is wrong, or an empty text.
std::string WhatIsWrongWithJobEvents(const std::vector<v1::SolveEvent>& events);

// Events that no watcher may miss: state changes, the analysis, checkpoints and the end.
bool IsDurableEvent(const v1::SolveEvent& event);

// Checks that `events`, received over several connections, contain every durable event of `all`, received over one.
// Returns what is missing, or an empty text.
std::string WhatIsMissing(const std::vector<v1::SolveEvent>& events, const std::vector<v1::SolveEvent>& all);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_SOLVE_JOBS_JOB_EVENTS_H_
