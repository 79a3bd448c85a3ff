// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/terminal.h"

#include <sys/ioctl.h>

namespace dlcs::client {

int WidthOf(std::FILE* stream) {
  constexpr int kWidthWithoutTerminal = 100;
  winsize size{};
  const bool known = ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : kWidthWithoutTerminal;
}

}  // namespace dlcs::client
