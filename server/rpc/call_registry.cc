// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/call_registry.h"

#include <utility>

namespace dlcs {

std::shared_ptr<SolveControl> CallRegistry::Register(CallKind kind, CallName name) {
  const std::lock_guard lock(mutex_);
  if (draining_) return nullptr;
  std::shared_ptr<SolveControl> control(new SolveControl, [this, kind](SolveControl* done) {
    {
      const std::lock_guard deregistering(mutex_);
      calls_.erase(done);
      if (kind == CallKind::kCompute) --computing_;
      // Under the lock: the waiting thread may destroy the registry as soon as it is released.
      ended_.notify_all();
    }
    delete done;
  });
  calls_.emplace(control.get(), Call{kind, std::move(name)});
  if (kind == CallKind::kCompute) ++computing_;
  return control;
}

void CallRegistry::Drain() {
  const std::lock_guard lock(mutex_);
  draining_ = true;
  for (const auto& [control, call] : calls_) {
    if (call.kind == CallKind::kStore) control->Stop(StopCause::kShutdown);
  }
}

bool CallRegistry::Stop(const std::string& id, const std::optional<std::string>& user, StopCause cause) {
  if (id.empty()) return false;
  const std::lock_guard lock(mutex_);
  for (const auto& [control, call] : calls_) {
    if (call.name.id != id || (user && call.name.user != *user)) continue;
    control->Stop(cause);
    return true;
  }
  return false;
}

void CallRegistry::StopAll(StopCause cause) {
  const std::lock_guard lock(mutex_);
  for (const auto& [control, call] : calls_) control->Stop(cause);
}

bool CallRegistry::WaitUntilIdle(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return ended_.wait_for(lock, timeout, [this] { return calls_.empty(); });
}

bool CallRegistry::WaitUntilComputed(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return ended_.wait_for(lock, timeout, [this] { return computing_ == 0; });
}

}  // namespace dlcs
