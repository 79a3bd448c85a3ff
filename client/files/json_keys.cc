// SPDX-License-Identifier: Apache-2.0
#include "client/files/json_keys.h"

#include <fmt/format.h>

#include <optional>
#include <utility>
#include <vector>

#include "client/files/json_text.h"
#include "client/files/matrix_json.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {

using nlohmann::json;

void ReadMatrixKey(const json& root, const std::string& key, const std::string& rule, JsonReader& reader,
                   v1::Matrix& matrix, bool may_have_formulas) {
  const json* value = reader.Require(root, key, rule);
  if (value == nullptr) return;
  if (auto read = ReadAnyMatrix(*value, key, reader, may_have_formulas)) matrix = *std::move(read);
}

void ReadNumbersKey(const json& root, const std::string& key, const std::string& rule, JsonReader& reader,
                    google::protobuf::RepeatedField<double>& numbers) {
  const json* value = reader.Require(root, key, rule);
  if (value == nullptr) return;
  if (const auto list = ReadAnyVector(*value, key, reader)) numbers.Add(list->begin(), list->end());
}

void ReadNamesKey(const json& root, const std::string& key, JsonReader& reader,
                  google::protobuf::RepeatedPtrField<std::string>& names) {
  if (!root.contains(key)) return;
  const json& value = root[key];
  if (!value.is_array()) {
    return reader.Refuse(key,
                         fmt::format("is {}; must be a list of names, as in [\"iL\", \"vC\"]", DescribeJson(value)));
  }
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (const auto name = reader.ReadString(value[i], fmt::format("{}[{}]", key, i))) names.Add(std::string(*name));
  }
}

void ReadParameters(const json& value, const std::string& path, JsonReader& reader,
                    google::protobuf::RepeatedPtrField<v1::Parameter>& parameters) {
  if (!value.is_object()) {
    return reader.Refuse(path,
                         fmt::format("is {}; must be an object with a number for each name, as in {{\"omega\": 314}}",
                                     DescribeJson(value)));
  }
  for (const auto& [name, number] : value.items()) {
    const auto read = reader.ReadNumber(number, fmt::format("{}.{}", path, TruncateUtf8(name, 40)));
    if (!read) continue;
    v1::Parameter& parameter = *parameters.Add();
    parameter.set_name(name);
    parameter.set_value(*read);
  }
}

void ReadSelectorKey(const json& root, JsonReader& reader, v1::Selector& selector) {
  const json& value = root["selector"];
  if (!value.is_object()) {
    return reader.Refuse(
        "selector", fmt::format("is {}; must be an object {{\"C\": [[...], ...], \"b\": [...]}}", DescribeJson(value)));
  }
  reader.RefuseUnknownKeys(value, {"C", "b"}, "selector");
  const json* c = reader.Require(value, "C", "selector needs the rows of the matrix C of ‖C y - b‖, n values each");
  const json* b = reader.Require(value, "b", "selector needs the vector b of ‖C y - b‖, a value per row of C");
  if (c != nullptr) {
    if (auto matrix = ReadAnyMatrix(*c, "selector.C", reader)) *selector.mutable_c() = *std::move(matrix);
  }
  if (b != nullptr) {
    if (const auto list = reader.ReadNumbers(*b, "selector.b")) selector.mutable_b()->Add(list->begin(), list->end());
  }
}

absl::StatusOr<json> ParseObject(const std::string& text, const std::string& source, const std::string& holds) {
  auto root = ParseJson(text, source);
  if (!root.ok() || root->is_object()) return root;
  return absl::InvalidArgumentError(
      fmt::format("{}: holds {}; must be one object {{...}} with {}", source, DescribeJson(*root), holds));
}

FileKind KindOf(const json& root) {
  const auto has = [&root](const char* key) { return root.contains(key); };
  if (has("members") && !has("A")) return FileKind::kMembers;
  if (root.contains("kind") || (has("N") && has("x0"))) return FileKind::kSystem;
  if (has("C") && has("d")) return FileKind::kModel;
  if (has("M") && has("q")) return root["q"].is_object() ? FileKind::kDcp : FileKind::kLcp;
  if ((has("times") && has("values")) || (has("v") && root["v"].is_object())) return FileKind::kPath;
  return FileKind::kUnknown;
}

absl::Status CheckKind(const json& root, FileKind kind, const std::string& source) {
  const FileKind found = KindOf(root);
  const char* what = nullptr;
  switch (found) {
    case FileKind::kUnknown:
      break;
    case FileKind::kSystem:
      what = "a system of differential equations with complementarity; run dlcs solve or dlcs analyze with it";
      break;
    case FileKind::kLcp:
      what = "one linear complementarity problem; run dlcs lcp with it";
      break;
    case FileKind::kDcp:
      what = "a dynamic complementarity problem; run dlcs dcp with it";
      break;
    case FileKind::kPath:
      what = "a path; check it with dlcs dcp --check";
      break;
    case FileKind::kModel:
      what = "an input-output model; make a problem from it with dlcs model input-output";
      break;
    case FileKind::kMembers:
      what = "the members of an ensemble; run dlcs ensemble with a problem and with it";
      break;
  }
  if (found == kind || what == nullptr) return absl::OkStatus();
  const char* wanted =
      kind == FileKind::kMembers
          ? "; members are expected here, as in [{\"x0\": [1, 0]}, {\"T\": 2}], or a table of initial states"
          : "";
  return absl::InvalidArgumentError(fmt::format("{}: holds {}{}", source, what, wanted));
}

}  // namespace dlcs::client
