// SPDX-License-Identifier: Apache-2.0
#include "server/store/store_location.h"

#include <unistd.h>

#include <filesystem>
#include <system_error>

#include "fmt/format.h"
#include "server/store/open_store.h"

namespace dlcs {

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
