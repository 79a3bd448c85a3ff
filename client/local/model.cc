// SPDX-License-Identifier: Apache-2.0
#include "client/local/model.h"

#include <fmt/format.h>

#include <string>
#include <vector>

#include "client/files/json_keys.h"
#include "client/files/json_reader.h"
#include "client/files/json_text.h"
#include "client/files/problem_file.h"
#include "client/files/time_function_json.h"
#include "client/local/mesh_file.h"
#include "core/models/american_option.h"
#include "core/models/drainage.h"
#include "core/models/heat.h"
#include "core/models/input_output.h"
#include "core/models/obstacle.h"
#include "core/models/signorini.h"
#include "core/problem/violation_list.h"
#include "server/wire/component_names.h"
#include "server/wire/convert.h"

namespace dlcs::client {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

Matrix ReadMatrix(const json& root, const std::string& key, JsonReader& reader) {
  const json* value = reader.Require(root, key, "the rows of a matrix, one per commodity");
  if (value == nullptr) return Matrix();
  const auto dense = reader.ReadMatrix(*value, key);
  if (!dense) return Matrix();
  v1::Matrix matrix;
  *matrix.mutable_dense() = *dense;
  std::vector<Violation> none;  // the reader judged the shape
  return MatrixFromProto(matrix, key, none);
}

InputOutputModel ReadModel(const json& root, JsonReader& reader) {
  InputOutputModel model;
  model.C = ReadMatrix(root, "C", reader);
  model.A = ReadMatrix(root, "A", reader);
  model.B = ReadMatrix(root, "B", reader);
  if (const json* value = reader.Require(root, "d", "the demand at t = 0, a value per commodity")) {
    if (const auto demand = reader.ReadNumbers(*value, "d"))
      model.demand = Eigen::Map<const Vector>(demand->data(), static_cast<Index>(demand->size()));
  }
  if (const json* value = reader.Require(root, "T", "the end time, a number above 0"))
    model.horizon = reader.ReadNumber(*value, "T").value_or(0);
  v1::TimeFunction f, g;
  const int commodities = static_cast<int>(model.C.rows());
  if (commodities == 0) return model;  // C was refused, and the size of f follows from it
  ReadSources(root, commodities, commodities, reader, f, g);
  std::vector<Violation> violations;
  model.f = TimeFunctionFromProto(f, commodities, "f", violations);
  for (const Violation& violation : violations) reader.Refuse(violation.field, violation.description);
  return model;
}

// The names of demands and supplies, which the model and its problem share.
ComponentNames ReadNames(const json& root, Index commodities, JsonReader& reader) {
  v1::Problem named;
  ReadNameKeys(root, reader, named);
  std::vector<Violation> violations;
  if (commodities > 0) CheckNames(NamesOf(named), {}, commodities, commodities, violations);  // else C was refused
  for (const Violation& violation : violations) reader.Refuse(violation.field, violation.description);
  return NamesOf(named);
}

struct NotedProblem {
  json notes;
  Problem problem;
};

// Sets the fields that the user gave, and makes the problem.
template <typename Model>
void SetCommon(const ModelOptions& given, Model& model) {
  model.cells = given.cells.value_or(0);
  model.dimensions = given.dimensions.value_or(model.dimensions);
  model.horizon = given.horizon.value_or(model.horizon);
}

absl::StatusOr<NotedProblem> WithNotes(const std::string& name, const std::string& source,
                                       absl::StatusOr<Problem> problem) {
  if (!problem.ok()) return problem.status();
  return NotedProblem{{{"name", name}, {"source", source}}, *std::move(problem)};
}

absl::StatusOr<NotedProblem> MakeGridModel(const ModelOptions& given) {
  switch (given.kind) {
    case ModelKind::kSignorini: {
      SignoriniModel model;
      SetCommon(given, model);
      model.coefficient = given.coefficient.value_or(model.coefficient);
      return WithNotes(fmt::format("Signorini, 1/{}, c = {}", model.cells, model.coefficient),
                       "(4.3) to (4.6) of Wu & Chen", MakeSignoriniProblem(model));
    }
    case ModelKind::kObstacle: {
      ObstacleModel model;
      SetCommon(given, model);
      model.coefficient = given.coefficient.value_or(model.coefficient);
      model.load = given.load.value_or(model.load);
      return WithNotes(fmt::format("obstacle, 1/{}, {}-D", model.cells, model.dimensions),
                       "parabolic obstacle problem, psi = 1/2 - 4 |s - 1/2|^2", MakeObstacleProblem(model));
    }
    case ModelKind::kAmericanOption: {
      AmericanOptionModel model;
      SetCommon(given, model);
      model.rate = given.rate.value_or(model.rate);
      model.volatility = given.volatility.value_or(model.volatility);
      model.correlation = given.correlation.value_or(model.correlation);
      return WithNotes(fmt::format("American put, {} on a grid of {}",
                                   model.dimensions == 1 ? "one asset" : "two assets", model.cells),
                       "equation of Black, Scholes and Merton in ln(S/K), value over strike",
                       MakeAmericanOptionProblem(model));
    }
    case ModelKind::kDrainage: {
      DrainageModel model;
      SetCommon(given, model);
      model.coefficient = given.coefficient.value_or(model.coefficient);
      model.conductance = given.conductance.value_or(model.conductance);
      model.drains = given.drains.value_or(model.drains);
      model.recharge = given.recharge.value_or(model.recharge);
      return WithNotes(fmt::format("drainage, 1/{}, {}-D", model.cells, model.dimensions),
                       "ground water between one-sided drains", MakeDrainageProblem(model));
    }
    case ModelKind::kInputOutput:
    case ModelKind::kHeat:
      break;
  }
  return absl::InternalError("not a model on a grid");
}

// Fields of a model are options: "cells" is --cells. Its formulas are checked as sources of the problem.
absl::Status InWordsOfTheOptions(const absl::Status& status, const ModelOptions& options) {
  const bool drains = options.kind == ModelKind::kDrainage;
  std::vector<Violation> violations = ViolationsOf(status);
  for (Violation& violation : violations) {
    const bool is_formula = violation.field.starts_with("f.");
    violation.field = is_formula ? (drains ? "--recharge" : "--load") : "--" + violation.field;
  }
  return violations.empty() ? status : StatusOf(violations);
}

// The engine names its own fields: x0 is the model's d.
absl::Status InWordsOfTheModel(const absl::Status& status, const std::string& source) {
  std::vector<Violation> violations = ViolationsOf(status);
  for (auto& [field, description] : violations) {
    if (field.starts_with("x0")) field.replace(0, 2, "d");
    field = fmt::format("{}: {}", source, field);
  }
  return violations.empty() ? status : StatusOf(violations);
}

// The notes of the model, then the problem.
ordered_json FileOf(const json& root, const Problem& problem, const ComponentNames& names) {
  ordered_json file = ordered_json::object();
  for (const char* key : {"name", "about", "source"}) {
    if (root.contains(key)) file[key] = root[key];
  }
  v1::Problem message = ToProto(problem);
  SetNames(names, message);
  file.update(ProblemJson(message));
  return file;
}

}  // namespace

absl::StatusOr<ModeledProblem> ModelInputOutput(const std::string& text, const std::string& source) {
  const auto root = ParseJson(text, source);
  if (!root.ok()) return root.status();
  if (!root->is_object()) {
    return absl::InvalidArgumentError(fmt::format(
        "{}: holds {}; must be one object {{...}} with the keys C, A, B, d and T", source, DescribeJson(*root)));
  }
  if (absl::Status kind = CheckKind(*root, FileKind::kModel, source); !kind.ok()) return kind;
  JsonReader reader(source);
  reader.RefuseUnknownKeys(*root, {"C", "A", "B", "d", "T", "f", "states", "pairs"}, "");
  const InputOutputModel model = ReadModel(*root, reader);
  const ComponentNames names = ReadNames(*root, model.C.rows(), reader);
  if (absl::Status status = reader.status(); !status.ok()) return status;
  const auto problem = MakeInputOutputProblem(model);
  if (!problem.ok()) return InWordsOfTheModel(problem.status(), source);
  return ModeledProblem{FileOf(*root, *problem, names), ToProto(InputOutputSection(model))};
}

absl::StatusOr<nlohmann::ordered_json> ModelOnGrid(const ModelOptions& options) {
  const auto made = MakeGridModel(options);
  if (!made.ok()) return InWordsOfTheOptions(made.status(), options);
  return FileOf(made->notes, made->problem, {});
}

absl::StatusOr<nlohmann::ordered_json> ModelOnMesh(const ModelOptions& options, const std::string& text,
                                                   const std::string& source) {
  auto mesh = ParseMesh(text, source);
  if (!mesh.ok()) return mesh.status();
  HeatModel model;
  model.mesh = *std::move(mesh);
  model.contact = options.contact;
  model.fixed = options.fixed;
  model.coefficient = options.coefficient.value_or(model.coefficient);
  model.horizon = options.horizon.value_or(model.horizon);
  model.load = options.load.value_or(model.load);
  const auto made = MakeHeatProblem(model);
  if (!made.ok()) {
    std::vector<Violation> violations = ViolationsOf(InWordsOfTheOptions(made.status(), options));
    for (Violation& violation : violations) {
      if (violation.field == "--mesh") violation.field = source;
    }
    return violations.empty() ? made.status() : StatusOf(violations);
  }
  ordered_json file = FileOf({{"name", fmt::format("heat in {}", source)},
                              {"source", "linear finite elements, one-sided contact with a wall"}},
                             made->problem, {});
  file["annotations"] = {{"nodes", made->nodes}};
  return file;
}

}  // namespace dlcs::client
