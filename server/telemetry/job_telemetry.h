// SPDX-License-Identifier: Apache-2.0
// Log lines and metrics about jobs.

#ifndef DLCS_SERVER_TELEMETRY_JOB_TELEMETRY_H_
#define DLCS_SERVER_TELEMETRY_JOB_TELEMETRY_H_

#include <string>

#include "dlcs/v1/solver.pb.h"
#include "server/jobs/job_manager.h"
#include "server/telemetry/metrics.h"

namespace dlcs {

// A termination in the log and in labels of metrics, without the prefix of the enumeration: "REACHED_END".
std::string TerminationLabel(v1::Termination termination);

// Wraps `solve` so that attempts are counted, and each one logs a line at its end: job, user, outcome and seconds.
// `metrics` must outlive it.
jobs::SolveFunction WithTelemetry(Metrics& metrics, jobs::SolveFunction solve);

}  // namespace dlcs

#endif  // DLCS_SERVER_TELEMETRY_JOB_TELEMETRY_H_
