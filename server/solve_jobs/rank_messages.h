// SPDX-License-Identifier: Apache-2.0
// Conversions to and from the messages between a worker and its first rank (server/solve_jobs/rank_link.proto).

#ifndef DLCS_SERVER_SOLVE_JOBS_RANK_MESSAGES_H_
#define DLCS_SERVER_SOLVE_JOBS_RANK_MESSAGES_H_

#include "absl/status/statusor.h"
#include "core/types.h"
#include "server/jobs/job_manager.h"
#include "server/jobs/job_run.h"
#include "server/solve_jobs/rank_link.pb.h"
#include "server/solve_jobs/solve_attempt.h"
#include "server/store/event_detail.h"

namespace dlcs {

ranks::Window ToProto(jobs::AcceptedWindow window);
jobs::AcceptedWindow FromProto(ranks::Window window);

ranks::End ToProto(const jobs::JobEnd& end);
jobs::JobEnd FromProto(const ranks::End& end);

ranks::Detail ToProto(const jobs::EventDetail& detail);
jobs::EventDetail FromProto(const ranks::Detail& detail);

void AddEarlier(const EarlierAttempts& earlier, ranks::Work& work);
// The stored results in `work`, for a problem of this size. Errors: Internal if they do not fit the problem.
absl::StatusOr<EarlierAttempts> EarlierIn(const ranks::Work& work, Index states, Index constraints);

// The interval at which ranks ping their worker. They notice within twice this time that the worker is lost.
inline constexpr int kRankPing_ms = 15'000;

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_RANK_MESSAGES_H_
