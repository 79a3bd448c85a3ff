// SPDX-License-Identifier: Apache-2.0
#ifndef DLCS_PROTO_WIRE_JOB_EVENT_H_
#define DLCS_PROTO_WIRE_JOB_EVENT_H_

#include <optional>

#include "dlcs/v1/jobs.pb.h"

namespace dlcs {

// What a solve tells of an event of its job, with the same number; absent for what it does not tell: states and
// checkpoints, and the end, of which more is to be said.
std::optional<v1::SolveEvent> AsSolveEvent(const v1::JobEvent& event);

}  // namespace dlcs

#endif  // DLCS_PROTO_WIRE_JOB_EVENT_H_
