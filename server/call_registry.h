// SPDX-License-Identifier: Apache-2.0
// The calls that are under way: who is to be told when the server shuts down, and when all are done.

#ifndef DLCS_SERVER_CALL_REGISTRY_H_
#define DLCS_SERVER_CALL_REGISTRY_H_

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <set>

#include "server/solve_session.h"

namespace dlcs {

// Safe from any thread; must outlive the controls it gave out.
class CallRegistry {
 public:
  // A new call's control; the call is under way until the last copy is gone. Null once Drain() was called.
  std::shared_ptr<SolveControl> Register();

  // No new calls from now on.
  void Drain();

  void StopAll(StopCause cause);

  // Waits until no call is under way; false when `timeout` passed first.
  bool WaitUntilIdle(std::chrono::milliseconds timeout);

 private:
  std::mutex mutex_;
  std::condition_variable idle_;
  bool draining_ = false;
  std::set<SolveControl*> calls_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_CALL_REGISTRY_H_
