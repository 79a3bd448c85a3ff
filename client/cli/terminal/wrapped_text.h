// SPDX-License-Identifier: Apache-2.0
// Wraps text to a width counted in characters, not in bytes.

#ifndef DLCS_CLIENT_CLI_TERMINAL_WRAPPED_TEXT_H_
#define DLCS_CLIENT_CLI_TERMINAL_WRAPPED_TEXT_H_

#include <cstddef>
#include <cstdio>
#include <string>

namespace dlcs::client {

// The number of characters of UTF-8 text.
std::size_t LetterCount(const std::string& text);

// The first `count` characters of `text`, and all its escape sequences, such as those of colors.
std::string FirstLetters(const std::string& text, std::size_t count);

// `text` padded with blanks to `width` characters.
std::string Padded(const std::string& text, std::size_t width);

class Paragraphs {
 public:
  // Lines have at most `width` characters (at least 40), unless a word is longer.
  Paragraphs(int width, std::FILE* out);

  // Prints one line unchanged.
  void Line(const std::string& text);
  // Prints `text` after `head`; continuation lines are indented by the width of `head`.
  void Print(const std::string& head, const std::string& text);

 private:
  std::size_t width_;
  std::FILE* out_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_TERMINAL_WRAPPED_TEXT_H_
