// SPDX-License-Identifier: Apache-2.0
#include "client/files/problem_arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "client/files/array_file.h"
#include "client/files/json_reader.h"
#include "client/files/matrix_json.h"
#include "client/files/time_function_json.h"
#include "proto/wire/matrix_shape.h"

namespace dlcs::client {
namespace {

const std::vector<std::string>& VariableNames() {
  static const std::vector<std::string> names = {"A", "B", "N", "M", "x0", "T", "f", "g", "E"};
  return names;
}

// Takes the variables of a file, and collects what is wrong with them.
class VariableReader {
 public:
  VariableReader(StoredVariables variables, const std::string& source)
      : variables_(std::move(variables)), reader_(source) {}

  void RefuseUnknown() {
    nlohmann::json names = nlohmann::json::object();
    for (const std::string& name : variables_.names) names[name] = nullptr;
    reader_.RefuseUnknownKeys(names, VariableNames(), "");
  }

  void ReadMatrix(const std::string& name, const std::string& rule, v1::Matrix& matrix) {
    auto array = Require(name, rule);
    if (!array) return;
    if (array->dimensions == 2) {
      matrix = std::move(array->matrix);
      return;
    }
    reader_.Refuse(name, fmt::format("has {} dimension{}; must be {}", array->dimensions,
                                     array->dimensions == 1 ? "" : "s", rule));
  }

  std::optional<std::vector<double>> ReadList(const std::string& name, const std::string& rule) {
    const auto array = Require(name, rule);
    return array ? VectorFrom(array->matrix, /*may_be_row=*/true, name, reader_) : std::nullopt;
  }

  std::optional<double> ReadNumber(const std::string& name, const std::string& rule) {
    const auto array = Require(name, rule);
    if (!array) return std::nullopt;
    const WireShape shape = ShapeOf(array->matrix);
    if (shape.rows == 1 && shape.columns == 1) {
      if (array->matrix.has_dense()) return array->matrix.dense().values(0);
      return array->matrix.sparse().values_size() > 0 ? array->matrix.sparse().values(0) : 0;
    }
    reader_.Refuse(name, fmt::format("is {} x {}; must be {}", shape.rows, shape.columns, rule));
    return std::nullopt;
  }

  bool Has(const std::string& name) const {
    return std::ranges::find(variables_.names, name) != variables_.names.end();
  }
  JsonReader& reader() { return reader_; }

 private:
  std::optional<StoredArray> Require(const std::string& name, const std::string& rule) {
    const auto found = variables_.arrays.find(name);
    if (found == variables_.arrays.end()) {
      reader_.Refuse(name, fmt::format("is missing; must be {}", rule));
      return std::nullopt;
    }
    if (found->second.ok()) return *std::move(found->second);
    reader_.Refuse(name, std::string(found->second.status().message()));
    return std::nullopt;
  }

  StoredVariables variables_;
  JsonReader reader_;
};

// f or g, a constant.
void ReadConstant(const std::string& name, VariableReader& variables, nlohmann::json& sources) {
  if (!variables.Has(name)) return;
  if (const auto values = variables.ReadList(name, "a list of constants")) sources[name] = *values;
}

int RowsOf(const v1::Matrix& matrix) { return static_cast<int>(std::max<std::int64_t>(ShapeOf(matrix).rows, 0)); }

}  // namespace

absl::StatusOr<v1::Problem> ParseProblemArrays(std::string_view bytes, const std::string& source) {
  auto stored = ParseArrayFile(bytes, source, [](const std::string& name) {
    return std::ranges::find(VariableNames(), name) != VariableNames().end();
  });
  if (!stored.ok()) return stored.status();
  if (stored->names == std::vector<std::string>{""}) {
    return absl::InvalidArgumentError(
        fmt::format("{}: holds one array; a problem has several, A, B, N, M, x0 and T, in an .npz or .mat file, or in "
                    "JSON, where {{\"file\": \"A.npy\"}} stands for a matrix",
                    source));
  }
  VariableReader variables(*std::move(stored), source);
  variables.RefuseUnknown();
  v1::Problem problem;
  variables.ReadMatrix("A", "the m x m state matrix", *problem.mutable_a());
  variables.ReadMatrix("B", "a matrix of m rows with a value per complementarity pair", *problem.mutable_b());
  variables.ReadMatrix("N", "a matrix with a row of m values per complementarity pair", *problem.mutable_n());
  variables.ReadMatrix("M", "the n x n complementarity matrix", *problem.mutable_m());
  if (variables.Has("E")) variables.ReadMatrix("E", "the m x m mass matrix", *problem.mutable_e());
  if (const auto x0 = variables.ReadList("x0", "the m values of the initial state")) {
    problem.mutable_x0()->Add(x0->begin(), x0->end());
  }
  if (const auto horizon = variables.ReadNumber("T", "the end time, a number above 0")) problem.set_horizon(*horizon);
  nlohmann::json sources = nlohmann::json::object();
  ReadConstant("f", variables, sources);
  ReadConstant("g", variables, sources);
  if (variables.reader().status().ok()) {
    ReadSources(sources, RowsOf(problem.a()), RowsOf(problem.m()), variables.reader(), *problem.mutable_f(),
                *problem.mutable_g());
  }
  if (absl::Status status = variables.reader().status(); !status.ok()) return status;
  return problem;
}

}  // namespace dlcs::client
