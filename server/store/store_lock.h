// SPDX-License-Identifier: Apache-2.0
// Ensures that only one dlcsd uses a store file.

#ifndef DLCS_SERVER_STORE_STORE_LOCK_H_
#define DLCS_SERVER_STORE_STORE_LOCK_H_

#include <string>

#include "absl/status/statusor.h"

namespace dlcs {

// Locks a store file for this process as long as it lives: a second server would mistake the running jobs of the first
// one for its own from before a restart. The lock is on PATH.lock, which is not deleted; the kernel releases it when
// the process ends. Databases, and servers without a store, need no lock.
class StoreLock {
 public:
  // Errors: FailedPrecondition with the path, if another process holds the lock or it cannot be created.
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
