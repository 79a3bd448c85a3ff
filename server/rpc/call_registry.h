// SPDX-License-Identifier: Apache-2.0
// The calls that are under way: which to stop when the server shuts down, and when all are done.

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
  kCompute,  // takes a solver; continues while the server drains, and delivers what it has when it is stopped
  kStore,    // about jobs and uploads; stopped when the server drains, so that the client continues at another one
};

// Safe from any thread; must outlive the controls it gave out.
class CallRegistry {
 public:
  // Who may stop a call, and by which name; others than the server only where it has one.
  struct CallName {
    std::string id;
    std::string user;
  };

  // A new call's control; the call is under way until the last copy is gone. Null once Drain() was called.
  std::shared_ptr<SolveControl> Register(CallKind kind, CallName name = {});

  // Stops the call of that id and user, or of any user where that is absent. False where none is under way.
  bool Stop(const std::string& id, const std::optional<std::string>& user, StopCause cause);

  // No new calls from now on; stops those about the store.
  void Drain();

  void StopAll(StopCause cause);

  // Waits until no call is under way, or none that computes; false when `timeout` passed first.
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
