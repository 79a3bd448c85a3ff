// SPDX-License-Identifier: Apache-2.0
#include "core/problem/problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/format_number.h"
#include "core/problem/formula_switching.h"
#include "core/problem/mass_factor.h"
#include "core/problem/problem_checks.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

struct SampleTime {
  double time;
  Side side;
};

// 257 even times, and both sides of every break point.
std::vector<SampleTime> SampleTimes(const TimeAxis& axis) {
  constexpr int kIntervals = 256;
  std::vector<SampleTime> samples;
  for (int k = 0; k < kIntervals; ++k) samples.push_back({axis.horizon * k / kIntervals, Side::kRight});
  samples.push_back({axis.horizon, Side::kLeft});
  for (const double time : axis.break_points) {
    samples.push_back({time, Side::kLeft});
    samples.push_back({time, Side::kRight});
  }
  std::stable_sort(samples.begin(), samples.end(),
                   [](const SampleTime& a, const SampleTime& b) { return a.time < b.time; });
  return samples;
}

// Formats a formula for a message. A long formula, as a program writes it, is cut after its head.
std::string Quoted(const std::string& formula) {
  constexpr std::size_t kLongest = 80;
  return '"' + (formula.size() <= kLongest ? formula : formula.substr(0, kLongest) + "...") + '"';
}

// Returns the name of component `i` of a piece, such as f.pieces[2][0].
std::string NameOf(const TimeFunction& function, const std::string& field, std::size_t piece, Index i) {
  return field + (function.pieces.size() > 1 ? ".pieces[" + std::to_string(piece) + "]" : "") + "[" +
         std::to_string(i) + "]";
}

const std::string& FormulaOf(const TimeFunction& function, const AnalyzedComponent& component) {
  const TimePiece& piece = function.pieces[component.piece].function;
  return std::get<FormulaFunction>(piece).formulas[static_cast<std::size_t>(component.component)];
}

// How component `i` of the piece that holds at `sample` is called and written.
Violation NonFiniteValue(const TimeFunction& function, const std::string& field, Index i, SampleTime sample,
                         double value) {
  std::size_t piece = 0;
  for (std::size_t k = 1; k < function.pieces.size(); ++k) {
    const double start = function.pieces[k].start;
    if (sample.side == Side::kRight ? start <= sample.time : start < sample.time) piece = k;
  }
  Violation violation{.field = NameOf(function, field, piece, i), .description = "no finite value"};
  if (const auto* formulas = std::get_if<FormulaFunction>(&function.pieces[piece].function)) {
    violation.description = Quoted(formulas->formulas[static_cast<std::size_t>(i)]) + " has no finite value";
  }
  violation.description += " at t = " + NumberText(sample.time) + " (" + NumberText(value) + ")";
  return violation;
}

// Reports formulas that cannot be used on [0, horizon].
void CheckFormulas(const TimeFunction& function, double horizon, const std::string& field, ViolationList& list) {
  if (function.is_lifted()) return CheckFormulas(function.Inner(), horizon, field + ".of", list);
  for (const AnalyzedComponent& component : AnalyzeFormulas(function, horizon)) {
    const std::string& refusal = component.formula->switching.refusal;
    if (refusal.empty()) continue;
    list.Add(NameOf(function, field, component.piece, component.component),
             Quoted(FormulaOf(function, component)) + " " + refusal);
  }
}

// f, g and h of the outputs, where there are outputs, with their names and sizes.
struct Source {
  const char* field;
  const TimeFunction* function;
  Index size;
};
std::vector<Source> SourcesOf(const Problem& problem) {
  std::vector<Source> sources = {{"f", &problem.f, problem.num_states()}};
  if (problem.num_constraints() > 0) sources.push_back({"g", &problem.g, problem.num_constraints()});
  const Outputs& outputs = problem.outputs;
  if (outputs.size() > 0) sources.push_back({"outputs.h", &outputs.h, outputs.size()});
  return sources;
}

// The formulas together may switch as often as one alone.
void CheckNumberOfSwitches(const Problem& problem, ViolationList& list) {
  std::vector<double> found;
  std::string field = "f";
  for (const auto& [name, function, size] : SourcesOf(problem)) {
    for (const AnalyzedComponent& component : AnalyzeFormulas(*function, problem.horizon)) {
      const std::vector<double>& times = component.formula->switching.times;
      found.insert(found.end(), times.begin(), times.end());
      field = times.empty() ? field : name;
    }
  }
  if (found.size() <= kMaxSwitchingTimes) return;
  const std::size_t count = MergeBreakPoints({}, found, problem.horizon).size();
  if (count <= kMaxSwitchingTimes) return;
  list.Add(field, std::to_string(count) + " switching times of all formulas; at most " +
                      std::to_string(kMaxSwitchingTimes) + " are allowed together");
}

void CheckMass(const Problem& problem, ViolationList& list) {
  const Index rows = problem.E.rows(), columns = problem.E.cols(), m = problem.num_states();
  if (rows == 0 && columns == 0) return;
  CheckMatrix(problem.E, m, m, "m x m = " + ShapeText(m, m) + " (m from A)", "E", list);
  if (rows != columns || rows == 0 || !problem.E.AllFinite()) return;
  if (std::string why = WhySingular(problem.E); !why.empty()) list.Add("E", std::move(why));
}

void AddWarnings(const TimeFunction& function, double horizon, const std::string& field,
                 std::vector<std::string>& warnings) {
  if (function.is_lifted()) return AddWarnings(function.Inner(), horizon, field + ".of", warnings);
  for (const AnalyzedComponent& component : AnalyzeFormulas(function, horizon)) {
    for (const std::string& warning : component.formula->switching.warnings) {
      warnings.push_back("Of " + NameOf(function, field, component.piece, component.component) + ", " +
                         Quoted(FormulaOf(function, component)) + ", " + warning + ".");
    }
  }
}

// Names the first time where a component has no finite value, once per component.
void CheckValues(const TimeFunction& function, Index size, const TimeAxis& axis, const std::vector<SampleTime>& samples,
                 const std::string& field, ViolationList& list) {
  if (function.is_lifted()) {  // finite where the lifted functions are
    return CheckValues(function.Inner(), function.lift.cols(), axis, samples, field + ".of", list);
  }
  absl::StatusOr<TimeFunctionEvaluator> evaluator = TimeFunctionEvaluator::Create(function, size, axis);
  if (!evaluator.ok()) return;  // has been listed with its rule
  std::vector<bool> reported(static_cast<std::size_t>(size), false);
  Vector value(size);
  for (const SampleTime& sample : samples) {
    evaluator->Evaluate(sample.time, sample.side, value);
    if (std::isfinite(value.sum())) continue;  // then so is each of them
    for (Index i = 0; i < size; ++i) {
      if (std::isfinite(value(i)) || reported[static_cast<std::size_t>(i)]) continue;
      reported[static_cast<std::size_t>(i)] = true;
      Violation violation = NonFiniteValue(function, field, i, sample, value(i));
      list.Add(std::move(violation.field), std::move(violation.description));
    }
  }
}

}  // namespace

std::vector<Violation> Validate(const Problem& problem) {
  const Index m = problem.num_states();
  const Index n = problem.num_constraints();
  ViolationList list;
  CheckSquareMatrix(problem.A, "m x m for m states", "A", list);
  const bool has_pairs = n > 0 || problem.switching.is_empty();
  if (has_pairs) {
    CheckMatrix(problem.B, m, n, "m x n = " + ShapeText(m, n) + " (m from A, n from M)", "B", list);
    CheckMatrix(problem.N, n, m, "n x m = " + ShapeText(n, m) + " (m from A, n from M)", "N", list);
    CheckSquareMatrix(problem.M, "n x n for n complementary pairs", "M", list);
  }
  Validate(problem.f, m, "f", list);
  if (has_pairs) Validate(problem.g, n, "g", list);
  CheckInitialState(problem.x0, m, list);
  const bool has_horizon = std::isfinite(problem.horizon) && problem.horizon > 0;
  if (!has_horizon) list.Add("T", NumberText(problem.horizon) + "; must be finite and greater than 0");
  CheckBreakPoints(problem.break_points, has_horizon ? problem.horizon : HUGE_VAL, list);
  CheckStart(problem.y0, problem.rule, n, list);
  CheckSelector(problem.selector, problem.rule, n, list);
  CheckMass(problem, list);
  CheckSwitching(problem.switching, m, n, has_horizon ? problem.horizon : HUGE_VAL, list);
  if (!problem.switching.is_empty() && problem.has_mass()) {
    list.Add("E", "a mass matrix beside switches; multiply the equations by its inverse");
  }
  CheckOutputs(problem.outputs, m, n, list);
  CheckMeasurements(problem.measurements, problem.outputs, has_horizon ? problem.horizon : HUGE_VAL, list);
  // Values are looked at last: they need the times, and a problem with other faults is read again anyway.
  if (list.empty()) {
    for (const Source& source : SourcesOf(problem)) {
      CheckFormulas(*source.function, problem.horizon, source.field, list);
    }
    CheckNumberOfSwitches(problem, list);
  }
  if (list.empty()) {
    const TimeAxis axis = AxisOf(problem);
    const std::vector<SampleTime> samples = SampleTimes(axis);
    for (const Source& source : SourcesOf(problem)) {
      CheckValues(*source.function, source.size, axis, samples, source.field, list);
    }
  }
  return std::move(list).Take();
}

std::vector<double> BreakPoints(const Problem& problem) {
  std::vector<double> found;
  for (const Source& source : SourcesOf(problem)) {
    const std::vector<double> of_source = BreakPoints(*source.function, problem.horizon);
    // Gates of a circuit switch all sources at the same thousands of times.
    if (of_source != found) found.insert(found.end(), of_source.begin(), of_source.end());
  }
  return MergeBreakPoints(problem.break_points, found, problem.horizon);
}

TimeAxis AxisOf(const Problem& problem) { return {problem.horizon, BreakPoints(problem)}; }

std::vector<std::string> SourceWarnings(const Problem& problem) {
  std::vector<std::string> warnings;
  for (const Source& source : SourcesOf(problem)) {
    AddWarnings(*source.function, problem.horizon, source.field, warnings);
  }
  return warnings;
}

}  // namespace dlcs
