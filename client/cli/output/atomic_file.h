// SPDX-License-Identifier: Apache-2.0
// A file that appears completely or not at all.

#ifndef DLCS_CLIENT_CLI_OUTPUT_ATOMIC_FILE_H_
#define DLCS_CLIENT_CLI_OUTPUT_ATOMIC_FILE_H_

#include <cstdio>
#include <initializer_list>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dlcs::client {

// Writes to a temporary file in the same folder, and renames it in one step. An existing file is kept until then. An
// object that is destroyed without Commit() leaves no file. A pipe or a device at the path is not replaced, but written
// to directly.
class AtomicFile {
 public:
  // Errors: InvalidArgument if no file can be created at `path` (no such folder, no permission, a folder). Blocks until
  // a named pipe has a reader. Call it before long work, so that the result is not lost.
  static absl::StatusOr<std::unique_ptr<AtomicFile>> Create(const std::string& path);
  ~AtomicFile();

  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  std::FILE* stream() { return stream_; }
  const std::string& path() const { return path_; }
  // The path of the content until Commit(), for code that writes to it without stream().
  const std::string& written_path() const { return is_direct() ? path_ : temporary_; }

  // Errors: Internal if the content could not be written (disk full); then an existing file is unchanged.
  absl::Status Commit();
  // The same for incomplete content: the file gets the name with ".partial" appended, which path() then returns.
  absl::Status CommitPartial();

 private:
  AtomicFile(std::string path, std::string temporary, std::FILE* stream);

  bool is_direct() const { return temporary_.empty(); }

  std::string path_;
  std::string temporary_;  // empty after Commit(), and for pipes and devices
  std::FILE* stream_;      // null after Commit()
};

// "" and "-".
bool IsStandardOutput(const std::string& path);

// The file for `--output path`; null for standard output. Errors: as AtomicFile::Create(); InvalidArgument if it is the
// same file as one of `inputs`, or if it is the name of a format, which is meant for --format.
absl::StatusOr<std::unique_ptr<AtomicFile>> OpenOutput(const std::string& path,
                                                       std::initializer_list<std::string> inputs = {});

// Flushes `stream`; an error when anything written to it was lost.
absl::Status FlushStream(std::FILE* stream, const std::string& name);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_ATOMIC_FILE_H_
