// SPDX-License-Identifier: Apache-2.0
#include "client/files/problem_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "client/files/array_file.h"
#include "client/files/json_keys.h"
#include "client/files/json_reader.h"
#include "client/files/json_text.h"
#include "client/files/matrix_json.h"
#include "client/files/outputs_json.h"
#include "client/files/problem_arrays.h"
#include "client/files/time_function_json.h"
#include "client/result/names.h"
#include "proto/wire/matrix_shape.h"

namespace dlcs::client {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

const std::vector<std::string>& ProblemKeys() {
  static const std::vector<std::string> keys = {
      "A",          "B",      "N",    "M",        "x0",           "T",    "f", "g",       "states",       "pairs",
      "parameters", "pieces", "rule", "selector", "break_points", "kind", "E", "outputs", "measurements", "y0"};
  return keys;
}

const std::vector<std::string>& NonlinearKeys() {
  static const std::vector<std::string> keys = {"kind",   "f",     "g",          "x0",           "T",
                                                "states", "pairs", "parameters", "break_points", "W"};
  return keys;
}

// Information that is not part of the problem.
const std::vector<std::string>& AnnotationKeys() {
  static const std::vector<std::string> keys = {"annotations", "name", "about", "source", "$schema"};
  return keys;
}

// In matrices of problems entries may be formulas of the parameters.
constexpr bool kFormulas = true;

// T and the break points, which both kinds of problems have.
template <typename Problem>
void ReadTimes(const json& root, JsonReader& reader, Problem& problem) {
  if (const json* horizon = reader.Require(root, "T", "the end time, a number above 0")) {
    if (const auto number = reader.ReadNumber(*horizon, "T")) problem.set_horizon(*number);
  }
  if (root.contains("break_points")) {
    ReadNumbersKey(root, "break_points", "", reader, *problem.mutable_break_points());
  }
}

// The names of states and pairs, and the parameters, which both kinds of problems have.
template <typename Problem>
void ReadNames(const json& root, JsonReader& reader, Problem& problem) {
  ReadNameKeys(root, reader, problem);
  if (root.contains("parameters"))
    ReadParameters(root["parameters"], "parameters", reader, *problem.mutable_parameters());
}

// Whether `text` has a comma between two digits, as in 1,5, although other commas are followed by a space.
bool HasDecimalComma(const std::string& text) {
  if (text.find(", ") == std::string::npos) return false;
  const auto is_digit = [&text](std::size_t at) { return text[at] >= '0' && text[at] <= '9'; };
  for (std::size_t at = text.find(',', 1); at != std::string::npos && at + 1 < text.size();
       at = text.find(',', at + 1)) {
    if (is_digit(at - 1) && is_digit(at + 1)) return true;
  }
  return false;
}

// Reports too many numbers if a decimal comma may be the reason; other wrong shapes are reported by the engine.
void RefuseDecimalCommas(const std::string& text, const v1::Problem& problem, JsonReader& reader) {
  constexpr const char* kCommas = "JSON reads 1,5 as two numbers; a decimal is written 1.5";
  const v1::DenseMatrix& a = problem.a().dense();
  if (a.columns() > a.rows() && HasDecimalComma(text)) {
    reader.Refuse("A",
                  fmt::format("is {} x {}; must be square, m x m for m states. {}", a.rows(), a.columns(), kCommas));
  } else if (a.rows() > 0 && problem.x0_size() > a.rows() && HasDecimalComma(text)) {
    reader.Refuse("x0", fmt::format("has {} values; must have one for each of the {} states. {}", problem.x0_size(),
                                    a.rows(), kCommas));
  }
}

// f and g; they may be given both directly and by pieces only if both are equal.
void ReadSourcesOnce(const json& root, int states, int constraints, const AgreementCheck& agrees, JsonReader& reader,
                     v1::Problem& problem) {
  v1::TimeFunction& f = *problem.mutable_f();
  v1::TimeFunction& g = *problem.mutable_g();
  const bool twice = root.contains("pieces") && (root.contains("f") || root.contains("g"));
  if (!twice || !agrees) return ReadSources(root, states, constraints, reader, f, g);
  json by_pieces = root, beside = root;
  by_pieces.erase("f");
  by_pieces.erase("g");
  beside.erase("pieces");
  ReadSources(by_pieces, states, constraints, reader, f, g);
  v1::TimeFunction f_beside, g_beside;
  ReadSources(beside, states, constraints, reader, f_beside, g_beside);
  if (!reader.status().ok()) return;
  const auto check = [&](const char* key, const v1::TimeFunction& one, const v1::TimeFunction& other, int size) {
    if (!root.contains(key) || agrees(one, other, size, problem)) return;
    reader.Refuse(
        key, fmt::format("is given as well as pieces, which hold another {}; put it into the pieces, or leave one of "
                         "them out",
                         key));
  };
  check("f", f, f_beside, states);
  check("g", g, g_beside, constraints);
}

void ReadLinear(const json& root, const AgreementCheck& agrees, JsonReader& reader, v1::Problem& problem) {
  ReadMatrixKey(root, "A", "the m rows of the state matrix, as in [[-1, 0], [0, -2]]", reader, *problem.mutable_a(),
                kFormulas);
  ReadMatrixKey(root, "B", "m rows with a value per complementarity pair", reader, *problem.mutable_b(), kFormulas);
  ReadMatrixKey(root, "N", "a row per complementarity pair with m values", reader, *problem.mutable_n(), kFormulas);
  ReadMatrixKey(root, "M", "the n rows of the complementarity matrix", reader, *problem.mutable_m(), kFormulas);
  if (root.contains("E")) ReadMatrixKey(root, "E", "", reader, *problem.mutable_e(), kFormulas);
  ReadNumbersKey(root, "x0", "the m values of the initial state", reader, *problem.mutable_x0());
  ReadTimes(root, reader, problem);
  const auto rows = [](const v1::Matrix& matrix) {
    return static_cast<int>(std::clamp<std::int64_t>(ShapeOf(matrix).rows, 0, std::numeric_limits<int>::max()));
  };
  ReadNames(root, reader, problem);
  ReadSourcesOnce(root, rows(problem.a()), rows(problem.m()), agrees, reader, problem);
  ReadRuleKeys(root, reader, problem);
  ReadOutputs(root, reader, problem);
  if (root.contains("y0")) ReadNumbersKey(root, "y0", "", reader, *problem.mutable_y0());
}

// A list of formulas in t, x1, ... and y1, ...; numbers are allowed as formulas.
void ReadFormulasKey(const json& root, const std::string& key, const std::string& rule, JsonReader& reader,
                     google::protobuf::RepeatedPtrField<std::string>& formulas) {
  const json* value = reader.Require(root, key, rule);
  if (value == nullptr) return;
  if (!value->is_array()) return reader.Refuse(key, fmt::format("is {}; must be {}", DescribeJson(*value), rule));
  for (std::size_t i = 0; i < value->size(); ++i) {
    const json& formula = (*value)[i];
    if (formula.is_number()) {
      formulas.Add(fmt::format("{}", formula.get<double>()));
    } else if (const auto text = reader.ReadString(formula, fmt::format("{}[{}]", key, i))) {
      formulas.Add(std::string(*text));
    }
  }
}

void ReadNonlinear(const json& root, JsonReader& reader, v1::NonlinearProblem& problem) {
  ReadFormulasKey(root, "f", "a list of m formulas in t, x1, x2, ... and y1, y2, ..., as in [\"x2\", \"y1-sin(x1)\"]",
                  reader, *problem.mutable_f());
  ReadFormulasKey(root, "g", "a list with a formula per complementarity pair, as in [\"y1+x1-1\"]", reader,
                  *problem.mutable_g());
  ReadNumbersKey(root, "x0", "the m values of the initial state", reader, *problem.mutable_x0());
  ReadTimes(root, reader, problem);
  if (root.contains("W")) ReadMatrixKey(root, "W", "", reader, *problem.mutable_w(), kFormulas);
  ReadNames(root, reader, problem);
}

// Whether `root` describes a nonlinear problem.
bool IsNonlinear(const json& root, JsonReader& reader) {
  return root.contains("kind") && reader.ReadWord(root["kind"], "kind", {"linear", "nonlinear"}) == "nonlinear";
}

// A file that has the name of one with arrays, and neither its content nor an object of JSON, so that the error is
// about the format that was meant.
bool ShouldBeArrayFile(const std::string& text, const std::string& source) {
  const bool named = source.ends_with(".mat") || source.ends_with(".npz") || source.ends_with(".npy");
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return named && (first == std::string::npos || text[first] != '{');
}

}  // namespace

absl::StatusOr<ProblemFile> ParseProblem(const std::string& text, const std::string& source,
                                         const AgreementCheck& agrees, const MatrixFiles& matrix_files) {
  if (IsArrayFile(text) || ShouldBeArrayFile(text, source)) {
    auto problem = ParseProblemArrays(text, source);
    if (!problem.ok()) return problem.status();
    return ProblemFile{.problem = *std::move(problem), .nonlinear = {}, .name = {}};
  }
  const auto root =
      ParseObject(text, source, "the keys A, B, N, M, x0 and T, or \"kind\": \"nonlinear\" and f, g, x0 and T");
  if (!root.ok()) return root.status();
  if (absl::Status kind = CheckKind(*root, FileKind::kSystem, source); !kind.ok()) return kind;

  ProblemFile file;
  JsonReader reader(source, matrix_files);
  const bool nonlinear = IsNonlinear(*root, reader);
  reader.RefuseUnknownKeys(*root, nonlinear ? NonlinearKeys() : ProblemKeys(), "", AnnotationKeys());
  if (nonlinear) {
    ReadNonlinear(*root, reader, file.nonlinear.emplace());
  } else {
    ReadLinear(*root, agrees, reader, file.problem);
    RefuseDecimalCommas(text, file.problem, reader);
  }

  if (root->contains("annotations") && !(*root)["annotations"].is_object()) {
    reader.Refuse("annotations", "must be an object; it may hold anything");
  }
  if (root->contains("name")) file.name = reader.ReadString((*root)["name"], "name").value_or("");

  const absl::Status status = reader.status();
  if (!status.ok()) return status;
  return file;
}

ordered_json ProblemJson(const v1::Problem& problem) {
  ordered_json file = ordered_json::object();
  file["A"] = MatrixJson(problem.a());
  file["B"] = MatrixJson(problem.b());
  file["N"] = MatrixJson(problem.n());
  file["M"] = MatrixJson(problem.m());
  if (problem.has_e()) file["E"] = MatrixJson(problem.e());
  ordered_json f = SourceJson(problem.f(), problem.x0_size());
  if (!f.is_null()) file["f"] = std::move(f);
  ordered_json g = SourceJson(problem.g(), static_cast<int>(ShapeOf(problem.m()).rows));
  if (!g.is_null()) file["g"] = std::move(g);
  file["x0"] = problem.x0();
  file["T"] = problem.horizon();
  if (!problem.state_names().empty()) file["states"] = problem.state_names();
  if (!problem.pair_names().empty()) file["pairs"] = problem.pair_names();
  for (const v1::Parameter& parameter : problem.parameters()) file["parameters"][parameter.name()] = parameter.value();
  if (!problem.break_points().empty()) file["break_points"] = problem.break_points();
  if (problem.rule() != v1::SOLUTION_RULE_UNSPECIFIED) file["rule"] = Word(problem.rule());
  if (problem.has_selector()) {
    file["selector"] = {{"C", MatrixJson(problem.selector().c())}, {"b", problem.selector().b()}};
  }
  WriteOutputs(problem, file);
  if (!problem.y0().empty()) file["y0"] = problem.y0();
  return file;
}

absl::StatusOr<ProblemFile> ReadProblemFile(const std::string& path, const AgreementCheck& agrees) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  return ParseProblem(*text, SourceName(path), agrees);
}

}  // namespace dlcs::client
