// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/job_service.h"

#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "fmt/format.h"
#include "proto/shared/title_limit.h"
#include "proto/wire/content_hash.h"
#include "proto/wire/matrix_shape.h"
#include "server/rpc/call_deadline.h"
#include "server/rpc/job_calls.h"
#include "server/rpc/job_solve_call.h"
#include "server/rpc/unary_call.h"
#include "server/solve_jobs/convert_job.h"
#include "server/solve_jobs/ensemble_jobs.h"
#include "server/solve_jobs/job_limits.h"
#include "server/solve_jobs/job_refusal.h"
#include "server/solve_jobs/page_size.h"
#include "server/solve_jobs/resource_names.h"
#include "server/telemetry/call_trace.h"
#include "server/telemetry/job_trace.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

constexpr std::size_t kMaxRequestIdBytes = 128;

// For both kinds of requests to create a job.
template <typename CreateRequest>
absl::Status Check(const CreateRequest& request) {
  std::vector<Violation> violations;
  if (request.request_id().size() > kMaxRequestIdBytes) {
    violations.push_back(
        {"request_id", fmt::format("has {} bytes; at most {}", request.request_id().size(), kMaxRequestIdBytes)});
  }
  if (request.title().size() > kMaxTitleBytes) {
    violations.push_back({"title", fmt::format("has {} bytes; at most {}", request.title().size(), kMaxTitleBytes)});
  }
  if (std::abs(std::int64_t{request.priority()}) > kMaxPriority) {
    violations.push_back(
        {"priority", fmt::format("{}: must be between -{} and {}", request.priority(), kMaxPriority, kMaxPriority)});
  }
  return violations.empty() ? absl::OkStatus() : InvalidRequest(violations);
}

// The description of a job that is available without its body: fields of SolveJob. `uploaded` is the problem that the
// request names, if any.
std::string About(const v1::CreateSolveJobRequest& create, const std::optional<v1::StoredProblem>& uploaded) {
  const v1::SolveRequest& request = create.solve();
  v1::SolveJob about;
  about.set_title(create.title());
  if (uploaded) {
    if (about.title().empty()) about.set_title(uploaded->title());
    about.set_states(uploaded->states());
    about.set_constraints(uploaded->constraints());
    about.set_horizon(uploaded->horizon());
    about.set_nonlinear(uploaded->nonlinear());
  } else if (request.has_nonlinear()) {
    about.set_states(request.nonlinear().x0_size());
    about.set_constraints(request.nonlinear().g_size());
    about.set_horizon(request.nonlinear().horizon());
    about.set_nonlinear(true);
  } else {
    about.set_states(request.problem().x0_size());
    about.set_constraints(ShapeOf(request.problem().m()).rows);
    about.set_horizon(request.problem().horizon());
  }
  if (request.overrides().has_horizon()) about.set_horizon(request.overrides().horizon());
  *about.mutable_options() = request.options();
  about.mutable_options()->clear_grid_times();
  about.mutable_options()->clear_output_times();
  return about.SerializeAsString();
}

// Renames violations of a `Request` to their paths in a request to create a job, which has it as its field `field`.
template <typename Request>
absl::Status InCreateRequest(const absl::Status& status, const char* field) {
  std::vector<Violation> violations = ViolationsOf(status);
  if (violations.empty()) return status;
  for (Violation& violation : violations) {
    const std::string name = violation.field.substr(0, violation.field.find_first_of(".["));
    if (Request::descriptor()->FindFieldByName(name) == nullptr || name == "request_id" || name == "title") continue;
    violation.field = fmt::format("{}.{}", field, violation.field);
  }
  return InvalidRequest(violations);
}

}  // namespace

absl::StatusOr<v1::SolveJob> JobService::Create(const Caller& caller, v1::CreateSolveJobRequest request,
                                                const std::string& trace_id) {
  if (request.title().empty()) request.set_title(request.solve().title());
  if (absl::Status status = Check(request); !status.ok()) return status;
  // A repeated request returns its job even if the queue is full.
  if (request.request_id().empty() && !request.validate_only()) {
    if (absl::Status full = jobs_.manager().CheckQueueSpace(caller.user); !full.ok()) return WithDetails(full);
  }
  jobs::Submission submission;
  submission.owner = caller.user;
  v1::SolveRequest& solve = *request.mutable_solve();
  solve.clear_request_id();
  solve.clear_title();
  std::optional<v1::StoredProblem> uploaded;
  if (solve.has_problem_name()) {
    const absl::StatusOr<jobs::ProblemId> problem = ProblemIdOf(solve.problem_name(), "problem_name");
    if (!problem.ok()) return problem.status();
    submission.problem = *problem;
    v1::GetProblemRequest named;
    named.set_name(solve.problem_name());
    absl::StatusOr<v1::StoredProblem> found = jobs_.library().Get(caller.user, named);
    if (found.ok()) uploaded = *std::move(found);  // a missing problem is reported by the store, with the job
  }
  submission.about = About(request, uploaded);
  submission.body = solve.SerializeAsString();
  // Deadline and priority are not part of the identity of a request: a client that repeats it may compute a new
  // deadline.
  submission.body_hash = ContentHash(submission.body);
  return Submit(request, std::move(submission), trace_id);
}

template <typename CreateRequest>
absl::StatusOr<v1::SolveJob> JobService::Submit(const CreateRequest& request, jobs::Submission submission,
                                                const std::string& trace_id) {
  submission.request_id = request.request_id();
  submission.priority = request.priority();
  if (request.has_deadline()) submission.deadline = FromProto(request.deadline());
  if (request.validate_only()) {
    const absl::StatusOr<jobs::Demand> demand = jobs_.manager().Check(submission);
    if (!demand.ok()) return WithDetails(demand.status());
    const double shards = submission.shards.empty() ? 1.0 : static_cast<double>(submission.shards.size());
    v1::SolveJob job;
    job.set_predicted_core_seconds(demand->core_seconds * shards);
    job.set_predicted_memory_bytes(demand->memory_bytes);
    return job;
  }
  submission.body =
      WithTraceId(std::move(submission.body),
                  trace_id);  // not part of the identity, since a repeated request may belong to another trace
  const absl::StatusOr<jobs::JobStore::Created> created = jobs_.manager().Submit(submission);
  if (!created.ok()) return WithDetails(created.status());
  return Show(created->job);
}

absl::StatusOr<v1::SolveJob> JobService::CreateEnsemble(const Caller& caller, v1::CreateEnsembleJobRequest request,
                                                        const std::string& trace_id) {
  if (absl::Status status = Check(request); !status.ok()) return status;
  // Before every member is checked, which may take seconds.
  if (request.request_id().empty() && !request.validate_only()) {
    if (absl::Status full = jobs_.manager().CheckQueueSpace(caller.user); !full.ok()) return WithDetails(full);
  }
  jobs::Submission submission;
  submission.owner = caller.user;
  if (NamesProblem(request.ensemble())) {
    const absl::StatusOr<jobs::ProblemId> problem = ProblemIdOf(request.ensemble().problem_name(), "problem_name");
    if (!problem.ok()) return problem.status();
    submission.problem = *problem;
  }
  v1::CreateEnsembleJobRequest work;  // the part of the request that identifies it
  work.mutable_ensemble()->Swap(request.mutable_ensemble());
  *work.mutable_results() = request.results();
  work.set_shard_members(request.shard_members());
  submission.body_hash = ContentHash(work.SerializeAsString());
  absl::StatusOr<SplitEnsemble> split = Split(std::move(work), environment_.limits, jobs_.library().Of(caller.user));
  if (!split.ok()) return split.status();
  split->about.set_title(request.title());
  split->about.mutable_options()->clear_grid_times();
  split->about.mutable_options()->clear_output_times();
  submission.about = split->about.SerializeAsString();
  submission.body = std::move(split->body);
  submission.shards = std::move(split->shards);
  submission.demand = split->demand;
  return Submit(request, std::move(submission), trace_id);
}

v1::SolveJob JobService::Show(const jobs::Job& job) const {
  v1::SolveJob shown = ToProto(job);
  const int ranks = shown.options().ranks();
  if (job.state == jobs::JobState::kQueued && ranks > 0 && !jobs_.manager().CanRun(job.about)) {
    shown.set_waiting_for(
        fmt::format("a server that starts {0} ranks of MPI: --mpi-launcher, and --max-ranks {0} or more", ranks));
  }
  return shown;
}

absl::StatusOr<v1::SolveJob> JobService::Get(const Caller& caller, const v1::GetSolveJobRequest& request) {
  const absl::StatusOr<jobs::JobId> id = JobIdOf(request.name());
  if (!id.ok()) return id.status();
  const absl::StatusOr<jobs::Job> job = jobs_.manager().store().Get(caller.SeesJobsOf(), *id);
  if (!job.ok()) return job.status();
  v1::SolveJob result = Show(*job);
  if (!jobs::IsFinal(job->state)) return result;
  const auto last = jobs_.manager().store().ReadEvents(*id, job->last_event - 1, 1);
  if (!last.ok()) return last.status();
  if (!last->empty() && !last->front().payload->empty())
    result.mutable_summary()->ParseFromString(*last->front().payload);
  return result;
}

absl::StatusOr<v1::ListSolveJobsResponse> JobService::List(const Caller& caller,
                                                           const v1::ListSolveJobsRequest& request) {
  jobs::JobFilter filter{.owner = caller.SeesJobsOf(), .states = {}};
  for (const int state : request.states()) {
    const auto known = FromProto(static_cast<v1::JobState>(state));
    if (!known) return InvalidRequest({{"states", fmt::format("{} is not a state", state)}});
    filter.states.push_back(*known);
  }
  const absl::StatusOr<int> size = PageSize(request.page_size());
  if (!size.ok()) return size.status();
  const absl::StatusOr<jobs::JobPage> page = jobs_.manager().store().List(filter, *size, request.page_token());
  if (!page.ok()) return page.status();
  v1::ListSolveJobsResponse response;
  for (const jobs::Job& job : page->jobs) {
    v1::SolveJob& listed = *response.add_jobs() = Show(job);
    if (listed.has_ensemble()) listed.mutable_ensemble()->clear_columns();
    if (job.shards == 0 && !job.tally.empty()) listed.mutable_summary()->ParseFromString(job.tally);
  }
  response.set_next_page_token(page->next_page_token);
  return response;
}

absl::StatusOr<v1::SolveJob> JobService::Cancel(const Caller& caller, const v1::CancelSolveJobRequest& request) {
  const absl::StatusOr<jobs::JobId> id = JobIdOf(request.name());
  if (!id.ok()) return id.status();
  const absl::StatusOr<jobs::Job> job = jobs_.manager().Cancel(caller.SeesJobsOf(), *id);
  if (!job.ok()) return job.status();
  return Show(*job);
}

absl::StatusOr<v1::DeleteSolveJobResponse> JobService::Delete(const Caller& caller,
                                                              const v1::DeleteSolveJobRequest& request) {
  const absl::StatusOr<jobs::JobId> id = JobIdOf(request.name());
  if (!id.ok()) return id.status();
  const absl::Status deleted = jobs_.manager().Delete(caller.SeesJobsOf(), *id);
  if (!deleted.ok()) return deleted;
  return v1::DeleteSolveJobResponse();
}

grpc::ServerUnaryReactor* JobService::CreateSolveJob(grpc::CallbackServerContext* context,
                                                     const v1::CreateSolveJobRequest* request, v1::SolveJob* response) {
  return CallStore(
      environment_, *context, "create job", *response,
      Audited("CreateSolveJob", *request,
              [=, this, trace_id = TraceIdOf(*context)](const Caller& caller) -> absl::StatusOr<v1::SolveJob> {
                absl::StatusOr<v1::SolveJob> job = Create(caller, *request, trace_id);
                return job.ok() ? job : InCreateRequest<v1::SolveRequest>(job.status(), "solve");
              }));
}

grpc::ServerUnaryReactor* JobService::GetSolveJob(grpc::CallbackServerContext* context,
                                                  const v1::GetSolveJobRequest* request, v1::SolveJob* response) {
  return CallStore(environment_, *context, "get job", *response,
                   [=, this](const Caller& caller) { return Get(caller, *request); });
}

grpc::ServerUnaryReactor* JobService::ListSolveJobs(grpc::CallbackServerContext* context,
                                                    const v1::ListSolveJobsRequest* request,
                                                    v1::ListSolveJobsResponse* response) {
  return CallStore(environment_, *context, "list jobs", *response,
                   [=, this](const Caller& caller) { return List(caller, *request); });
}

grpc::ServerUnaryReactor* JobService::CancelSolveJob(grpc::CallbackServerContext* context,
                                                     const v1::CancelSolveJobRequest* request, v1::SolveJob* response) {
  return CallStore(
      environment_, *context, "cancel job", *response,
      Audited("CancelSolveJob", *request, [=, this](const Caller& caller) { return Cancel(caller, *request); }));
}

grpc::ServerUnaryReactor* JobService::DeleteSolveJob(grpc::CallbackServerContext* context,
                                                     const v1::DeleteSolveJobRequest* request,
                                                     v1::DeleteSolveJobResponse* response) {
  return CallStore(
      environment_, *context, "delete job", *response,
      Audited("DeleteSolveJob", *request, [=, this](const Caller& caller) { return Delete(caller, *request); }));
}

grpc::ServerWriteReactor<v1::SolveEvent>* JobService::WatchSolveJob(grpc::CallbackServerContext* context,
                                                                    const v1::WatchSolveJobRequest* request) {
  return JobWatchCall::Start(std::make_shared<JobWatchCall>(environment_, *context, *request));
}

grpc::ServerWriteReactor<v1::TrajectoryPage>* JobService::ReadTrajectory(grpc::CallbackServerContext* context,
                                                                         const v1::ReadTrajectoryRequest* request) {
  return ReadTrajectoryCall::Start(std::make_shared<ReadTrajectoryCall>(environment_, *context, *request));
}

grpc::ServerUnaryReactor* JobService::CreateEnsembleJob(grpc::CallbackServerContext* context,
                                                        const v1::CreateEnsembleJobRequest* request,
                                                        v1::SolveJob* response) {
  return CallStore(
      environment_, *context, "create ensemble", *response,
      Audited("CreateEnsembleJob", *request, [=, this, trace_id = TraceIdOf(*context)](const Caller& caller) {
        absl::StatusOr<v1::SolveJob> job = CreateEnsemble(caller, *request, trace_id);
        if (job.ok()) return job;
        return absl::StatusOr<v1::SolveJob>(InCreateRequest<v1::SolveEnsembleRequest>(job.status(), "ensemble"));
      }));
}

grpc::ServerWriteReactor<v1::EnsemblePage>* JobService::ReadEnsemble(grpc::CallbackServerContext* context,
                                                                     const v1::ReadEnsembleRequest* request) {
  return ReadEnsembleCall::Start(std::make_shared<ReadEnsembleCall>(environment_, *context, *request));
}

absl::StatusOr<v1::Accepted> JobService::CreateForSolve(const Caller& caller, const v1::SolveRequest& request,
                                                        std::chrono::system_clock::time_point deadline,
                                                        const std::string& trace_id) {
  v1::CreateSolveJobRequest create;
  *create.mutable_solve() = request;
  create.set_request_id(request.request_id());
  if (const auto stop_time = StopTime(deadline, 0)) {
    *create.mutable_deadline() = ToProto(std::chrono::time_point_cast<jobs::Duration>(*stop_time));
  }
  const absl::StatusOr<v1::SolveJob> job = Create(caller, std::move(create), trace_id);
  if (!job.ok()) return job.status();
  v1::Accepted accepted;
  accepted.set_solve_id(job->name());
  accepted.set_job(job->name());
  if (request.has_problem_name()) {
    v1::GetProblemRequest named;
    named.set_name(request.problem_name());
    const absl::StatusOr<v1::StoredProblem> problem = jobs_.library().Get(caller.user, named);
    if (!problem.ok()) return problem.status();
    accepted.set_states(problem->states());
    accepted.set_constraints(problem->constraints());
  } else if (request.has_nonlinear()) {
    accepted.set_states(request.nonlinear().x0_size());
    accepted.set_constraints(request.nonlinear().g_size());
  } else {
    accepted.set_states(request.problem().x0_size());
    accepted.set_constraints(static_cast<int>(ShapeOf(request.problem().m()).rows));
  }
  return accepted;
}

grpc::ServerWriteReactor<v1::SolveEvent>* JobService::Solve(grpc::CallbackServerContext& context,
                                                            const v1::SolveRequest& request) {
  auto create = Audited("Solve", request,
                        [=, this, &request, deadline = context.deadline(), trace_id = TraceIdOf(context)](
                            const Caller& caller) { return CreateForSolve(caller, request, deadline, trace_id); });
  return JobSolveCall::Start(std::make_shared<JobSolveCall>(environment_, context, std::move(create)));
}

}  // namespace dlcs
