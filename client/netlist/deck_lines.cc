// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "absl/strings/ascii.h"
#include "client/files/encoding.h"
#include "client/files/json_text.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kMaxDepth = 16;
constexpr std::size_t kMaxLines = 1'000'000;
constexpr std::size_t kMaxDeckBytes = std::size_t{16} << 20;

bool IsBlank(char letter) { return letter == ' ' || letter == '\t' || letter == '\r' || letter == '\f'; }

// Where the comment of a line begins; quotes and braces hide nothing, as in ngspice.
std::size_t EndOfCode(std::string_view line) {
  for (std::size_t at = 0; at < line.size(); ++at) {
    const bool after_blank = at == 0 || IsBlank(line[at - 1]) || line[at - 1] == ',';
    if (line[at] == ';') return at;
    if (after_blank && line[at] == '$') return at;
    if (after_blank && line[at] == '/' && at + 1 < line.size() && line[at + 1] == '/') return at;
  }
  return line.size();
}

std::string_view Stripped(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

// The first word of a line, in small letters.
std::string FirstWord(std::string_view text) {
  std::size_t end = 0;
  while (end < text.size() && !IsBlank(text[end])) ++end;
  return Lower(text.substr(0, end));
}

// The commands of a line in a .control block, which ; separates there.
std::vector<std::string_view> CommandsOf(std::string_view line) {
  std::vector<std::string_view> commands;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(';', begin), line.size());
    const std::string_view one = line.substr(begin, end - begin);
    commands.push_back(Stripped(one.substr(0, EndOfCode(one))));
    begin = end + 1;
  }
  return commands;
}

// Whether a command of a .control block makes another circuit.
bool ChangesCircuit(const std::string& command) {
  return command == "alter" || command == "altermod" || command == "alterparam" || command == "source" ||
         command == "circbyline" || command == "setcirc" || command == "loadcirc" || command == "edit";
}

std::string_view Unquoted(std::string_view text) {
  if (text.size() >= 2 && (text.front() == '"' || text.front() == '\'') && text.back() == text.front()) {
    return text.substr(1, text.size() - 2);
  }
  return text;
}

// LTspice writes the libraries that come with it into every deck with a diode or transistor.
bool IsStandardLibrary(std::string_view name) {
  const std::string lower = Lower(name);
  const std::string file = lower.substr(lower.find_last_of("/\\") + 1);
  return file == "standard.dio" || file == "standard.bjt" || file == "standard.mos" || file == "standard.jft";
}

// The number of the line in which a byte stands.
std::ptrdiff_t LineOf(const std::string& bytes, std::size_t at) {
  return 1 + std::count(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(at), '\n');
}

class Splitter {
 public:
  explicit Splitter(std::string folder) : folder_(std::move(folder)) {}

  absl::Status Split(const std::string& bytes, const std::string& source, bool is_deck,
                     const std::optional<std::string>& section) {
    if (const std::string wide = ExplainWideEncoding(bytes); !wide.empty()) return DeckError(source, wide);
    if (const std::size_t zero = bytes.find('\0'); zero != std::string::npos) {
      return DeckError(fmt::format("{}:{}", source, LineOf(bytes, zero)),
                       "holds a byte of 0, and is not text; save it as UTF-8");
    }
    // LTspice writes its µ in Latin-1. Bytes that are neither that nor UTF-8 throughout belong to no text.
    const std::size_t strange = FindInvalidUtf8(bytes);
    if (strange != std::string::npos && HasUtf8Letters(bytes)) {
      return DeckError(
          fmt::format("{}:{}", source, LineOf(bytes, strange)),
          fmt::format("the byte {:#04x} is not UTF-8, though other letters of the file are; save it as UTF-8",
                      static_cast<unsigned char>(bytes[strange])));
    }
    const std::string text = strange == std::string::npos ? bytes : FromLatin1(bytes);
    std::size_t begin = 0, number = 0;
    bool in_control = false, has_run = false, ignores_change = false, is_inside = !section;
    bool may_continue = false;
    while (begin <= text.size()) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      const std::string_view raw(text.data() + begin, end - begin);
      begin = end + 1;
      ++number;
      if (number == 1 && is_deck) {
        deck_.title = std::string(Stripped(raw));
        continue;
      }
      std::size_t column = 0;
      while (column < raw.size() && IsBlank(raw[column])) ++column;
      if (column == raw.size() || raw[column] == '*') continue;
      const std::string_view code = Stripped(raw.substr(0, EndOfCode(raw)).substr(std::min(column, EndOfCode(raw))));
      if (code.empty()) continue;
      if (in_control) {
        for (const std::string_view command : CommandsOf(raw)) {
          const std::string first = FirstWord(command);
          const auto at = static_cast<std::size_t>(command.data() - raw.data()) + 1;
          if (first == ".endc") in_control = false;
          // A second one is refused or ignored; more are not needed for that.
          const bool counts = first == "tran" && deck_.runs.size() < 2;
          if (counts) deck_.runs.push_back({source, std::string(command), {{0, number, at}}});
          has_run = has_run || first == "tran" || first == "run";
          if (!ChangesCircuit(first)) continue;
          if (has_run) {
            if (!std::exchange(ignores_change, true)) {
              Note(fmt::format("{}:{}: {} is ignored: the circuit is solved as it is before", source, number, first));
            }
            continue;
          }
          return DeckError(fmt::format("{}:{}:{}", source, number, at),
                           fmt::format("{} makes another circuit before it is run, and .control blocks are not run; "
                                       "write the values that are meant into the elements, models and parameters",
                                       first));
        }
        continue;
      }
      if (code[0] == '+') {
        if (!is_inside) continue;
        if (!may_continue) {
          return DeckError(fmt::format("{}:{}:{}", source, number, column + 1),
                           "+ continues a line, but there is none");
        }
        Append(code.substr(1), number, column + 1);
        continue;
      }
      const std::string word = FirstWord(code);
      if (section) {
        if (word == ".endl") {
          is_inside = false;
          may_continue = false;
          continue;
        }
        if (word == ".lib" && Lower(Stripped(code.substr(4))) == *section) {
          is_inside = found_section_ = true;
          continue;
        }
        if (!is_inside) continue;
      }
      may_continue = true;
      if (word == ".control") {
        in_control = true;
        Note(fmt::format("{}:{}: the .control block is not run", source, number));
        continue;
      }
      if (word == ".end" && is_deck) return absl::OkStatus();
      if (word == ".end") continue;
      if (deck_.lines.size() >= kMaxLines) {
        return DeckError(fmt::format("{}:{}", source, number), fmt::format("more than {} lines", kMaxLines));
      }
      deck_.lines.push_back({source, "", {}});
      Append(code, number, column);
      if (word == ".include" || word == ".inc" || word == ".incl" || word == ".lib") {
        // It may be continued, and so ends where the next line begins; files have short names, and none is.
        const DeckLine line = deck_.lines.back();
        deck_.lines.pop_back();
        may_continue = false;
        if (absl::Status status = Include(line, word == ".lib"); !status.ok()) return status;
      }
    }
    if (in_control) return DeckError(source, ".control without .endc");
    return absl::OkStatus();
  }

  // Puts the points of PWL file=NAME in its place, as in PWL (time value ...).
  absl::Status InsertPoints() {
    std::size_t bytes = 0;
    for (DeckLine& line : deck_.lines) {
      if (line.text[0] != 'V' && line.text[0] != 'v' && line.text[0] != 'I' && line.text[0] != 'i') continue;
      const std::string lower = Lower(line.text);
      const std::size_t wave = lower.find("pwl");
      const std::size_t begin = wave == std::string::npos ? wave : lower.find("file", wave);
      if (begin == std::string::npos) continue;
      std::size_t at = lower.find_first_not_of(" \t", begin + 4);
      if (at == std::string::npos || lower[at] != '=') continue;
      at = lower.find_first_not_of(" \t", at + 1);
      if (at == std::string::npos) return DeckError(line.Place(begin), "names no file");
      const bool is_quoted = lower[at] == '"' || lower[at] == '\'';
      const std::size_t close = is_quoted ? lower.find(lower[at], at + 1) : lower.find_first_of(" \t)", at);
      if (is_quoted && close == std::string::npos)
        return DeckError(line.Place(at), "a file name without closing quote");
      const std::size_t end = std::min(lower.size(), is_quoted ? close + 1 : close);
      const std::string name(Unquoted(std::string_view(line.text).substr(at, end - at)));
      const auto text = TextBelow(line.Place(at), fmt::format("reads {}", name), name);
      if (!text.ok()) return text.status();
      std::string points = text->second;
      if (points.find('\0') != std::string::npos || FindInvalidUtf8(points) != std::string::npos) {
        return DeckError(line.Place(at), fmt::format("reads {}, which is not text", name));
      }
      bytes += points.size();
      if (bytes > kMaxDeckBytes) return DeckError(line.Place(at), "the points of all files are larger than 16 MiB");
      std::replace_if(
          points.begin(), points.end(), [](char letter) { return IsBlank(letter) || letter == '\n'; }, ' ');
      // As they stand outside of parentheses and inside.
      const std::size_t open = lower.find_first_not_of(" \t", wave + 3);
      if (open == begin) points = "(" + points + ")";
      const DeckLine::Segment source = line.SegmentOf(end);
      line.text.replace(begin, end - begin, points);
      std::erase_if(line.segments,
                    [&](const DeckLine::Segment& one) { return one.offset > begin && one.offset < end; });
      for (DeckLine::Segment& one : line.segments) {
        if (one.offset >= end) one.offset += points.size() - (end - begin);
      }
      const auto behind = std::find_if(line.segments.begin(), line.segments.end(),
                                       [&](const DeckLine::Segment& one) { return one.offset > begin; });
      line.segments.insert(behind, {begin + points.size(), source.line, source.column + (end - source.offset)});
    }
    return absl::OkStatus();
  }

  DeckText Take() && { return std::move(deck_); }

 private:
  void Append(std::string_view code, std::size_t line, std::size_t column) {
    DeckLine& last = deck_.lines.back();
    if (!last.text.empty()) last.text += ' ';
    last.segments.push_back({last.text.size(), line, column + 1});
    last.text += code;
  }

  void Note(std::string note) { deck_.notes.push_back(std::move(note)); }

  absl::Status Include(const DeckLine& line, bool is_library) {
    const std::string_view rest = Stripped(std::string_view(line.text).substr(FirstWord(line.text).size()));
    std::string_view name = rest;
    std::optional<std::string> section;
    if (!rest.empty() && (rest.front() == '"' || rest.front() == '\'')) {
      const std::size_t close = rest.find(rest.front(), 1);
      if (close == std::string_view::npos) return DeckError(line.Place(), "a file name without closing quote");
      name = rest.substr(0, close + 1);
      if (const std::string_view more = Stripped(rest.substr(close + 1)); !more.empty()) section = Lower(more);
    } else if (const std::size_t blank = rest.find_first_of(" \t");
               is_library && blank != std::string_view::npos && !IsStandardLibrary(rest)) {
      name = rest.substr(0, blank);
      section = Lower(Stripped(rest.substr(blank)));
    }
    name = Unquoted(name);
    if (name.empty()) return DeckError(line.Place(), "names no file");
    if (is_library && !section && IsStandardLibrary(name)) {
      Note(fmt::format("{}: {} is a library of another program, and is not read", line.Place(), name));
      return absl::OkStatus();
    }
    if (section && !is_library) return DeckError(line.Place(), fmt::format("\"{}\" after the file name", *section));
    return IncludeFile(line, std::string(name), section);
  }

  // The path of a file below the folder of the deck, and its text. `what` says what is done with it.
  absl::StatusOr<std::pair<std::filesystem::path, std::string>> TextBelow(const std::string& place,
                                                                          const std::string& what,
                                                                          const std::string& name) {
    namespace fs = std::filesystem;
    if (folder_.empty()) return DeckError(place, what + ", but a deck on standard input has no folder for files");
    const fs::path given(name);
    if (given.is_absolute()) {
      return DeckError(place, what + "; files must be named relative to the deck and be below its folder");
    }
    std::error_code error;
    const fs::path root = fs::weakly_canonical(folder_, error);
    const fs::path from = stack_.empty() ? root : stack_.back().parent_path();
    const fs::path path = fs::weakly_canonical(from / given, error);
    const auto inside = std::mismatch(root.begin(), root.end(), path.begin(), path.end());
    if (error || inside.first != root.end()) {
      return DeckError(place, what + ", which is not below the folder of the deck");
    }
    if (std::find(stack_.begin(), stack_.end(), path) != stack_.end()) {
      return DeckError(place, what + ", which includes this file: a cycle");
    }
    if (stack_.size() >= kMaxDepth) {
      return DeckError(place, fmt::format("{}; files are nested deeper than {}", what, kMaxDepth));
    }
    auto text = ReadTextFile(path.string(), kMaxDeckBytes);
    if (!text.ok()) return DeckError(place, fmt::format("{}: {}", what, std::string(text.status().message())));
    return std::pair(path, *std::move(text));
  }

  absl::Status IncludeFile(const DeckLine& line, const std::string& name, const std::optional<std::string>& section) {
    const auto file = TextBelow(line.Place(), fmt::format("includes {}", name), name);
    if (!file.ok()) return file.status();
    const auto& [path, text] = *file;
    std::error_code error;
    const std::filesystem::path root = std::filesystem::weakly_canonical(folder_, error);
    stack_.push_back(path);
    found_section_ = false;
    const absl::Status status = Split(text, path.lexically_relative(root).string(), /*is_deck=*/false, section);
    stack_.pop_back();
    if (status.ok() && section && !found_section_) {
      return DeckError(line.Place(), fmt::format("{} has no section \".lib {}\"", name, *section));
    }
    return status;
  }

  const std::string folder_;
  std::vector<std::filesystem::path> stack_;
  bool found_section_ = false;
  DeckText deck_;
};

}  // namespace

DeckLine::Segment DeckLine::SegmentOf(std::size_t offset) const {
  Segment found = segments.front();
  for (const Segment& segment : segments) {
    if (segment.offset <= offset) found = segment;
  }
  return found;
}

std::string DeckLine::Place(std::size_t offset) const {
  const Segment found = SegmentOf(offset);
  return fmt::format("{}:{}:{}", file, found.line, found.column + (offset - std::min(offset, found.offset)));
}

std::string DeckLine::Place() const { return fmt::format("{}:{}", file, segments.front().line); }

absl::StatusOr<DeckText> SplitDeck(const std::string& text, const std::string& source, const std::string& folder) {
  if (text.size() > kMaxDeckBytes) return DeckError(source, "is larger than 16 MiB");
  Splitter splitter(folder);
  if (absl::Status status = splitter.Split(text, source, /*is_deck=*/true, std::nullopt); !status.ok()) return status;
  if (absl::Status status = splitter.InsertPoints(); !status.ok()) return status;
  return std::move(splitter).Take();
}

absl::Status DeckError(const std::string& place, const std::string& what) {
  return absl::InvalidArgumentError(fmt::format("{}: {}", place, what));
}

std::string Lower(std::string_view text) {
  std::string lower(text);
  absl::AsciiStrToLower(&lower);
  return lower;
}

}  // namespace dlcs::client
