// SPDX-License-Identifier: Apache-2.0
// Shortens text for messages.

#ifndef DLCS_PROTO_SHARED_TRUNCATE_TEXT_H_
#define DLCS_PROTO_SHARED_TRUNCATE_TEXT_H_

#include <cstddef>
#include <string>
#include <vector>

namespace dlcs {

// At most `max_bytes` of `text`. Longer text is cut between characters (UTF-8) and ends with "...".
std::string TruncateUtf8(std::string text, std::size_t max_bytes);

// "a, b, c"; of more than `most` names the first ones, and "...".
std::string JoinFirst(const std::vector<std::string>& names, std::size_t most);

}  // namespace dlcs

#endif  // DLCS_PROTO_SHARED_TRUNCATE_TEXT_H_
