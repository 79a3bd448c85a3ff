// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/result_page.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "client/cli/output/exit_code.h"
#include "client/cli/output/result_output.h"
#include "client/cli/terminal/terminal.h"
#include "client/cli/terminal/wrapped_text.h"

namespace dlcs::client {
namespace {

const char* ColorOf(const v1::Summary& summary) {
  switch (ExitCodeOf(summary)) {
    case kSolved:
      return "\x1b[32m";  // green
    case kNoAnswer:
    case kBadInput:
      return "\x1b[31m";  // red
    case kServiceFailed:
    case kInterrupted:
    case kTerminated:
      break;
  }
  return "\x1b[33m";  // yellow
}

std::string TableText(const std::string& name, const SolveResult& result, int width) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* const paper = open_memstream(&text, &size);
  PrintTable(name, result, width, paper);
  std::fclose(paper);
  std::string table(text, size);
  std::free(text);
  return table;
}

}  // namespace

std::string Wrapped(const std::string& line, std::size_t width) {
  if (LetterCount(line) <= width) return line;
  // The label ends at the first two blanks after the indentation.
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t gap = line.find("  ", begin);
  const std::size_t label = gap == std::string::npos ? begin : line.find_first_not_of(' ', gap);
  const std::size_t indent = label > width / 2 ? begin + 2 : label;
  std::string text = line.substr(0, label);
  std::size_t letters = LetterCount(text);
  std::istringstream words(line.substr(label));
  bool fresh = true;
  for (std::string word; words >> word; fresh = false) {
    if (!fresh && letters + 1 + LetterCount(word) > width) {
      text += '\n' + std::string(indent, ' ');
      letters = indent;
      fresh = true;
    }
    text += (fresh ? "" : " ") + word;
    letters += (fresh ? 0 : 1) + LetterCount(word);
  }
  return text;
}

void PrintPage(const std::string& name, const SolveResult& result, std::FILE* out) {
  const int width = WidthOf(out);
  if (isatty(fileno(out)) == 0) return PrintTable(name, result, width, out);
  std::istringstream lines(TableText(name, result, width));
  bool first = true;
  for (std::string line; std::getline(lines, line); first = false) {
    line = Wrapped(line, static_cast<std::size_t>(width));
    // The first line is the name, a colon and the verdict.
    if (first && UsesColor(out) && line.size() > name.size() + 2) {
      line.insert(name.size() + 2, ColorOf(result.summary));
      line += "\x1b[0m";
    }
    fmt::print(out, "{}\n", line);
  }
}

}  // namespace dlcs::client
