// SPDX-License-Identifier: Apache-2.0
#include "server/access/user_quota.h"

#include <chrono>

#include "server/wire/errors.h"

namespace dlcs {

absl::StatusOr<UserQuota::Ticket> UserQuota::Take(const std::string& user) {
  constexpr std::chrono::milliseconds kRetryAfter{5000};
  {
    const std::lock_guard lock(state_->mutex);
    int& taken = state_->taken[user];
    if (taken >= most_) return ServerBusy(limit_, most_, kRetryAfter);
    ++taken;
  }
  return Ticket(state_.get(), [state = state_, user](const void*) {
    const std::lock_guard lock(state->mutex);
    const auto entry = state->taken.find(user);
    if (--entry->second == 0) state->taken.erase(entry);
  });
}

}  // namespace dlcs
