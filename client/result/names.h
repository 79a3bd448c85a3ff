// SPDX-License-Identifier: Apache-2.0
// The enumerators of the contract as words in files, on the command line and in tables: METHOD_TIME_STEPPING is
// "time-stepping", and the unspecified enumerator is "auto". An enumerator that this program does not know is printed
// as its number.

#ifndef DLCS_CLIENT_RESULT_NAMES_H_
#define DLCS_CLIENT_RESULT_NAMES_H_

#include <google/protobuf/descriptor.h>
#include <google/protobuf/generated_enum_reflection.h>

#include <optional>
#include <string>
#include <vector>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

std::string EnumWord(const google::protobuf::EnumDescriptor& enumeration, int number);
std::optional<int> ParseEnumWord(const google::protobuf::EnumDescriptor& enumeration, const std::string& word);
// In the order of the contract, "auto" first.
std::vector<std::string> EnumWords(const google::protobuf::EnumDescriptor& enumeration);

template <typename Enum>
std::string Word(Enum value) {
  return EnumWord(*google::protobuf::GetEnumDescriptor<Enum>(), value);
}
template <typename Enum>
std::optional<Enum> ParseWord(const std::string& word) {
  const auto number = ParseEnumWord(*google::protobuf::GetEnumDescriptor<Enum>(), word);
  return number ? std::optional(static_cast<Enum>(*number)) : std::nullopt;
}
template <typename Enum>
std::vector<std::string> Words() {
  return EnumWords(*google::protobuf::GetEnumDescriptor<Enum>());
}

// "REACHED_END", "INFEASIBLE", ...
std::string TerminationName(v1::Termination termination);
// "SOLVED", "ERROR_ESTIMATED", "ERROR_UNKNOWN"; if not solved the termination, "INFEASIBLE".
std::string VerdictName(const v1::Summary& summary);
// The same with the error: "SOLVED within an error of 1e-08, estimated error 2e-10".
std::string VerdictText(const v1::Summary& summary);
// Whether the solution may be used.
bool Succeeded(const v1::Summary& summary);
// "SOLVED", "INFEASIBLE", ...
std::string VerdictName(v1::LcpStatus verdict);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RESULT_NAMES_H_
