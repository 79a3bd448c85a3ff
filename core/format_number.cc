// SPDX-License-Identifier: Apache-2.0
#include "core/format_number.h"

#include <charconv>
#include <cmath>

namespace dlcs {

namespace {

// `format` holds what std::to_chars() takes after the value.
template <typename... Format>
std::string Text(double value, Format... format) {
  if (std::isnan(value)) return "nan";  // without the sign that std::to_chars gives some of them
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value, format...).ptr};
}

}  // namespace

std::string NumberText(double value) { return Text(value); }

std::string FormatNumber(double value) { return Text(value, std::chars_format::general, 6); }

std::string ShapeText(Index rows, Index columns) { return std::to_string(rows) + "x" + std::to_string(columns); }

std::string ListText(const std::vector<std::string>& words) {
  std::string list;
  for (std::size_t k = 0; k < words.size(); ++k) {
    list += (k == 0 ? "" : k + 1 == words.size() ? " and " : ", ") + words[k];
  }
  return list;
}

}  // namespace dlcs
