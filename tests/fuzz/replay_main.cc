// SPDX-License-Identifier: Apache-2.0
// Runs every file of the given folders, and every given file, in the order of their names: earlier findings are tested
// on every machine and with every compiler.
//
//     fuzz_replay TARGET FILE_OR_FOLDER...

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz_target.h"

namespace {

namespace fs = std::filesystem;

using Target = void (*)(const std::string& input);

const std::map<std::string, Target> kTargets = {
    {"deck", dlcs::fuzz::TryDeck},
    {"formula", dlcs::fuzz::TryFormula},
    {"gateway", dlcs::fuzz::TryGateway},
    {"job_request", dlcs::fuzz::TryJobRequest},
    {"lcp_file", dlcs::fuzz::TryLcpFile},
    {"matrix_market", dlcs::fuzz::TryMatrixMarket},
    {"members_file", dlcs::fuzz::TryMembersFile},
    {"problem_file", dlcs::fuzz::TryProblemFile},
    {"request", dlcs::fuzz::TryRequest},
    {"solve", dlcs::fuzz::TrySolve},
    {"state_archive", dlcs::fuzz::TryStateArchive},
};

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
  const auto target = kTargets.find(count > 1 ? words[1] : "");
  if (target == kTargets.end()) return std::fputs("fuzz_replay TARGET FILE_OR_FOLDER...: no such target\n", stderr), 1;
  std::vector<fs::path> files;
  for (int k = 2; k < count; ++k) AddFiles(words[k], files);
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return std::fprintf(stderr, "%s: cannot be read\n", file.c_str()), 1;
    const std::string input{std::istreambuf_iterator<char>(stream), {}};
    // Printed before the run, so that it is the last line if the target ends the program.
    std::printf("%s\n", file.c_str());
    std::fflush(stdout);
    target->second(input);
  }
  std::printf("%zu inputs tried\n", files.size());
  return files.empty() ? 1 : 0;
}
