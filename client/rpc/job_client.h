// SPDX-License-Identifier: Apache-2.0
// The client of jobs: calls that outlast cuts of the connection and restarts of the server.
//
//     auto client = dlcs::client::JobClient::Connect("localhost:50051");
//     auto job = (*client)->Submit(request, {});
//     (*client)->Watch(job->name(), {}, [](const dlcs::v1::JobEvent& event) { ... }, {});

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

// Every call is repeated where no answer comes, until its deadline (retry.h); repeating does nothing twice. Calls
// block. An object may be used from several threads at once. Errors: as Backend; and NotFound, AlreadyExists,
// FailedPrecondition as in dlcs/v1/jobs.proto.
class JobClient {
 public:
  // As Client::Connect(). `notice` may be empty.
  static absl::StatusOr<std::unique_ptr<JobClient>> Connect(const ConnectionOptions& options, Notice notice = {});

  JobClient(Connection connection, Notice notice)
      : stub_(v1::JobService::NewStub(connection.channel())), retry_(std::move(connection), std::move(notice)) {}

  // Where `request` has no request_id a random one is given to it, so that repeating is safe.
  absl::StatusOr<v1::SolveJob> Submit(v1::CreateSolveJobRequest request, const CallLimits& limits);
  absl::StatusOr<v1::SolveJob> Get(const std::string& name, const CallLimits& limits);
  // All pages. `states` may be empty.
  absl::StatusOr<std::vector<v1::SolveJob>> List(const std::vector<v1::JobState>& states, std::size_t most,
                                                 const CallLimits& limits);
  absl::StatusOr<v1::SolveJob> Cancel(const std::string& name, const CallLimits& limits);
  absl::Status Delete(const std::string& name, const CallLimits& limits);

  // Hands every event to `on_event` as it comes, the one with `finished` last; each once, whatever is cut in between.
  absl::Status Watch(const v1::WatchSolveJobRequest& request, const std::function<void(const v1::JobEvent&)>& on_event,
                     const CallLimits& limits);
  // Hands every page to `on_page`, whose CRC was checked; the last one says whether the job has ended.
  absl::Status ReadTrajectory(const v1::ReadTrajectoryRequest& request,
                              const std::function<void(const v1::TrajectoryPage&)>& on_page, const CallLimits& limits);

 private:
  std::unique_ptr<v1::JobService::Stub> stub_;
  Retry retry_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_JOB_CLIENT_H_
