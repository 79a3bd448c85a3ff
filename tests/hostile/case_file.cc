// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/case_file.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <stdexcept>

#include "tests/support/paths.h"

namespace dlcs::hostile {

namespace {

using Json = nlohmann::json;

Eigen::VectorXd ReadVector(const Json& entries) {
  Eigen::VectorXd result(static_cast<Index>(entries.size()));
  for (size_t i = 0; i < entries.size(); ++i) result(static_cast<Index>(i)) = entries[i].get<double>();
  return result;
}

Eigen::MatrixXd ReadMatrix(const Json& rows) {
  Eigen::MatrixXd result(static_cast<Index>(rows.size()), static_cast<Index>(rows[0].size()));
  for (size_t i = 0; i < rows.size(); ++i) result.row(static_cast<Index>(i)) = ReadVector(rows[i]);
  return result;
}

// The place of `wanted` among the functions of `system`, where it is put with what its derivative needs.
Index PlaceOf(System& system, SourceFunction wanted) {
  using Kind = SourceFunction::Kind;
  if (wanted.kind == Kind::kPower && wanted.power > 0) PlaceOf(system, {Kind::kPower, wanted.power - 1, 0, 0});
  if (wanted.kind == Kind::kCosine) return PlaceOf(system, {Kind::kSine, 0, wanted.rate, wanted.phase}) + 1;
  std::vector<SourceFunction>& functions = system.functions;
  for (size_t k = 0; k < functions.size(); ++k) {
    if (functions[k].kind == wanted.kind && functions[k].power == wanted.power && functions[k].rate == wanted.rate &&
        functions[k].phase == wanted.phase)
      return static_cast<Index>(k);
  }
  functions.push_back(wanted);
  if (wanted.kind == Kind::kSine) functions.push_back({Kind::kCosine, 0, wanted.rate, wanted.phase});
  return static_cast<Index>(functions.size()) - (wanted.kind == Kind::kSine ? 2 : 1);
}

// One term: a number, a function, or a number times a function.
std::pair<double, SourceFunction> ReadTerm(const std::string& text) {
  using Kind = SourceFunction::Kind;
  static const std::string number = R"(([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?))";
  static const std::regex pattern("(-?)(?:" + number + ")?\\*?(?:(sin|cos|exp)\\((?:" + number + "\\*)?t(?:\\+?" +
                                  number + ")?\\)|t(?:\\*\\*([0-9]))?)?");
  std::smatch match;
  if (text.empty() || !std::regex_match(text, match, pattern)) throw std::runtime_error("cannot read the term " + text);
  const double factor = (match[1].length() > 0 ? -1.0 : 1.0) * (match[2].matched ? std::stod(match[2]) : 1.0);
  const std::string name = match[3];
  const double rate = match[4].matched ? std::stod(match[4]) : 1.0,
               phase = match[5].matched ? std::stod(match[5]) : 0.0;
  if (name == "sin") return {factor, {Kind::kSine, 0, rate, phase}};
  if (name == "cos") return {factor, {Kind::kCosine, 0, rate, phase}};
  if (name == "exp") return {factor, {Kind::kExponential, 0, rate, 0}};
  const bool has_t = text.back() == 't' || match[6].matched;
  return {factor, {Kind::kPower, match[6].matched ? std::stoi(match[6]) : has_t ? 1 : 0, 0, 0}};
}

struct Factor {
  Index row, function;
  double value;
};

// Adds the functions of `formulas` to the system.
std::vector<Factor> ReadFormulas(System& system, const Json& formulas, Index first_row) {
  std::vector<Factor> factors;
  for (size_t i = 0; i < formulas.size(); ++i) {
    const Index row = first_row + static_cast<Index>(i);
    std::string rest = formulas[i].is_number() ? formulas[i].dump() : formulas[i].get<std::string>();
    static const std::regex after(R"(([^*]+)\*\(t > ([^)]+)\))");
    while (!rest.empty()) {
      const size_t plus = rest.find(" + ");
      const std::string term = rest.substr(0, plus);
      rest = plus == std::string::npos ? "" : rest.substr(plus + 3);
      if (std::smatch match; std::regex_match(term, match, after)) {
        system.kinks.push_back(
            {KinkedTerm::Kind::kAfter, static_cast<int>(row), std::stod(match[1]), 0, std::stod(match[2])});
        continue;
      }
      const auto [value, function] = ReadTerm(term);
      factors.push_back({row, PlaceOf(system, function), value});
    }
  }
  return factors;
}

}  // namespace

std::vector<std::string> CaseNames() {
  std::vector<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(testing::ProjectPath("tests/hostile/cases"))) {
    if (file.path().extension() == ".json") names.push_back(file.path().stem());
  }
  std::sort(names.begin(), names.end());
  return names;
}

CaseFile ReadCase(const std::string& name) {
  std::ifstream file(testing::ProjectPath("tests/hostile/cases/" + name + ".json"));
  if (!file) throw std::runtime_error("cannot read " + name);
  const Json json = Json::parse(file);
  CaseFile result;
  System& system = result.system;
  system.traits = name;
  system.A = ReadMatrix(json.at("A"));
  system.B = ReadMatrix(json.at("B"));
  system.N = ReadMatrix(json.at("N"));
  system.M = ReadMatrix(json.at("M"));
  system.x0 = ReadVector(json.at("x0"));
  system.horizon = json.at("T").get<double>();
  system.functions = {{}};
  system.starts = {0};
  const Index m = system.num_states(), n = system.num_pairs();
  std::vector<Factor> factors = ReadFormulas(system, json.at("f"), 0);
  for (const Factor& factor : ReadFormulas(system, json.at("g"), m)) factors.push_back(factor);
  const Index size = static_cast<Index>(system.functions.size());
  system.F = {Eigen::MatrixXd::Zero(m, size)};
  system.G = {Eigen::MatrixXd::Zero(n, size)};
  for (const Factor& factor : factors) {
    (factor.row < m ? system.F[0](factor.row, factor.function) : system.G[0](factor.row - m, factor.function)) +=
        factor.value;
  }
  system.rank_matters = json.value("rank_matters", false);
  system.several_solutions = json.value("several_solutions", false);
  for (const Json& expected : json.value("refs", Json::array())) {
    result.expected.push_back({expected.at("t").get<double>(), ReadVector(expected.at("x"))});
  }
  result.accuracy = json.value("reference_accuracy", result.accuracy);
  return result;
}

}  // namespace dlcs::hostile
