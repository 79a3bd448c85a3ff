// SPDX-License-Identifier: Apache-2.0
// A file that is either there whole or not there.

#ifndef DLCS_CLIENT_CLI_OUTPUT_ATOMIC_FILE_H_
#define DLCS_CLIENT_CLI_OUTPUT_ATOMIC_FILE_H_

#include <cstdio>
#include <initializer_list>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dlcs::client {

// Collects its content next to its place and moves there in one step. What was there before stays until
// then; an object that is destroyed without Commit() leaves nothing behind.
class AtomicFile {
 public:
  // Errors: InvalidArgument when no file can be made at `path` (no such folder, no permission, a folder).
  // To be called before long work, so that it is not lost for want of a place.
  static absl::StatusOr<std::unique_ptr<AtomicFile>> Create(const std::string& path);
  ~AtomicFile();

  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  std::FILE* stream() { return stream_; }
  const std::string& path() const { return path_; }

  // Errors: Internal when the content could not be written (disk full); then nothing has changed.
  absl::Status Commit();
  // The same under the path with ".partial" behind it, which path() then is: what is not whole does not get the name of
  // what is.
  absl::Status CommitPartial();

 private:
  AtomicFile(std::string path, std::string temporary, std::FILE* stream);

  std::string path_;
  std::string temporary_;  // empty once committed
  std::FILE* stream_;      // null once committed
};

// "" and "-".
bool IsStandardOutput(const std::string& path);

// The file for `--output path`; null where that is standard output. Errors: as AtomicFile::Create(); InvalidArgument
// where it is one of `inputs`, by this or another name, or the name of a format, which was meant for --format.
absl::StatusOr<std::unique_ptr<AtomicFile>> OpenOutput(const std::string& path,
                                                       std::initializer_list<std::string> inputs = {});

// Flushes `stream`; an error when anything written to it was lost.
absl::Status FlushStream(std::FILE* stream, const std::string& name);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_ATOMIC_FILE_H_
