// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/solve_call.h"

#include <malloc.h>

#include <cstdint>
#include <string>
#include <utility>

#include "core/problem/solution.h"
#include "server/jobs/catch_exceptions.h"
#include "server/log.h"
#include "server/telemetry/job_telemetry.h"

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

// What the engine took to work with goes back to the system while a large result waits for its reader.
void TrimAfter(std::int64_t result_bytes) {
  if (result_bytes > kLargeResultBytes) malloc_trim(0);
}

}  // namespace

void SolveCall::Run() {
  absl::StatusOr<FinishedSolve> finished = CatchExceptions(lifetime_.id(), [this] { return Solve(); });
  if (!finished.ok()) Tell("solve refused or failed", FactsOf(finished.status()));
  mailbox_.Close(std::move(finished));
}

absl::StatusOr<FinishedSolve> SolveCall::Solve() {
  const absl::StatusOr<PreparedSolve> prepared = PrepareSolve(request_, environment_.limits, Problems());
  if (!prepared.ok()) return prepared.status();
  if (absl::Status held = lifetime_.HoldResult(prepared->result_bytes); !held.ok()) return held;
  lifetime_.StopBeforeDeadline(context_.deadline(), prepared->result_bytes);
  absl::StatusOr<FinishedSolve> finished =
      RunSolve(*prepared, lifetime_.id(), lifetime_.control(), *this, environment_.setups);
  if (finished.ok()) {
    Count("call", *finished, environment_.metrics);
    Tell("solve finished", FactsOf(*prepared, *finished));
  }
  TrimAfter(prepared->result_bytes);
  return finished;
}

void SolveCall::Accept(v1::SolveEvent event) {
  mailbox_.Put(std::move(event));
  PumpSoon();
}

void EnsembleCall::Run() {
  absl::StatusOr<v1::EnsembleSummary> summary = CatchExceptions(lifetime_.id(), [this] { return Solve(); });
  if (!summary.ok()) Tell("solve refused or failed", FactsOf(summary.status()));
  mailbox_.Close(std::move(summary));
}

absl::StatusOr<v1::EnsembleSummary> EnsembleCall::Solve() {
  const absl::StatusOr<PreparedEnsemble> prepared = PrepareEnsemble(request_, environment_.limits, Problems());
  if (!prepared.ok()) return prepared.status();
  if (absl::Status held = lifetime_.HoldResult(prepared->held_bytes); !held.ok()) return held;
  lifetime_.StopBeforeDeadline(context_.deadline(), prepared->held_bytes);
  mailbox_.Open(lifetime_.id(), *prepared);
  Pump();
  absl::StatusOr<v1::EnsembleSummary> summary = RunEnsemble(*prepared, lifetime_.control(), *this, environment_.setups);
  if (summary.ok()) Tell("ensemble finished", FactsOf(*prepared, *summary));
  TrimAfter(prepared->held_bytes);
  return summary;
}

void EnsembleCall::Finished(Index member, FinishedSolve solve) {
  Count("member", solve, environment_.metrics);
  mailbox_.Finished(member, std::move(solve));
  PumpSoon();
}

}  // namespace dlcs
