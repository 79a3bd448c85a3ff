// SPDX-License-Identifier: Apache-2.0
// Limits the number of concurrent solves and the memory of their results.

#ifndef DLCS_SERVER_RPC_ADMISSION_H_
#define DLCS_SERVER_RPC_ADMISSION_H_

#include <cstdint>
#include <memory>
#include <mutex>

#include "absl/status/statusor.h"

namespace dlcs {

// Two counts with different lifetimes: a solver is free when the engine has finished, the memory of a result when its
// reader has received it or has disconnected. Safe from any thread; must outlive its tickets.
class Admission {
 public:
  // Releases its solver or memory when it is destroyed.
  using Ticket = std::shared_ptr<void>;

  Admission(int max_concurrent_solves, std::int64_t max_held_result_bytes);

  // Errors: ServerBusy when all solvers are taken. There is no queue: the refusal is immediate.
  absl::StatusOr<Ticket> TakeSolver();

  // Errors: ServerBusy if `bytes` do not fit beside the results that are held now.
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
