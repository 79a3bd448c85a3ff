// SPDX-License-Identifier: Apache-2.0
// A solve that is a job: created, watched and read in one call.

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
  // Makes the job, or finds the one that an earlier call made; what is told first. Blocks on the store.
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
  // Nothing where a solve does not tell of it.
  std::optional<v1::SolveEvent> Told(const jobs::Event& event);

  const Create create_;
  jobs::JobId id_;
  std::unique_ptr<jobs::JobWatch> watch_;
  std::optional<v1::SolveEvent> next_;  // that is known already
  bool queued_ = true;
  double progress_ = 0;

  // Behind the last event of the job.
  std::int64_t last_sequence_ = 0;
  std::optional<v1::Summary> summary_;
  std::optional<TrajectoryReader> reader_;
  bool ended_ = false;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_JOB_SOLVE_CALL_H_
