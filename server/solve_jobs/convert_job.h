// SPDX-License-Identifier: Apache-2.0
// Jobs and their events as messages.

#ifndef DLCS_SERVER_SOLVE_JOBS_CONVERT_JOB_H_
#define DLCS_SERVER_SOLVE_JOBS_CONVERT_JOB_H_

#include <optional>
#include <string>

#include "dlcs/v1/jobs.pb.h"
#include "server/jobs/event_log.h"
#include "server/store/event.h"
#include "server/store/job.h"

namespace dlcs {

google::protobuf::Timestamp ToProto(jobs::Time time);
// Truncated to microseconds.
jobs::Time FromProto(const google::protobuf::Timestamp& time);
v1::JobState ToProto(jobs::JobState state);
// Absent for a state that this version does not know.
std::optional<jobs::JobState> FromProto(v1::JobState state);
// The fields `summary` and `waiting_for` are not set.
v1::SolveJob ToProto(const jobs::Job& job);
// The number of MPI ranks that a job with this Job::about requests; 0: none.
int RanksOf(const std::string& about);

// The payloads of events are SolveEvents in which only the kind is set (JobSolver makes them); of kState it is the
// state's name, of kSummary a Summary or nothing.
v1::SolveEvent ToProto(const jobs::Event& event);
v1::SolveEvent ToProto(const jobs::EventGap& gap, jobs::Time now);
v1::SolveEvent HeartbeatAfter(std::int64_t sequence, jobs::Time now);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_CONVERT_JOB_H_
