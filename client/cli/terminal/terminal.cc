// SPDX-License-Identifier: Apache-2.0
#include "client/cli/terminal/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace dlcs::client {

int WidthOf(std::FILE* stream, int otherwise) {
  winsize size{};
  const bool known = ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : otherwise;
}

int HeightOf(std::FILE* stream) {
  constexpr int kHeightWithoutTerminal = 24;
  winsize size{};
  const bool known = ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_row > 0;
  return known ? size.ws_row : kHeightWithoutTerminal;
}

bool CanRedraw(std::FILE* stream) {
  const char* const kind = std::getenv("TERM");
  return isatty(fileno(stream)) != 0 && kind != nullptr && std::string_view(kind) != "dumb";
}

bool UsesColor(std::FILE* stream) {
  const char* const no_color = std::getenv("NO_COLOR");
  return CanRedraw(stream) && (no_color == nullptr || *no_color == '\0');
}

bool UsesUtf8() {
  for (const char* const name : {"LC_ALL", "LC_CTYPE", "LANG"}) {  // the first that is set counts
    const char* const value = std::getenv(name);
    if (value == nullptr || *value == '\0') continue;
    const std::string_view locale(value);
    for (const std::string_view coding : {"UTF-8", "utf-8", "UTF8", "utf8"}) {
      if (locale.find(coding) != std::string_view::npos) return true;
    }
    return false;
  }
  return false;
}

}  // namespace dlcs::client
