// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "client/files/encoding.h"
#include "client/netlist/spice_number.h"

namespace dlcs::client {
namespace {

absl::Status DefineParameter(const DeckLine& line, const std::set<std::string>& given, ParameterScope& scope) {
  const auto definitions = DefinitionsOf(line, line.text.find_first_of(" \t"));
  if (!definitions.ok()) return definitions.status();
  for (const auto& [name, expression, offset] : *definitions) {
    if (scope.Define(Lower(name), expression)) continue;
    // Given by the instance, or twice here: the last of the deck counts in SPICE, but a slip is likelier.
    if (given.contains(Lower(name))) continue;
    return DeckError(line.Place(offset), fmt::format("parameter {} is defined twice", name));
  }
  return absl::OkStatus();
}

absl::Status DefineFunction(const DeckLine& line, ParameterScope& scope) {
  const std::size_t open = line.text.find('('), close = line.text.find(')');
  if (open == std::string::npos || close == std::string::npos || close < open) {
    return DeckError(line.Place(), ".func needs a name with arguments, as in .func f(x) {2*x}");
  }
  const std::string name = Lower(Trimmed(line.text.substr(5, open - 5)));
  std::vector<std::string> arguments;
  std::string argument;
  for (std::size_t k = open + 1; k <= close; ++k) {
    if (line.text[k] == ',' || k == close) {
      if (argument = Lower(Trimmed(argument)); !argument.empty()) arguments.push_back(argument);
      argument.clear();
    } else {
      argument += line.text[k];
    }
  }
  std::string body = Trimmed(line.text.substr(close + 1));
  if (!body.empty() && body[0] == '=') body = Trimmed(body.substr(1));
  body = WithoutBraces(body);
  if (name.empty() || body.empty()) return DeckError(line.Place(), ".func needs a name and a body");
  if (scope.DefineFunction(name, arguments, body)) return absl::OkStatus();
  return DeckError(line.Place(), fmt::format("function {} is defined twice", name));
}

// 1F is a femto-something.
void NoteUnit(const DeckLine& line, const DeckWord& word, double number, DeckNotes& notes) {
  const std::string lower = Lower(word.text);
  const std::size_t letter = lower.find_first_not_of("0123456789.+-e");
  if (letter != std::string::npos && lower.substr(letter).starts_with("f") && number != 0) {
    const std::string rest = lower.substr(letter);
    if (rest == "f" || rest == "farad") {
      notes.Add(fmt::format("{}: {} is {:g}: f is femto", line.Place(word.offset), word.text, number));
    }
  }
}

// 4k7 is 4.7k, which some programs read as 4k.
std::string DecimalHint(const std::string& text) {
  const std::size_t letters = text.find_first_not_of("0123456789");
  const std::size_t digits = text.find_first_of("0123456789", letters);
  if (letters == 0 || digits == std::string::npos) return "";
  if (text.find_first_not_of("0123456789", digits) != std::string::npos) return "";
  const std::string suffix = text.substr(letters, digits - letters);
  if (Lower(suffix) == "e" || Lower(suffix) == "x") return "";  // 1e400, 0x10
  const std::string number = text.substr(0, letters) + "." + text.substr(digits) + (Lower(suffix) == "r" ? "" : suffix);
  return ReadSpiceNumber(number) ? fmt::format("; write {}", number) : "";
}

// Letters that do not show on a screen, by their code.
std::string Visible(const std::string& text) {
  std::string shown;
  for (const char32_t letter : LettersOf(text)) {
    if (letter >= 0x20 && (letter < 0x7f || letter > 0x9f)) continue;
    shown += fmt::format("{}0x{:02x}", shown.empty() ? "" : ", ", static_cast<unsigned>(letter));
  }
  return shown.empty() ? fmt::format("\"{}\"", text)
                       : fmt::format("\"{}\", with the control character {},", text, shown);
}

// µ in UTF-8 that was read as Latin-1 or Windows-1252.
bool HasBrokenMicro(const std::string& text) {
  return text.find("\u00c2\u00b5") != std::string::npos || text.find("\u00ce\u00bc") != std::string::npos;
}

}  // namespace

void DeckNotes::Add(std::string note) {
  if (std::find(notes_.begin(), notes_.end(), note) == notes_.end()) notes_.push_back(std::move(note));
}

absl::StatusOr<double> ValueOf(const DeckLine& line, const DeckWord& word, ParameterScope& scope, DeckNotes& notes) {
  if (word.is_expression) {
    const auto value = scope.Evaluate(word.text);
    if (!value.ok()) return DeckError(line.Place(word.offset), std::string(value.status().message()));
    return *value;
  }
  if (const auto number = ReadSpiceNumber(word.text)) {
    NoteUnit(line, word, *number, notes);
    return *number;
  }
  if (scope.Evaluate(word.text).ok()) {
    return DeckError(line.Place(word.offset),
                     fmt::format("\"{0}\" is not a number; a parameter is written in braces: {{{0}}}", word.text));
  }
  const std::string hint = HasBrokenMicro(word.text)
                               ? "; this was a \u00b5 before the encoding of the file was mistaken: write u"
                               : DecimalHint(word.text);
  return DeckError(line.Place(word.offset), fmt::format("{} is not a number{}", Visible(word.text), hint));
}

absl::Status DefineParameters(const std::vector<const DeckLine*>& lines, const std::set<std::string>& given,
                              ParameterScope& scope) {
  for (const DeckLine* line : lines) {
    const absl::Status status =
        Lower(line->text).starts_with(".func") ? DefineFunction(*line, scope) : DefineParameter(*line, given, scope);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace dlcs::client
