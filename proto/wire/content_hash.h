// SPDX-License-Identifier: Apache-2.0
// What a text of bytes is known by, on both ends.

#ifndef DLCS_PROTO_WIRE_CONTENT_HASH_H_
#define DLCS_PROTO_WIRE_CONTENT_HASH_H_

#include <string>
#include <string_view>

namespace dlcs {

// SHA-256: 32 bytes. Nobody finds two contents with the same one.
std::string ContentHash(std::string_view content);

}  // namespace dlcs

#endif  // DLCS_PROTO_WIRE_CONTENT_HASH_H_
