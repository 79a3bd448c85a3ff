// SPDX-License-Identifier: Apache-2.0
// The trace of the call that made a job, kept with the job.

#ifndef DLCS_SERVER_TELEMETRY_JOB_TRACE_H_
#define DLCS_SERVER_TELEMETRY_JOB_TRACE_H_

#include <string>

namespace dlcs {

// A stored request, the serialized message, followed by one more field of it that only this file knows: whoever parses
// the request passes over it, as over fields of later versions. `trace_id` as TraceIdOf() gives it; an empty one
// changes nothing.
std::string WithTraceId(std::string request, const std::string& trace_id);

// The id in such a request; empty where there is none. O(1).
std::string TraceIdIn(const std::string& request);

}  // namespace dlcs

#endif  // DLCS_SERVER_TELEMETRY_JOB_TRACE_H_
