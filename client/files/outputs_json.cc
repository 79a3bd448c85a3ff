// SPDX-License-Identifier: Apache-2.0
#include "client/files/outputs_json.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "client/files/json_keys.h"
#include "client/files/matrix_json.h"
#include "client/files/time_function_json.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using Names = std::vector<std::string>;
using Indices = google::protobuf::RepeatedField<std::int32_t>;

bool IsObject(const json& value, const std::string& path, JsonReader& reader) {
  if (value.is_object()) return true;
  reader.Refuse(path, fmt::format("is {}; must be an object", DescribeJson(value)));
  return false;
}

std::int32_t ReadInteger(const json& value, const std::string& path, JsonReader& reader) {
  const auto number = reader.ReadNumber(value, path);
  if (!number) return 0;
  if (*number == std::floor(*number) && std::abs(*number) < 1e9) return static_cast<std::int32_t>(*number);
  reader.Refuse(path, fmt::format("is {}; must be an integer", *number));
  return 0;
}

std::optional<std::int32_t> FindOutput(const std::string& name, const Names& names) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<std::int32_t>(found - names.begin());
}

std::int32_t ReadOutput(const std::string& name, const Names& names, const std::string& path, JsonReader& reader) {
  if (const auto found = FindOutput(name, names)) return *found;
  // Words give the message with the nearest name.
  if (names.empty()) {
    reader.Refuse(path, "names an output, but the file has none");
  } else {
    reader.ReadWord(name, path, names);
  }
  return 0;
}

void ReadOutputList(const json& value, const Names& names, const std::string& path, JsonReader& reader,
                    Indices& outputs) {
  if (!value.is_array()) {
    return reader.Refuse(path, fmt::format("is {}; must be a list of names of outputs", DescribeJson(value)));
  }
  for (std::size_t k = 0; k < value.size(); ++k) {
    const std::string place = fmt::format("{}[{}]", path, k);
    if (const auto name = reader.ReadString(value[k], place)) outputs.Add(ReadOutput(*name, names, place, reader));
  }
}

// The words of an enumeration without that of its unspecified value.
template <typename Enum>
Names SetWords() {
  Names words = Words<Enum>();
  words.erase(words.begin());
  return words;
}

void ReadInstant(const json& value, const Names& names, const std::string& path, JsonReader& reader,
                 v1::MeasurementInstant& instant) {
  if (!IsObject(value, path, reader)) return;
  reader.RefuseUnknownKeys(value, {"time", "outputs", "level", "direction", "number", "after"}, path);
  if (value.contains("time")) instant.set_time(reader.ReadNumber(value["time"], path + ".time").value_or(0));
  if (value.contains("outputs")) {
    ReadOutputList(value["outputs"], names, path + ".outputs", reader, *instant.mutable_outputs());
  }
  if (value.contains("level")) instant.set_level(reader.ReadNumber(value["level"], path + ".level").value_or(0));
  if (value.contains("direction")) {
    const auto word = reader.ReadWord(value["direction"], path + ".direction", SetWords<v1::CrossingDirection>());
    if (word) instant.set_direction(*ParseWord<v1::CrossingDirection>(*word));
  }
  if (value.contains("number")) instant.set_number(ReadInteger(value["number"], path + ".number", reader));
  if (value.contains("after")) instant.set_after(reader.ReadNumber(value["after"], path + ".after").value_or(0));
}

void ReadMeasurement(const json& value, const Names& names, const std::string& path, JsonReader& reader,
                     v1::Measurement& measurement) {
  if (!IsObject(value, path, reader)) return;
  reader.RefuseUnknownKeys(value, {"name", "kind", "outputs", "begin", "end", "at", "until", "formula"}, path);
  if (value.contains("name")) measurement.set_name(reader.ReadString(value["name"], path + ".name").value_or(""));
  if (!value.contains("kind")) {
    reader.Refuse(path, "has no \"kind\", what is measured");
  } else if (const auto word = reader.ReadWord(value["kind"], path + ".kind", SetWords<v1::MeasurementKind>())) {
    measurement.set_kind(*ParseWord<v1::MeasurementKind>(*word));
  }
  if (value.contains("outputs")) {
    ReadOutputList(value["outputs"], names, path + ".outputs", reader, *measurement.mutable_outputs());
  }
  if (value.contains("begin")) measurement.set_begin(reader.ReadNumber(value["begin"], path + ".begin").value_or(0));
  if (value.contains("end")) measurement.set_end(reader.ReadNumber(value["end"], path + ".end").value_or(0));
  if (value.contains("at")) ReadInstant(value["at"], names, path + ".at", reader, *measurement.mutable_at());
  if (value.contains("until"))
    ReadInstant(value["until"], names, path + ".until", reader, *measurement.mutable_until());
  if (value.contains("formula")) {
    measurement.set_formula(reader.ReadString(value["formula"], path + ".formula").value_or(""));
  }
}

ordered_json NamesOf(const Indices& outputs, const v1::Problem& problem) {
  ordered_json names = ordered_json::array();
  for (const int output : outputs) names.push_back(problem.outputs().names(output));
  return names;
}

ordered_json InstantJson(const v1::MeasurementInstant& instant, const v1::Problem& problem) {
  ordered_json value = ordered_json::object();
  if (instant.has_time()) {
    value["time"] = instant.time();
    return value;
  }
  value["outputs"] = NamesOf(instant.outputs(), problem);
  value["level"] = instant.level();
  if (instant.direction() != v1::CROSSING_DIRECTION_UNSPECIFIED) value["direction"] = Word(instant.direction());
  if (instant.number() != 0) value["number"] = instant.number();
  if (instant.after() != 0) value["after"] = instant.after();
  return value;
}

ordered_json MeasurementJson(const v1::Measurement& measurement, const v1::Problem& problem) {
  ordered_json value = ordered_json::object();
  value["name"] = measurement.name();
  value["kind"] = Word(measurement.kind());
  if (!measurement.outputs().empty()) value["outputs"] = NamesOf(measurement.outputs(), problem);
  if (measurement.begin() != 0) value["begin"] = measurement.begin();
  if (measurement.has_end()) value["end"] = measurement.end();
  if (measurement.has_at()) value["at"] = InstantJson(measurement.at(), problem);
  if (measurement.has_until()) value["until"] = InstantJson(measurement.until(), problem);
  if (!measurement.formula().empty()) value["formula"] = measurement.formula();
  return value;
}

ordered_json OutputsJson(const v1::Outputs& outputs) {
  ordered_json value = ordered_json::object();
  value["names"] = outputs.names();
  if (outputs.has_c()) value["C"] = MatrixJson(outputs.c());
  if (outputs.has_d()) value["D"] = MatrixJson(outputs.d());
  ordered_json h = SourceJson(outputs.h(), outputs.names_size());
  if (!h.is_null()) value["h"] = std::move(h);
  if (outputs.hidden() != 0) value["hidden"] = outputs.hidden();
  for (const v1::OutputLimit& limit : outputs.limits()) value["limits"][outputs.names(limit.output())] = limit.value();
  return value;
}

}  // namespace

void ReadOutputs(const json& root, JsonReader& reader, v1::Problem& problem) {
  Names names;
  if (root.contains("outputs") && IsObject(root["outputs"], "outputs", reader)) {
    const json& value = root["outputs"];
    reader.RefuseUnknownKeys(value, {"names", "C", "D", "h", "hidden", "limits"}, "outputs");
    v1::Outputs& outputs = *problem.mutable_outputs();
    if (!value.contains("names")) {
      reader.Refuse("outputs", "has no \"names\", a list with a name for each output");
    } else if (!value["names"].is_array()) {
      reader.Refuse("outputs.names", fmt::format("is {}; must be a list of names", DescribeJson(value["names"])));
    } else {
      for (std::size_t k = 0; k < value["names"].size(); ++k) {
        names.push_back(reader.ReadString(value["names"][k], fmt::format("outputs.names[{}]", k)).value_or(""));
      }
    }
    outputs.mutable_names()->Add(names.begin(), names.end());
    constexpr bool kFormulas = true;
    for (const auto& [key, field] : {std::pair("C", &v1::Outputs::mutable_c), {"D", &v1::Outputs::mutable_d}}) {
      if (!value.contains(key)) continue;
      auto matrix = ReadAnyMatrix(value[key], fmt::format("outputs.{}", key), reader, kFormulas);
      if (matrix) *(outputs.*field)() = *std::move(matrix);
    }
    if (value.contains("h")) {
      ReadFunction(value, "h", "outputs.", static_cast<int>(names.size()), reader, *outputs.mutable_h());
    }
    if (value.contains("hidden")) outputs.set_hidden(ReadInteger(value["hidden"], "outputs.hidden", reader));
    if (value.contains("limits") && IsObject(value["limits"], "outputs.limits", reader)) {
      // The names are keys here.
      reader.RefuseUnknownKeys(value["limits"], names, "outputs.limits");
      for (const auto& [name, limit] : value["limits"].items()) {
        const auto output = FindOutput(name, names);
        if (!output) continue;
        v1::OutputLimit& out = *outputs.add_limits();
        out.set_output(*output);
        out.set_value(reader.ReadNumber(limit, fmt::format("outputs.limits.{}", name)).value_or(0));
      }
    }
  }
  if (!root.contains("measurements")) return;
  const json& measurements = root["measurements"];
  if (!measurements.is_array()) {
    return reader.Refuse("measurements",
                         fmt::format("is {}; must be a list of measurements", DescribeJson(measurements)));
  }
  for (std::size_t k = 0; k < measurements.size(); ++k) {
    ReadMeasurement(measurements[k], names, fmt::format("measurements[{}]", k), reader, *problem.add_measurements());
  }
}

void WriteOutputs(const v1::Problem& problem, ordered_json& file) {
  if (!problem.outputs().names().empty()) file["outputs"] = OutputsJson(problem.outputs());
  for (const v1::Measurement& measurement : problem.measurements()) {
    file["measurements"].push_back(MeasurementJson(measurement, problem));
  }
}

}  // namespace dlcs::client
