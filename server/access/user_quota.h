// SPDX-License-Identifier: Apache-2.0
// Limits how many of something each user may have at the same time.

#ifndef DLCS_SERVER_ACCESS_USER_QUOTA_H_
#define DLCS_SERVER_ACCESS_USER_QUOTA_H_

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/statusor.h"

namespace dlcs {

// Safe from any thread.
class UserQuota {
 public:
  // Counts as one until it is destroyed.
  using Ticket = std::shared_ptr<const void>;

  // `limit` is the name for messages, that of the flag: "max_watches_per_user".
  UserQuota(std::string limit, int most) : state_(std::make_shared<State>()), limit_(std::move(limit)), most_(most) {}

  // Errors: ServerBusy if `user` has as many as allowed.
  absl::StatusOr<Ticket> Take(const std::string& user);

 private:
  struct State {
    std::mutex mutex;
    std::map<std::string, int> taken;  // per user; no entries with 0
  };

  const std::shared_ptr<State> state_;  // tickets may outlive the quota
  const std::string limit_;
  const int most_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_USER_QUOTA_H_
