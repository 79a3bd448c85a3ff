// SPDX-License-Identifier: Apache-2.0
// Runs the built programs as people do.

#ifndef DLCS_TESTS_CLIENT_PROGRAM_H_
#define DLCS_TESTS_CLIENT_PROGRAM_H_

#include <cstdint>
#include <string>

namespace dlcs::client {

struct ProgramOutcome {
  int code = -1;  // exit code; 128 and more when a signal ended it
  std::string out;
  std::string err;
  // The most memory that the program had in use, or one in front of it in the prefix. Linux counts in what this process had
  // in use when it started them.
  std::int64_t peak_bytes = 0;
};

// Runs `dlcs` with `arguments`, as a shell reads them, in front of it `prefix` ("echo '{}' | ").
ProgramOutcome RunDlcs(const std::string& arguments, const std::string& prefix = "");

}  // namespace dlcs::client

#endif  // DLCS_TESTS_CLIENT_PROGRAM_H_
