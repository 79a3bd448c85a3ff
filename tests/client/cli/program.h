// SPDX-License-Identifier: Apache-2.0
// Runs the built programs as people do.

#ifndef DLCS_TESTS_CLIENT_CLI_PROGRAM_H_
#define DLCS_TESTS_CLIENT_CLI_PROGRAM_H_

#include <cstdint>
#include <string>

namespace dlcs::client {

struct ProgramOutcome {
  int code = -1;  // exit code; 128 and more when a signal ended it
  std::string out;
  std::string err;
  // The peak memory of the program, or of one in the prefix. Linux includes the memory that this process used when it
  // started them.
  std::int64_t peak_bytes = 0;
};

// Runs `dlcs` with `arguments`, as a shell reads them. `prefix` is put in front ("echo '{}' | ").
ProgramOutcome RunDlcs(const std::string& arguments, const std::string& prefix = "");

// A problem with a state and a pair that is solved in a few milliseconds.
inline constexpr const char* kEasyProblem =
    R"json({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[2]], "x0": [1], "T": 4, "f": ["sin(t)"], "g": [-1]})json";

// Runs `dlcs solve` with `options` on the problem `json`, a text without single quotes.
ProgramOutcome SolveText(const std::string& json, const std::string& options);

}  // namespace dlcs::client

#endif  // DLCS_TESTS_CLIENT_CLI_PROGRAM_H_
