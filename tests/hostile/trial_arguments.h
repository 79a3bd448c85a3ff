// SPDX-License-Identifier: Apache-2.0
// What the commands that try random systems read and print.

#ifndef DLCS_TESTS_HOSTILE_COMMAND_LINE_H_
#define DLCS_TESTS_HOSTILE_COMMAND_LINE_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/hostile/trial.h"

namespace dlcs::hostile {

struct SeedRange {
  uint64_t begin, end;  // without `end`
};
// "A:B"
std::optional<SeedRange> ReadSeeds(const std::string& text);

// "1e-4,default,steps=1000"
std::vector<Asked> ReadAsked(const std::string& list);
std::string Text(const Asked& asked);

// A line "  what: 1 2 3"; none without seeds.
void PrintSeeds(const char* what, const std::vector<uint64_t>& seeds);

}  // namespace dlcs::hostile

#endif  // DLCS_TESTS_HOSTILE_COMMAND_LINE_H_
