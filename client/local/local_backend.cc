// SPDX-License-Identifier: Apache-2.0
#include "client/local/local_backend.h"

#include <fmt/format.h>
#include <unistd.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <variant>

#include "client/result/ensemble_result.h"
#include "client/rpc/rpc_error.h"
#include "core/problem/problem.h"
#include "core/problem/violation_list.h"
#include "google/rpc/error_details.pb.h"
#include "server/session/call_session.h"
#include "server/session/capabilities.h"
#include "server/session/ensemble_session.h"
#include "server/session/solve_session.h"

namespace dlcs::client {
namespace {

// Passes events on as they arrive.
class CallbackSink final : public SolveSink {
 public:
  CallbackSink(ResultCollector& collector, const EventCallback& on_event)
      : collector_(collector), on_event_(on_event) {}

  void Accept(v1::SolveEvent event) override {
    collector_.Add(event);
    if (on_event_) on_event_(event);
  }

 private:
  ResultCollector& collector_;
  const EventCallback& on_event_;
};

// Stops `control` when the time is up, unless it is destroyed before.
class DeadlineTimer {
 public:
  DeadlineTimer(std::chrono::duration<double> deadline, SolveControl& control)
      : waiter_([this, deadline, &control](std::stop_token finished) {
          std::unique_lock lock(mutex_);
          const bool in_time = changed_.wait_for(lock, finished, deadline, [&] { return finished.stop_requested(); });
          if (!in_time) control.Stop(StopCause::kDeadline);
        }) {}

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::jthread waiter_;  // last: it uses the others
};

// A trajectory or a system beyond the memory of this machine is refused at once; allocating it would stall the machine.
SessionLimits LimitsOfThisMachine(int processes = 1) {
  // The least memory that a solve needs for a state or a pair: the rows of its matrices and vectors.
  constexpr std::int64_t kBytesPerRow = 128;
  SessionLimits limits;
  limits.max_result_bytes = std::int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE) * processes;
  limits.max_states = limits.max_constraints = limits.max_result_bytes / kBytesPerRow;
  return limits;
}

// An error of the session as that of a server would be.
absl::Status Describe(const absl::Status& status) {
  if (absl::IsResourceExhausted(status)) {
    const bool trajectory = status.message().find("max_result_bytes") != std::string_view::npos;
    const double gigabytes = 1e-9 * static_cast<double>(LimitsOfThisMachine().max_result_bytes);
    if (trajectory) {
      return absl::ResourceExhaustedError(fmt::format(
          "a trajectory with this many steps does not fit into the {:.1f} GB of this machine; ask for fewer, "
          "or for fewer times with --at",
          gigabytes));
    }
    return absl::InvalidArgumentError(fmt::format(
        "the system has more states or pairs (rows of A or M) than fit into the {:.1f} GB of this machine: at most {}",
        gigabytes, LimitsOfThisMachine().max_states));
  }
  google::rpc::BadRequest bad_request;
  for (const Violation& violation : ViolationsOf(status)) {
    auto& described = *bad_request.add_field_violations();
    described.set_field(violation.field);
    described.set_description(violation.description);
  }
  return bad_request.field_violations().empty() ? status : BadRequestError(bad_request);
}

// A unary call, `run(stop)`. As on the wire, a cancelled call returns no answer.
template <typename Response, typename Run>
absl::StatusOr<Response> Ask(const char* what, const CallLimits& limits, const Run& run) {
  SolveControl control;
  const DeadlineTimer timer(limits.deadline, control);
  const std::stop_callback cancel(limits.stop, [&control] { control.Stop(StopCause::kCancelled); });
  absl::StatusOr<Response> response = run(control.token());
  if (control.cause() == StopCause::kCancelled) return absl::CancelledError(fmt::format("{} was cancelled", what));
  if (control.cause() == StopCause::kDeadline)
    return absl::DeadlineExceededError(fmt::format("{} took longer than it was allowed", what));
  if (!response.ok()) return Describe(response.status());
  return response;
}

}  // namespace

absl::StatusOr<SolveResult> LocalBackend::Solve(const v1::SolveRequest& request, const EventCallback& on_event,
                                                const CallLimits& limits) {
  if (hooks_.check) {
    if (absl::Status checked = hooks_.check(request); !checked.ok()) return checked;
  }
  SolveControl control;
  const DeadlineTimer timer(limits.deadline, control);
  const std::stop_callback cancel(limits.stop, [&control] { control.Stop(StopCause::kCancelled); });
  ResultCollector collector(request, limits.keep_trajectory);
  CallbackSink sink(collector, on_event);
  absl::StatusOr<PreparedSolve> prepared = PrepareSolve(request, LimitsOfThisMachine(hooks_.processes));
  if (!prepared.ok()) return Describe(prepared.status());
  auto* const problem = std::get_if<Problem>(&prepared->system);
  if (problem && hooks_.on_problem) hooks_.on_problem(*problem);
  absl::StatusOr<FinishedSolve> finished = RunSolve(*prepared, "local", control, sink);
  if (!finished.ok()) return Describe(finished.status());
  if (hooks_.has_no_trajectory && hooks_.has_no_trajectory()) collector.ExpectTimesAlone();
  while (std::optional<v1::SolveEvent> event = finished->NextEvent()) sink.Accept(*std::move(event));
  return std::move(collector).Finish();
}

absl::StatusOr<v1::EnsembleSummary> LocalBackend::SolveEnsemble(const v1::SolveEnsembleRequest& request,
                                                                const MemberCallback& on_member,
                                                                const CallLimits& limits) {
  SolveControl control;
  const DeadlineTimer timer(limits.deadline, control);
  const std::stop_callback cancel(limits.stop, [&control] { control.Stop(StopCause::kCancelled); });
  EnsembleCollector collector(request, on_member, limits.keep_trajectory);
  const auto collect = [&collector](v1::EnsembleEvent event) { collector.Add(std::move(event)); };
  if (!hooks_.receives_members) collector.ExpectSummaryAlone();
  const absl::Status status = hooks_.run_ensemble
                                  ? hooks_.run_ensemble(request, LimitsOfThisMachine(), control, collect)
                                  : RunEnsembleToEnd(request, LimitsOfThisMachine(), "local", control, collect);
  if (!status.ok()) return Describe(status);
  return std::move(collector).Finish();
}

absl::StatusOr<v1::SolveLcpResponse> LocalBackend::SolveLcp(const v1::SolveLcpRequest& request,
                                                            const CallLimits& limits) {
  return Ask<v1::SolveLcpResponse>("the LCP", limits,
                                   [&](std::stop_token stop) { return RunLcp(request, LimitsOfThisMachine(), stop); });
}

absl::StatusOr<v1::SolveDcpResponse> LocalBackend::SolveDcp(const v1::SolveDcpRequest& request,
                                                            const CallLimits& limits) {
  return Ask<v1::SolveDcpResponse>("the DCP", limits,
                                   [&](std::stop_token stop) { return RunDcp(request, LimitsOfThisMachine(), stop); });
}

absl::StatusOr<v1::AnalyzeProblemResponse> LocalBackend::AnalyzeProblem(const v1::AnalyzeProblemRequest& request,
                                                                        const CallLimits& limits) {
  return Ask<v1::AnalyzeProblemResponse>(
      "the analysis", limits, [&](std::stop_token stop) { return RunAnalysis(request, LimitsOfThisMachine(), stop); });
}

absl::StatusOr<v1::GetCapabilitiesResponse> LocalBackend::GetCapabilities(const CallLimits& /*limits*/) {
  v1::GetCapabilitiesResponse response = CommonCapabilities();
  response.set_max_result_bytes(LimitsOfThisMachine().max_result_bytes);
  response.set_threads(static_cast<int>(std::thread::hardware_concurrency()));
  return response;
}

}  // namespace dlcs::client
