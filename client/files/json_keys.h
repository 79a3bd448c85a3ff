// SPDX-License-Identifier: Apache-2.0
// Keys that several kinds of files share.

#ifndef DLCS_CLIENT_FILES_JSON_KEYS_H_
#define DLCS_CLIENT_FILES_JSON_KEYS_H_

#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/files/json_reader.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Parses the JSON object `text`. Errors: InvalidArgument if it is not JSON or not an object; the message names the
// expected contents: "the keys M and q".
absl::StatusOr<nlohmann::json> ParseObject(const std::string& text, const std::string& source,
                                           const std::string& holds);

// The kind of a file, as far as its keys show it.
enum class FileKind { kUnknown, kSystem, kLcp, kDcp, kPath, kModel, kMembers };
FileKind KindOf(const nlohmann::json& root);
// OK unless `root` is clearly of another kind than `kind`; the error names the command for it.
absl::Status CheckKind(const nlohmann::json& root, FileKind kind, const std::string& source);

// Each reads a required key; `rule` describes it in messages. Formulas as in ReadAnyMatrix().
void ReadMatrixKey(const nlohmann::json& root, const std::string& key, const std::string& rule, JsonReader& reader,
                   v1::Matrix& matrix, bool may_have_formulas = false);
void ReadNumbersKey(const nlohmann::json& root, const std::string& key, const std::string& rule, JsonReader& reader,
                    google::protobuf::RepeatedField<double>& numbers);

// The optional keys `states` and `pairs`, lists of names. The engine checks how many there are, and their form.
void ReadNamesKey(const nlohmann::json& root, const std::string& key, JsonReader& reader,
                  google::protobuf::RepeatedPtrField<std::string>& names);
template <typename Problem>
void ReadNameKeys(const nlohmann::json& root, JsonReader& reader, Problem& problem) {
  ReadNamesKey(root, "states", reader, *problem.mutable_state_names());
  ReadNamesKey(root, "pairs", reader, *problem.mutable_pair_names());
}

// An object with a number for each name, as in {"omega": 314}.
void ReadParameters(const nlohmann::json& value, const std::string& path, JsonReader& reader,
                    google::protobuf::RepeatedPtrField<v1::Parameter>& parameters);

// Reads the optional keys `rule` and `selector` of a problem or an LCP.
void ReadSelectorKey(const nlohmann::json& root, JsonReader& reader, v1::Selector& selector);
template <typename Request>
void ReadRuleKeys(const nlohmann::json& root, JsonReader& reader, Request& request) {
  if (root.contains("rule")) {
    if (const auto rule = reader.ReadRule(root["rule"], "rule")) request.set_rule(*rule);
  }
  if (root.contains("selector")) ReadSelectorKey(root, reader, *request.mutable_selector());
}

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_JSON_KEYS_H_
