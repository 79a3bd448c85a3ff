// SPDX-License-Identifier: Apache-2.0
#include "client/mpi/rank_ensemble.h"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/mpi/same_request.h"
#include "client/result/ensemble_result.h"
#include "core/parallel/team.h"
#include "core/setup_cache.h"

namespace dlcs::client {
namespace {

using google::protobuf::io::ArrayInputStream;
using google::protobuf::io::StringOutputStream;

constexpr std::int64_t kRoundBytes = std::int64_t{64} << 20;
constexpr std::size_t kMembersOfRank = 64;  // in a round

// The members of a round that one rank solves, and what came of them.
class OwnMembers final : public EnsembleSink {
 public:
  explicit OwnMembers(EnsembleWriter& writer) : writer_(writer) {}

  void Begin(std::vector<Index> members) {
    members_ = std::move(members);
    events_.clear();
  }
  bool MayBegin(Index /*member*/, const std::stop_token& /*stop*/) override { return true; }
  void Finished(Index member, FinishedSolve solve) override {
    StringOutputStream stream(&events_);
    while (std::optional<v1::SolveEvent> event = solve.NextEvent()) {
      google::protobuf::util::SerializeDelimitedToZeroCopyStream(
          writer_.OfMember(members_[static_cast<std::size_t>(member)], *std::move(event)), &stream);
    }
  }

  // Messages EnsembleEvent, one after the other.
  const std::string& events() const { return events_; }

 private:
  EnsembleWriter& writer_;
  std::vector<Index> members_;  // their numbers in the ensemble
  std::string events_;
};

// The end of the round that begins with member `begin`.
std::size_t EndOfRound(const std::vector<std::int64_t>& bytes, std::size_t begin, std::size_t ranks) {
  const std::size_t most = std::min(bytes.size(), begin + ranks * kMembersOfRank);
  std::int64_t sum = 0;
  for (std::size_t k = begin; k < most; ++k) {
    sum += bytes[k];
    if (sum > kRoundBytes && k >= begin + ranks) return k;
  }
  return most;
}

// Passes the events of a round on, in the order of members.
void Deliver(const std::vector<std::string>& texts, const EnsembleEvents& take, std::int64_t& sequence) {
  std::map<std::int64_t, std::vector<v1::EnsembleEvent>> of_members;
  for (const std::string& text : texts) {
    ArrayInputStream stream(text.data(), static_cast<int>(text.size()));
    v1::EnsembleEvent event;
    while (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&event, &stream, /*clean_eof=*/nullptr)) {
      const std::int64_t member = event.has_member() ? event.member().member() : event.trajectory().member();
      of_members[member].push_back(std::move(event));
      event = {};
    }
  }
  for (auto& [member, events] : of_members) {
    for (v1::EnsembleEvent& event : events) {
      event.set_sequence(++sequence);
      take(std::move(event));
    }
  }
}

// Of what each rank has counted, the sum on all.
v1::EnsembleSummary SumOfRanks(const v1::EnsembleSummary& own, std::size_t members, MpiTeam& team) {
  const auto sum = [&team](auto count) { return static_cast<decltype(count)>(team.Sum(static_cast<double>(count))); };
  v1::EnsembleSummary all;
  all.set_solved(sum(own.solved()));
  all.set_reached(sum(own.reached()));
  all.set_failed(sum(own.failed()));
  all.set_stopped(sum(own.stopped()));
  all.set_setup_hits(sum(own.setup_hits()));
  all.set_setup_misses(sum(own.setup_misses()));
  const auto count = static_cast<std::int64_t>(members);
  all.set_not_begun(count - all.solved() - all.reached() - all.failed() - all.stopped());
  all.set_message(team.FirstText(own.message()));
  return all;
}

}  // namespace

absl::Status RunEnsembleOnRanks(const v1::SolveEnsembleRequest& request, const SessionLimits& limits,
                                const SolveControl& control, const EnsembleEvents& take, MpiTeam& team) {
  const auto begin = std::chrono::steady_clock::now();
  if (absl::Status same = CheckSameEnsemble(request, team); !same.ok()) return same;
  absl::StatusOr<PreparedEnsemble> prepared = PrepareEnsemble(request, limits);
  if (!prepared.ok()) return prepared.status();
  EnsembleWriter writer(prepared->labels);
  v1::EnsembleEvent accepted = writer.Accepted("local", *prepared);
  std::int64_t sequence = accepted.sequence();
  take(std::move(accepted));

  const TeamScope alone(Team::Alone());
  OwnMembers sink(writer);
  SetupCache setups(kOwnSetupBytes);
  // Those of a round that are this rank's take their place.
  std::vector<EnsembleMember> members = std::exchange(prepared->ensemble.members, {});
  std::vector<EnsembleMember>& own = prepared->ensemble.members;
  v1::EnsembleSummary counts;
  const auto ranks = static_cast<std::size_t>(team.size());
  bool stopped = false;
  for (std::size_t first = 0, last = 0; first < members.size() && !stopped; first = last) {
    last = EndOfRound(prepared->result_bytes, first, ranks);
    std::vector<Index> numbers;
    own.clear();
    for (std::size_t k = first; k < last; ++k) {
      if (!team.Owns(static_cast<Index>(k))) continue;
      numbers.push_back(static_cast<Index>(k));
      own.push_back(std::move(members[k]));
    }
    sink.Begin(std::move(numbers));
    absl::Status solved;
    if (!own.empty()) {
      absl::StatusOr<v1::EnsembleSummary> part = RunEnsemble(*prepared, control, sink, &setups);
      if (part.ok()) AddSummary(*part, counts);
      solved = part.status();
    }
    const std::string fault = team.FirstText(std::string(solved.message()));
    if (!solved.ok()) return solved;
    if (!fault.empty()) return absl::InvalidArgumentError(fault);
    const std::vector<std::string> texts = team.CollectTexts(sink.events());
    if (team.rank() == 0) Deliver(texts, take, sequence);
    stopped = team.Any(control.token().stop_requested());
  }
  v1::EnsembleSummary summary = SumOfRanks(counts, members.size(), team);
  summary.set_seconds(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  v1::EnsembleEvent end;
  end.set_sequence(++sequence);
  *end.mutable_summary() = std::move(summary);
  take(std::move(end));
  return absl::OkStatus();
}

}  // namespace dlcs::client
