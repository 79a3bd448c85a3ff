// SPDX-License-Identifier: Apache-2.0
// A request to stop, seen deep inside of a computation without being handed down through all of it.

#ifndef DLCS_CORE_PARALLEL_STOP_SCOPE_H_
#define DLCS_CORE_PARALLEL_STOP_SCOPE_H_

#include <stop_token>
#include <utility>

namespace dlcs {

// What LookForStop() throws: it unwinds a computation that is of no use any more. Solve() and the other entry points
// catch it, and so do methods that have something to keep; nobody else should.
struct Stopped {};

// While it lives, LookForStop() on this thread means `stop`. Scopes nest. Workers carry the scope of whoever calls them
// to all their threads.
class StopScope {
 public:
  explicit StopScope(std::stop_token stop) : own_(std::move(stop)), outer_(current_) { current_ = &own_; }
  // The scope of another thread, which lives longer; null for none.
  explicit StopScope(const std::stop_token* stop) : outer_(current_) { current_ = stop; }
  ~StopScope() { current_ = outer_; }
  StopScope(const StopScope&) = delete;
  StopScope& operator=(const StopScope&) = delete;

  // That of this thread; null where there is none.
  static const std::stop_token* Current() { return current_; }

 private:
  static inline constinit thread_local const std::stop_token* current_ = nullptr;
  const std::stop_token own_;
  const std::stop_token* const outer_;
};

// Throws Stopped when it was asked for. Costs a nanosecond. Whatever takes more than some milliseconds calls it in its
// loops: pivots, columns of a factorization, panels of a product.
inline void LookForStop() {
  if (const std::stop_token* stop = StopScope::Current(); stop && stop->stop_requested()) throw Stopped();
}

}  // namespace dlcs

#endif  // DLCS_CORE_PARALLEL_STOP_SCOPE_H_
