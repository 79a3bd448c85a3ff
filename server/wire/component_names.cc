// SPDX-License-Identifier: Apache-2.0
#include "server/wire/component_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "core/problem/formula_syntax.h"
#include "fmt/format.h"
#include "fmt/ranges.h"
#include "proto/shared/nearest_name.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

// How messages write the index of a component, and which names apply to it.
struct Spelling {
  std::string_view text;  // before "[1]"
  bool of_states;
};
// A spelling comes before its suffixes.
constexpr std::array kSpellings = {Spelling{"(N x + g)", false}, Spelling{"x0", true}, Spelling{"x", true},
                                   Spelling{"f", true},          Spelling{"y", false}, Spelling{"w", false},
                                   Spelling{"g", false}};

bool IsWordLetter(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

// The index in "[12]" at `at` of `text`, and the position after it.
struct IndexAt {
  std::size_t index = 0;
  std::size_t end = 0;
};
std::optional<IndexAt> ReadIndex(std::string_view text, std::size_t at) {
  if (at >= text.size() || text[at] != '[') return std::nullopt;
  IndexAt found;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + at + 1, end, found.index);
  if (error != std::errc() || stop == end || *stop != ']') return std::nullopt;
  found.end = static_cast<std::size_t>(stop - text.data()) + 1;
  return found;
}

std::string NameOf(const std::vector<std::string>& names, std::size_t index) {
  return index < names.size() ? names[index] : std::string();
}

// Whether `name` is x, y or w followed by a number.
bool IsNumbered(std::string_view name) {
  return name.size() > 1 && (name[0] == 'x' || name[0] == 'y' || name[0] == 'w') &&
         name.find_first_not_of("0123456789", 1) == std::string_view::npos;
}

// Why `name` is not allowed; empty if it is.
std::string FaultOfOwnName(const std::string& name) {
  constexpr std::array kWords = {"t", "pi", "e", "and", "or", "not", "in", "is", "if", "else", "lambda"};
  const bool is_function = std::any_of(kFormulaFunctions.begin(), kFormulaFunctions.end(),
                                       [&](const FormulaName& function) { return function.name == name; });
  const bool is_identifier = !name.empty() && std::isdigit(static_cast<unsigned char>(name[0])) == 0 &&
                             std::all_of(name.begin(), name.end(), IsWordLetter);
  if (!is_identifier) return fmt::format("{}; must be a letter or _, and then letters, digits and _", Quoted(name));
  if (is_function) return fmt::format("{}; is a function; choose another name", Quoted(name));
  if (std::find(kWords.begin(), kWords.end(), name) != kWords.end()) {
    return fmt::format("{}; is reserved in formulas; choose another name", Quoted(name));
  }
  if (IsNumbered(name))
    return fmt::format("{}; x, y and w with a number are components; choose another name", Quoted(name));
  return "";
}

// The same for component `index`, whose default name is `letter` and its number.
std::string FaultOfName(const std::string& name, char letter, std::size_t index) {
  const std::string own = fmt::format("{}{}", letter, index + 1);
  if (name == own) return "";
  if (!IsNumbered(name)) return FaultOfOwnName(name);
  return fmt::format("{}; x, y and w with a number are names of components, and that of this one is {}", Quoted(name),
                     own);
}

class NameCheck {
 public:
  NameCheck(const FormulaParameters& parameters, std::vector<Violation>& violations) : violations_(violations) {
    for (const auto& [name, value] : parameters) taken_.emplace(name, "parameters." + name);
  }

  void Check(const std::vector<std::string>& names, const char* field, char letter, Index size, const char* each) {
    if (names.empty()) return;
    if (static_cast<Index>(names.size()) != size) {
      violations_.push_back(
          {field, fmt::format("{} names; must be {}, one for each {}, or none", names.size(), size, each)});
      return;
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      const std::string place = fmt::format("{}[{}]", field, i);
      if (const std::string fault = FaultOfName(names[i], letter, i); !fault.empty()) {
        violations_.push_back({place, fault});
      } else if (const auto [other, is_new] = taken_.emplace(names[i], place); !is_new) {
        violations_.push_back({place, fmt::format("{}; is already the name of {}; names must be unique",
                                                  Quoted(names[i]), other->second)});
      }
    }
  }

 private:
  std::vector<Violation>& violations_;
  std::map<std::string, std::string> taken_;  // and by what
};

// Rows and columns of A, B, N and M.
std::optional<std::pair<bool, bool>> IsOfStates(char matrix) {
  switch (matrix) {
    case 'A':
      return std::pair(true, true);
    case 'B':
      return std::pair(true, false);
    case 'N':
      return std::pair(false, true);
    case 'M':
      return std::pair(false, false);
    default:
      return std::nullopt;
  }
}

// "vC, iL" for a field that is an entry A[1][0]; empty for any other.
std::string EntryNames(const std::string& field, const ComponentNames& names) {
  const auto kinds = field.empty() ? std::nullopt : IsOfStates(field[0]);
  const auto row = kinds ? ReadIndex(field, 1) : std::nullopt;
  const auto column = row ? ReadIndex(field, row->end) : std::nullopt;
  if (!column || column->end != field.size()) return "";
  const std::string of_row = NameOf(kinds->first ? names.states : names.pairs, row->index);
  const std::string of_column = NameOf(kinds->second ? names.states : names.pairs, column->index);
  if (of_row.empty() || of_column.empty()) return of_row + of_column;
  return of_row + ", " + of_column;
}

}  // namespace

FormulaParameters ParametersFromProto(const google::protobuf::RepeatedPtrField<v1::Parameter>& parameters,
                                      const std::string& field, std::vector<Violation>& violations) {
  FormulaParameters result;
  for (const v1::Parameter& parameter : parameters) {
    if (result.emplace(parameter.name(), parameter.value()).second) continue;
    violations.push_back({field + "." + parameter.name(), "given twice; keep one of them"});
  }
  for (const auto& [name, value] : result) {
    const std::string place = field + "." + name;
    if (std::string fault = FaultOfOwnName(name); !fault.empty()) violations.push_back({place, std::move(fault)});
    if (!std::isfinite(value)) violations.push_back({place, fmt::format("{}; must be finite", value)});
  }
  return result;
}

void ChangeParameters(const google::protobuf::RepeatedPtrField<v1::Parameter>& changes, const std::string& field,
                      FormulaParameters& parameters, std::vector<Violation>& violations) {
  for (const v1::Parameter& change : changes) {
    const auto found = parameters.find(change.name());
    const std::string place = field + "." + change.name();
    if (found == parameters.end()) {
      std::vector<std::string> known;
      for (const auto& [name, value] : parameters) known.push_back(name);
      violations.push_back(
          {place, known.empty() ? "the problem has no parameters"
                                : fmt::format("no parameter of the problem, which has {}", fmt::join(known, ", "))});
    } else if (!std::isfinite(change.value())) {
      violations.push_back({place, fmt::format("{}; must be finite", change.value())});
    } else {
      found->second = change.value();
    }
  }
}

void CheckNames(const ComponentNames& names, const FormulaParameters& parameters, Index m, Index n,
                std::vector<Violation>& violations) {
  NameCheck check(parameters, violations);
  check.Check(names.states, "states", 'x', m, "state");
  check.Check(names.pairs, "pairs", 'y', n, "pair");
}

NamesInFormulas::NamesInFormulas(const ComponentNames& names, const FormulaParameters& parameters) {
  for (std::size_t i = 0; i < names.states.size(); ++i) numbers_.emplace(names.states[i], fmt::format("x{}", i + 1));
  for (std::size_t i = 0; i < names.pairs.size(); ++i) numbers_.emplace(names.pairs[i], fmt::format("y{}", i + 1));
  // The shortest digits that read back as the same double; a sign binds less than a power.
  for (const auto& [name, value] : parameters) {
    numbers_.emplace(name, std::signbit(value) ? fmt::format("({})", value) : fmt::format("{}", value));
  }
}

std::string NamesInFormulas::InNumbers(const std::string& formula) const {
  if (numbers_.empty()) return formula;
  const std::string_view text = formula;
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    // Letters that directly follow a number, such as the e of an exponent, are not a name.
    const std::size_t begin = at;
    while (at < text.size() && (IsWordLetter(text[at]) || text[at] == '.')) ++at;
    if (at == begin) {
      result += text[at++];
      continue;
    }
    const std::string_view word = text.substr(begin, at - begin);
    const auto number = numbers_.find(word);
    const std::size_t filled = result.size() + word.size();
    result += number == numbers_.end() ? word : std::string_view(number->second);
    if (result.size() < filled) result.append(filled - result.size(), ' ');
  }
  return result;
}

std::string WithNames(const std::string& text, const ComponentNames& names) {
  if (names.empty()) return text;
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    bool found = false;
    for (const Spelling& spelling : kSpellings) {
      const bool begins_word = at == 0 || !IsWordLetter(text[at - 1]);
      if (!begins_word || text.compare(at, spelling.text.size(), spelling.text) != 0) continue;
      const auto index = ReadIndex(text, at + spelling.text.size());
      if (!index) continue;
      result.append(text, at, index->end - at);
      at = index->end;
      const std::string name = NameOf(spelling.of_states ? names.states : names.pairs, index->index);
      if (!name.empty() && (at == text.size() || text[at] != '[')) result += " (" + name + ")";
      found = true;
      break;
    }
    if (!found) result += text[at++];
  }
  return result;
}

void AddNames(const ComponentNames& names, std::vector<Violation>& violations) {
  if (names.empty()) return;
  for (Violation& violation : violations) {
    const std::string of_entry = EntryNames(violation.field, names);
    violation.field =
        of_entry.empty() ? WithNames(violation.field, names) : fmt::format("{} ({})", violation.field, of_entry);
    violation.description = WithNames(violation.description, names);
  }
}

void AddNames(const ComponentNames& names, Solution& solution) {
  solution.message = WithNames(solution.message, names);
  for (std::string& warning : solution.warnings) warning = WithNames(warning, names);
  for (NamedComponent& named : solution.accuracy.named) {
    named.name = DisplayName(named.component, names);
    if (named.beside) named.beside_name = DisplayName(*named.beside, names);
  }
  for (Advice::OfComponent& advised : solution.accuracy.advice.absolute) {
    advised.name = DisplayName(advised.component, names);
  }
}

std::string DisplayName(const Component& component, const ComponentNames& names) {
  const auto index = static_cast<std::size_t>(component.index);
  const auto name_of = [&](const std::vector<std::string>& given, char letter) {
    const std::string name = NameOf(given, index);
    return name.empty() ? fmt::format("{}{}", letter, index + 1) : name;
  };
  switch (component.kind) {
    case ComponentKind::kState:
      return name_of(names.states, 'x');
    case ComponentKind::kPair:
      return name_of(names.pairs, 'y');
    case ComponentKind::kSlack: {
      const std::string pair = NameOf(names.pairs, index);
      return pair.empty() || IsNumbered(pair) ? fmt::format("w{}", index + 1) : fmt::format("w({})", pair);
    }
    case ComponentKind::kOutput:
      break;
  }
  return name_of(names.outputs, 'z');
}

namespace {

std::optional<Index> IndexOf(const std::string& name, const std::vector<std::string>& names) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() || name.empty() ? std::nullopt : std::optional<Index>(found - names.begin());
}

// x1, y1 or w1, whatever else the component is called.
std::optional<Component> ComponentNumbered(const std::string& name, Index m, Index n) {
  if (!IsNumbered(name)) return std::nullopt;
  Index number = 0;
  std::from_chars(name.data() + 1, name.data() + name.size(), number);
  const ComponentKind kind = name[0] == 'x'   ? ComponentKind::kState
                             : name[0] == 'y' ? ComponentKind::kPair
                                              : ComponentKind::kSlack;
  if (number < 1 || number > (kind == ComponentKind::kState ? m : n)) return std::nullopt;
  return Component{kind, number - 1};
}

// The display names of the first `most` components.
std::vector<std::string> FirstNames(const ComponentNames& names, Index m, Index n, Index most) {
  std::vector<std::string> result;
  const auto p = static_cast<Index>(names.outputs.size());
  for (const auto& [kind, size] : {std::pair(ComponentKind::kState, m), std::pair(ComponentKind::kPair, n),
                                   std::pair(ComponentKind::kSlack, n), std::pair(ComponentKind::kOutput, p)}) {
    for (Index i = 0; i < size && std::ssize(result) < most; ++i) result.push_back(DisplayName({kind, i}, names));
  }
  return result;
}

}  // namespace

std::optional<Component> ComponentNamed(const std::string& name, const ComponentNames& names, Index m, Index n) {
  if (const auto state = IndexOf(name, names.states)) return Component{ComponentKind::kState, *state};
  if (const auto pair = IndexOf(name, names.pairs)) return Component{ComponentKind::kPair, *pair};
  if (name.starts_with("w(") && name.ends_with(")")) {
    const auto pair = IndexOf(name.substr(2, name.size() - 3), names.pairs);
    if (pair) return Component{ComponentKind::kSlack, *pair};
  }
  // An output may have the number of a component that has a name.
  const auto numbered = ComponentNumbered(name, m, n);
  const bool has_name = numbered && !(numbered->kind == ComponentKind::kState ? names.states : names.pairs).empty();
  if (numbered && !has_name) return numbered;
  if (const auto output = IndexOf(name, names.outputs)) return Component{ComponentKind::kOutput, *output};
  return numbered;
}

std::string NoComponentNamed(const std::string& name, const ComponentNames& names, Index m, Index n) {
  constexpr Index kListed = 8;
  constexpr Index kCompared = 10'000;  // beyond that a request would buy much work with a short name
  const Index count = m + 2 * n + static_cast<Index>(names.outputs.size());
  const std::vector<std::string> listed = FirstNames(names, m, n, kListed);
  const std::string more = count > kListed ? fmt::format(" and {} more", count - kListed) : "";
  return fmt::format("{}; is no state, pair or output of the problem, which has {}{}{}", Quoted(name),
                     fmt::join(listed, ", "), more, DidYouMean(NearestName(name, FirstNames(names, m, n, kCompared))));
}

}  // namespace dlcs
