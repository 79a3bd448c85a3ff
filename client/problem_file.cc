// SPDX-License-Identifier: Apache-2.0
#include "client/problem_file.h"

#include <fmt/format.h>

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "client/json_reader.h"
#include "client/json_text.h"
#include "client/time_function_json.h"

namespace dlcs::client {
namespace {

using nlohmann::json;

const std::vector<std::string>& ProblemKeys() {
  static const std::vector<std::string> keys = {"A", "B", "N",      "M",    "x0",          "T",
                                                "f", "g", "pieces", "rule", "break_points"};
  return keys;
}

const std::vector<std::string>& AnnotationKeys() {
  static const std::vector<std::string> keys = {"name",
                                                "about",
                                                "source",
                                                "M_class",
                                                "refs",
                                                "switchings",
                                                "y_unique",
                                                "state_jumps",
                                                "switching_times_first",
                                                "reference",
                                                "why",
                                                "expect",
                                                "siconos_x_at_T",
                                                "reference_self_diff",
                                                "pointwise_iteration"};
  return keys;
}

std::vector<std::string> Together(std::vector<std::string> first, const std::vector<std::string>& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

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

void ReadRuleKey(const json& root, JsonReader& reader, v1::SolutionRule* rule) {
  if (!root.contains("rule")) return;
  if (const auto found = reader.ReadRule(root["rule"], "rule")) *rule = *found;
}

absl::StatusOr<json> ParseObject(const std::string& text, const std::string& source,
                                 const std::string& holds) {
  auto root = ParseJson(text, source);
  if (!root.ok() || root->is_object()) return root;
  return absl::InvalidArgumentError(
      fmt::format("{}: holds {}; must be one object {{...}} with {}", source, DescribeJson(*root), holds));
}

}  // namespace

absl::StatusOr<ProblemFile> ParseProblem(const std::string& text, const std::string& source) {
  const auto root = ParseObject(text, source, "the keys A, B, N, M, x0 and T");
  if (!root.ok()) return root.status();

  ProblemFile file;
  v1::Problem& problem = file.problem;
  JsonReader reader(source);
  reader.RefuseUnknownKeys(*root, Together(ProblemKeys(), AnnotationKeys()), "");
  ReadMatrixKey(*root, "A", "the m rows of the state matrix, as in [[-1, 0], [0, -2]]", reader,
                *problem.mutable_a());
  ReadMatrixKey(*root, "B", "m rows with a value per complementarity pair", reader, *problem.mutable_b());
  ReadMatrixKey(*root, "N", "a row per complementarity pair with m values", reader, *problem.mutable_n());
  ReadMatrixKey(*root, "M", "the n rows of the complementarity matrix", reader, *problem.mutable_m());
  ReadNumbersKey(*root, "x0", "the m values of the initial state", reader, *problem.mutable_x0());
  if (const json* horizon = reader.Require(*root, "T", "the end of time, a number above 0")) {
    if (const auto number = reader.ReadNumber(*horizon, "T")) problem.set_horizon(*number);
  }
  ReadSources(*root, problem.a().dense().rows(), problem.m().dense().rows(), reader, *problem.mutable_f(),
              *problem.mutable_g());
  if (root->contains("break_points")) {
    ReadNumbersKey(*root, "break_points", "", reader, *problem.mutable_break_points());
  }
  v1::SolutionRule rule = v1::SOLUTION_RULE_UNSPECIFIED;
  ReadRuleKey(*root, reader, &rule);
  problem.set_rule(rule);

  file.annotations = json::object();
  for (const std::string& key : AnnotationKeys()) {
    if (root->contains(key)) file.annotations[key] = (*root)[key];
  }
  if (root->contains("name")) file.name = reader.ReadString((*root)["name"], "name").value_or("");

  const absl::Status status = reader.status();
  if (!status.ok()) return status;
  return file;
}

absl::StatusOr<ProblemFile> ReadProblemFile(const std::string& path) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  return ParseProblem(*text, SourceName(path));
}

absl::StatusOr<v1::SolveLcpRequest> ParseLcp(const std::string& text, const std::string& source) {
  const auto root = ParseObject(text, source, "the keys M and q");
  if (!root.ok()) return root.status();

  v1::SolveLcpRequest request;
  JsonReader reader(source);
  reader.RefuseUnknownKeys(*root, {"M", "q", "rule", "name", "about", "source", "why", "expect"}, "");
  ReadMatrixKey(*root, "M", "the n rows of the matrix of 0 <= y ⟂ q + M y >= 0", reader,
                *request.mutable_m());
  ReadNumbersKey(*root, "q", "the n values of the vector of 0 <= y ⟂ q + M y >= 0", reader,
                 *request.mutable_q());
  v1::SolutionRule rule = v1::SOLUTION_RULE_UNSPECIFIED;
  ReadRuleKey(*root, reader, &rule);
  request.set_rule(rule);

  const absl::Status status = reader.status();
  if (!status.ok()) return status;
  return request;
}

absl::StatusOr<v1::SolveLcpRequest> ReadLcpFile(const std::string& path) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  return ParseLcp(*text, SourceName(path));
}

}  // namespace dlcs::client
