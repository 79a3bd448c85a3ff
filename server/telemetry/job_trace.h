// SPDX-License-Identifier: Apache-2.0
// The trace of the call that created a job, stored with the job.

#ifndef DLCS_SERVER_TELEMETRY_JOB_TRACE_H_
#define DLCS_SERVER_TELEMETRY_JOB_TRACE_H_

#include <string>

namespace dlcs {

// Appends `trace_id` to a stored request (a serialized message) as a field that only this file knows. Parsers of the
// request ignore it, like fields of later versions. `trace_id` as TraceIdOf() gives it; an empty one changes nothing.
std::string WithTraceId(std::string request, const std::string& trace_id);

// The id in such a request; empty if there is none. O(1).
std::string TraceIdIn(const std::string& request);

}  // namespace dlcs

#endif  // DLCS_SERVER_TELEMETRY_JOB_TRACE_H_
