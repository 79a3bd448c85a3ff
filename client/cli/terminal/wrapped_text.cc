// SPDX-License-Identifier: Apache-2.0
#include "client/cli/terminal/wrapped_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <sstream>

namespace dlcs::client {

std::size_t LetterCount(const std::string& text) {
  // All bytes but those that continue a character.
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string FirstLetters(const std::string& text, std::size_t count) {
  std::string first;
  bool in_escape = false, fits = true;
  std::size_t letters = 0;
  for (const char c : text) {
    if (c == '\x1b') in_escape = true;
    if (!in_escape && (static_cast<unsigned char>(c) & 0xC0) != 0x80) fits = ++letters <= count;
    if (in_escape || fits) first += c;
    if (in_escape && std::isalpha(static_cast<unsigned char>(c)) != 0) in_escape = false;  // it ends with a letter
  }
  return first;
}

std::string Padded(const std::string& text, std::size_t width) {
  const std::size_t letters = LetterCount(text);
  return text + std::string(letters < width ? width - letters : 0, ' ');
}

Paragraphs::Paragraphs(int width, std::FILE* out) : width_(static_cast<std::size_t>(std::max(width, 40))), out_(out) {}

void Paragraphs::Line(const std::string& text) { fmt::print(out_, "{}\n", text); }

void Paragraphs::Print(const std::string& head, const std::string& text) {
  const std::size_t indent = LetterCount(head);
  std::string line = head;
  bool fresh = true;
  std::istringstream words(text);
  for (std::string word; words >> word; fresh = false) {
    if (!fresh && LetterCount(line) + 1 + LetterCount(word) > width_) {
      Line(line);
      line = std::string(indent, ' ');
      fresh = true;
    }
    line += (fresh ? "" : " ") + word;
  }
  Line(line);
}

}  // namespace dlcs::client
