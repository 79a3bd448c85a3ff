// SPDX-License-Identifier: Apache-2.0

// GCC 12 warns of alternatives of a moved variant that it cannot hold.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include "tests/support/cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/linalg/norms.h"
#include "tests/support/json_arrays.h"
#include "tests/support/paths.h"

namespace dlcs::testing {
namespace {

using Json = nlohmann::json;

FormulaFunction ReadFormulas(const Json& formulas) { return {formulas.get<std::vector<std::string>>()}; }

TimeFunction ReadSource(const Json& json, const char* key) {
  if (!json.contains("pieces")) return TimeFunction::Formulas(ReadFormulas(json.at(key)).formulas);
  TimeFunction function;
  for (const Json& piece : json.at("pieces")) {
    function.pieces.push_back({piece.at("t0").get<double>(), ReadFormulas(piece.at(key))});
  }
  return function;
}

}  // namespace

std::vector<std::string> CaseNames() {
  std::vector<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(ProjectPath("tests/cases"))) {
    if (file.path().extension() == ".json") names.push_back(file.path().stem());
  }
  std::sort(names.begin(), names.end());
  return names;
}

Case LoadCase(const std::string& name) {
  std::ifstream file(CasePath(name));
  EXPECT_TRUE(file) << name;
  const Json json = Json::parse(file);
  Case result;
  result.name = name;
  Problem& problem = result.problem;
  problem.A = ReadMatrix(json.at("A"));
  problem.B = ReadMatrix(json.at("B"));
  problem.N = ReadMatrix(json.at("N"));
  problem.M = ReadMatrix(json.at("M"));
  problem.x0 = ReadVector(json.at("x0"));
  problem.horizon = json.at("T").get<double>();
  problem.f = ReadSource(json, "f");
  problem.g = ReadSource(json, "g");
  const Json& about = json.at("annotations");
  for (const Json& ref : about.value("refs", Json::array())) {
    result.references.push_back(
        {ref.at("t").get<double>(), ReadVector(ref.at("x")), ReadVector(ref.at("y")), ReadVector(ref.at("By"))});
  }
  result.y_is_unique = about.value("y_unique", false);
  for (const Json& jump : about.value("state_jumps", Json::array())) {
    result.state_jumps.emplace_back(jump.at("t").get<double>(), ReadVector(jump.at("dx")));
  }
  if (about.contains("switchings")) result.num_switchings = about.at("switchings").get<std::size_t>();
  result.switching_times = about.value("switching_times_first", std::vector<double>());
  result.reference_accuracy = about.value("reference_self_diff", 0.0);
  return result;
}

std::vector<double> ReferenceTimes(const Case& the_case) {
  std::vector<double> times;
  for (const Reference& reference : the_case.references) times.push_back(reference.time);
  return times;
}

CaseError ErrorOf(const Case& the_case, const std::vector<double>& times, const Matrix& x, const Matrix& y) {
  CaseError error, scale;
  for (const Reference& reference : the_case.references) {
    const auto found = std::find_if(times.begin(), times.end(), [&](double t) {
      return std::abs(t - reference.time) <= 1e-9 * the_case.problem.horizon;
    });
    if (found == times.end()) {
      ADD_FAILURE() << the_case.name << ": no value at t = " << reference.time;
      return {NAN, NAN, NAN};
    }
    const Index k = found - times.begin();
    error.x = NanMax(error.x, MaxAbs(x.col(k) - reference.x));
    error.By = NanMax(error.By, MaxAbs(the_case.problem.B * y.col(k) - reference.By));
    error.y = NanMax(error.y, MaxAbs(y.col(k) - reference.y));
    scale.x = std::max(scale.x, MaxAbs(reference.x));
    scale.By = std::max(scale.By, MaxAbs(reference.By));
    scale.y = std::max(scale.y, MaxAbs(reference.y));
  }
  // A case whose y vanishes at all reference times is judged absolutely.
  const auto relative = [](double e, double s) { return s > 0 ? e / s : e; };
  return {relative(error.x, scale.x), relative(error.By, scale.By), relative(error.y, scale.y)};
}

}  // namespace dlcs::testing
