// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/solve_call.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include "core/parallel/memory_pages.h"
#include "core/problem/solution.h"
#include "fmt/format.h"
#include "server/jobs/catch_exceptions.h"
#include "server/rpc/call_deadline.h"
#include "server/telemetry/call_trace.h"
#include "server/telemetry/job_telemetry.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

constexpr std::int64_t kLargeResultBytes = 16 << 20;

LogFields FactsOf(const PreparedSolve& prepared, const FinishedSolve& finished) {
  const Solution& solution = finished.solution();
  return {{"states", std::int64_t{prepared.num_states()}},
          {"constraints", std::int64_t{prepared.num_constraints()}},
          {"steps", std::int64_t{solution.cost.steps}},
          {"method", MethodName(solution.method)},
          {"termination", TerminationLabel(finished.termination())},
          {"seconds", solution.cost.seconds_total}};
}

LogFields FactsOf(const PreparedEnsemble& prepared, const v1::EnsembleSummary& summary) {
  const Problem& base = prepared.ensemble.base;
  return {{"states", std::int64_t{base.num_states()}},
          {"constraints", std::int64_t{base.num_constraints()}},
          {"solved", summary.solved()},
          {"reached", summary.reached()},
          {"failed", summary.failed()},
          {"stopped", summary.stopped()},
          {"not_begun", summary.not_begun()},
          {"seconds", summary.seconds()}};
}

LogFields FactsOf(const absl::Status& error) {
  return {{"code", absl::StatusCodeToString(error.code())}, {"error", std::string(error.message())}};
}

void Count(const char* kind, const FinishedSolve& solve, Metrics& metrics) {
  const Solution& solution = solve.solution();
  metrics.Solved(kind, MethodName(solution.method), TerminationLabel(solve.termination()), solution.cost);
}

// Returns the work memory of the engine to the system while a large result waits for its reader.
void TrimAfter(std::int64_t result_bytes) {
  if (result_bytes > kLargeResultBytes) ReturnFreedMemory();
}

}  // namespace

std::string NewSolveId() {
  static const unsigned process = std::random_device{}();
  static std::atomic<std::uint64_t> count{0};
  return fmt::format("solve-{:08x}-{}", process, ++count);
}

template <typename Event, typename Buffer>
absl::Status SolverCall<Event, Buffer>::TakeSolver() {
  absl::StatusOr<Admission::Ticket> solver = this->environment_.admission.TakeSolver();
  if (!solver.ok()) {
    Log(spdlog::level::warn, "solve refused", {{"solve", id_}, {"error", std::string(solver.status().message())}});
    return solver.status();
  }
  solver_ = *std::move(solver);
  return absl::OkStatus();
}

template <typename Event, typename Buffer>
absl::Status SolverCall<Event, Buffer>::HoldResult(std::int64_t bytes) {
  absl::StatusOr<Admission::Ticket> result = this->environment_.admission.HoldResult(bytes);
  if (!result.ok()) return result.status();
  result_ = *std::move(result);
  return absl::OkStatus();
}

template <typename Event, typename Buffer>
void SolverCall<Event, Buffer>::StopBeforeDeadline(std::int64_t result_bytes) {
  const auto stop_time = StopTime(this->context_.deadline(), result_bytes);
  if (!stop_time) return;
  alarm_.Set(*stop_time, [control = std::weak_ptr(this->control())](bool rang) {
    if (const auto stopped = control.lock(); rang && stopped) stopped->Stop(StopCause::kDeadline);
  });
}

template <typename Event, typename Buffer>
auto SolverCall<Event, Buffer>::Next(Event& event) -> absl::StatusOr<Got> {
  switch (buffer_.Next(event)) {
    case EventBuffer::Got::kEvent:
      return buffer_.delivered() ? Got::kLast : Got::kMessage;
    case EventBuffer::Got::kNothing:
      return Got::kNothing;
    case EventBuffer::Got::kEnd:
      break;
  }
  if (absl::Status status = buffer_.status(); !status.ok()) return status;
  return Got::kEnd;
}

template <typename Event, typename Buffer>
void SolverCall<Event, Buffer>::LogCall(const std::string& message, LogFields facts) const {
  if (!spdlog::should_log(spdlog::level::info)) return;  // looking up the user costs time
  facts.insert(facts.begin(), {{"solve", id_}, {"user", UserOf(this->environment_.access, this->context_)}});
  facts.push_back({"trace_id", TraceIdOf(this->context_)});
  Log(spdlog::level::info, message, facts);
}

template class SolverCall<v1::SolveEvent, EventBuffer>;
template class SolverCall<v1::EnsembleEvent, EnsembleBuffer>;

void SolveCall::Run() {
  absl::StatusOr<FinishedSolve> finished = CatchExceptions(id(), [this] { return Solve(); });
  if (!finished.ok()) LogCall("solve refused or failed", FactsOf(finished.status()));
  ReleaseSolver();
  buffer_.Close(std::move(finished));
}

absl::StatusOr<FinishedSolve> SolveCall::Solve() {
  const absl::StatusOr<PreparedSolve> prepared =
      PrepareSolve(request_, environment_.limits, environment_.ProblemsOf(context_));
  if (!prepared.ok()) return prepared.status();
  if (absl::Status held = HoldResult(prepared->result_bytes); !held.ok()) return held;
  StopBeforeDeadline(prepared->result_bytes);
  absl::StatusOr<FinishedSolve> finished = RunSolve(*prepared, id(), *control(), *this, environment_.setups.get());
  if (finished.ok()) {
    Count("call", *finished, environment_.metrics);
    LogCall("solve finished", FactsOf(*prepared, *finished));
  }
  TrimAfter(prepared->result_bytes);
  return finished;
}

void SolveCall::Accept(v1::SolveEvent event) {
  // There is nothing to gather with a chunk, which is large.
  const std::chrono::milliseconds delay = event.has_trajectory() ? std::chrono::milliseconds(0) : kGathering;
  buffer_.Put(std::move(event));
  PumpSoon(delay);
}

void EnsembleCall::Run() {
  absl::StatusOr<v1::EnsembleSummary> summary = CatchExceptions(id(), [this] { return Solve(); });
  if (!summary.ok()) LogCall("solve refused or failed", FactsOf(summary.status()));
  ReleaseSolver();
  buffer_.Close(std::move(summary));
}

absl::StatusOr<v1::EnsembleSummary> EnsembleCall::Solve() {
  const absl::StatusOr<PreparedEnsemble> prepared =
      PrepareEnsemble(request_, environment_.limits, environment_.ProblemsOf(context_));
  if (!prepared.ok()) return prepared.status();
  if (absl::Status held = HoldResult(prepared->held_bytes); !held.ok()) return held;
  StopBeforeDeadline(prepared->held_bytes);
  buffer_.Open(id(), *prepared);
  Pump();
  absl::StatusOr<v1::EnsembleSummary> summary = RunEnsemble(*prepared, *control(), *this, environment_.setups.get());
  if (summary.ok()) LogCall("ensemble finished", FactsOf(*prepared, *summary));
  TrimAfter(prepared->held_bytes);
  return summary;
}

void EnsembleCall::Finished(Index member, FinishedSolve solve) {
  Count("member", solve, environment_.metrics);
  buffer_.Finished(member, std::move(solve));
  PumpSoon();
}

}  // namespace dlcs
