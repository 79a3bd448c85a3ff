// SPDX-License-Identifier: Apache-2.0
#include "server/call_registry.h"

namespace dlcs {

std::shared_ptr<SolveControl> CallRegistry::Register() {
  const std::lock_guard lock(mutex_);
  if (draining_) return nullptr;
  std::shared_ptr<SolveControl> control(new SolveControl, [this](SolveControl* done) {
    {
      const std::lock_guard deregistering(mutex_);
      calls_.erase(done);
      // Told under the lock: whoever waits may destroy the registry as soon as it is released.
      if (calls_.empty()) idle_.notify_all();
    }
    delete done;
  });
  calls_.insert(control.get());
  return control;
}

void CallRegistry::Drain() {
  const std::lock_guard lock(mutex_);
  draining_ = true;
}

void CallRegistry::StopAll(StopCause cause) {
  const std::lock_guard lock(mutex_);
  for (SolveControl* call : calls_) call->Stop(cause);
}

bool CallRegistry::WaitUntilIdle(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return idle_.wait_for(lock, timeout, [this] { return calls_.empty(); });
}

}  // namespace dlcs
