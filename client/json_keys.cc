// SPDX-License-Identifier: Apache-2.0
#include "client/json_keys.h"

#include <fmt/format.h>

#include <optional>
#include <utility>
#include <vector>

#include "client/json_text.h"

namespace dlcs::client {

using nlohmann::json;

void ReadMatrixKey(const json& root, const std::string& key, const std::string& rule, JsonReader& reader,
                   v1::Matrix& matrix) {
  const json* value = reader.Require(root, key, rule);
  if (value == nullptr) return;
  if (auto dense = reader.ReadMatrix(*value, key)) *matrix.mutable_dense() = *std::move(dense);
}

void ReadNumbersKey(const json& root, const std::string& key, const std::string& rule, JsonReader& reader,
                    google::protobuf::RepeatedField<double>& numbers) {
  const json* value = reader.Require(root, key, rule);
  if (value == nullptr) return;
  if (const auto list = reader.ReadNumbers(*value, key)) numbers.Add(list->begin(), list->end());
}

void ReadSelectorKey(const json& root, JsonReader& reader, v1::Selector& selector) {
  const json& value = root["selector"];
  if (!value.is_object()) {
    return reader.Refuse(
        "selector",
        fmt::format("is {}; must be an object {{\"C\": [[...], ...], \"b\": [...]}}", DescribeJson(value)));
  }
  reader.RefuseUnknownKeys(value, {"C", "b"}, "selector");
  const json* c =
      reader.Require(value, "C", "selector needs the rows of the matrix C of ‖C y - b‖, n values each");
  const json* b =
      reader.Require(value, "b", "selector needs the vector b of ‖C y - b‖, a value per row of C");
  if (c != nullptr) {
    if (auto dense = reader.ReadMatrix(*c, "selector.C"))
      *selector.mutable_c()->mutable_dense() = *std::move(dense);
  }
  if (b != nullptr) {
    if (const auto list = reader.ReadNumbers(*b, "selector.b"))
      selector.mutable_b()->Add(list->begin(), list->end());
  }
}

absl::StatusOr<json> ParseObject(const std::string& text, const std::string& source,
                                 const std::string& holds) {
  auto root = ParseJson(text, source);
  if (!root.ok() || root->is_object()) return root;
  return absl::InvalidArgumentError(
      fmt::format("{}: holds {}; must be one object {{...}} with {}", source, DescribeJson(*root), holds));
}

}  // namespace dlcs::client
