// SPDX-License-Identifier: Apache-2.0
// UTF-8 and Latin-1.

#ifndef DLCS_CLIENT_FILES_ENCODING_H_
#define DLCS_CLIENT_FILES_ENCODING_H_

#include <cstddef>
#include <string>
#include <string_view>

namespace dlcs::client {

// The first byte of `text` that is not valid UTF-8; npos if there is none. Overlong forms and surrogates are not valid.
std::size_t FindInvalidUtf8(std::string_view text);

// The characters of `text`, in valid UTF-8.
std::u32string LettersOf(std::string_view text);

// The UTF-8 of a text in Latin-1.
std::string FromLatin1(std::string_view text);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_ENCODING_H_
