// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/call_registry.h"

#include <utility>

namespace dlcs {

std::shared_ptr<SolveControl> CallRegistry::Register(CallName name) {
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
  calls_.emplace(control.get(), std::move(name));
  return control;
}

void CallRegistry::Drain() {
  const std::lock_guard lock(mutex_);
  draining_ = true;
}

bool CallRegistry::Stop(const std::string& id, const std::optional<std::string>& user, StopCause cause) {
  if (id.empty()) return false;
  const std::lock_guard lock(mutex_);
  for (const auto& [call, name] : calls_) {
    if (name.id != id || (user && name.user != *user)) continue;
    call->Stop(cause);
    return true;
  }
  return false;
}

void CallRegistry::StopAll(StopCause cause) {
  const std::lock_guard lock(mutex_);
  for (const auto& [call, name] : calls_) call->Stop(cause);
}

bool CallRegistry::WaitUntilIdle(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return idle_.wait_for(lock, timeout, [this] { return calls_.empty(); });
}

}  // namespace dlcs
