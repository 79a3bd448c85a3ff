// SPDX-License-Identifier: Apache-2.0
#include "client/files/encoding.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "proto/shared/byte_order_mark.h"

namespace dlcs::client {
namespace {

// The length of the character in UTF-8 that `text` begins with; 0 if it begins with none.
std::size_t CharacterLength(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  const std::size_t length = lead < 0x80   ? 1
                             : lead < 0xc2 ? 0
                             : lead < 0xe0 ? 2
                             : lead < 0xf0 ? 3
                             : lead < 0xf5 ? 4
                                           : 0;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((static_cast<unsigned char>(text[k]) & 0xc0) != 0x80) return 0;
  }
  const auto second = static_cast<unsigned char>(length > 1 ? text[1] : 0);
  const bool is_overlong = (lead == 0xe0 && second < 0xa0) || (lead == 0xf0 && second < 0x90);
  const bool is_none = (lead == 0xed && second > 0x9f) || (lead == 0xf4 && second > 0x8f);
  return is_overlong || is_none ? 0 : length;
}

void AppendUtf8(char32_t letter, std::string& text) {
  const auto put = [&text](char32_t byte) { text += static_cast<char>(byte); };
  if (letter < 0x80) return put(letter);
  if (letter < 0x800) {
    put(0xc0 | letter >> 6);
  } else if (letter < 0x10000) {
    put(0xe0 | letter >> 12);
    put(0x80 | (letter >> 6 & 0x3f));
  } else {
    put(0xf0 | letter >> 18);
    put(0x80 | (letter >> 12 & 0x3f));
    put(0x80 | (letter >> 6 & 0x3f));
  }
  put(0x80 | (letter & 0x3f));
}

// The UTF-8 of `bytes` in UTF-16, whose units begin with the low byte or the high one; absent if they are none.
std::optional<std::string> FromUtf16(std::string_view bytes, bool low_first) {
  if (bytes.size() % 2 != 0) return std::nullopt;
  const auto unit = [&](std::size_t at) {
    const auto first = static_cast<unsigned char>(bytes[at]), second = static_cast<unsigned char>(bytes[at + 1]);
    return static_cast<char32_t>(low_first ? second << 8 | first : first << 8 | second);
  };
  std::string text;
  text.reserve(bytes.size() / 2);
  for (std::size_t at = 0; at < bytes.size(); at += 2) {
    char32_t letter = unit(at);
    if (letter >= 0xd800 && letter < 0xe000) {
      const char32_t low = letter < 0xdc00 && at + 2 < bytes.size() ? unit(at + 2) : 0;
      if (low < 0xdc00 || low >= 0xe000) return std::nullopt;
      letter = 0x10000 + ((letter - 0xd800) << 10) + (low - 0xdc00);
      at += 2;
    }
    AppendUtf8(letter, text);
  }
  return text;
}

// "UTF-16LE" and the like, where `bytes` are that.
std::string WideEncoding(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("\xff\xfe\0\0"sv) || bytes.starts_with("\0\0\xfe\xff"sv)) return "UTF-32";
  if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff")) return "UTF-16";
  const std::string_view begin = bytes.substr(0, 64);
  std::size_t zeros[2] = {0, 0};
  for (std::size_t k = 0; k < begin.size(); ++k) zeros[k % 2] += begin[k] == '\0';
  const std::size_t half = begin.size() / 2;
  if (half >= 2 && zeros[0] == 0 && 2 * zeros[1] > half) return "UTF-16LE";
  if (half >= 2 && zeros[1] == 0 && 2 * zeros[0] > half) return "UTF-16BE";
  return "";
}

}  // namespace

std::size_t FindInvalidUtf8(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = CharacterLength(text.substr(at));
    if (length == 0) return at;
    at += length;
  }
  return std::string_view::npos;
}

bool HasUtf8Letters(std::string_view text) {
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (CharacterLength(text.substr(at)) > 1) return true;
  }
  return false;
}

std::u32string LettersOf(std::string_view text) {
  std::u32string letters;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = std::max<std::size_t>(CharacterLength(text.substr(at)), 1);
    const auto lead = static_cast<unsigned char>(text[at]);
    char32_t letter = length == 1 ? lead : lead & (0x7fU >> length);
    for (std::size_t k = 1; k < length; ++k) letter = letter << 6 | (static_cast<unsigned char>(text[at + k]) & 0x3f);
    letters += letter;
    at += length;
  }
  return letters;
}

std::string FromLatin1(std::string_view text) {
  std::string converted;
  for (const char letter : text) {
    const auto byte = static_cast<unsigned char>(letter);
    if (byte < 0x80) {
      converted += letter;
    } else {
      converted += static_cast<char>(0xc0 | (byte >> 6));
      converted += static_cast<char>(0x80 | (byte & 0x3f));
    }
  }
  return converted;
}

std::string ExplainWideEncoding(std::string_view bytes) {
  const std::string wide = WideEncoding(bytes);
  if (wide.empty()) return "";
  return "is text in " + wide + "; save it as UTF-8, or convert it with iconv -f " + wide + " -t UTF-8";
}

std::string TextOf(std::string bytes) {
  std::string text;
  if (WideEncoding(bytes) == "UTF-16") {
    std::optional<std::string> converted = FromUtf16(std::string_view(bytes).substr(2), bytes.starts_with("\xff"));
    if (!converted) return bytes;
    text = *std::move(converted);
  } else {
    bytes.erase(0, bytes.size() - WithoutByteOrderMark(bytes).size());
    text = std::move(bytes);
  }
  if (text.find_first_of(std::string_view("\n\0", 2)) == std::string::npos)
    std::replace(text.begin(), text.end(), '\r', '\n');
  return text;
}

}  // namespace dlcs::client
