// SPDX-License-Identifier: Apache-2.0
#include "server/session/ensemble_session.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <thread>
#include <variant>

#include "core/problem/verdict.h"

namespace dlcs {
namespace {

using Clock = std::chrono::steady_clock;

// Size of a result without its trajectory: messages, warnings, certificate.
constexpr std::int64_t kSummaryBytes = 4096;
// Small results wait for their reader up to here, so that a slow one does not stop the threads at once.
constexpr std::int64_t kWaitingBytes = 64 << 20;
// Size of the cache for one ensemble in a process without a set-up cache.

std::int64_t HeldBytes(const PreparedEnsemble& prepared, const SessionLimits& limits) {
  const std::int64_t largest = *std::max_element(prepared.result_bytes.begin(), prepared.result_bytes.end());
  const int asked = prepared.ensemble.options.num_threads;
  const std::int64_t threads = asked > 0 ? asked : std::max(1U, std::thread::hardware_concurrency());
  // For each thread one result in progress and one that waits.
  const double useful =
      std::max(2.0 * static_cast<double>(threads) * static_cast<double>(largest), double{kWaitingBytes});
  const auto allowed = static_cast<std::int64_t>(std::min(useful, static_cast<double>(limits.max_result_bytes)));
  return std::min(prepared.all_bytes, std::max(largest, allowed));
}

absl::StatusOr<std::optional<OutputEvaluator>> OutputsOfMember(const ValidEnsemble& ensemble, const Options& options,
                                                               Index member) {
  if (ensemble.base.outputs.shown() == 0) return std::optional<OutputEvaluator>();
  return OutputsOf(MemberProblem(ensemble.base, ensemble.members[static_cast<std::size_t>(member)]), options);
}

void Count(const FinishedSolve& solve, v1::EnsembleSummary& summary) {
  const Verdict verdict = JudgeSolution(solve.solution());
  switch (solve.termination()) {
    case v1::TERMINATION_REACHED_END:
      if (verdict.kind == VerdictKind::kSolved) return summary.set_solved(summary.solved() + 1);
      if (verdict.success) return summary.set_reached(summary.reached() + 1);
      return summary.set_failed(summary.failed() + 1);
    case v1::TERMINATION_CANCELLED:
    case v1::TERMINATION_DEADLINE:
      return summary.set_stopped(summary.stopped() + 1);
    default:
      return summary.set_failed(summary.failed() + 1);
  }
}

}  // namespace

absl::StatusOr<PreparedEnsemble> PrepareEnsemble(const v1::SolveEnsembleRequest& request, const SessionLimits& limits,
                                                 const ProblemResolver& find) {
  if (NamesProblem(request)) {
    const absl::StatusOr<v1::SolveEnsembleRequest> whole = ResolveProblem(request, find);
    return whole.ok() ? PrepareEnsemble(*whole, limits) : whole.status();
  }
  absl::StatusOr<ValidEnsemble> sound = ParseAndValidate(request, limits);
  if (!sound.ok()) return sound.status();
  PreparedEnsemble prepared;
  prepared.ensemble = *std::move(sound);
  Options& options = prepared.ensemble.options;
  const auto of_base = CountResultBytes(prepared.ensemble.base, options, limits);
  for (const EnsembleMember& member : prepared.ensemble.members) {
    const bool has_own_times = member.f || member.g || member.h || member.horizon || member.break_points;
    const auto bytes =
        has_own_times ? CountResultBytes(MemberProblem(prepared.ensemble.base, member), options, limits) : of_base;
    if (!bytes.ok()) return bytes.status();
    prepared.result_bytes.push_back(*bytes + kSummaryBytes);
    prepared.all_bytes +=
        std::min(prepared.result_bytes.back(), std::numeric_limits<std::int64_t>::max() - prepared.all_bytes);
  }
  for (const v1::EnsembleMember& member : request.members()) prepared.labels.push_back(member.label());
  options.num_threads = AllowedThreads(options.num_threads, limits);
  prepared.held_bytes = HeldBytes(prepared, limits);
  return prepared;
}

absl::StatusOr<v1::EnsembleSummary> RunEnsemble(const PreparedEnsemble& prepared, const SolveControl& control,
                                                EnsembleSink& sink, SetupCache* setups) {
  const auto begin = Clock::now();
  SetupCache own(kOwnSetupBytes);
  if (setups == nullptr) setups = &own;
  const SetupCache::Statistics before = setups->statistics();
  v1::EnsembleSummary summary;
  absl::Status outputs_status;
  const auto finished = [&](Index member, Solution solution) {
    AddNames(prepared.ensemble.names, solution);
    auto outputs = OutputsOfMember(prepared.ensemble, prepared.ensemble.options, member);
    outputs_status.Update(outputs.status());
    if (!outputs.ok()) return;
    FinishedSolve solve(std::move(solution), *std::move(outputs), control.cause(), 1);
    Count(solve, summary);
    sink.Finished(member, std::move(solve));
  };
  const std::stop_token stop = control.token();
  const auto may_begin = [&](Index member) { return !stop.stop_requested() && sink.MayBegin(member, stop); };
  const ValidEnsemble& ensemble = prepared.ensemble;
  const absl::Status status =
      SolveEnsembleValidated(ensemble.base, ensemble.members, ensemble.options, finished, stop, setups, may_begin);
  if (!status.ok()) return FromEngine(status, "problem");
  if (!outputs_status.ok()) return outputs_status;

  const auto members = static_cast<std::int64_t>(ensemble.members.size());
  summary.set_not_begun(members - summary.solved() - summary.reached() - summary.failed() - summary.stopped());
  if (summary.stopped() + summary.not_begun() > 0) summary.set_message(StopAdvice(control.cause()));
  summary.set_seconds(std::chrono::duration<double>(Clock::now() - begin).count());
  const SetupCache::Statistics after = setups->statistics();
  summary.set_setup_hits(after.hits - before.hits);
  summary.set_setup_misses(after.misses - before.misses);
  return summary;
}

v1::EnsembleEvent EnsembleWriter::Next() {
  v1::EnsembleEvent event;
  event.set_sequence(next_sequence_++);
  return event;
}

v1::EnsembleEvent EnsembleWriter::Accepted(const std::string& solve_id, const PreparedEnsemble& prepared) {
  v1::EnsembleEvent event = Next();
  v1::EnsembleAccepted& accepted = *event.mutable_accepted();
  accepted.set_solve_id(solve_id);
  accepted.set_members(static_cast<std::int64_t>(prepared.labels.size()));
  accepted.set_result_bytes(static_cast<double>(prepared.all_bytes));
  accepted.set_states(static_cast<int>(prepared.ensemble.base.num_states()));
  accepted.set_constraints(static_cast<int>(prepared.ensemble.base.num_constraints()));
  SetNames(prepared.ensemble.names, accepted);
  return event;
}

v1::EnsembleEvent EnsembleWriter::OfMember(Index member, v1::SolveEvent event) {
  v1::EnsembleEvent result = Next();
  if (event.has_trajectory()) {
    result.mutable_trajectory()->set_member(member);
    result.mutable_trajectory()->mutable_chunk()->Swap(event.mutable_trajectory());
  } else {
    result.mutable_member()->set_member(member);
    result.mutable_member()->set_label(labels_[static_cast<std::size_t>(member)]);
    result.mutable_member()->mutable_summary()->Swap(event.mutable_summary());
  }
  return result;
}

v1::EnsembleEvent EnsembleWriter::Summary(v1::EnsembleSummary summary) {
  v1::EnsembleEvent event = Next();
  event.mutable_summary()->Swap(&summary);
  return event;
}

absl::Status RunEnsembleToEnd(const v1::SolveEnsembleRequest& request, const SessionLimits& limits,
                              const std::string& solve_id, const SolveControl& control, const EnsembleEvents& take) {
  // The callback takes each member when it finishes, so no results are held.
  class Forwarder final : public EnsembleSink {
   public:
    Forwarder(EnsembleWriter& writer, const EnsembleEvents& take) : writer_(writer), take_(take) {}
    bool MayBegin(Index /*member*/, const std::stop_token& /*stop*/) override { return true; }
    void Finished(Index member, FinishedSolve solve) override {
      while (std::optional<v1::SolveEvent> event = solve.NextEvent())
        take_(writer_.OfMember(member, *std::move(event)));
    }

   private:
    EnsembleWriter& writer_;
    const EnsembleEvents& take_;
  };
  const absl::StatusOr<PreparedEnsemble> prepared = PrepareEnsemble(request, limits);
  if (!prepared.ok()) return prepared.status();
  EnsembleWriter writer(prepared->labels);
  take(writer.Accepted(solve_id, *prepared));
  Forwarder forwarder(writer, take);
  absl::StatusOr<v1::EnsembleSummary> summary = RunEnsemble(*prepared, control, forwarder);
  if (!summary.ok()) return summary.status();
  take(writer.Summary(*std::move(summary)));
  return absl::OkStatus();
}

}  // namespace dlcs
