// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/client.h"

#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>

#include "client/result/ensemble_result.h"
#include "client/rpc/resumable_solve.h"

namespace dlcs::client {
namespace {

// Time limit for cleaning up after a result, so that the caller does not wait long.
CallLimits CleanupLimits() { return {.deadline = std::chrono::seconds(5), .stop = {}}; }

// `limits` without the stop token, for a call that a StopOnRequest stops.
CallLimits WithoutStop(CallLimits limits) {
  limits.stop = {};
  return limits;
}

// Ends `stream` when a stop is requested: by StopSolve, which delivers the part solved so far, if the call is a solve
// on the server; otherwise by cancelling the call.
class StopOnRequest {
 public:
  StopOnRequest(v1::SolverService::Stub& stub, const Connection& connection, Call& stream, const std::stop_token& stop)
      : stub_(stub), connection_(connection), stream_(stream), on_stop_(stop, [this] { Stop(); }) {}

  // The id of the call for StopSolve.
  void Accepted(const std::string& solve_id) {
    const std::lock_guard lock(mutex_);
    solve_id_ = solve_id;
  }

 private:
  void Stop() {
    v1::StopSolveRequest request;
    {
      const std::lock_guard lock(mutex_);
      request.set_solve_id(solve_id_);
    }
    Call call(connection_, CleanupLimits());
    v1::StopSolveResponse response;
    const bool asked = !request.solve_id().empty() && stub_.StopSolve(call.context(), request, &response).ok();
    if (!asked) stream_.context()->TryCancel();
  }

  v1::SolverService::Stub& stub_;
  const Connection& connection_;
  Call& stream_;
  std::mutex mutex_;
  std::string solve_id_;
  std::stop_callback<std::function<void()>> on_stop_;  // last: it may call Stop() at once
};

}  // namespace

absl::StatusOr<std::unique_ptr<Client>> Client::Connect(const ConnectionOptions& options, Notice notice) {
  absl::StatusOr<Connection> connection = Connection::Open(options);
  if (!connection.ok()) return connection.status();
  return std::unique_ptr<Client>(new Client(*std::move(connection), std::move(notice)));
}

Client::Client(Connection connection, Notice notice)
    : connection_(std::move(connection)),
      stub_(v1::SolverService::NewStub(connection_.channel())),
      notice_(std::move(notice)),
      jobs_(connection_, notice_),
      problems_(connection_, notice_) {}

absl::StatusOr<SolveResult> Client::Solve(const v1::SolveRequest& request, const EventCallback& on_event,
                                          const CallLimits& limits) {
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [start] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start); };
  ResultCollector collector(request, limits.keep_trajectory);
  ResumableSolve solve(collector, on_event);
  absl::Status status;
  {
    Call call(connection_, WithoutStop(limits));
    StopOnRequest stopping(*stub_, connection_, call, limits.stop);
    const auto reader = stub_->Solve(call.context(), request);
    for (v1::SolveEvent event; reader->Read(&event);) {
      connection_.NoteAnswer();
      // A job that nobody watches is ended by CancelSolveJob, below.
      if (event.has_accepted() && event.accepted().job().empty()) stopping.Accepted(event.accepted().solve_id());
      solve.Take(event);
    }
    const grpc::Status ended = reader->Finish();
    status = ended.ok() ? absl::OkStatus() : connection_.Describe(ended);
    const bool continues =
        !solve.job().empty() && !collector.has_summary() && IsTransient(ended) && !limits.stop.stop_requested();
    if (continues) {
      if (notice_) notice_(fmt::format("{}; resuming {}", ended.error_message(), solve.job()));
      CallLimits left = limits;
      left.deadline = limits.deadline - seconds();
      status = solve.Resume(jobs_, left);
    }
  }
  const bool stopped = limits.stop.stop_requested() && !solve.job().empty() && !collector.has_summary();
  if (stopped && jobs_.Cancel(solve.job(), CleanupLimits()).ok()) {
    // The part solved until it stopped, some milliseconds later.
    CallLimits left = limits;
    left.deadline = limits.deadline - seconds();
    left.stop = {};
    const absl::Status read = solve.Resume(jobs_, left);
    if (!read.ok()) status = absl::CancelledError(read.message());
  }
  // A summary is final, even if the deadline passes before the status arrives.
  if (status.ok() || collector.has_summary()) {
    absl::StatusOr<SolveResult> result = std::move(collector).Finish();
    if (!result.ok() || solve.job().empty()) return result;
    if (stopped) {
      result->job = solve.job();
    } else {
      jobs_.Delete(solve.job(), CleanupLimits()).IgnoreError();
    }
    return result;
  }
  if (absl::IsCancelled(status) && limits.stop.stop_requested()) {
    return std::move(collector).FinishIncomplete(v1::TERMINATION_CANCELLED, seconds().count());
  }
  if (absl::IsDeadlineExceeded(status) && collector.accepted()) {
    return std::move(collector).FinishIncomplete(v1::TERMINATION_DEADLINE, seconds().count());
  }
  return status;
}

absl::StatusOr<v1::EnsembleSummary> Client::SolveEnsemble(const v1::SolveEnsembleRequest& request,
                                                          const MemberCallback& on_member, const CallLimits& limits) {
  const auto start = std::chrono::steady_clock::now();
  EnsembleCollector collector(request, on_member, limits.keep_trajectory);
  Call call(connection_, WithoutStop(limits));
  StopOnRequest stopping(*stub_, connection_, call, limits.stop);
  const auto reader = stub_->SolveEnsemble(call.context(), request);
  for (v1::EnsembleEvent event; reader->Read(&event);) {
    if (event.has_accepted()) stopping.Accepted(event.accepted().solve_id());
    collector.Add(std::move(event));
  }
  const grpc::Status status = reader->Finish();
  if (status.ok() || collector.has_summary()) return std::move(collector).Finish();

  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  if (status.error_code() == grpc::StatusCode::CANCELLED && limits.stop.stop_requested()) {
    return std::move(collector).FinishIncomplete("Cancelled.", seconds.count());
  }
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED && collector.accepted()) {
    return std::move(collector).FinishIncomplete("The deadline passed. Allow more time or ask for fewer members.",
                                                 seconds.count());
  }
  return connection_.Describe(status);
}

// A unary call of a method of the stub.
template <typename Request, typename Response>
absl::StatusOr<Response> Client::Ask(UnaryMethod<Request, Response> method, const Request& request,
                                     const CallLimits& limits) {
  Call call(connection_, limits);
  Response response;
  const grpc::Status status = ((*stub_).*method)(call.context(), request, &response);
  if (!status.ok()) return connection_.Describe(status);
  return response;
}

absl::StatusOr<v1::SolveLcpResponse> Client::SolveLcp(const v1::SolveLcpRequest& request, const CallLimits& limits) {
  return Ask(&v1::SolverService::Stub::SolveLcp, request, limits);
}

absl::StatusOr<v1::SolveDcpResponse> Client::SolveDcp(const v1::SolveDcpRequest& request, const CallLimits& limits) {
  return Ask(&v1::SolverService::Stub::SolveDcp, request, limits);
}

absl::StatusOr<v1::AnalyzeProblemResponse> Client::AnalyzeProblem(const v1::AnalyzeProblemRequest& request,
                                                                  const CallLimits& limits) {
  return Ask(&v1::SolverService::Stub::AnalyzeProblem, request, limits);
}

absl::StatusOr<v1::GetCapabilitiesResponse> Client::GetCapabilities(const CallLimits& limits) {
  return Ask(&v1::SolverService::Stub::GetCapabilities, v1::GetCapabilitiesRequest(), limits);
}

}  // namespace dlcs::client
