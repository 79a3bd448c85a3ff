// SPDX-License-Identifier: Apache-2.0
#include "core/number_text.h"

#include <charconv>
#include <cmath>

namespace dlcs {

std::string NumberText(double value) {
  if (std::isnan(value)) return "nan";  // without the sign that std::to_chars gives some of them
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

}  // namespace dlcs
