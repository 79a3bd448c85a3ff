// SPDX-License-Identifier: Apache-2.0
#include "client/files/members_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "client/files/json_keys.h"
#include "client/files/json_reader.h"
#include "client/files/json_text.h"
#include "client/files/time_function_json.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

using nlohmann::json;
using Members = std::vector<v1::EnsembleMember>;

// The most members with errors that are reported, since often every member has the same error.
constexpr std::size_t kMaxFaulty = 10;
// The most bytes of a first line that are shown.
constexpr std::size_t kMaxShownNames = 200;

std::string PlaceOf(const std::string& source, std::size_t member) {
  return fmt::format("{}: members[{}]", source, member);
}

absl::StatusOr<v1::EnsembleMember> ReadMember(const json& value, const std::string& source, int states,
                                              int constraints) {
  JsonReader reader(source);
  v1::EnsembleMember member;
  if (!value.is_object()) {
    return absl::InvalidArgumentError(
        fmt::format("{}: is {}; must be an object, as in {{\"x0\": [1, 0]}}", source, DescribeJson(value)));
  }
  reader.RefuseUnknownKeys(value, {"x0", "f", "g", "pieces", "T", "break_points", "parameters", "label"}, "a member");
  if (value.contains("x0")) ReadNumbersKey(value, "x0", "", reader, *member.mutable_x0());
  if (value.contains("T")) {
    if (const auto number = reader.ReadNumber(value["T"], "T")) member.set_horizon(*number);
  }
  if (value.contains("break_points")) {
    ReadNumbersKey(value, "break_points", "", reader, *member.mutable_break_points()->mutable_times());
  }
  if (value.contains("label")) member.set_label(reader.ReadString(value["label"], "label").value_or(""));
  if (value.contains("parameters"))
    ReadParameters(value["parameters"], "parameters", reader, *member.mutable_parameters());
  v1::TimeFunction f;
  v1::TimeFunction g;
  ReadSources(value, states, constraints, reader, f, g);
  const bool both = value.contains("pieces");
  if (both || value.contains("f")) *member.mutable_f() = std::move(f);
  if (both || value.contains("g")) *member.mutable_g() = std::move(g);
  if (absl::Status status = reader.status(); !status.ok()) return status;
  return member;
}

absl::StatusOr<Members> ReadList(const json& list, const std::string& source, int states, int constraints) {
  Members members;
  std::vector<std::string> faults;
  for (std::size_t k = 0; k < list.size() && faults.size() < kMaxFaulty; ++k) {
    auto member = ReadMember(list[k], PlaceOf(source, k), states, constraints);
    if (member.ok()) {
      members.push_back(*std::move(member));
    } else {
      faults.emplace_back(member.status().message());
    }
  }
  if (!faults.empty()) return absl::InvalidArgumentError(fmt::format("{}", fmt::join(faults, "\n")));
  return members;
}

// The numbers of a line, separated by commas; absent if one is not a number.
std::optional<std::vector<double>> NumbersOf(absl::string_view line) {
  std::vector<double> numbers;
  for (const absl::string_view field : absl::StrSplit(line, ',')) {
    double number = 0;
    if (!absl::SimpleAtod(absl::StripAsciiWhitespace(field), &number)) return std::nullopt;
    numbers.push_back(number);
  }
  return numbers;
}

// Whether a line may hold the names of columns: where a field begins like a number, it is a mistake in one.
bool MayBeNames(absl::string_view line) {
  for (const absl::string_view field : absl::StrSplit(line, ',')) {
    const absl::string_view name = absl::StripAsciiWhitespace(field);
    if (!name.empty() && (absl::ascii_isdigit(static_cast<unsigned char>(name[0])) || name[0] == '-' ||
                          name[0] == '+' || name[0] == '.')) {
      return false;
    }
  }
  return true;
}

// A table whose columns are in another order, or hold something else, would give wrong states without a word.
absl::Status CheckNames(absl::string_view line, const std::string& source, int states,
                        const std::vector<std::string>& state_names) {
  std::vector<std::string> found;
  for (const absl::string_view field : absl::StrSplit(line, ',')) {
    absl::string_view name = absl::StripAsciiWhitespace(field);
    if (name.size() >= 2 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
    found.emplace_back(name);
  }
  std::vector<std::string> numbered;
  for (int i = 0; i < states; ++i) numbered.push_back(fmt::format("x{}", i + 1));
  if (found == numbered || found == state_names) return absl::OkStatus();
  constexpr std::size_t kMaxListed = 20;
  return absl::InvalidArgumentError(
      fmt::format("{}, line 1: the columns are {}; must be the states in their order, {}, or leave this line out",
                  source, TruncateUtf8(fmt::format("{}", fmt::join(found, ", ")), kMaxShownNames),
                  JoinFirst(state_names.empty() ? numbered : state_names, kMaxListed)));
}

absl::StatusOr<Members> ReadTable(const std::string& text, const std::string& source, int states,
                                  const std::vector<std::string>& state_names) {
  Members members;
  std::size_t number = 0;
  for (const absl::string_view untrimmed : absl::StrSplit(text, '\n')) {
    ++number;
    const absl::string_view line = absl::StripAsciiWhitespace(untrimmed);
    if (line.empty()) continue;
    const auto numbers = NumbersOf(line);
    if (!numbers && number == 1 && MayBeNames(line)) {
      if (absl::Status names = CheckNames(line, source, states, state_names); !names.ok()) return names;
      continue;
    }
    if (!numbers) {
      return absl::InvalidArgumentError(fmt::format(
          "{}, line {}: is not an initial state; a table has one per line, as numbers between commas (a JSON file "
          "begins with [ or {{)",
          source, number));
    }
    members.emplace_back().mutable_x0()->Add(numbers->begin(), numbers->end());
  }
  return members;
}

}  // namespace

absl::StatusOr<Members> ParseMembers(const std::string& text, const std::string& source, int states, int constraints,
                                     const std::vector<std::string>& state_names) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  const bool is_json = first != std::string::npos && (text[first] == '[' || text[first] == '{');
  if (!is_json) return ReadTable(text, source, states, state_names);
  const auto root = ParseJson(text, source);
  if (!root.ok()) return root.status();
  if (root->is_array()) return ReadList(*root, source, states, constraints);
  if (absl::Status kind = CheckKind(*root, FileKind::kMembers, source); !kind.ok()) return kind;
  JsonReader reader(source);
  reader.RefuseUnknownKeys(*root, {"members"}, "");
  const json* members = reader.Require(*root, "members", "a list of objects, as in [{\"x0\": [1, 0]}, {\"T\": 2}]");
  if (members != nullptr && !members->is_array()) {
    reader.Refuse("members", fmt::format("is {}; must be a list of objects", DescribeJson(*members)));
  }
  if (absl::Status status = reader.status(); !status.ok()) return status;
  return ReadList(*members, source, states, constraints);
}

absl::StatusOr<Members> ReadMembersFile(const std::string& path, int states, int constraints,
                                        const std::vector<std::string>& state_names) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  return ParseMembers(*text, SourceName(path), states, constraints, state_names);
}

}  // namespace dlcs::client
