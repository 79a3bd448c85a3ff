// SPDX-License-Identifier: Apache-2.0
#include "client/result/ensemble_result.h"

#include <fmt/format.h>

#include <utility>

#include "proto/wire/matrix_shape.h"

namespace dlcs::client {

EnsembleCollector::EnsembleCollector(const v1::SolveEnsembleRequest& request, const MemberCallback& on_member,
                                     bool keep_trajectory)
    : on_member_(on_member),
      states_(static_cast<std::size_t>(ShapeOf(request.problem().a()).rows)),
      constraints_(static_cast<std::size_t>(ShapeOf(request.problem().m()).rows)),
      names_(NamesIn(request.problem())),
      keep_trajectory_(keep_trajectory),
      members_(request.members_size()) {}

void EnsembleCollector::Add(v1::EnsembleEvent event) {
  switch (event.kind_case()) {
    case v1::EnsembleEvent::kAccepted:
      accepted_ = true;
      // Of a problem that the request names, the server knows the shape.
      if (states_ == 0) {
        states_ = static_cast<std::size_t>(event.accepted().states());
        constraints_ = static_cast<std::size_t>(event.accepted().constraints());
        names_ = NamesIn(event.accepted());
      }
      break;
    case v1::EnsembleEvent::kTrajectory:
      Of(event.trajectory().member()).AddChunk(event.trajectory().chunk());
      break;
    case v1::EnsembleEvent::kMember:
      AddSummary(std::move(*event.mutable_member()));
      break;
    case v1::EnsembleEvent::kSummary:
      summary_ = std::move(*event.mutable_summary());
      has_summary_ = true;
      break;
    case v1::EnsembleEvent::KIND_NOT_SET:  // an event of a newer server
      break;
  }
}

// What collects the events of `member`, which follow one another.
ResultCollector& EnsembleCollector::Of(std::int64_t member) {
  if (member != member_ && collector_ && fault_.empty()) {
    fault_ = fmt::format("the events of member {} end without its summary", member_);
  }
  if (member != member_ || !collector_) collector_.emplace(states_, constraints_, names_, keep_trajectory_);
  member_ = member;
  return *collector_;
}

void EnsembleCollector::AddSummary(v1::MemberSummary summary) {
  Count(summary.summary());
  Of(summary.member()).AddSummary(std::move(*summary.mutable_summary()));
  absl::StatusOr<SolveResult> result = std::move(*collector_).Finish();
  collector_.reset();
  if (!result.ok()) {
    if (fault_.empty()) fault_ = fmt::format("member {}: {}", summary.member(), std::string(result.status().message()));
    return;
  }
  if (on_member_) on_member_({summary.member(), summary.label(), *std::move(result)});
}

void EnsembleCollector::Count(const v1::Summary& summary) {
  const v1::Termination termination = summary.termination();
  if (summary.verdict().kind() == v1::VERDICT_KIND_SOLVED) {
    counted_.set_solved(counted_.solved() + 1);
  } else if (summary.verdict().success()) {
    counted_.set_reached(counted_.reached() + 1);
  } else if (termination == v1::TERMINATION_CANCELLED || termination == v1::TERMINATION_DEADLINE) {
    counted_.set_stopped(counted_.stopped() + 1);
  } else {
    counted_.set_failed(counted_.failed() + 1);
  }
}

absl::StatusOr<v1::EnsembleSummary> EnsembleCollector::Finish() && {
  if (!fault_.empty()) return absl::DataLossError(fault_);
  if (!has_summary_) return absl::DataLossError("the events of the ensemble ended without a summary");
  const std::int64_t announced = summary_.solved() + summary_.reached() + summary_.failed() + summary_.stopped();
  const std::int64_t came = counted_.solved() + counted_.reached() + counted_.failed() + counted_.stopped();
  if (expects_members_ && announced != came) {
    return absl::DataLossError(fmt::format("received {} members; expected {}", came, announced));
  }
  return std::move(summary_);
}

v1::EnsembleSummary EnsembleCollector::FinishIncomplete(const std::string& why, double seconds) && {
  counted_.set_not_begun(members_ - counted_.solved() - counted_.reached() - counted_.failed() - counted_.stopped());
  counted_.set_message(why);
  counted_.set_seconds(seconds);
  return std::move(counted_);
}

void AddSummary(const v1::EnsembleSummary& part, v1::EnsembleSummary& sum) {
  sum.set_solved(sum.solved() + part.solved());
  sum.set_reached(sum.reached() + part.reached());
  sum.set_failed(sum.failed() + part.failed());
  sum.set_stopped(sum.stopped() + part.stopped());
  sum.set_not_begun(sum.not_begun() + part.not_begun());
  sum.set_seconds(sum.seconds() + part.seconds());
  sum.set_setup_hits(sum.setup_hits() + part.setup_hits());
  sum.set_setup_misses(sum.setup_misses() + part.setup_misses());
  if (!part.message().empty()) sum.set_message(part.message());
}

}  // namespace dlcs::client
