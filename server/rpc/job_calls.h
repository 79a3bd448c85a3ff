// SPDX-License-Identifier: Apache-2.0
// The calls of JobService that stream: the events of a job, its trajectory, the results of an ensemble.

#ifndef DLCS_SERVER_RPC_JOB_CALLS_H_
#define DLCS_SERVER_RPC_JOB_CALLS_H_

#include <memory>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "dlcs/v1/jobs.grpc.pb.h"
#include "server/access/user_quota.h"
#include "server/jobs/job_manager.h"
#include "server/rpc/stream_call.h"
#include "server/solve_jobs/ensemble_results.h"
#include "server/solve_jobs/job_trajectory.h"
#include "server/solve_jobs/watch_view.h"

namespace dlcs {

// The events of a job.
class JobWatchCall final : public StreamCall<v1::SolveEvent> {
 public:
  JobWatchCall(CallEnvironment& environment, grpc::CallbackServerContext& context,
               const v1::WatchSolveJobRequest& request)
      : StreamCall(environment, context, CallKind::kStore), request_(request) {}

 private:
  absl::Status Work() override;
  absl::StatusOr<Got> Next(v1::SolveEvent& event) override;
  bool HasMore() const override { return behind_gap_.has_value() || watch_->has_more(); }
  absl::StatusOr<Got> ToMessage(const jobs::Event& delivered, v1::SolveEvent& event) const;

  const v1::WatchSolveJobRequest& request_;  // owned by gRPC, valid until OnDone()
  WatchView view_;
  UserQuota::Ticket place_;
  std::unique_ptr<jobs::JobWatch> watch_;
  std::optional<jobs::Event> behind_gap_;
};

// The trajectory of a job.
class ReadTrajectoryCall final : public StreamCall<v1::TrajectoryPage> {
 public:
  ReadTrajectoryCall(CallEnvironment& environment, grpc::CallbackServerContext& context,
                     const v1::ReadTrajectoryRequest& request)
      : StreamCall(environment, context, CallKind::kStore), request_(request) {}

 private:
  absl::Status Work() override;
  absl::StatusOr<Got> Next(v1::TrajectoryPage& page) override;

  const v1::ReadTrajectoryRequest& request_;  // owned by gRPC, valid until OnDone()
  std::optional<TrajectoryReader> reader_;
  std::optional<v1::TrajectoryPage> page_;
  bool ended_ = false;
};

// The results of an ensemble; with `follow`, also those stored later.
class ReadEnsembleCall final : public StreamCall<v1::EnsemblePage> {
 public:
  ReadEnsembleCall(CallEnvironment& environment, grpc::CallbackServerContext& context,
                   const v1::ReadEnsembleRequest& request)
      : StreamCall(environment, context, CallKind::kStore), request_(request) {}

 private:
  absl::Status Open();
  absl::Status Work() override;
  absl::StatusOr<Got> Next(v1::EnsemblePage& page) override;
  // Nothing more is stored: waits for an event of the job.
  Got Wait(v1::EnsemblePage& page);

  const v1::ReadEnsembleRequest& request_;  // owned by gRPC, valid until OnDone()
  UserQuota::Ticket place_;
  std::unique_ptr<jobs::JobWatch> watch_;  // wakes the call while it waits for results; null without `follow`
  std::optional<EnsembleReader> reader_;
  std::optional<v1::EnsemblePage> page_;
  bool fetches_ = false;  // events are to be read from the store
  bool waits_ = false;
  bool ended_ = false;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_JOB_CALLS_H_
