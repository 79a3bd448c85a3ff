// SPDX-License-Identifier: Apache-2.0
// Assembles the results of an ensemble from its events.

#ifndef DLCS_CLIENT_RESULT_ENSEMBLE_RESULT_H_
#define DLCS_CLIENT_RESULT_ENSEMBLE_RESULT_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "client/result/backend.h"
#include "client/result/solve_result.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Takes the events of one ensemble in their order, and passes on the result of each member when its summary arrives.
// Not thread-safe.
class EnsembleCollector {
 public:
  // `on_member` must outlive it.
  EnsembleCollector(const v1::SolveEnsembleRequest& request, const MemberCallback& on_member, bool keep_trajectory);

  void Add(v1::EnsembleEvent event);
  // Members are received elsewhere.
  void ExpectSummaryAlone() { expects_members_ = false; }

  bool accepted() const { return accepted_; }
  bool has_summary() const { return has_summary_; }

  // Call it once. Errors: DataLoss if there was no summary, if events of a member are missing, or if the number of
  // members differs from that in the summary.
  absl::StatusOr<v1::EnsembleSummary> Finish() &&;

  // The summary of an ensemble that ended without one, because of `why`, after `seconds`.
  v1::EnsembleSummary FinishIncomplete(const std::string& why, double seconds) &&;

 private:
  ResultCollector& Of(std::int64_t member);
  void AddSummary(v1::MemberSummary summary);
  void Count(const v1::Summary& summary);

  const MemberCallback& on_member_;
  std::size_t states_;
  std::size_t constraints_;
  DisplayNames names_;
  bool keep_trajectory_;
  std::int64_t members_;
  std::int64_t member_ = -1;  // the member whose events are arriving
  std::optional<ResultCollector> collector_;
  v1::EnsembleSummary counted_;
  v1::EnsembleSummary summary_;
  std::string fault_;  // the first
  bool accepted_ = false;
  bool has_summary_ = false;
  bool expects_members_ = true;
};

// Adds the counts, the seconds and the message of `part`, the summary of some members, to `sum`.
void AddSummary(const v1::EnsembleSummary& part, v1::EnsembleSummary& sum);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RESULT_ENSEMBLE_RESULT_H_
