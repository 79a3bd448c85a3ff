// SPDX-License-Identifier: Apache-2.0
// The byte order mark with which some editors begin a text in UTF-8.

#ifndef DLCS_PROTO_SHARED_BYTE_ORDER_MARK_H_
#define DLCS_PROTO_SHARED_BYTE_ORDER_MARK_H_

#include <string_view>

namespace dlcs {

inline constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

// `text` behind its mark, if it begins with one. The mark is no part of a text, so everything that reads a file as text
// passes it by here.
inline std::string_view WithoutByteOrderMark(std::string_view text) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  return text;
}

}  // namespace dlcs

#endif  // DLCS_PROTO_SHARED_BYTE_ORDER_MARK_H_
