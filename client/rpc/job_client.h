// SPDX-License-Identifier: Apache-2.0
// The client of jobs, whose calls survive lost connections and server restarts.
//
//     auto client = dlcs::client::JobClient::Connect("localhost:50051");
//     auto job = (*client)->Submit(request, {});
//     (*client)->Watch(job->name(), {}, [](const dlcs::v1::SolveEvent& event) { ... }, {});

#ifndef DLCS_CLIENT_RPC_JOB_CLIENT_H_
#define DLCS_CLIENT_RPC_JOB_CLIENT_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/result/backend.h"
#include "client/rpc/retry.h"
#include "dlcs/v1/jobs.grpc.pb.h"

namespace dlcs::client {

// A call that gets no answer is repeated until its deadline (retry.h); all calls are idempotent. Calls block. An object
// may be used from several threads at once. Errors: as Backend; and NotFound, AlreadyExists, FailedPrecondition as in
// dlcs/v1/jobs.proto.
class JobClient {
 public:
  JobClient(Connection connection, Notice notice)
      : stub_(v1::JobService::NewStub(connection.channel())), retry_(std::move(connection), std::move(notice)) {}

  // A `request` without request_id gets a random one, so that repeating it is safe. The same for an ensemble.
  absl::StatusOr<v1::SolveJob> Submit(v1::CreateSolveJobRequest request, const CallLimits& limits);
  absl::StatusOr<v1::SolveJob> SubmitEnsemble(v1::CreateEnsembleJobRequest request, const CallLimits& limits);
  absl::StatusOr<v1::SolveJob> Get(const std::string& name, const CallLimits& limits);
  // All pages. `states` may be empty.
  absl::StatusOr<std::vector<v1::SolveJob>> List(const std::vector<v1::JobState>& states, std::size_t most,
                                                 const CallLimits& limits);
  absl::StatusOr<v1::SolveJob> Cancel(const std::string& name, const CallLimits& limits);
  absl::Status Delete(const std::string& name, const CallLimits& limits);

  // Passes every event to `on_event` as it arrives, exactly once in spite of lost connections; the last one has
  // `summary`.
  absl::Status Watch(const v1::WatchSolveJobRequest& request,
                     const std::function<void(const v1::SolveEvent&)>& on_event, const CallLimits& limits);
  // Passes every page to `on_page` after checking its CRC; the last one says whether the job has ended.
  absl::Status ReadTrajectory(const v1::ReadTrajectoryRequest& request,
                              const std::function<void(const v1::TrajectoryPage&)>& on_page, const CallLimits& limits);

  // Passes every shard to `on_shard`, exactly once in spite of lost connections, in the order in which they were
  // stored; with request.follow() until the ensemble has ended.
  absl::Status ReadEnsemble(const v1::ReadEnsembleRequest& request,
                            const std::function<void(const v1::EnsembleShard&)>& on_shard, const CallLimits& limits);

 private:
  std::unique_ptr<v1::JobService::Stub> stub_;
  Retry retry_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_JOB_CLIENT_H_
