// SPDX-License-Identifier: Apache-2.0
#include "server/store/failure_log.h"

#include "spdlog/spdlog.h"

namespace dlcs::jobs {

void FailureLog::Failed(const std::string& failure) {
  const std::lock_guard lock(mutex_);
  if (failure != last_failure_) spdlog::warn("{}", failure);
  last_failure_ = failure;
}

void FailureLog::Recovered() {
  const std::lock_guard lock(mutex_);
  if (!last_failure_.empty()) spdlog::info("job store: works again");
  last_failure_.clear();
}

}  // namespace dlcs::jobs
