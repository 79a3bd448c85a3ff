// SPDX-License-Identifier: Apache-2.0
// Text in lines of one width, counted in letters and not in bytes.

#ifndef DLCS_CLIENT_CLI_OUTPUT_WRAPPED_TEXT_H_
#define DLCS_CLIENT_CLI_OUTPUT_WRAPPED_TEXT_H_

#include <cstddef>
#include <cstdio>
#include <string>

namespace dlcs::client {

// Letters of UTF-8 text on the screen.
std::size_t LetterCount(const std::string& text);

// `text` with blanks behind it, up to `width` letters.
std::string Padded(const std::string& text, std::size_t width);

class Paragraphs {
 public:
  // Lines of `width` letters, at least 40, as far as words allow it.
  Paragraphs(int width, std::FILE* out);

  // One line as it is.
  void Line(const std::string& text);
  // `head` on the first line, as many blanks on those that follow.
  void Print(const std::string& head, const std::string& text);

 private:
  std::size_t width_;
  std::FILE* out_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_WRAPPED_TEXT_H_
