// SPDX-License-Identifier: Apache-2.0
#ifndef DLCS_PROTO_WIRE_JOB_EVENT_H_
#define DLCS_PROTO_WIRE_JOB_EVENT_H_

#include <optional>

#include "dlcs/v1/jobs.pb.h"

namespace dlcs {

// The SolveEvent for an event of a job, with the same number. Absent for events that Solve does not report: states and
// checkpoints, and the end, which needs more data.
std::optional<v1::SolveEvent> AsSolveEvent(const v1::JobEvent& event);

}  // namespace dlcs

#endif  // DLCS_PROTO_WIRE_JOB_EVENT_H_
