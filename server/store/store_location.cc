// SPDX-License-Identifier: Apache-2.0
#include "server/store/store_location.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "fmt/format.h"
#include "server/store/open_store.h"

namespace dlcs {
namespace {

// Whether SQLite may take the file: it is empty, or begins as every database does. One that cannot be read is judged
// when it is opened.
bool MayBeDatabase(const std::string& path) {
  constexpr std::string_view kBegin("SQLite format 3\0", 16);
  std::ifstream file(path, std::ios::binary);
  std::string begin(kBegin.size(), '\0');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  return begin.empty() || begin == kBegin;
}

}  // namespace

absl::Status CheckStoreLocation(const std::string& store) {
  namespace fs = std::filesystem;
  if (store.empty() || jobs::IsShared(store)) return absl::OkStatus();
  const auto refuse = [&](const std::string& rule) {
    return absl::InvalidArgumentError(fmt::format("--store {}: {}", store, rule));
  };
  if (store.find("://") != std::string::npos) return refuse("must be a file, or begin with postgresql://");
  std::error_code error;
  const fs::file_status file = fs::status(store, error);
  if (fs::exists(file)) {
    if (!fs::is_regular_file(file)) return refuse("must be a file");
    if (access(store.c_str(), R_OK | W_OK) != 0) return refuse("this user must be allowed to read and to write it");
    if (!MayBeDatabase(store)) {
      return refuse("is no SQLite database, and is left as it is; must be a store that dlcsd made, or a new file");
    }
  }
  fs::path folder = fs::path(store).parent_path();
  if (folder.empty()) folder = ".";
  if (!fs::is_directory(folder, error)) return refuse(fmt::format("the folder {} must exist", folder.string()));
  // SQLite keeps its log beside the file.
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    return refuse(fmt::format("this user must be allowed to create files in {}", folder.string()));
  }
  return absl::OkStatus();
}

}  // namespace dlcs
