// SPDX-License-Identifier: Apache-2.0
// The terminal that a command writes to.

#ifndef DLCS_CLIENT_CLI_OUTPUT_TERMINAL_H_
#define DLCS_CLIENT_CLI_OUTPUT_TERMINAL_H_

#include <cstdio>

namespace dlcs::client {

// Letters in a line of the terminal behind `stream`, or 100 where it is none.
int WidthOf(std::FILE* stream);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_TERMINAL_H_
