// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/ensemble_jobs.h"

#include <algorithm>
#include <charconv>
#include <functional>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "fmt/format.h"
#include "proto/shared/known_end.h"
#include "server/session/ensemble_session.h"
#include "server/solve_jobs/ensemble_results.h"
#include "server/solve_jobs/job_solver.h"
#include "server/telemetry/job_telemetry.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

using Members = google::protobuf::RepeatedPtrField<v1::EnsembleMember>;

constexpr std::int64_t kDefaultShardMembers = 1000;
// Long enough that the store costs little in comparison, short enough that other jobs get their turn.
constexpr double kShardCoreSeconds = 20;
constexpr std::int64_t kShardResultBytes = 1'000'000;
// Members that are converted at the same time to check them.
constexpr int kCheckedAtOnce = 10'000;
// Memory for a member, without its solution.
constexpr std::int64_t kMemberBytes = 2000;
// Memory for all nodes of the failed members that FindEnds() solves at the same time.
constexpr std::int64_t kBytesOfNodes = 64'000'000;

// "members[3].x0[1]" of a part of the members that begins at `first`, as in the whole list.
std::string InAllMembers(const std::string& field, std::int64_t first) {
  constexpr std::string_view kBegin = "members[";
  if (!field.starts_with(kBegin)) return field;
  std::int64_t index = 0;
  const auto [end, error] = std::from_chars(field.data() + kBegin.size(), field.data() + field.size(), index);
  return error == std::errc() ? fmt::format("{}{}{}", kBegin, first + index, end) : field;
}

absl::Status InAllMembers(const absl::Status& status, std::int64_t first) {
  std::vector<Violation> violations = ViolationsOf(status);
  if (violations.empty()) return status;
  for (Violation& violation : violations) violation.field = InAllMembers(violation.field, first);
  return InvalidRequest(violations);
}

// `request` with members [first, first + count).
v1::SolveEnsembleRequest WithMembers(v1::SolveEnsembleRequest request, const Members& members, int first, int count) {
  const auto begin = members.begin() + first;
  request.mutable_members()->Add(begin, begin + count);
  return request;
}

// Checks all members; returns the first of them, prepared.
absl::StatusOr<PreparedEnsemble> CheckMembers(const v1::SolveEnsembleRequest& base, const Members& members,
                                              const SessionLimits& limits) {
  std::optional<PreparedEnsemble> first;
  const int at_once = static_cast<int>(std::min<std::int64_t>(kCheckedAtOnce, limits.max_members));
  for (int k = 0; k == 0 || k < members.size(); k += at_once) {
    const int count = std::min(at_once, members.size() - k);
    absl::StatusOr<PreparedEnsemble> prepared = PrepareEnsemble(WithMembers(base, members, k, count), limits);
    if (!prepared.ok()) return InAllMembers(prepared.status(), k);
    if (!first) first = *std::move(prepared);
  }
  return *std::move(first);
}

// The time at which all members end, if there is one that is known.
std::optional<double> CommonEnd(const v1::SolveOptions& options, const Members& members, double horizon) {
  const bool own = std::ranges::any_of(members, [](const auto& member) { return member.has_horizon(); });
  return own && options.period() <= 0 ? std::nullopt : KnownEnd(options, horizon);
}

// Adds the end to the output times if there are any, or if only the end is kept. Errors: InvalidArgument for output
// times of members that do not end together: some would lack their end.
absl::Status AddEnd(std::optional<double> end, bool extrema, v1::SolveOptions& options) {
  const auto& times = options.output_times();
  if (!end && !times.empty()) {
    return InvalidRequest({{"options.output_times",
                            "need one end for all members of a job, but some have a horizon of their own, or a period "
                            "that is to be found; leave them out, and the extrema are those of all nodes"}});
  }
  const bool lacks_end = times.empty() ? !extrema : *std::ranges::max_element(times) < end;
  if (end && lacks_end) options.add_output_times(*end);
  return absl::OkStatus();
}

// Members in each shard.
absl::StatusOr<std::int64_t> ShardMembers(std::int64_t asked, std::int64_t members, std::size_t columns,
                                          double seconds_of_member, const SessionLimits& limits) {
  if (asked < 0) return InvalidRequest({{"shard_members", fmt::format("{}; must not be negative", asked)}});
  const auto in_time = static_cast<std::int64_t>(std::clamp(kShardCoreSeconds / seconds_of_member, 1.0, 1e9));
  const std::int64_t wanted = asked > 0 ? asked : std::min(kDefaultShardMembers, in_time);
  const std::int64_t fitting =
      std::clamp<std::int64_t>(kShardResultBytes / MemberResultBytes(columns), 1, limits.max_members);
  // More members where there would be too many shards.
  const std::int64_t size = std::min(std::max(wanted, (members + kMaxShards - 1) / kMaxShards), fitting);
  const std::int64_t shards = (members + size - 1) / size;
  if (shards > kMaxShards) return LimitExceeded("max_shards", kMaxShards, shards);
  return size;
}

}  // namespace

absl::StatusOr<SplitEnsemble> Split(v1::CreateEnsembleJobRequest request, const SessionLimits& limits,
                                    const ProblemResolver& find) {
  Members members;
  members.Swap(request.mutable_ensemble()->mutable_members());
  v1::SolveEnsembleRequest& ensemble = *request.mutable_ensemble();
  absl::StatusOr<v1::SolveEnsembleRequest> whole = ensemble;
  if (NamesProblem(ensemble)) whole = ResolveProblem(ensemble, find);
  if (!whole.ok()) return whole.status();
  // An invalid horizon is reported with the other violations of the problem.
  if (const double horizon = whole->problem().horizon(); horizon > 0) {
    const std::optional<double> end = CommonEnd(ensemble.options(), members, horizon);
    const absl::Status status = AddEnd(end, request.results().extrema(), *ensemble.mutable_options());
    if (!status.ok()) return status;
  }
  *whole->mutable_options() = ensemble.options();
  absl::StatusOr<PreparedEnsemble> prepared = CheckMembers(*whole, members, limits);
  if (!prepared.ok()) return prepared.status();
  const ValidEnsemble& sound = prepared->ensemble;
  absl::StatusOr<std::vector<v1::EnsembleColumn>> columns = ColumnsOf(request.results(), sound.base, sound.names);
  if (!columns.ok()) return columns.status();
  const double result_bytes = static_cast<double>(MemberResultBytes(columns->size())) * members.size();
  if (absl::Status limit = CheckLimit("max_result_bytes", result_bytes, limits.max_result_bytes); !limit.ok()) {
    return limit;
  }

  const PreparedSolve member{.system = sound.base,
                             .options = sound.options,
                             .result_bytes = *std::ranges::max_element(prepared->result_bytes),
                             .names = sound.names};
  SplitEnsemble split;
  const double all = std::max(1, members.size());
  const double seconds_of_member = PredictDemand(member, all).core_seconds / all;
  const absl::StatusOr<std::int64_t> size =
      ShardMembers(request.shard_members(), members.size(), columns->size(), seconds_of_member, limits);
  if (!size.ok()) return size.status();
  const int in_shard = static_cast<int>(std::min<std::int64_t>(*size, members.size()));
  const int threads = std::clamp(sound.options.num_threads, 1, in_shard);
  split.demand = PredictDemand(member, in_shard);
  // All threads that are free on the server that solves the shard, which may have more of them than this one.
  split.demand.threads = ensemble.options().threads() > 0 ? threads : in_shard;
  split.demand.memory_bytes =
      split.demand.memory_bytes * threads + (2 * MemberResultBytes(columns->size()) + kMemberBytes) * in_shard;

  request.set_shard_members(in_shard);
  split.body = request.SerializeAsString();
  for (int k = 0; k < members.size(); k += in_shard) {
    split.shards.push_back(WithMembers({}, members, k, std::min(in_shard, members.size() - k)).SerializeAsString());
  }
  split.about.set_states(static_cast<int>(sound.base.num_states()));
  split.about.set_constraints(static_cast<int>(sound.base.num_constraints()));
  split.about.set_horizon(sound.base.horizon);
  *split.about.mutable_options() = ensemble.options();
  v1::EnsembleProgress& progress = *split.about.mutable_ensemble();
  progress.set_members(members.size());
  progress.set_shards(static_cast<int>(split.shards.size()));
  progress.set_shard_members(in_shard);
  progress.mutable_columns()->Add(columns->begin(), columns->end());
  return split;
}

namespace {

// Receives the members of a shard as they finish.
class ShardSink final : public EnsembleSink {
 public:
  ShardSink(ShardResults results, Metrics& metrics) : results_(std::move(results)), metrics_(metrics) {}

  bool MayBegin(Index /*member*/, const std::stop_token& /*stop*/) override { return true; }
  void Finished(Index member, FinishedSolve solve) override {
    const Solution& solution = solve.solution();
    metrics_.Solved("member", MethodName(solution.method), TerminationLabel(solve.termination()), solution.cost);
    if (solve.termination() != v1::TERMINATION_REACHED_END) broken_.push_back(member);
    results_.Add(member, std::move(solve));
  }
  // Those that did not reach their end.
  const std::vector<Index>& broken() const { return broken_; }
  ShardResults& results() { return results_; }

 private:
  ShardResults results_;
  std::vector<Index> broken_;
  Metrics& metrics_;
};

// Receives the ends of failed members, the k-th of which has the number broken[k].
class EndSink final : public EnsembleSink {
 public:
  EndSink(const std::vector<Index>& broken, ShardResults& results) : broken_(broken), results_(results) {}

  bool MayBegin(Index /*member*/, const std::stop_token& /*stop*/) override { return true; }
  void Finished(Index member, FinishedSolve solve) override {
    results_.SetEnd(broken_[static_cast<std::size_t>(member)], std::move(solve));
  }

 private:
  const std::vector<Index>& broken_;
  ShardResults& results_;
};

}  // namespace

absl::Status EnsembleSolver::FindEnds(const jobs::JobRun& run, const v1::SolveEnsembleRequest& ensemble,
                                      const std::vector<Index>& broken, const SolveControl& control,
                                      ShardResults& results) const {
  if (broken.empty() || ensemble.options().output_times().empty()) return absl::OkStatus();
  v1::SolveEnsembleRequest again = ensemble;
  again.clear_members();
  again.mutable_options()->clear_output_times();
  for (const Index member : broken) *again.add_members() = ensemble.members(static_cast<int>(member));
  absl::StatusOr<PreparedEnsemble> prepared = PrepareEnsemble(again, limits_, library_.Of(run.job().owner));
  if (!prepared.ok()) return absl::OkStatus();  // too many nodes for the limits
  const std::int64_t fitting = kBytesOfNodes / *std::ranges::max_element(prepared->result_bytes);
  prepared->ensemble.options.num_threads = static_cast<int>(std::clamp<std::int64_t>(fitting, 1, run.threads()));
  EndSink ends(broken, results);
  const absl::StatusOr<v1::EnsembleSummary> summary = RunEnsemble(*prepared, control, ends, setups_);
  if (!summary.ok()) return summary.status();
  return summary->stopped() + summary->not_begun() > 0 ? absl::CancelledError() : absl::OkStatus();
}

jobs::JobEnd EnsembleSolver::Solve(jobs::JobRun& run) const {
  v1::CreateEnsembleJobRequest request;
  v1::SolveEnsembleRequest members;
  if (!request.ParseFromString(run.body()) || !members.ParseFromString(*run.shard_input())) {
    return {absl::DataLossError("The stored request cannot be read."), ""};
  }
  request.mutable_ensemble()->mutable_members()->Swap(members.mutable_members());
  const std::int64_t first = *run.lease().shard * request.shard_members();
  absl::StatusOr<PreparedEnsemble> prepared =
      PrepareEnsemble(request.ensemble(), limits_, library_.Of(run.job().owner));
  if (!prepared.ok()) return {InAllMembers(prepared.status(), first), ""};
  const ValidEnsemble& ensemble = prepared->ensemble;
  absl::StatusOr<std::vector<v1::EnsembleColumn>> columns = ColumnsOf(request.results(), ensemble.base, ensemble.names);
  if (!columns.ok()) return {columns.status(), ""};
  prepared->ensemble.options.num_threads = run.threads();

  ShardSink sink(ShardResults(*std::move(columns), first, static_cast<Index>(ensemble.members.size())), metrics_);
  SolveControl control;
  const std::stop_callback stop(run.stop(), [&control] { control.Stop(StopCause::kCancelled); });
  const absl::StatusOr<v1::EnsembleSummary> summary = RunEnsemble(*prepared, control, sink, setups_);
  if (!summary.ok()) return {summary.status(), ""};
  if (summary->stopped() + summary->not_begun() > 0) return {absl::CancelledError(), ""};
  if (absl::Status ends = FindEnds(run, request.ensemble(), sink.broken(), control, sink.results()); !ends.ok()) {
    return {ends, ""};
  }
  return {absl::OkStatus(), "", std::move(sink.results()).Take()};
}

}  // namespace dlcs
