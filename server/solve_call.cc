// SPDX-License-Identifier: Apache-2.0
#include "server/solve_call.h"

#include <malloc.h>

#include <cstdint>
#include <string>
#include <utility>

#include "core/solution.h"
#include "server/guarded.h"
#include "server/telemetry/call_trace.h"
#include "server/telemetry/log.h"

namespace dlcs {
namespace {

constexpr std::int64_t kLargeResultBytes = 16 << 20;

void TellSolve(const CallLifetime& call, const std::string& trace_id, const PreparedSolve& prepared,
               const FinishedSolve& finished, Metrics& metrics) {
  const Solution& solution = finished.solution();
  const std::string termination = v1::Termination_Name(finished.termination());
  metrics.Solved("call", MethodName(solution.method), termination, solution.cost);
  Log(spdlog::level::info, "solve finished",
      {{"solve", call.id()},
       {"states", std::int64_t{prepared.num_states()}},
       {"constraints", std::int64_t{prepared.num_constraints()}},
       {"steps", std::int64_t{solution.cost.steps}},
       {"method", MethodName(solution.method)},
       {"termination", termination},
       {"seconds", solution.cost.seconds_total},
       {"trace_id", trace_id}});
}

void TellEnsemble(const CallLifetime& call, const std::string& trace_id, const PreparedEnsemble& prepared,
                  const v1::EnsembleSummary& summary) {
  const Problem& base = prepared.ensemble.base;
  Log(spdlog::level::info, "ensemble finished",
      {{"solve", call.id()},
       {"states", std::int64_t{base.num_states()}},
       {"constraints", std::int64_t{base.num_constraints()}},
       {"solved", summary.solved()},
       {"failed", summary.failed()},
       {"stopped", summary.stopped()},
       {"not_begun", summary.not_begun()},
       {"seconds", summary.seconds()},
       {"trace_id", trace_id}});
}

// The result of `solve`; one that is an error, or an exception, goes to the log.
template <typename Solve>
auto Logged(const std::string& id, const std::string& trace_id, const Solve& solve) {
  auto result = Guarded(id, solve);
  if (!result.ok()) {
    Log(spdlog::level::info, "solve refused or failed",
        {{"solve", id},
         {"code", absl::StatusCodeToString(result.status().code())},
         {"error", std::string(result.status().message())},
         {"trace_id", trace_id}});
  }
  return result;
}

// What the engine took to work with goes back to the system while a large result waits for its reader.
void TrimAfter(std::int64_t result_bytes) {
  if (result_bytes > kLargeResultBytes) malloc_trim(0);
}

}  // namespace

void SolveCall::Run() {
  mailbox_.Close(Logged(lifetime_.id(), TraceIdOf(context_), [this] { return Solve(); }));
}

absl::StatusOr<FinishedSolve> SolveCall::Solve() {
  const absl::StatusOr<PreparedSolve> prepared = PrepareSolve(request_, environment_.limits, Problems());
  if (!prepared.ok()) return prepared.status();
  if (absl::Status held = lifetime_.HoldResult(prepared->result_bytes); !held.ok()) return held;
  lifetime_.StopBeforeDeadline(context_.deadline(), prepared->result_bytes);
  absl::StatusOr<FinishedSolve> finished =
      RunSolve(*prepared, lifetime_.id(), lifetime_.control(), *this, environment_.setups);
  if (finished.ok()) TellSolve(lifetime_, TraceIdOf(context_), *prepared, *finished, environment_.metrics);
  TrimAfter(prepared->result_bytes);
  return finished;
}

void SolveCall::Accept(v1::SolveEvent event) {
  mailbox_.Put(std::move(event));
  PumpSoon();
}

void EnsembleCall::Run() {
  mailbox_.Close(Logged(lifetime_.id(), TraceIdOf(context_), [this] { return Solve(); }));
}

absl::StatusOr<v1::EnsembleSummary> EnsembleCall::Solve() {
  const absl::StatusOr<PreparedEnsemble> prepared = PrepareEnsemble(request_, environment_.limits, Problems());
  if (!prepared.ok()) return prepared.status();
  if (absl::Status held = lifetime_.HoldResult(prepared->held_bytes); !held.ok()) return held;
  lifetime_.StopBeforeDeadline(context_.deadline(), prepared->held_bytes);
  mailbox_.Open(lifetime_.id(), *prepared);
  Pump();
  absl::StatusOr<v1::EnsembleSummary> summary = RunEnsemble(*prepared, lifetime_.control(), *this, environment_.setups);
  if (summary.ok()) TellEnsemble(lifetime_, TraceIdOf(context_), *prepared, *summary);
  TrimAfter(prepared->held_bytes);
  return summary;
}

void EnsembleCall::Finished(Index member, FinishedSolve solve) {
  environment_.metrics.Solved("member", MethodName(solve.solution().method), v1::Termination_Name(solve.termination()),
                              solve.solution().cost);
  mailbox_.Finished(member, std::move(solve));
  PumpSoon();
}

}  // namespace dlcs
