// SPDX-License-Identifier: Apache-2.0
// Tries every file of the given folders, and every given file, in the order of their names: what was found once, on
// every machine and with every compiler.
//
//     formula_fuzz FILE_OR_FOLDER...

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz_target.h"

namespace {

namespace fs = std::filesystem;

void AddFiles(const fs::path& path, std::vector<fs::path>& files) {
  if (!fs::is_directory(path)) return files.push_back(path);
  for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
}

// A small input must not ask for much memory. (The address sanitizer takes terabytes of addresses for itself.)
void LimitMemory() {
#ifndef __SANITIZE_ADDRESS__
  constexpr rlimit kLimit{rlim_t{2} << 30, rlim_t{2} << 30};
  setrlimit(RLIMIT_AS, &kLimit);
#endif
}

}  // namespace

int main(int count, char** words) {
  LimitMemory();
  std::vector<fs::path> files;
  for (int k = 1; k < count; ++k) AddFiles(words[k], files);
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return std::fprintf(stderr, "%s: cannot be read\n", file.c_str()), 1;
    const std::string input{std::istreambuf_iterator<char>(stream), {}};
    // Before, so that it is the last line where the target ends the program.
    std::printf("%s\n", file.c_str());
    std::fflush(stdout);
    dlcs::fuzz::Try(input);
  }
  std::printf("%zu inputs tried\n", files.size());
  return files.empty() ? 1 : 0;
}
