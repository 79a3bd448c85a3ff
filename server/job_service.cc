// SPDX-License-Identifier: Apache-2.0
#include "server/job_service.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "fmt/format.h"
#include "server/content_hash.h"
#include "server/convert_job.h"
#include "server/errors.h"
#include "server/jobs/open_job_store.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

// What waits is short: a read or a commit. The longest is a page of a trajectory.
constexpr int kWorkers = 4;
constexpr std::size_t kMaxRequestIdBytes = 128;
constexpr int kMaxPriority = 100;
constexpr int kDefaultPageSize = 100;
constexpr int kMaxPageSize = 1000;
// Until callers have names, all share.
constexpr const char* kOwner = "";
constexpr std::nullopt_t kEverybody = std::nullopt;

std::string WorkerName(const ServerConfig& config) {
  if (!config.worker_name.empty()) return config.worker_name;
  char host[256] = {};
  gethostname(host, sizeof host - 1);
  const std::string port = config.listen.substr(config.listen.rfind(':') + 1);
  // A free port is another one next time: then the jobs of this life are taken up when their leases run out.
  return fmt::format("{}:{}", host, port == "0" ? fmt::format("pid-{}", getpid()) : port);
}

jobs::JobManagerOptions ManagerOptions(const ServerConfig& config) {
  jobs::JobManagerOptions options;
  options.runs_jobs = config.role != "front";
  if (jobs::IsShared(config.store)) options.worker = WorkerName(config);
  spdlog::info("jobs in {}, role {}, named {}", jobs::DescribeStore(config.store), config.role, options.worker);
  options.lease = std::chrono::milliseconds(config.lease_ms);
  jobs::SchedulerLimits& limits = options.limits;
  limits.cores = config.threads;
  limits.max_threads_per_job = config.threads;
  limits.max_running_memory_bytes = config.max_memory_bytes + config.max_held_result_bytes;
  limits.max_job_memory_bytes = limits.max_running_memory_bytes;
  limits.cores_kept_for_small = std::min(1, config.threads - 1);
  return options;
}

// A refusal of the scheduler with the details that the wire has for it.
absl::Status WithDetails(const absl::Status& status) {
  const std::optional<jobs::Refusal> refusal = jobs::RefusalOf(status);
  if (!refusal) return status;
  const auto value = static_cast<std::int64_t>(refusal->value);
  if (!refusal->retry_after) return LimitExceeded(refusal->limit, value, static_cast<std::int64_t>(refusal->asked));
  return ServerBusy(refusal->limit, value,
                    std::chrono::duration_cast<std::chrono::milliseconds>(*refusal->retry_after));
}

absl::Status Check(const v1::CreateSolveJobRequest& request) {
  std::vector<Violation> violations;
  if (request.request_id().size() > kMaxRequestIdBytes) {
    violations.push_back(
        {"request_id", fmt::format("has {} bytes; at most {}", request.request_id().size(), kMaxRequestIdBytes)});
  }
  if (std::abs(static_cast<std::int64_t>(request.priority())) > kMaxPriority) {
    violations.push_back(
        {"priority", fmt::format("{}: must be between -{} and {}", request.priority(), kMaxPriority, kMaxPriority)});
  }
  return violations.empty() ? absl::OkStatus() : InvalidRequest(violations);
}

}  // namespace

JobService::JobService(const ServerConfig& config)
    : setups_(static_cast<double>(config.setup_cache_bytes)),
      store_(jobs::OpenJobStore(config.store)),
      solver_(LimitsOf(config), config.setup_cache_bytes > 0 ? &setups_ : nullptr, *store_,
              std::chrono::milliseconds(config.checkpoint_ms)),
      manager_(
          ManagerOptions(config), *store_, [this](const std::string& body) { return solver_.Predict(body); },
          [this](jobs::JobRun& run) { return solver_.Solve(run); }, jobs::SystemClock()),
      workers_(kWorkers),
      environment_{calls_, workers_, manager_, jobs::SystemClock()} {}

absl::StatusOr<v1::SolveJob> JobService::Create(const v1::CreateSolveJobRequest& request) {
  if (absl::Status status = Check(request); !status.ok()) return status;
  jobs::Submission submission;
  submission.owner = kOwner;
  submission.request_id = request.request_id();
  submission.priority = request.priority();
  submission.body = request.solve().SerializeAsString();
  if (request.has_deadline()) submission.deadline = FromProto(request.deadline());
  if (request.validate_only()) {
    const absl::StatusOr<jobs::Demand> demand = solver_.Predict(submission.body);
    if (!demand.ok()) return demand.status();
    v1::SolveJob job;
    job.set_predicted_core_seconds(demand->core_seconds);
    job.set_predicted_memory_bytes(demand->memory_bytes);
    return job;
  }
  // The deadline and the priority are those of the first request: a client that repeats it may count from now.
  submission.body_hash = ContentHash(submission.body);
  const absl::StatusOr<jobs::JobStore::Created> created = manager_.Submit(submission);
  if (!created.ok()) return WithDetails(created.status());
  return ToProto(created->job);
}

absl::StatusOr<v1::SolveJob> JobService::Get(const v1::GetSolveJobRequest& request) {
  const absl::StatusOr<jobs::JobId> id = JobIdOf(request.name());
  if (!id.ok()) return id.status();
  const absl::StatusOr<jobs::Job> job = store_->Get(kEverybody, *id);
  if (!job.ok()) return job.status();
  v1::SolveJob result = ToProto(*job);
  if (!jobs::IsFinal(job->state)) return result;
  const auto last = store_->ReadEvents(*id, job->last_event - 1, 1);
  if (!last.ok()) return last.status();
  if (!last->empty() && !last->front().payload->empty())
    result.mutable_summary()->ParseFromString(*last->front().payload);
  return result;
}

absl::StatusOr<v1::ListSolveJobsResponse> JobService::List(const v1::ListSolveJobsRequest& request) {
  jobs::JobFilter filter{.owner = kEverybody, .states = {}};
  for (const int state : request.states()) {
    const auto known = FromProto(static_cast<v1::JobState>(state));
    if (!known) return InvalidRequest({{"states", fmt::format("{} is no state", state)}});
    filter.states.push_back(*known);
  }
  if (request.page_size() < 0) return InvalidRequest({{"page_size", "must not be negative"}});
  const int size = request.page_size() == 0 ? kDefaultPageSize : std::min(request.page_size(), kMaxPageSize);
  const absl::StatusOr<jobs::JobPage> page = store_->List(filter, size, request.page_token());
  if (!page.ok()) return page.status();
  v1::ListSolveJobsResponse response;
  for (const jobs::Job& job : page->jobs) *response.add_jobs() = ToProto(job);
  response.set_next_page_token(page->next_page_token);
  return response;
}

namespace {

// A call whose `run()` gives a StatusOr of the response.
template <typename Response, typename Run>
grpc::ServerUnaryReactor* Answer(const JobCallEnvironment& environment, const char* name, Response& response, Run run) {
  return JobCall::Start(environment, name, [&response, run = std::move(run)]() -> absl::Status {
    absl::StatusOr<Response> result = run();
    if (!result.ok()) return result.status();
    response = *std::move(result);
    return absl::OkStatus();
  });
}

}  // namespace

grpc::ServerUnaryReactor* JobService::CreateSolveJob(grpc::CallbackServerContext*,
                                                     const v1::CreateSolveJobRequest* request, v1::SolveJob* response) {
  return Answer(environment_, "create job", *response, [=, this] { return Create(*request); });
}

grpc::ServerUnaryReactor* JobService::GetSolveJob(grpc::CallbackServerContext*, const v1::GetSolveJobRequest* request,
                                                  v1::SolveJob* response) {
  return Answer(environment_, "get job", *response, [=, this] { return Get(*request); });
}

grpc::ServerUnaryReactor* JobService::ListSolveJobs(grpc::CallbackServerContext*,
                                                    const v1::ListSolveJobsRequest* request,
                                                    v1::ListSolveJobsResponse* response) {
  return Answer(environment_, "list jobs", *response, [=, this] { return List(*request); });
}

grpc::ServerUnaryReactor* JobService::CancelSolveJob(grpc::CallbackServerContext*,
                                                     const v1::CancelSolveJobRequest* request, v1::SolveJob* response) {
  return Answer(environment_, "cancel job", *response, [=, this]() -> absl::StatusOr<v1::SolveJob> {
    const absl::StatusOr<jobs::JobId> id = JobIdOf(request->name());
    if (!id.ok()) return id.status();
    const absl::StatusOr<jobs::Job> job = manager_.Cancel(kEverybody, *id);
    if (!job.ok()) return job.status();
    return ToProto(*job);
  });
}

grpc::ServerUnaryReactor* JobService::DeleteSolveJob(grpc::CallbackServerContext*,
                                                     const v1::DeleteSolveJobRequest* request,
                                                     v1::DeleteSolveJobResponse*) {
  return JobCall::Start(environment_, "delete job", [=, this]() -> absl::Status {
    const absl::StatusOr<jobs::JobId> id = JobIdOf(request->name());
    if (!id.ok()) return id.status();
    return manager_.Delete(kEverybody, *id);
  });
}

grpc::ServerWriteReactor<v1::JobEvent>* JobService::WatchSolveJob(grpc::CallbackServerContext*,
                                                                  const v1::WatchSolveJobRequest* request) {
  return JobWatchCall::Start(environment_, *request);
}

grpc::ServerWriteReactor<v1::TrajectoryPage>* JobService::ReadTrajectory(grpc::CallbackServerContext*,
                                                                         const v1::ReadTrajectoryRequest* request) {
  return ReadTrajectoryCall::Start(environment_, *request);
}

void JobService::Drain() {
  calls_.Drain();
  calls_.StopAll(StopCause::kShutdown);
}

void JobService::Stop(std::chrono::milliseconds grace) { manager_.Drain(grace); }

}  // namespace dlcs
