// SPDX-License-Identifier: Apache-2.0
#include "server/access/watched_file.h"

#include <sys/stat.h>

#include "fmt/format.h"

namespace dlcs {

std::string FileStamps(const std::vector<std::string>& files) {
  std::string stamps;
  for (const std::string& file : files) {
    struct stat found {};
    if (stat(file.c_str(), &found) != 0) {
      stamps += "none;";
    } else {
      // The inode, since orchestrators replace files by links to others; and its change time, since a copy may keep the
      // modification time of the original.
      stamps += fmt::format("{}.{}.{}.{}.{}.{}.{};", found.st_dev, found.st_ino, found.st_size, found.st_mtim.tv_sec,
                            found.st_mtim.tv_nsec, found.st_ctim.tv_sec, found.st_ctim.tv_nsec);
    }
  }
  return stamps;
}

}  // namespace dlcs
