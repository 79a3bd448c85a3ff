// SPDX-License-Identifier: Apache-2.0
// The terminal that a command writes to.

#ifndef DLCS_CLIENT_CLI_OUTPUT_TERMINAL_H_
#define DLCS_CLIENT_CLI_OUTPUT_TERMINAL_H_

#include <cstdio>

namespace dlcs::client {

// The width in characters of the terminal `stream`; 100 if it is not a terminal.
int WidthOf(std::FILE* stream);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_TERMINAL_H_
