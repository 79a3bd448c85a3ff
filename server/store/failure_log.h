// SPDX-License-Identifier: Apache-2.0
// What an operator reads of a store that breaks and comes back.

#ifndef DLCS_SERVER_STORE_FAILURE_LOG_H_
#define DLCS_SERVER_STORE_FAILURE_LOG_H_

#include <mutex>
#include <string>

namespace dlcs::jobs {

// Safe from any thread.
class FailureLog {
 public:
  // A warning, where it is not the one before.
  void Failed(const std::string& failure);
  // That the store works again, where it has failed.
  void Recovered();

 private:
  std::mutex mutex_;
  std::string said_;  // empty while all is well
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_FAILURE_LOG_H_
