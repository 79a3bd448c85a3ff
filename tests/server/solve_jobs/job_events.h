// SPDX-License-Identifier: Apache-2.0
// What the events of one job must look like, whoever watched them.

#ifndef DLCS_TESTS_SERVER_SOLVE_JOBS_JOB_EVENTS_H_
#define DLCS_TESTS_SERVER_SOLVE_JOBS_JOB_EVENTS_H_

#include <string>
#include <vector>

#include "dlcs/v1/jobs.pb.h"

namespace dlcs::testing {

// Checks that numbers rise, that what is missing between them is in a gap, that stored times rise, and that the end
// comes last. What is wrong, or an empty text.
std::string WhatIsWrongWithJobEvents(const std::vector<v1::SolveEvent>& events);

// Events that no watcher may miss: state changes, the analysis, checkpoints and the end.
bool IsDurableEvent(const v1::SolveEvent& event);

// Whether `events`, seen by somebody who was cut and came back, hold every durable event of `all`, watched without a
// cut. Returns what is missing, or an empty text.
std::string WhatIsMissing(const std::vector<v1::SolveEvent>& events, const std::vector<v1::SolveEvent>& all);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_SOLVE_JOBS_JOB_EVENTS_H_
