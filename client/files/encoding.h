// SPDX-License-Identifier: Apache-2.0
// Encodings of text: UTF-8, which the program uses throughout, Latin-1 and UTF-16.

#ifndef DLCS_CLIENT_FILES_ENCODING_H_
#define DLCS_CLIENT_FILES_ENCODING_H_

#include <cstddef>
#include <string>
#include <string_view>

namespace dlcs::client {

// The first byte of `text` that is not valid UTF-8; npos if there is none. Overlong forms and surrogates are not valid.
std::size_t FindInvalidUtf8(std::string_view text);

// Whether `text` has letters of two bytes and more in UTF-8, besides others or not.
bool HasUtf8Letters(std::string_view text);

// The characters of `text`, in valid UTF-8.
std::u32string LettersOf(std::string_view text);

// The UTF-8 of a text in Latin-1.
std::string FromLatin1(std::string_view text);

// Where `bytes` are UTF-16 or UTF-32, by their byte order mark or because every other byte of their begin is zero: that
// they are, and what to do about it. Empty otherwise.
std::string ExplainWideEncoding(std::string_view bytes);

// The text for which the bytes of a file stand: without the byte order mark of UTF-8, or converted from UTF-16 where
// the mark of that begins it; with '\n' for each '\r' where the file has no '\n', as old Macs write it. Broken UTF-16,
// bytes with a zero, as files of arrays have them, and all else stay as they are.
std::string TextOf(std::string bytes);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_ENCODING_H_
