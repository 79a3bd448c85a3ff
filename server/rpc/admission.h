// SPDX-License-Identifier: Apache-2.0
// How many solves at once, and how much memory their results may hold: says no early.

#ifndef DLCS_SERVER_RPC_ADMISSION_H_
#define DLCS_SERVER_RPC_ADMISSION_H_

#include <cstdint>
#include <memory>
#include <mutex>

#include "absl/status/statusor.h"

namespace dlcs {

// Two counts, since they end at different times: a solver is free again when the engine has finished, the
// memory of a result when its reader has taken it, or has gone. Safe from any thread; must outlive its
// tickets.
class Admission {
 public:
  // Gives back what it stands for when it is destroyed.
  using Ticket = std::shared_ptr<void>;

  Admission(int max_concurrent_solves, std::int64_t max_held_result_bytes);

  // Errors: ServerBusy when all solvers are taken. There is no queue: the caller hears at once and decides.
  absl::StatusOr<Ticket> TakeSolver();

  // Errors: ServerBusy when `bytes` do not fit beside the results that are held now.
  absl::StatusOr<Ticket> HoldResult(std::int64_t bytes);

  int solves() const;
  int max_solves() const { return max_solves_; }
  std::int64_t held_result_bytes() const;

 private:
  const int max_solves_;
  const std::int64_t max_bytes_;
  mutable std::mutex mutex_;
  int solves_ = 0;
  std::int64_t bytes_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_ADMISSION_H_
