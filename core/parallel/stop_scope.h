// SPDX-License-Identifier: Apache-2.0
// A request to stop that is visible deep inside a computation without being passed down as an argument.

#ifndef DLCS_CORE_PARALLEL_STOP_SCOPE_H_
#define DLCS_CORE_PARALLEL_STOP_SCOPE_H_

#include <stop_token>
#include <utility>

namespace dlcs {

// Thrown by LookForStop() to unwind a computation. Solve() and the other entry points catch it, and so do methods that
// have partial results to keep; no other code should.
struct Stopped {};

// While it lives, LookForStop() on this thread checks `stop`. Scopes nest. Workers apply the scope of their caller to
// all their threads.
class StopScope {
 public:
  explicit StopScope(std::stop_token stop) : own_(std::move(stop)), outer_(current_) { current_ = &own_; }
  // The scope of another thread, which lives longer; null for none.
  explicit StopScope(const std::stop_token* stop) : outer_(current_) { current_ = stop; }
  ~StopScope() { current_ = outer_; }
  StopScope(const StopScope&) = delete;
  StopScope& operator=(const StopScope&) = delete;

  // The token of this thread; null if there is none.
  static const std::stop_token* Current() { return current_; }

 private:
  static inline constinit thread_local const std::stop_token* current_ = nullptr;
  const std::stop_token own_;
  const std::stop_token* const outer_;
};

// Throws Stopped if a stop was requested. Costs a nanosecond. Computations of more than some milliseconds call it in
// their loops: at pivots, columns of a factorization, panels of a product.
inline void LookForStop() {
  if (const std::stop_token* stop = StopScope::Current(); stop && stop->stop_requested()) throw Stopped();
}

}  // namespace dlcs

#endif  // DLCS_CORE_PARALLEL_STOP_SCOPE_H_
