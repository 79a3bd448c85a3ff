// SPDX-License-Identifier: Apache-2.0
// The registry of running calls: stops them at shutdown, and waits until all are done.

#ifndef DLCS_SERVER_RPC_CALL_REGISTRY_H_
#define DLCS_SERVER_RPC_CALL_REGISTRY_H_

#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "server/session/solve_session.h"

namespace dlcs {

enum class CallKind {
  kCompute,  // uses a solver; continues while the server drains, and delivers partial results when it is stopped
  kStore,    // about jobs and uploads; stopped when the server drains, so that the client continues with another one
};

// Safe from any thread; must outlive the controls that it returned.
class CallRegistry {
 public:
  // The name by which a call can be stopped, and the user who may do so. Without a name only the server can stop it.
  struct CallName {
    std::string id;
    std::string user;
  };

  // The control of a new call; the call counts as running until the last copy is destroyed. Null after Drain().
  std::shared_ptr<SolveControl> Register(CallKind kind, CallName name = {});

  // Stops the call with this id and user (any user if absent). False if there is none.
  bool Stop(const std::string& id, const std::optional<std::string>& user, StopCause cause);

  // Admits no more calls, and stops those of kind kStore.
  void Drain();

  void StopAll(StopCause cause);

  // Waits until no call is running, or none that computes; false if `timeout` passed first.
  bool WaitUntilIdle(std::chrono::milliseconds timeout);
  bool WaitUntilComputed(std::chrono::milliseconds timeout);

 private:
  struct Call {
    CallKind kind;
    CallName name;
  };

  std::mutex mutex_;
  std::condition_variable ended_;
  bool draining_ = false;
  std::map<SolveControl*, Call> calls_;
  int computing_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_CALL_REGISTRY_H_
