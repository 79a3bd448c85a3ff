// SPDX-License-Identifier: Apache-2.0
#include "tests/support/discrete_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <variant>

#include "tests/support/json_arrays.h"
#include "tests/support/paths.h"

namespace dlcs::testing {
namespace {

using Json = nlohmann::json;

// Zero, of that size, where there is none.
Vector VectorOr0(const Json& system, const char* key, Index size) {
  return system.contains(key) ? ReadVector(system[key]) : Vector(Vector::Zero(size));
}

// Empty where there is none.
Matrix MatrixOrEmpty(const Json& system, const char* key) {
  return system.contains(key) ? ReadMatrix(system[key]) : Matrix();
}

std::vector<SwitchCondition> ReadConditions(const Json& switch_json, const char* key) {
  std::vector<SwitchCondition> conditions;
  for (const Json& row : switch_json.value(key, Json::array())) {
    conditions.push_back({row[0].get<Index>(), row[1].get<double>()});
  }
  return conditions;
}

Switch ReadSwitch(const Json& json, double horizon) {
  Switch result{.name = json["name"], .start = json["start"] != 0, .set = {}, .reset = {}};
  result.delay = json.value("delay", 0.0);
  const std::string kind = json["kind"];
  if (kind == "given") {
    result.kind = SwitchKind::kGiven;
    result.edges = json["edges"].get<std::vector<double>>();
    std::erase_if(result.edges, [horizon](double time) { return time > horizon; });
    return result;
  }
  if (kind == "latch") {
    result.set = ReadConditions(json, "set");
    result.reset = ReadConditions(json, "reset");
    result.set_dominates = json.value("dominant", "reset") == "set";
    return result;
  }
  const auto control = json["control"].get<Index>();
  result.set = {{control, json["on"]}};
  const std::vector<SwitchCondition> off = {{control, json["off"], true}};
  if (kind == "thresholds") {
    result.reset = off;
    return result;
  }
  EXPECT_EQ(kind, "clocked");
  result.kind = SwitchKind::kClocked;
  result.at_clock = off;
  result.reset = ReadConditions(json, "reset");
  if (json.contains("edge")) {
    result.edge = json["edge"].get<Index>();
    return result;
  }
  const double first = json["times"][0], period = json["times"][1];
  for (int k = 0; first + k * period <= horizon; ++k) result.clock.push_back(first + k * period);
  return result;
}

StateReset ReadReset(const Json& json) {
  StateReset reset{.times = json.value("times", std::vector<double>()), .edge = {}, .J = {}, .j = {}};
  if (json.contains("edge")) {
    reset.edge = json["edge"][0].get<Index>();
    reset.value = json["edge"][1] != 0;
  }
  reset.J = MatrixOrEmpty(json, "J");
  reset.j = ReadVector(json["j"]);
  return reset;
}

}  // namespace

std::vector<std::string> DiscreteCaseNames() {
  std::vector<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(ProjectPath("tests/discrete"))) {
    if (file.path().extension() == ".json") names.push_back(file.path().stem());
  }
  std::sort(names.begin(), names.end());
  return names;
}

DiscreteCase LoadDiscreteCase(const std::string& name) {
  std::ifstream file(ProjectPath("tests/discrete/" + name + ".json"));
  const Json json = Json::parse(file, nullptr, /*allow_exceptions=*/false);
  EXPECT_TRUE(json.is_object()) << name;
  const Json &system = json["system"], &expected = json["expected"];
  DiscreteCase result;
  Problem& problem = result.problem;
  problem.x0 = ReadVector(system["x0"]);
  problem.horizon = system["T"];
  const Index m = problem.x0.size();
  problem.A = system.contains("A") ? MatrixOrEmpty(system, "A") : Matrix(Matrix::Zero(m, m));
  problem.f = TimeFunction::Constant(VectorOr0(system, "f", m));
  Switching& switching = problem.switching;
  switching.F = MatrixOrEmpty(system, "F");
  switching.C = MatrixOrEmpty(system, "C");
  switching.H = MatrixOrEmpty(system, "H");
  if (system.contains("h")) switching.h = ReadVector(system["h"]);
  switching.order = system.value("order", std::vector<std::string>());
  for (const Json& of : system["switches"]) switching.switches.push_back(ReadSwitch(of, problem.horizon));
  for (const Json& of : system.value("resets", Json::array())) switching.resets.push_back(ReadReset(of));

  for (const Json& flip : expected.value("flips", Json::array())) {
    result.flips.push_back({flip[0].get<double>(), flip[1].get<std::string>(), flip[2] != 0});
  }
  result.order_is_free = expected.contains("order_within_an_instant_free");
  if (expected.contains("x")) result.end = ReadVector(expected["x"]);
  result.refused = expected.value("refused", "");
  result.refused_at = expected.value("time", 0.0);
  result.names = expected.value("switches", std::vector<std::string>());
  result.file_order_decides = expected.contains("race_at_start");
  return result;
}

void ChangeUnits(const std::vector<double>& state_units, const std::vector<double>& control_units, double time_unit,
                 DiscreteCase& the_case) {
  Problem& problem = the_case.problem;
  Switching& switching = problem.switching;
  Vector x(problem.num_states()), c(std::max({switching.C.rows(), switching.H.rows(), switching.h.size()}));
  for (Index i = 0; i < x.size(); ++i) x[i] = state_units[static_cast<std::size_t>(i) % state_units.size()];
  for (Index i = 0; i < c.size(); ++i) c[i] = control_units[static_cast<std::size_t>(i) % control_units.size()];
  const Vector per_x = x.cwiseInverse(), per_c = c.cwiseInverse();
  // In the new units numbers are the old ones times the inverse of the unit.
  problem.A = Matrix(time_unit * (per_x.asDiagonal() * problem.A.Dense() * x.asDiagonal()));
  Vector f = std::get<ConstantFunction>(problem.f.pieces.front().function).value;
  problem.f = TimeFunction::Constant(time_unit * f.cwiseProduct(per_x));
  problem.x0 = problem.x0.cwiseProduct(per_x);
  problem.horizon /= time_unit;
  if (switching.F.size() > 0) switching.F = time_unit * (per_x.asDiagonal() * switching.F);
  if (switching.C.size() > 0) switching.C = per_c.asDiagonal() * switching.C * x.asDiagonal();
  if (switching.H.size() > 0) switching.H = per_c.asDiagonal() * switching.H;
  if (switching.h.size() > 0) switching.h = switching.h.cwiseProduct(per_c);
  const auto scale = [time_unit](std::vector<double>& times) {
    for (double& time : times) time /= time_unit;
  };
  for (Switch& of : switching.switches) {
    for (auto* conditions : {&of.set, &of.reset, &of.at_clock}) {
      for (SwitchCondition& condition : *conditions) condition.level *= per_c[condition.control];
    }
    scale(of.edges);
    scale(of.clock);
    of.delay /= time_unit;
  }
  for (StateReset& reset : switching.resets) {
    scale(reset.times);
    reset.J = per_x.asDiagonal() * reset.J * x.asDiagonal();
    reset.j = reset.j.cwiseProduct(per_x);
  }
  for (NamedFlip& flip : the_case.flips) flip.time /= time_unit;
  if (the_case.end) *the_case.end = the_case.end->cwiseProduct(per_x);
  the_case.refused_at /= time_unit;
}

void ReverseSwitches(DiscreteCase& the_case) {
  Switching& switching = the_case.problem.switching;
  const auto count = static_cast<Index>(switching.switches.size());
  const auto reverse = [count](std::optional<Index>& index) {
    if (index) index = count - 1 - *index;
  };
  std::reverse(switching.switches.begin(), switching.switches.end());
  if (switching.F.size() > 0) switching.F = switching.F.rowwise().reverse().eval();
  if (switching.H.size() > 0) switching.H = switching.H.rowwise().reverse().eval();
  for (Switch& of : switching.switches) reverse(of.edge);
  for (StateReset& reset : switching.resets) reverse(reset.edge);
}

}  // namespace dlcs::testing
