// SPDX-License-Identifier: Apache-2.0
// A value that is read from files, and read again when they change.

#ifndef DLCS_SERVER_ACCESS_WATCHED_FILE_H_
#define DLCS_SERVER_ACCESS_WATCHED_FILE_H_

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "spdlog/spdlog.h"

namespace dlcs {

// A text that changes when one of the files does: their identities, sizes and modification times. A missing file has a
// stamp too.
std::string FileStamps(const std::vector<std::string>& files);

// The last `Value` that was good. Safe from any thread.
template <typename Value>
class WatchedFile {
 public:
  using Load = std::function<absl::StatusOr<Value>()>;

  // Errors: those of `load`.
  static absl::StatusOr<std::unique_ptr<WatchedFile>> Open(std::vector<std::string> files, Load load) {
    std::unique_ptr<WatchedFile> result(new WatchedFile(std::move(files), std::move(load)));
    result->stamps_ = FileStamps(result->files_);
    absl::StatusOr<Value> value = result->load_();
    if (!value.ok()) return value.status();
    result->value_ = std::make_shared<const Value>(*std::move(value));
    return result;
  }

  std::shared_ptr<const Value> get() const {
    const std::lock_guard lock(mutex_);
    return value_;
  }

  // Reads the files again if they have changed, and logs the outcome. If they cannot be used (half written, invalid)
  // the old value is kept. One thread at a time.
  void Refresh() {
    std::string stamps = FileStamps(files_);
    if (stamps == stamps_) return;
    // Recorded before reading, so that a change during the read is noticed by the next Refresh().
    stamps_ = std::move(stamps);
    absl::StatusOr<Value> value = load_();
    if (!value.ok()) {
      return spdlog::error("{}; the previous content remains in use", std::string(value.status().message()));
    }
    spdlog::info("{}: read again", files_.front());
    const std::lock_guard lock(mutex_);
    value_ = std::make_shared<const Value>(*std::move(value));
  }

 private:
  WatchedFile(std::vector<std::string> files, Load load) : files_(std::move(files)), load_(std::move(load)) {}

  const std::vector<std::string> files_;
  const Load load_;
  std::string stamps_;
  mutable std::mutex mutex_;
  std::shared_ptr<const Value> value_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_WATCHED_FILE_H_
