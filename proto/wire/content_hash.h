// SPDX-License-Identifier: Apache-2.0
// The hash that identifies uploaded contents.

#ifndef DLCS_PROTO_WIRE_CONTENT_HASH_H_
#define DLCS_PROTO_WIRE_CONTENT_HASH_H_

#include <string>
#include <string_view>

namespace dlcs {

// SHA-256: 32 bytes.
std::string ContentHash(std::string_view content);

}  // namespace dlcs

#endif  // DLCS_PROTO_WIRE_CONTENT_HASH_H_
