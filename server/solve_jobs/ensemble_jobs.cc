// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/ensemble_jobs.h"

#include <algorithm>
#include <charconv>
#include <functional>
#include <optional>
#include <stop_token>
#include <utility>

#include "fmt/format.h"
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
// Long enough for the store not to matter, short enough for others to get their turn.
constexpr double kShardCoreSeconds = 20;
constexpr std::int64_t kShardResultBytes = 1'000'000;
// Members that are converted at the same time to check them.
constexpr int kCheckedAtOnce = 10'000;
// Of a member in memory, beside its solution.
constexpr std::int64_t kMemberBytes = 2000;

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

// Whether only the values at the end are of interest, at a time that all members share.
bool NeedsOnlyTheEnd(const v1::CreateEnsembleJobRequest& request) {
  const v1::SolveEnsembleRequest& ensemble = request.ensemble();
  return !request.results().extrema() && ensemble.options().output_times().empty() &&
         std::ranges::none_of(ensemble.members(), [](const auto& member) { return member.has_horizon(); });
}

// Members in each shard.
absl::StatusOr<std::int64_t> ShardMembers(std::int64_t asked, std::int64_t members, std::size_t columns,
                                          double core_seconds, const SessionLimits& limits) {
  if (asked < 0) return InvalidRequest({{"shard_members", fmt::format("{}; must not be negative", asked)}});
  const auto in_time = static_cast<std::int64_t>(std::clamp(kShardCoreSeconds / core_seconds, 1.0, 1e9));
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
  const bool needs_only_the_end = NeedsOnlyTheEnd(request);
  Members members;
  members.Swap(request.mutable_ensemble()->mutable_members());
  v1::SolveEnsembleRequest& ensemble = *request.mutable_ensemble();
  absl::StatusOr<v1::SolveEnsembleRequest> whole = ensemble;
  if (NamesProblem(ensemble)) whole = ResolveProblem(ensemble, find);
  if (!whole.ok()) return whole.status();
  if (needs_only_the_end) {
    ensemble.mutable_options()->add_output_times(whole->problem().horizon());
    *whole->mutable_options() = ensemble.options();
  }
  absl::StatusOr<PreparedEnsemble> prepared = CheckMembers(*whole, members, limits);
  if (!prepared.ok()) return prepared.status();
  const SoundEnsemble& sound = prepared->ensemble;
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
  split.demand = PredictDemand(member);
  const absl::StatusOr<std::int64_t> size =
      ShardMembers(request.shard_members(), members.size(), columns->size(), split.demand.core_seconds, limits);
  if (!size.ok()) return size.status();
  const int in_shard = static_cast<int>(std::min<std::int64_t>(*size, members.size()));
  const int threads = std::clamp(sound.options.num_threads, 1, in_shard);
  split.demand.core_seconds *= in_shard;
  // All that are free at the server that solves it, which may have more than this one.
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

// Takes the members of a shard as they finish.
class ShardSink final : public EnsembleSink {
 public:
  ShardSink(ShardResults results, Metrics& metrics) : results_(std::move(results)), metrics_(metrics) {}

  bool MayBegin(Index /*member*/, const std::stop_token& /*stop*/) override { return true; }
  void Finished(Index member, FinishedSolve solve) override {
    const Solution& solution = solve.solution();
    metrics_.Solved("member", MethodName(solution.method), TerminationLabel(solve.termination()), solution.cost);
    results_.Add(member, std::move(solve));
  }
  jobs::ShardResult Take() { return std::move(results_).Take(); }

 private:
  ShardResults results_;
  Metrics& metrics_;
};

}  // namespace

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
  const SoundEnsemble& ensemble = prepared->ensemble;
  absl::StatusOr<std::vector<v1::EnsembleColumn>> columns = ColumnsOf(request.results(), ensemble.base, ensemble.names);
  if (!columns.ok()) return {columns.status(), ""};
  prepared->ensemble.options.num_threads = run.threads();

  ShardSink sink(ShardResults(*std::move(columns), first, static_cast<Index>(ensemble.members.size())), metrics_);
  SolveControl control;
  const std::stop_callback stop(run.stop(), [&control] { control.Stop(StopCause::kCancelled); });
  const absl::StatusOr<v1::EnsembleSummary> summary = RunEnsemble(*prepared, control, sink, setups_);
  if (!summary.ok()) return {summary.status(), ""};
  if (summary->stopped() + summary->not_begun() > 0) return {absl::CancelledError(), ""};
  return {absl::OkStatus(), "", sink.Take()};
}

}  // namespace dlcs
