// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/circuit_outputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "client/files/json_reader.h"
#include "client/files/matrix_json.h"
#include "client/files/time_function_json.h"
#include "core/problem/time_axis.h"
#include "core/problem/violation_list.h"
#include "server/wire/convert.h"

namespace dlcs::client {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

void ReadFactors(const json& value, const std::string& key, JsonReader& reader, v1::Matrix& matrix) {
  const json* rows = reader.Require(value, key, "a row per output");
  if (rows == nullptr) return;
  if (const auto dense = reader.ReadMatrix(*rows, "annotations.outputs." + key)) *matrix.mutable_dense() = *dense;
}

}  // namespace

ordered_json OutputsJson(const NamedOutputs& outputs) {
  ordered_json value = ordered_json::object();
  value["names"] = outputs.names;
  if (outputs.shown < outputs.names.size()) value["shown"] = outputs.shown;
  if (!outputs.limits.empty()) value["limits"] = outputs.limits;
  value["x"] = MatrixJson(outputs.x_factors);
  value["y"] = MatrixJson(outputs.y_factors);
  ordered_json sources = SourceJson(outputs.sources, static_cast<int>(outputs.names.size()));
  if (!sources.is_null()) value["sources"] = std::move(sources);
  return value;
}

absl::StatusOr<NamedOutputs> OutputsFromJson(const json& value, const std::string& source) {
  JsonReader reader(source);
  NamedOutputs outputs;
  if (!value.is_object() || !value.contains("names") || !value["names"].is_array()) {
    reader.Refuse("annotations.outputs", "must be an object with names, x, y and sources");
    return reader.status();
  }
  for (const json& name : value["names"]) outputs.names.push_back(name.is_string() ? name.get<std::string>() : "");
  const auto count = static_cast<int>(outputs.names.size());
  outputs.shown = outputs.names.size();
  if (value.contains("shown")) {
    const auto shown = reader.ReadNumber(value["shown"], "annotations.outputs.shown");
    if (shown && *shown >= 0 && *shown <= count) outputs.shown = static_cast<std::size_t>(*shown);
  }
  if (value.contains("limits") && value["limits"].is_object()) {
    for (const auto& [name, limit] : value["limits"].items()) {
      outputs.limits[name] = reader.ReadNumber(limit, "annotations.outputs.limits." + name).value_or(0);
    }
  }
  ReadFactors(value, "x", reader, outputs.x_factors);
  ReadFactors(value, "y", reader, outputs.y_factors);
  json sources = json::object();
  if (value.contains("sources")) sources["f"] = value["sources"];
  v1::TimeFunction none;
  ReadSources(sources, count, 1, reader, outputs.sources, none);
  if (absl::Status status = reader.status(); !status.ok()) return status;
  return outputs;
}

absl::StatusOr<OutputColumns> EvaluateOutputs(const NamedOutputs& outputs, const SolveResult& result, double horizon) {
  const auto count = static_cast<Index>(outputs.names.size());
  std::vector<Violation> violations;
  const Matrix x_factors = MatrixFromProto(outputs.x_factors, "annotations.outputs.x", violations);
  const Matrix y_factors = MatrixFromProto(outputs.y_factors, "annotations.outputs.y", violations);
  const TimeFunction sources = TimeFunctionFromProto(outputs.sources, count, "annotations.outputs.sources", violations);
  if (violations.empty()) violations = Validate(sources, count, "annotations.outputs.sources");
  if (!violations.empty()) return StatusOf(violations);
  if (x_factors.rows() != count || x_factors.cols() != static_cast<Index>(result.states) || y_factors.rows() != count ||
      y_factors.cols() != static_cast<Index>(result.constraints)) {
    return absl::InvalidArgumentError(fmt::format("annotations.outputs: x must be {} x {} and y {} x {}, for {} names",
                                                  count, result.states, count, result.constraints, count));
  }
  const TimeAxis axis{horizon, MergeBreakPoints({}, BreakPoints(sources, horizon), horizon)};
  auto evaluator = TimeFunctionEvaluator::Create(sources, count, axis);
  if (!evaluator.ok()) return evaluator.status();
  OutputColumns columns;
  columns.names = outputs.names;
  columns.values.resize(result.times.size() * outputs.names.size());
  Vector at(count);
  for (std::size_t k = 0; k < result.times.size(); ++k) {
    evaluator->Evaluate(axis.Nearest(result.times[k]), result.times[k] < horizon ? Side::kRight : Side::kLeft, at);
    at += x_factors * Eigen::Map<const Vector>(result.x_at(k).data(), x_factors.cols());
    at += y_factors * Eigen::Map<const Vector>(result.y_at(k).data(), y_factors.cols());
    std::copy(at.begin(), at.end(), columns.values.begin() + static_cast<std::ptrdiff_t>(k * outputs.names.size()));
  }
  return columns;
}

std::vector<std::string> ReachedLimits(const NamedOutputs& outputs, const OutputColumns& columns,
                                       const std::vector<double>& times) {
  constexpr double kReached = 0.999;
  std::vector<std::string> reached;
  for (std::size_t i = 0; i < columns.names.size(); ++i) {
    const auto limit = outputs.limits.find(columns.names[i]);
    if (limit == outputs.limits.end()) continue;
    for (std::size_t k = 0; k < times.size(); ++k) {
      if (!(std::abs(columns.at(k)[i]) >= kReached * limit->second)) continue;
      reached.push_back(
          fmt::format("{} reaches {:g} A at t = {:g}, the largest current that the model of this switch "
                      "allows: the result is none of the circuit",
                      columns.names[i], limit->second, times[k]));
      break;
    }
  }
  return reached;
}

OutputColumns ShownOutputs(const NamedOutputs& outputs, const OutputColumns& columns) {
  OutputColumns shown;
  const std::size_t count = std::min(outputs.shown, columns.names.size());
  shown.names.assign(columns.names.begin(), columns.names.begin() + static_cast<std::ptrdiff_t>(count));
  const std::size_t times = columns.names.empty() ? 0 : columns.values.size() / columns.names.size();
  for (std::size_t k = 0; k < times; ++k) {
    const auto values = columns.at(k).first(count);
    shown.values.insert(shown.values.end(), values.begin(), values.end());
  }
  return shown;
}

}  // namespace dlcs::client
