// SPDX-License-Identifier: Apache-2.0
#include "server/solve_call.h"

#include <malloc.h>

#include <cstdint>
#include <string>
#include <utility>

#include "core/solution.h"
#include "server/guarded.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

constexpr std::int64_t kLargeResultBytes = 16 << 20;

void LogSolve(const std::string& id, const PreparedSolve& prepared, const FinishedSolve& finished) {
  const Solution& solution = finished.solution();
  spdlog::info("{}: {} states, {} constraints, {} steps, {}, {}, {:.3f} s", id, prepared.num_states(),
               prepared.num_constraints(), solution.cost.steps, MethodName(solution.method),
               v1::Termination_Name(finished.termination()), solution.cost.seconds_total);
}

void LogEnsemble(const std::string& id, const PreparedEnsemble& prepared, const v1::EnsembleSummary& summary) {
  const Problem& base = prepared.ensemble.base;
  spdlog::info("{}: ensemble of {} states, {} constraints: {} solved, {} failed, {} stopped, {} not begun, {:.3f} s",
               id, base.num_states(), base.num_constraints(), summary.solved(), summary.failed(), summary.stopped(),
               summary.not_begun(), summary.seconds());
}

// The result of `solve`; one that is an error, or an exception, goes to the log.
template <typename Solve>
auto Logged(const std::string& id, const Solve& solve) {
  auto result = Guarded(id, solve);
  if (!result.ok()) {
    spdlog::info("{}: {}: {}", id, absl::StatusCodeToString(result.status().code()),
                 std::string(result.status().message()));
  }
  return result;
}

// What the engine took to work with goes back to the system while a large result waits for its reader.
void TrimAfter(std::int64_t result_bytes) {
  if (result_bytes > kLargeResultBytes) malloc_trim(0);
}

}  // namespace

void SolveCall::Run() {
  mailbox_.Close(Logged(lifetime_.id(), [this] { return Solve(); }));
}

absl::StatusOr<FinishedSolve> SolveCall::Solve() {
  const absl::StatusOr<PreparedSolve> prepared = PrepareSolve(request_, environment_.limits, environment_.find_problem);
  if (!prepared.ok()) return prepared.status();
  if (absl::Status held = lifetime_.HoldResult(prepared->result_bytes); !held.ok()) return held;
  lifetime_.StopBeforeDeadline(context_.deadline(), prepared->result_bytes);
  absl::StatusOr<FinishedSolve> finished =
      RunSolve(*prepared, lifetime_.id(), lifetime_.control(), *this, environment_.setups);
  if (finished.ok()) LogSolve(lifetime_.id(), *prepared, *finished);
  TrimAfter(prepared->result_bytes);
  return finished;
}

void SolveCall::Accept(v1::SolveEvent event) {
  mailbox_.Put(std::move(event));
  PumpSoon();
}

void EnsembleCall::Run() {
  mailbox_.Close(Logged(lifetime_.id(), [this] { return Solve(); }));
}

absl::StatusOr<v1::EnsembleSummary> EnsembleCall::Solve() {
  const absl::StatusOr<PreparedEnsemble> prepared = PrepareEnsemble(request_, environment_.limits, environment_.find_problem);
  if (!prepared.ok()) return prepared.status();
  if (absl::Status held = lifetime_.HoldResult(prepared->held_bytes); !held.ok()) return held;
  lifetime_.StopBeforeDeadline(context_.deadline(), prepared->held_bytes);
  mailbox_.Open(lifetime_.id(), *prepared);
  Pump();
  absl::StatusOr<v1::EnsembleSummary> summary = RunEnsemble(*prepared, lifetime_.control(), *this, environment_.setups);
  if (summary.ok()) LogEnsemble(lifetime_.id(), *prepared, *summary);
  TrimAfter(prepared->held_bytes);
  return summary;
}

void EnsembleCall::Finished(Index member, FinishedSolve solve) {
  mailbox_.Finished(member, std::move(solve));
  PumpSoon();
}

}  // namespace dlcs
