// SPDX-License-Identifier: Apache-2.0
#include "client/files/lcp_file.h"

#include <fmt/format.h>

#include <optional>
#include <utility>
#include <vector>

#include "client/files/json_keys.h"
#include "client/files/json_reader.h"
#include "client/files/json_text.h"

namespace dlcs::client {
namespace {

using nlohmann::json;

// {"times": [t_0, ...], "values": [[...], ...]}, one row of values per time.
void ReadPath(const json& value, const std::string& path, JsonReader& reader, v1::PiecewiseLinearPath& wire) {
  if (!value.is_object()) {
    return reader.Refuse(path, fmt::format("is {}; must be an object {{\"times\": [...], \"values\": [[...], ...]}}",
                                           DescribeJson(value)));
  }
  const json* times = reader.Require(value, "times", fmt::format("{} needs the times of its nodes", path));
  const json* values = reader.Require(value, "values", fmt::format("{} needs a row of values per time", path));
  if (times == nullptr || values == nullptr) return;
  const auto time_list = reader.ReadNumbers(*times, path + ".times");
  const auto rows = reader.ReadMatrix(*values, path + ".values");
  if (!time_list || !rows) return;
  if (time_list->size() != static_cast<std::size_t>(rows->rows())) {
    return reader.Refuse(path + ".values",
                         fmt::format("has {} rows but {}.times has {}; must hold one row of values per time",
                                     rows->rows(), path, time_list->size()));
  }
  wire.mutable_times()->Add(time_list->begin(), time_list->end());
  *wire.mutable_values() = rows->values();
}

}  // namespace

absl::StatusOr<v1::SolveLcpRequest> ParseLcp(const std::string& text, const std::string& source) {
  const auto root = ParseObject(text, source, "the keys M and q");
  if (!root.ok()) return root.status();

  if (absl::Status kind = CheckKind(*root, FileKind::kLcp, source); !kind.ok()) return kind;

  v1::SolveLcpRequest request;
  JsonReader reader(source);
  reader.RefuseUnknownKeys(*root, {"M", "q", "rule", "selector"}, "", {"why", "expect"});
  ReadMatrixKey(*root, "M", "the n rows of the matrix of 0 <= y ⟂ q + M y >= 0", reader, *request.mutable_m());
  ReadNumbersKey(*root, "q", "the n values of the vector of 0 <= y ⟂ q + M y >= 0", reader, *request.mutable_q());
  ReadRuleKeys(*root, reader, request);

  const absl::Status status = reader.status();
  if (!status.ok()) return status;
  return request;
}

absl::StatusOr<v1::SolveLcpRequest> ReadLcpFile(const std::string& path) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  return ParseLcp(*text, SourceName(path));
}

absl::StatusOr<v1::SolveDcpRequest> ParseDcp(const std::string& text, const std::string& source) {
  const auto root = ParseObject(text, source, "the keys M and q");
  if (!root.ok()) return root.status();

  if (KindOf(*root) != FileKind::kLcp) {  // otherwise q is wrong, and the reader records the error
    if (absl::Status kind = CheckKind(*root, FileKind::kDcp, source); !kind.ok()) return kind;
  }

  v1::SolveDcpRequest request;
  JsonReader reader(source);
  reader.RefuseUnknownKeys(*root, {"M", "q"}, "");
  ReadMatrixKey(*root, "M", "the n rows of the matrix of w = q + M v", reader, *request.mutable_m());
  if (const json* q = reader.Require(*root, "q", "the path q, as in {\"times\": [0, 1], \"values\": [[0], [-1]]}")) {
    if (q->is_object()) reader.RefuseUnknownKeys(*q, {"times", "values"}, "q");
    ReadPath(*q, "q", reader, *request.mutable_q());
  }
  const absl::Status status = reader.status();
  if (!status.ok()) return status;
  return request;
}

absl::StatusOr<v1::SolveDcpRequest> ReadDcpFile(const std::string& path) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  return ParseDcp(*text, SourceName(path));
}

absl::StatusOr<v1::PiecewiseLinearPath> ReadPathFile(const std::string& path) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  const std::string source = SourceName(path);
  const auto root = ParseObject(*text, source, "the keys times and values");
  if (!root.ok()) return root.status();
  if (!root->contains("times") && !root->contains("v")) {
    if (absl::Status kind = CheckKind(*root, FileKind::kPath, source); !kind.ok()) return kind;
  }

  v1::PiecewiseLinearPath wire;
  JsonReader reader(source);
  const auto v = root->find("v");
  ReadPath(v == root->end() ? *root : *v, "v", reader, wire);
  const absl::Status status = reader.status();
  if (!status.ok()) return status;
  return wire;
}

}  // namespace dlcs::client
