// SPDX-License-Identifier: Apache-2.0
// Phrases that the outputs share.

#ifndef DLCS_CLIENT_CLI_TERMINAL_WORDS_H_
#define DLCS_CLIENT_CLI_TERMINAL_WORDS_H_

#include <fmt/format.h>

#include <cstdint>
#include <string>

namespace dlcs::client {

// "1 step", "1000 steps".
inline std::string Count(std::int64_t count, const char* one) {
  return fmt::format("{} {}{}", count, one, count == 1 ? "" : "s");
}

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_TERMINAL_WORDS_H_
