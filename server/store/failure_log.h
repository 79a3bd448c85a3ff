// SPDX-License-Identifier: Apache-2.0
// Logs failures and recoveries of a store.

#ifndef DLCS_SERVER_STORE_FAILURE_LOG_H_
#define DLCS_SERVER_STORE_FAILURE_LOG_H_

#include <mutex>
#include <string>

namespace dlcs::jobs {

// Safe from any thread.
class FailureLog {
 public:
  // Logs a warning, unless it is the same as the last one.
  void Failed(const std::string& failure);
  // Logs that the store works again, if it had failed.
  void Recovered();

 private:
  std::mutex mutex_;
  std::string last_failure_;  // the last warning; empty while the store works
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_FAILURE_LOG_H_
