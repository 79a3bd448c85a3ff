// SPDX-License-Identifier: Apache-2.0
#include "server/store/failure_log.h"

#include "spdlog/spdlog.h"

namespace dlcs::jobs {

void FailureLog::Failed(const std::string& failure) {
  const std::lock_guard lock(mutex_);
  if (failure != said_) spdlog::warn("{}", failure);
  said_ = failure;
}

void FailureLog::Recovered() {
  const std::lock_guard lock(mutex_);
  if (!said_.empty()) spdlog::info("job store: works again");
  said_.clear();
}

}  // namespace dlcs::jobs
