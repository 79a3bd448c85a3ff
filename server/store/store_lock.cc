// SPDX-License-Identifier: Apache-2.0
#include "server/store/store_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "fmt/format.h"
#include "server/store/open_store.h"

namespace dlcs {

absl::StatusOr<StoreLock> StoreLock::Take(const std::string& store) {
  if (store.empty() || jobs::IsShared(store)) return StoreLock(-1);
  const std::string path = store + ".lock";
  StoreLock lock(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  const auto refuse = [&](const std::string& why) {
    return absl::FailedPreconditionError(fmt::format("--store {}: {}", store, why));
  };
  if (lock.descriptor_ < 0) return refuse(fmt::format("cannot make {}: {}", path, std::strerror(errno)));
  if (flock(lock.descriptor_, LOCK_EX | LOCK_NB) != 0) {
    return refuse(errno == EWOULDBLOCK
                      ? "another dlcsd uses it. Only one can use a file at a time; several can share PostgreSQL"
                      : fmt::format("cannot lock {}: {}", path, std::strerror(errno)));
  }
  return lock;
}

StoreLock::StoreLock(StoreLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

StoreLock::~StoreLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

}  // namespace dlcs
