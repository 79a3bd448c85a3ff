// SPDX-License-Identifier: Apache-2.0
// What an ensemble gave, put together from its events.

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

// Puts the events of one ensemble together, in their order, and hands on each member when its summary has come. Not
// thread-safe.
class EnsembleCollector {
 public:
  // `on_member` must outlive it.
  EnsembleCollector(const v1::SolveEnsembleRequest& request, const MemberCallback& on_member, bool keep_trajectory);

  void Add(v1::EnsembleEvent event);

  bool accepted() const { return accepted_; }
  bool has_summary() const { return has_summary_; }

  // To be called once. Errors: DataLoss when there was no summary, when a member's events do not join up, or when there
  // are not as many members as the summary counts.
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
  std::int64_t member_ = -1;  // whose events come
  std::optional<ResultCollector> collector_;
  v1::EnsembleSummary counted_;
  v1::EnsembleSummary summary_;
  std::string fault_;  // the first
  bool accepted_ = false;
  bool has_summary_ = false;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RESULT_ENSEMBLE_RESULT_H_
