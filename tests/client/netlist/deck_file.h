// SPDX-License-Identifier: Apache-2.0
// A deck in a file of the test that runs.

#ifndef DLCS_TESTS_CLIENT_NETLIST_DECK_FILE_H_
#define DLCS_TESTS_CLIENT_NETLIST_DECK_FILE_H_

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

namespace dlcs::client {

// Writes a title, `lines` and .end, and returns the path.
inline std::string WriteDeck(const std::string& lines) {
  const std::string path =
      fmt::format("{}{}.cir", ::testing::TempDir(), ::testing::UnitTest::GetInstance()->current_test_info()->name());
  std::ofstream(path) << "title\n" << lines << ".end\n";
  return path;
}

}  // namespace dlcs::client

#endif  // DLCS_TESTS_CLIENT_NETLIST_DECK_FILE_H_
