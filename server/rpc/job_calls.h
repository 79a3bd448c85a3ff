// SPDX-License-Identifier: Apache-2.0
// Calls about jobs: reactors that leave what blocks on the store to worker threads.

#ifndef DLCS_SERVER_RPC_JOB_CALLS_H_
#define DLCS_SERVER_RPC_JOB_CALLS_H_

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "dlcs/v1/jobs.grpc.pb.h"
#include "grpcpp/support/server_callback.h"
#include "server/access/access.h"
#include "server/access/audit.h"
#include "server/access/credentials.h"
#include "server/access/user_quota.h"
#include "server/jobs/job_manager.h"
#include "server/rpc/call_registry.h"
#include "server/rpc/worker_pool.h"
#include "server/solve_jobs/job_trajectory.h"
#include "server/solve_jobs/watch_view.h"

namespace dlcs {

// What calls share. Outlives them.
struct JobCallEnvironment {
  CallRegistry& calls;
  WorkerPool& workers;
  jobs::JobManager& manager;
  const jobs::Clock& clock;
  UserQuota& watches;
  const Access& access;
};

// A call with one answer. Lives until both gRPC (OnDone) and the worker have let go.
class JobCall final : public grpc::ServerUnaryReactor, public std::enable_shared_from_this<JobCall> {
 public:
  // Fills the response, which is gRPC's until OnDone(), where it returns OK. Runs on a worker thread.
  using Work = std::function<absl::Status()>;
  static grpc::ServerUnaryReactor* Start(const JobCallEnvironment& environment, const char* name, Work work);

  JobCall(const char* name, Work work) : name_(name), work_(std::move(work)) {}

  void OnDone() override;

 private:
  const char* const name_;
  const Work work_;
  std::shared_ptr<JobCall> self_;          // gRPC's share
  std::shared_ptr<SolveControl> control_;  // null when the call was refused
};

// A call whose `run(caller)` gives a StatusOr of the response.
template <typename Response, typename Run>
grpc::ServerUnaryReactor* Answer(const JobCallEnvironment& environment, const grpc::CallbackServerContext& context,
                                 const char* name, Response& response, Run run) {
  return JobCall::Start(
      environment, name,
      [&response, run = std::move(run), caller = CallerOf(environment.access, context)]() -> absl::Status {
        if (!caller.ok()) return caller.status();
        absl::StatusOr<Response> result = run(*caller);
        if (!result.ok()) return result.status();
        response = *std::move(result);
        return absl::OkStatus();
      });
}

// `run(caller)`, with what came of it in the log: of calls that change something. `request` outlives the call.
template <typename Request, typename Run>
auto Audited(const char* method, const Request& request, Run run) {
  return [method, &request, run = std::move(run)](const Caller& caller) {
    auto result = run(caller);
    std::string object;
    if constexpr (requires { request.name(); }) {
      object = request.name();
    } else if (result.ok()) {
      if constexpr (requires { result->name(); }) {
        object = result->name();
      } else {
        object = result->job();
      }
    }
    Audit({.user = caller.user, .method = method, .object = object, .outcome = result.status().code(), .peer = caller.peer});
    return result;
  };
}

// A call with many answers, of which one is in flight. Ends with UNAVAILABLE when the server drains, so that the client
// goes on elsewhere. Lives until gRPC, the worker and whoever wakes it have let go.
template <typename Message>
class JobStream : public grpc::ServerWriteReactor<Message>, public std::enable_shared_from_this<JobStream<Message>> {
 public:
  void OnSendInitialMetadataDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 protected:
  enum class Got {
    kMessage,
    kNothing,  // for now: Pump() is called later
    kBlocks,   // Prepare() is to be called on a worker thread first
    kEnd,
  };

  // Never blocks. Called by one thread at a time. An error ends the call.
  virtual absl::StatusOr<Got> Next(Message& message) = 0;
  // May block. Called on a worker thread, once before the first Next() and after each kBlocks. An error ends the call.
  virtual absl::Status Prepare() = 0;

  explicit JobStream(const JobCallEnvironment& environment) : environment_(environment) {}
  static grpc::ServerWriteReactor<Message>* Begin(std::shared_ptr<JobStream> call);
  // Writes what there is, unless something is in flight. Safe from any thread.
  void Pump();

  const JobCallEnvironment& environment_;

 private:
  void PrepareOnWorker();
  void HangUp(const absl::Status& why);

  std::shared_ptr<JobStream> self_;        // gRPC's share
  std::shared_ptr<SolveControl> control_;  // null when the call was refused
  std::optional<std::stop_callback<std::function<void()>>> on_stop_;

  std::mutex mutex_;
  bool busy_ = true;  // writing or preparing
  bool finished_ = false;
  std::optional<absl::Status> hung_up_;
  Message message_;
};

// The events of a job.
class JobWatchCall final : public JobStream<v1::JobEvent> {
 public:
  static grpc::ServerWriteReactor<v1::JobEvent>* Start(const JobCallEnvironment& environment,
                                                       const absl::StatusOr<Caller>& caller,
                                                       const v1::WatchSolveJobRequest& request);
  JobWatchCall(const JobCallEnvironment& environment, const absl::StatusOr<Caller>& caller,
               const v1::WatchSolveJobRequest& request)
      : JobStream(environment), caller_(caller), request_(request) {}

 private:
  absl::StatusOr<Got> Next(v1::JobEvent& event) override;
  absl::Status Prepare() override;
  absl::StatusOr<Got> Told(const jobs::Event& delivered, v1::JobEvent& event) const;

  const absl::StatusOr<Caller> caller_;
  const v1::WatchSolveJobRequest request_;
  WatchView view_;
  UserQuota::Ticket place_;
  std::unique_ptr<jobs::JobWatch> watch_;
  std::optional<jobs::Event> behind_gap_;
};

// The trajectory of a job.
class ReadTrajectoryCall final : public JobStream<v1::TrajectoryPage> {
 public:
  static grpc::ServerWriteReactor<v1::TrajectoryPage>* Start(const JobCallEnvironment& environment,
                                                             const absl::StatusOr<Caller>& caller,
                                                             const v1::ReadTrajectoryRequest& request);
  ReadTrajectoryCall(const JobCallEnvironment& environment, const absl::StatusOr<Caller>& caller,
                     const v1::ReadTrajectoryRequest& request)
      : JobStream(environment), caller_(caller), request_(request) {}

 private:
  absl::StatusOr<Got> Next(v1::TrajectoryPage& page) override;
  absl::Status Prepare() override;

  const absl::StatusOr<Caller> caller_;
  const v1::ReadTrajectoryRequest request_;
  std::optional<TrajectoryReader> reader_;
  std::optional<v1::TrajectoryPage> page_;
  bool ended_ = false;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_JOB_CALLS_H_
