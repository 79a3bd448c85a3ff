// SPDX-License-Identifier: Apache-2.0
// The models of `dlcs model`, which generate problem files. Needs the engine in the process.

#ifndef DLCS_CLIENT_LOCAL_MODEL_H_
#define DLCS_CLIENT_LOCAL_MODEL_H_

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

struct ModeledProblem {
  nlohmann::ordered_json file;  // a problem file
  v1::AnalysisSection section;  // facts about the model
};

// The dynamic input-output economy (4.6) of [Chen & Xiang 2013]: x' = A x + B y + f(t),
// 0 <= y ⟂ (I - C) y - x >= 0, x(0) = d. Reads the keys C A B d T, f (as in a problem file, zero when missing), and
// name, about, source, states and pairs, which are copied. Errors: InvalidArgument with one "source: place rule" per
// line.
absl::StatusOr<ModeledProblem> ModelInputOutput(const std::string& text, const std::string& source);

enum class ModelKind { kInputOutput, kSignorini, kObstacle, kAmericanOption, kDrainage, kHeat };

// The options of a model (core/models). Absent ones have the default of the model.
struct ModelOptions {
  ModelKind kind = ModelKind::kInputOutput;
  std::optional<std::int64_t> cells = {}, dimensions = {}, drains = {};
  std::optional<double> coefficient = {}, horizon = {}, rate = {}, volatility = {}, correlation = {}, conductance = {};
  std::optional<std::string> load = {}, recharge = {};  // formulas in t
  std::vector<std::string> contact = {}, fixed = {};    // physical groups of a mesh
};

// The problem file of a model on a grid, with its structure: some 2 MB for a membrane of 65,025 states. Errors:
// InvalidArgument with one "--option: rule" per line.
absl::StatusOr<nlohmann::ordered_json> ModelOnGrid(const ModelOptions& options);

// The problem file of heat in a body, with the mesh of a file in the format MSH (client/local/mesh_file.h). Its
// annotations hold the node of each state. Errors: InvalidArgument with one "source: rule" or "--option: rule" per
// line.
absl::StatusOr<nlohmann::ordered_json> ModelOnMesh(const ModelOptions& options, const std::string& text,
                                                   const std::string& source);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_LOCAL_MODEL_H_
