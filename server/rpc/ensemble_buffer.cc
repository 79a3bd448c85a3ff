// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/ensemble_buffer.h"

#include <utility>

namespace dlcs {

void EnsembleBuffer::Open(const std::string& solve_id, const PreparedEnsemble& prepared) {
  const std::lock_guard lock(mutex_);
  result_bytes_ = prepared.result_bytes;
  most_bytes_ = prepared.held_bytes;
  writer_.emplace(prepared.labels);
  accepted_ = writer_->Accepted(solve_id, prepared);
}

bool EnsembleBuffer::MayBegin(Index member, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const std::int64_t bytes = result_bytes_[static_cast<std::size_t>(member)];
  const bool has_room = room_.wait(lock, stop, [&] { return bytes <= most_bytes_ - held_bytes_; });
  if (has_room) held_bytes_ += bytes;
  return has_room;
}

void EnsembleBuffer::Finished(Index member, FinishedSolve solve) {
  const std::lock_guard lock(mutex_);
  members_.push_back({member, std::move(solve)});
}

void EnsembleBuffer::Close(absl::StatusOr<v1::EnsembleSummary> summary) {
  const std::lock_guard lock(mutex_);
  summary_.emplace(std::move(summary));
}

EnsembleBuffer::Got EnsembleBuffer::Next(v1::EnsembleEvent& event) {
  const std::lock_guard lock(mutex_);
  if (accepted_.has_value()) {
    event = *std::exchange(accepted_, std::nullopt);
    return Got::kEvent;
  }
  if (NextOfMembers(event)) return Got::kEvent;
  if (!summary_.has_value()) return Got::kNothing;
  if (!summary_->ok() || summary_made_) return Got::kEnd;
  event = writer_->Summary(**summary_);
  summary_made_ = true;
  return Got::kEvent;
}

bool EnsembleBuffer::has_more() const {
  const std::lock_guard lock(mutex_);
  return !members_.empty() || (summary_.has_value() && summary_->ok() && !summary_made_);
}

bool EnsembleBuffer::delivered() const {
  const std::lock_guard lock(mutex_);
  return summary_made_;
}

bool EnsembleBuffer::NextOfMembers(v1::EnsembleEvent& event) {
  if (members_.empty()) return false;
  Member& first = members_.front();
  event = writer_->OfMember(first.member, *first.solve.NextEvent());
  if (event.has_member()) {  // its last
    held_bytes_ -= result_bytes_[static_cast<std::size_t>(first.member)];
    members_.pop_front();
    room_.notify_all();
  }
  return true;
}

bool EnsembleBuffer::closed() const {
  const std::lock_guard lock(mutex_);
  return summary_.has_value();
}

absl::Status EnsembleBuffer::status() const {
  const std::lock_guard lock(mutex_);
  return summary_.has_value() ? summary_->status() : absl::OkStatus();
}

std::int64_t EnsembleBuffer::held_bytes() const {
  const std::lock_guard lock(mutex_);
  return held_bytes_;
}

}  // namespace dlcs
