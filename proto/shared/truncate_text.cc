// SPDX-License-Identifier: Apache-2.0
#include "proto/shared/truncate_text.h"

#include <algorithm>

namespace dlcs {

std::string TruncateUtf8(std::string text, std::size_t max_bytes) {
  if (text.size() <= max_bytes) return text;
  constexpr char kEllipsis[] = "...";
  std::size_t end = max_bytes - std::min(max_bytes, sizeof(kEllipsis) - 1);
  // Bytes 10xxxxxx continue a character; do not cut before one.
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  text.resize(end);
  return text + kEllipsis;
}

std::string JoinFirst(const std::vector<std::string>& names, std::size_t most) {
  std::string joined;
  for (std::size_t k = 0; k < names.size() && k <= most; ++k) {
    if (k > 0) joined += ", ";
    joined += k < most ? names[k] : "...";
  }
  return joined;
}

}  // namespace dlcs
