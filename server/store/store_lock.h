// SPDX-License-Identifier: Apache-2.0
// One dlcsd for a file of jobs.

#ifndef DLCS_SERVER_STORE_STORE_LOCK_H_
#define DLCS_SERVER_STORE_STORE_LOCK_H_

#include <string>

#include "absl/status/statusor.h"

namespace dlcs {

// Holds a file of jobs for this process, for as long as it lives: a second server would take the running jobs of the
// first for those of an earlier life of its own. What is locked is a file beside it, PATH.lock, which stays; a server
// that was killed holds nothing. The address of a database, and no store, need no lock.
class StoreLock {
 public:
  // Errors: FailedPrecondition where another process holds it, or it cannot be made; with the path.
  static absl::StatusOr<StoreLock> Take(const std::string& store);

  StoreLock(StoreLock&& other) noexcept;
  StoreLock& operator=(StoreLock&&) = delete;
  ~StoreLock();

 private:
  explicit StoreLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;  // -1: nothing is locked
};

}  // namespace dlcs

#endif  // DLCS_SERVER_STORE_STORE_LOCK_H_
