// SPDX-License-Identifier: Apache-2.0
// Tokens: 256 random bits as text, of which servers keep only a hash.

#ifndef DLCS_SERVER_ACCESS_TOKEN_H_
#define DLCS_SERVER_ACCESS_TOKEN_H_

#include <string>
#include <string_view>

namespace dlcs {

// "dlcs_" and 43 letters, digits, - and _: safe in headers, files and shells. The prefix lets secret scanners find it.
std::string RandomToken();

// SHA-256, 32 bytes. A token cannot be guessed, unlike a password, so that no slow hash is needed to hide it.
std::string TokenHash(std::string_view token);

// "sha256:" and the hash in 64 hexadecimal digits, as written in a tokens file.
std::string TokenHashText(std::string_view token);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_TOKEN_H_
