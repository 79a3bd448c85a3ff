// SPDX-License-Identifier: Apache-2.0

#include "core/nonlinear/functions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/format_number.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

absl::StatusOr<std::vector<Formula>> Compile(const std::vector<std::string>& texts, const FormulaVariables& variables,
                                             const TimeAxis& axis) {
  std::vector<Formula> formulas;
  for (const std::string& text : texts) {
    LookForStop();
    auto analyzed = AnalyzeFormula(text, variables, 0, axis.horizon);
    if (!analyzed.ok()) return analyzed.status();
    formulas.emplace_back(*std::move(analyzed), axis);
  }
  return formulas;
}

// The derivative of `value`, a function of `variable`, which is left as it was.
template <typename Value>
double Difference(Value value, double& variable) {
  const double center = variable;
  const double step = std::cbrt(std::numeric_limits<double>::epsilon()) * std::max(1.0, std::abs(center));
  const double right = center + step, left = center - step;  // the rounded values; the quotient uses their difference
  variable = right;
  const double above = value();
  variable = left;
  const double below = value();
  variable = center;
  if (std::isfinite(above) && std::isfinite(below)) return (above - below) / (right - left);
  const double here = value();
  return std::isfinite(above) ? (above - here) / (right - center) : (here - below) / (center - left);
}

}  // namespace

absl::StatusOr<NonlinearFunctions> NonlinearFunctions::Create(const NonlinearProblem& problem) {
  const FormulaVariables variables{problem.num_states(), problem.num_constraints(), problem.parameters};
  const TimeAxis axis{problem.horizon, BreakPoints(problem)};
  auto f = Compile(problem.f, variables, axis);
  if (!f.ok()) return f.status();
  auto g = Compile(problem.g, variables, axis);
  if (!g.ok()) return g.status();
  NonlinearFunctions functions;
  functions.f_ = *std::move(f);
  functions.g_ = *std::move(g);
  return functions;
}

Vector NonlinearFunctions::Values(std::vector<Formula>& formulas, double t, const Vector& x, const Vector& y) {
  Vector values(static_cast<Index>(formulas.size()));
  for (Index i = 0; i < values.size(); ++i) values[i] = formulas[i].Evaluate(t, x, y);
  return values;
}

Matrix NonlinearFunctions::Jacobian(std::vector<Formula>& formulas, bool by_x, double t, Vector x, Vector y) {
  Vector& variables = by_x ? x : y;
  Matrix jacobian = Matrix::Zero(static_cast<Index>(formulas.size()), variables.size());
  for (Index i = 0; i < jacobian.rows(); ++i) {
    LookForStop();
    Formula& formula = formulas[i];
    for (const Index j : by_x ? formula.states() : formula.constraints()) {
      jacobian(i, j) = Difference([&] { return formula.Evaluate(t, x, y); }, variables[j]);
    }
  }
  return jacobian;
}

std::vector<Index> NonlinearFunctions::ConstraintsAbsentFromG() const {
  std::vector<Index> absent;
  for (Index i = 0; i < static_cast<Index>(g_.size()); ++i) {
    const bool occurs = std::any_of(g_.begin(), g_.end(), [i](const Formula& formula) {
      return std::count(formula.constraints().begin(), formula.constraints().end(), i) > 0;
    });
    if (!occurs) absent.push_back(i);
  }
  return absent;
}

std::string DescribeNonFinite(const std::string& name, const std::vector<std::string>& formulas, const Vector& values,
                              double t) {
  constexpr std::size_t kLongest = 80;  // a formula longer than that was written by a program
  for (Index i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    std::string formula = formulas[static_cast<std::size_t>(i)];
    if (formula.size() > kLongest) formula = formula.substr(0, kLongest) + "...";
    return name + "[" + std::to_string(i) + "], \"" + formula + "\", is " + NumberText(values[i]) +
           " at t = " + NumberText(t);
  }
  return {};
}

}  // namespace dlcs
