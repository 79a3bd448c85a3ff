// SPDX-License-Identifier: Apache-2.0
#include "client/result/names.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <cctype>
#include <string_view>

namespace dlcs::client {
namespace {

using google::protobuf::EnumDescriptor;

// What all names of `enumeration` begin with: that of number 0 ends with UNSPECIFIED.
std::string Prefix(const EnumDescriptor& enumeration) {
  const std::string& name = enumeration.FindValueByNumber(0)->name();
  return name.substr(0, name.rfind("UNSPECIFIED"));
}

// The name of an enumerator without the prefix, METHOD_TIME_STEPPING as TIME_STEPPING. With it and a number where this
// program does not know the enumerator.
std::string BareName(const EnumDescriptor& enumeration, int number) {
  const std::string prefix = Prefix(enumeration);
  const auto* value = enumeration.FindValueByNumber(number);
  if (value == nullptr) return fmt::format("{}{}", prefix, number);
  const std::string& name = value->name();
  return name.starts_with(prefix) ? name.substr(prefix.size()) : name;
}

}  // namespace

std::string EnumWord(const EnumDescriptor& enumeration, int number) {
  if (number == 0) return "auto";
  std::string word = BareName(enumeration, number);
  for (char& c : word) c = c == '_' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return word;
}

std::optional<int> ParseEnumWord(const EnumDescriptor& enumeration, const std::string& word) {
  for (int i = 0; i < enumeration.value_count(); ++i) {
    const int number = enumeration.value(i)->number();
    if (EnumWord(enumeration, number) == word) return number;
  }
  return std::nullopt;
}

std::vector<std::string> EnumWords(const EnumDescriptor& enumeration) {
  std::vector<std::string> words;
  for (int i = 0; i < enumeration.value_count(); ++i)
    words.push_back(EnumWord(enumeration, enumeration.value(i)->number()));
  return words;
}

std::string TerminationName(v1::Termination termination) {
  return BareName(*v1::Termination_descriptor(), termination);
}

std::string VerdictName(const v1::Summary& summary) {
  if (summary.termination() != v1::TERMINATION_REACHED_END) return TerminationName(summary.termination());
  return BareName(*v1::VerdictKind_descriptor(), summary.verdict().kind());
}

std::string VerdictText(const v1::Summary& summary) {
  if (summary.termination() != v1::TERMINATION_REACHED_END) return TerminationName(summary.termination());
  return summary.verdict().text();
}

bool Succeeded(const v1::Summary& summary) { return summary.verdict().success(); }

std::string VerdictName(v1::LcpStatus verdict) { return BareName(*v1::LcpStatus_descriptor(), verdict); }

}  // namespace dlcs::client
