// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

namespace dlcs::client {
namespace {

absl::Status CannotWrite(const std::string& path, int error) {
  return absl::InvalidArgumentError(
      fmt::format("cannot write {}: {}; choose another place", path, std::strerror(error)));
}

// The mode of a new file; mkstemp uses 0600 and ignores the umask.
mode_t NewFileMode() {
  const mode_t mask = umask(0);
  umask(mask);
  return 0666 & ~mask;
}

}  // namespace

absl::StatusOr<std::unique_ptr<AtomicFile>> AtomicFile::Create(const std::string& path) {
  std::error_code ignored;
  // A link is kept: its target is replaced.
  std::filesystem::path target = path;
  if (std::filesystem::is_symlink(target, ignored)) target = std::filesystem::weakly_canonical(target, ignored);
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  if (std::filesystem::is_directory(status)) return CannotWrite(path, EISDIR);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    // A pipe or a device: there is nothing to keep, and a file must not take its place.
    const int descriptor = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) return CannotWrite(path, errno);
    return std::unique_ptr<AtomicFile>(new AtomicFile(path, "", fdopen(descriptor, "wb")));
  }
  std::string temporary = target.string() + ".XXXXXX";
  const int descriptor = mkstemp(temporary.data());
  if (descriptor < 0) return CannotWrite(path, errno);
  fchmod(descriptor, NewFileMode());
  return std::unique_ptr<AtomicFile>(new AtomicFile(target.string(), std::move(temporary), fdopen(descriptor, "wb")));
}

AtomicFile::AtomicFile(std::string path, std::string temporary, std::FILE* stream)
    : path_(std::move(path)), temporary_(std::move(temporary)), stream_(stream) {}

AtomicFile::~AtomicFile() {
  if (stream_ != nullptr) std::fclose(stream_);
  if (!temporary_.empty()) unlink(temporary_.c_str());
}

absl::Status AtomicFile::Commit() {
  const absl::Status written = FlushStream(stream_, path_);
  if (!written.ok()) return written;
  // Without this a power cut may leave an empty file with the new name.
  const bool synced = is_direct() || fsync(fileno(stream_)) == 0;
  const bool closed = std::fclose(std::exchange(stream_, nullptr)) == 0;
  if (!synced || !closed || (!is_direct() && rename(temporary_.c_str(), path_.c_str()) != 0)) {
    return absl::InternalError(fmt::format("cannot write {}: {}", path_, std::strerror(errno)));
  }
  temporary_.clear();  // it is there no more
  return absl::OkStatus();
}

absl::Status AtomicFile::CommitPartial() {
  if (!is_direct()) path_ += ".partial";
  return Commit();
}

bool IsStandardOutput(const std::string& path) { return path.empty() || path == "-"; }

absl::StatusOr<std::unique_ptr<AtomicFile>> OpenOutput(const std::string& path,
                                                       std::initializer_list<std::string> inputs) {
  if (IsStandardOutput(path)) return nullptr;
  const std::initializer_list<std::string_view> formats = {"table", "json", "csv", "npy", "npz", "hdf5", "mat", "raw"};
  if (std::find(formats.begin(), formats.end(), path) != formats.end()) {
    return absl::InvalidArgumentError(
        fmt::format("--output {}: would be a file of that name; did you mean --format {}? Write ./{} for the file",
                    path, path, path));
  }
  for (const std::string& input : inputs) {
    std::error_code ignored;
    if (input != "-" && std::filesystem::equivalent(input, path, ignored)) {
      return absl::InvalidArgumentError(
          fmt::format("--output {}: is the input {}, which it would replace; choose another name", path, input));
    }
  }
  return AtomicFile::Create(path);
}

absl::Status FlushStream(std::FILE* stream, const std::string& name) {
  if (std::fflush(stream) == 0 && std::ferror(stream) == 0) return absl::OkStatus();
  return absl::InternalError(fmt::format("cannot write {}: {}; is the disk full?", name, std::strerror(errno)));
}

}  // namespace dlcs::client
