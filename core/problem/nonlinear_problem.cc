// SPDX-License-Identifier: Apache-2.0

#include "core/problem/nonlinear_problem.h"

#include <cmath>
#include <utility>

#include "core/format_number.h"
#include "core/parallel/stop_scope.h"
#include "core/problem/formula_switching.h"
#include "core/problem/problem_checks.h"
#include "core/problem/validate.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

FormulaVariables VariablesOf(const NonlinearProblem& problem) {
  return {problem.num_states(), problem.num_constraints(), problem.parameters};
}

void CheckFormulas(const std::vector<std::string>& formulas, const FormulaVariables& variables,
                   const std::string& field, ViolationList& list) {
  for (std::size_t i = 0; i < formulas.size() && !list.full(); ++i) {
    LookForStop();
    const absl::StatusOr<FormulaTree> formula = ReadFormula(formulas[i], variables);
    if (!formula.ok()) list.Add(field + "[" + std::to_string(i) + "]", std::string(formula.status().message()));
  }
}

// What is known about each formula of f and g, by their names.
template <typename Look>
void ForEachFormula(const NonlinearProblem& problem, Look look) {
  const FormulaVariables variables = VariablesOf(problem);
  for (const auto& [field, formulas] : {std::pair{"f", &problem.f}, {"g", &problem.g}}) {
    for (std::size_t i = 0; i < formulas->size(); ++i) {
      const auto analyzed = AnalyzeFormula((*formulas)[i], variables, 0, problem.horizon);
      if (analyzed.ok()) look(field + std::string("[") + std::to_string(i) + "]", (*analyzed)->switching);
    }
  }
}

void CheckSwitches(const NonlinearProblem& problem, ViolationList& list) {
  ForEachFormula(problem, [&](const std::string& field, const FormulaSwitching& switching) {
    if (!switching.refusal.empty()) list.Add(field, switching.refusal);
  });
}

}  // namespace

std::vector<double> BreakPoints(const NonlinearProblem& problem) {
  std::vector<double> found;
  ForEachFormula(problem, [&](const std::string&, const FormulaSwitching& switching) {
    found.insert(found.end(), switching.times.begin(), switching.times.end());
  });
  return MergeBreakPoints(problem.break_points, found, problem.horizon);
}

std::vector<std::string> SourceWarnings(const NonlinearProblem& problem) {
  std::vector<std::string> warnings;
  ForEachFormula(problem, [&](const std::string& field, const FormulaSwitching& switching) {
    for (const std::string& warning : switching.warnings) warnings.push_back("Of " + field + ", " + warning + ".");
  });
  return warnings;
}

std::vector<Violation> Validate(const NonlinearProblem& problem) {
  const Index m = problem.num_states();
  const Index n = problem.num_constraints();
  ViolationList list;
  if (static_cast<Index>(problem.f.size()) != m) {
    list.Add("f", std::to_string(problem.f.size()) + " formulas; must be m = " + std::to_string(m) + " (from x0)");
  }
  CheckFormulas(problem.f, VariablesOf(problem), "f", list);
  if (n == 0) list.Add("g", "no formulas; must hold at least one");
  CheckFormulas(problem.g, VariablesOf(problem), "g", list);
  if (m == 0) list.Add("x0", "no components; must hold at least one");
  list.AddNonFiniteComponents(problem.x0, "x0");
  const bool has_horizon = std::isfinite(problem.horizon) && problem.horizon > 0;
  if (!has_horizon) list.Add("T", NumberText(problem.horizon) + "; must be finite and greater than 0");
  CheckBreakPoints(problem.break_points, has_horizon ? problem.horizon : HUGE_VAL, list);
  if (problem.W) {
    if (problem.W->rows() != m || problem.W->cols() != m) {
      list.Add("W",
               ShapeText(problem.W->rows(), problem.W->cols()) + "; must be m x m = " + ShapeText(m, m) + " (from x0)");
    }
    list.AddNonFiniteEntries(*problem.W, "W");
  }
  CheckParameters(problem.parameters, list);
  if (list.empty()) CheckSwitches(problem, list);
  return std::move(list).Take();
}

absl::Status CheckValid(const NonlinearProblem& problem, const Options& options) {
  std::vector<Violation> violations = Validate(problem);
  for (Violation& violation : Validate(options, problem.horizon)) violations.push_back(std::move(violation));
  for (Violation& violation : CheckOptions(problem, options)) violations.push_back(std::move(violation));
  return StatusOf(violations);
}

std::vector<Violation> CheckOptions(const NonlinearProblem& /*problem*/, const Options& options) {
  std::vector<Violation> violations;
  if (options.method != Method::kAuto && options.method != Method::kLaplaceIteration) {
    violations.push_back({"method", "nonlinear problems are solved by laplace-iteration only; must be that or auto"});
  }
  if (options.period != 0) {
    violations.push_back({"period", "periodic solutions of nonlinear problems are not searched for; must not be set"});
  }
  return violations;
}

}  // namespace dlcs
