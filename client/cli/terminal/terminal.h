// SPDX-License-Identifier: Apache-2.0
// The terminal that a command writes to.

#ifndef DLCS_CLIENT_CLI_TERMINAL_TERMINAL_H_
#define DLCS_CLIENT_CLI_TERMINAL_TERMINAL_H_

#include <cstdio>

namespace dlcs::client {

// The width in characters of the terminal `stream`; `otherwise` if it is not a terminal.
int WidthOf(std::FILE* stream, int otherwise = 100);
// Its height in lines; 24 if it is not a terminal.
int HeightOf(std::FILE* stream);

// Whether `stream` is a terminal whose lines can be redrawn (TERM is not "dumb").
bool CanRedraw(std::FILE* stream);
// Whether it is, and NO_COLOR (no-color.org) is not set.
bool UsesColor(std::FILE* stream);
// Whether the locale has other letters than those of ASCII.
bool UsesUtf8();

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_TERMINAL_TERMINAL_H_
