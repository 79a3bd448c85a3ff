// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/event_buffer.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace dlcs {
namespace {

bool IsWindow(const v1::SolveEvent& event) { return event.has_window_started() || event.has_window_finished(); }

v1::SolveEvent GapInsteadOf(const v1::SolveEvent& event) {
  v1::SolveEvent result;
  result.set_sequence(event.sequence());
  *result.mutable_time() = event.time();
  v1::Gap& gap = *result.mutable_gap();
  gap.set_first_sequence(event.sequence());
  gap.set_last_sequence(event.sequence());
  gap.set_reason(v1::Gap::REASON_SLOW);
  if (event.has_iterate()) gap.set_iterates(1);
  if (IsWindow(event)) gap.set_window_events(1);
  return result;
}

// Joins the gap in `later`, which follows at once, to the one in `earlier`.
void Extend(v1::SolveEvent& earlier, const v1::SolveEvent& later) {
  earlier.set_sequence(later.sequence());
  *earlier.mutable_time() = later.time();
  v1::Gap& gap = *earlier.mutable_gap();
  gap.set_last_sequence(later.gap().last_sequence());
  gap.set_iterates(gap.iterates() + later.gap().iterates());
  gap.set_window_events(gap.window_events() + later.gap().window_events());
}

}  // namespace

void EventBuffer::Put(v1::SolveEvent event) {
  const std::lock_guard lock(mutex_);
  const bool is_iterate = event.has_iterate();
  if (event.has_trajectory()) ++chunks_;
  if (is_iterate && iterates_ == limits_.max_iterates) DropOldestIterate();
  queue_.push_back(std::move(event));
  if (is_iterate && iterates_++ == 0) oldest_iterate_ = std::prev(queue_.end());
  // A dropped event may leave a gap of its own, which is as long as itself; the next one then joins it.
  while (queue_.size() > limits_.max_events) {
    if (iterates_ > 0) {
      DropOldestIterate();
    } else {
      DropOldestWindow();
    }
  }
}

bool EventBuffer::WantsChunk() const {
  const std::lock_guard lock(mutex_);
  return chunks_ < limits_.max_chunks;
}

void EventBuffer::Close(absl::StatusOr<FinishedSolve> finished) {
  const std::lock_guard lock(mutex_);
  finished_.emplace(std::move(finished));
}

EventBuffer::Got EventBuffer::Next(v1::SolveEvent& event) {
  const std::lock_guard lock(mutex_);
  if (!queue_.empty()) {
    if (queue_.begin() == oldest_iterate_) ForgetOldestIterate();
    event = std::move(queue_.front());
    queue_.pop_front();
    if (event.has_trajectory()) --chunks_;
    return Got::kEvent;
  }
  if (!finished_.has_value()) return Got::kNothing;
  if (!finished_->ok()) return Got::kEnd;
  std::optional<v1::SolveEvent> next = (*finished_)->NextEvent();
  if (!next.has_value()) return Got::kEnd;
  event = *std::move(next);
  if (event.has_summary()) {
    event.mutable_summary()->set_conflated_iterates(conflated_iterates_);
    summary_given_ = true;
  }
  return Got::kEvent;
}

bool EventBuffer::has_more() const {
  const std::lock_guard lock(mutex_);
  return !queue_.empty() || (finished_.has_value() && finished_->ok() && !summary_given_);
}

bool EventBuffer::delivered() const {
  const std::lock_guard lock(mutex_);
  return summary_given_;
}

bool EventBuffer::closed() const {
  const std::lock_guard lock(mutex_);
  return finished_.has_value();
}

absl::Status EventBuffer::status() const {
  const std::lock_guard lock(mutex_);
  return finished_.has_value() ? finished_->status() : absl::OkStatus();
}

std::size_t EventBuffer::size() const {
  const std::lock_guard lock(mutex_);
  return queue_.size();
}

void EventBuffer::ForgetOldestIterate() {
  --iterates_;
  oldest_iterate_ = iterates_ == 0 ? queue_.end()
                                   : std::find_if(std::next(oldest_iterate_), queue_.end(),
                                                  [](const v1::SolveEvent& event) { return event.has_iterate(); });
}

void EventBuffer::DropOldestIterate() {
  const Queue::iterator dropped = oldest_iterate_;
  ForgetOldestIterate();
  ++conflated_iterates_;
  ReplaceByGap(dropped);
}

void EventBuffer::DropOldestWindow() {
  // Near the front: only accepted, analysis, chunks and the gaps between them can precede it.
  ReplaceByGap(std::find_if(queue_.begin(), queue_.end(), IsWindow));
}

void EventBuffer::ReplaceByGap(Queue::iterator position) {
  *position = GapInsteadOf(*position);
  if (position != queue_.begin() && std::prev(position)->has_gap()) {
    Extend(*std::prev(position), *position);
    position = std::prev(queue_.erase(position));
  }
  if (const auto next = std::next(position); next != queue_.end() && next->has_gap()) {
    Extend(*position, *next);
    queue_.erase(next);
  }
}

}  // namespace dlcs
