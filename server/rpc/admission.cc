// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/admission.h"

#include <chrono>

#include "server/wire/errors.h"

namespace dlcs {
namespace {

// Most solves take less; a caller that retries too early is refused again.
constexpr std::chrono::milliseconds kRetryAfter{1000};

}  // namespace

Admission::Admission(int max_concurrent_solves, std::int64_t max_held_result_bytes)
    : max_solves_(max_concurrent_solves), max_bytes_(max_held_result_bytes) {}

absl::StatusOr<Admission::Ticket> Admission::TakeSolver() {
  const std::lock_guard lock(mutex_);
  if (solves_ >= max_solves_) return ServerBusy("max_concurrent_solves", max_solves_, kRetryAfter);
  ++solves_;
  return Ticket(nullptr, [this](void*) {
    const std::lock_guard giving_back(mutex_);
    --solves_;
  });
}

absl::StatusOr<Admission::Ticket> Admission::HoldResult(std::int64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (bytes > max_bytes_ - bytes_) return ServerBusy("max_held_result_bytes", max_bytes_, kRetryAfter);
  bytes_ += bytes;
  return Ticket(nullptr, [this, bytes](void*) {
    const std::lock_guard giving_back(mutex_);
    bytes_ -= bytes;
  });
}

int Admission::solves() const {
  const std::lock_guard lock(mutex_);
  return solves_;
}

std::int64_t Admission::held_result_bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace dlcs
