// SPDX-License-Identifier: Apache-2.0
// SolverService::Solve for a solve that runs as a job: creates it, watches it and reads its result in one call.

#ifndef DLCS_SERVER_RPC_JOB_SOLVE_CALL_H_
#define DLCS_SERVER_RPC_JOB_SOLVE_CALL_H_

#include <functional>
#include <memory>
#include <optional>

#include "dlcs/v1/solver.grpc.pb.h"
#include "server/access/access.h"
#include "server/jobs/job_manager.h"
#include "server/rpc/stream_call.h"
#include "server/solve_jobs/job_trajectory.h"

namespace dlcs {

class JobSolveCall final : public StreamCall<v1::SolveEvent> {
 public:
  // Creates the job, or finds the one that an earlier call created; returns the first event. Blocks on the store.
  using Create = std::function<absl::StatusOr<v1::Accepted>(const Caller&)>;
  JobSolveCall(CallEnvironment& environment, grpc::CallbackServerContext& context, Create create)
      : StreamCall(environment, context, CallKind::kStore), create_(std::move(create)) {}

 private:
  absl::Status Work() override;
  absl::StatusOr<Got> Next(v1::SolveEvent& event) override;

  absl::Status BeginToWatch();
  absl::Status BeginToRead();
  absl::Status ReadPage();
  Got NextOfJob(v1::SolveEvent& event);

  const Create create_;
  jobs::JobId id_;
  std::unique_ptr<jobs::JobWatch> watch_;
  std::optional<v1::SolveEvent> next_;  // the next event, if it is known already

  // The number of the job's summary, its last event. 0 before it.
  std::int64_t last_sequence_ = 0;
  std::optional<v1::Summary> summary_;
  std::optional<TrajectoryReader> reader_;
  bool ended_ = false;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_JOB_SOLVE_CALL_H_
