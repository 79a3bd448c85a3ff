// SPDX-License-Identifier: Apache-2.0
// A folder that is deleted at the end of the test.

#ifndef DLCS_TESTS_SERVER_STORE_TEMPORARY_FOLDER_H_
#define DLCS_TESTS_SERVER_STORE_TEMPORARY_FOLDER_H_

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace dlcs::jobs::testing {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "dlcs-jobs-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string File(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_STORE_TEMPORARY_FOLDER_H_
