// SPDX-License-Identifier: Apache-2.0
#include "core/event_driven/mode_sizes.h"

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

#include "core/discretization/sources.h"
#include "core/discretization/step_sources.h"
#include "core/event_driven/magnitudes.h"
#include "core/event_driven/mode.h"
#include "core/linalg/abs_times.h"
#include "core/linalg/bounded_sum.h"

namespace dlcs {
namespace {

// x' as a function of x, without the entries that are the rounding of their terms: they would join what is not coupled.
Matrix DynamicsOf(const Mode& mode) {
  const Index rest = mode.F.rows() - mode.num_algebraic;
  const Matrix terms = mode.is_explicit()
                           ? mode.F_terms
                           : Matrix(mode.solve_slope.leftCols(rest).cwiseAbs() * mode.F_terms.topRows(rest));
  return (mode.dynamics.array().abs() > RoundingOf(8) * terms.array()).select(mode.dynamics, 0);
}

// The sizes of the terms of the sources in x'.
Vector SourcesOf(const Mode& mode, const DataSizes& sizes) {
  if (mode.source_g.size() == 0) return sizes.f_terms;
  if (mode.is_explicit()) return sizes.f_terms + AbsTimes(mode.source_g, sizes.g_terms);
  const Index rest = mode.F.rows() - mode.num_algebraic;
  return sizes.f_terms +
         AbsTimes(mode.solve_slope.leftCols(rest), AbsTimes(mode.source_g.topRows(rest), sizes.g_terms));
}

// The guards, y_i of the active pairs and w_i of the others, as functions of x: sizes of their rows and of the terms of
// their sources.
struct GuardRows {
  Matrix of_x;
  Vector of_sources;
};
GuardRows GuardRowsOf(const Mode& mode, const Matrix& dynamics, const Vector& slope_sources, const DataSizes& sizes) {
  GuardRows rows{mode.guard.state.cwiseAbs(), AbsTimes(mode.guard.g, sizes.g_terms)};
  if (mode.is_explicit()) return rows;
  rows.of_x += mode.guard.slope.cwiseAbs() * dynamics.cwiseAbs();
  rows.of_sources += AbsTimes(mode.guard.slope, slope_sources) + AbsTimes(mode.guard.f, sizes.f_terms);
  return rows;
}

// The active sets of the solution: those of its modes, or that at its end.
std::set<std::vector<Index>> ActiveSetsOf(const Solution& solution) {
  std::set<std::vector<Index>> sets;
  std::set<Index> active;
  for (const SwitchingTime& switching : solution.switching_times) {
    active.insert(switching.entering.begin(), switching.entering.end());
    for (const Index i : switching.leaving) active.erase(i);
    if (switching.kind != SwitchingKind::kCoupledStepsBegin) sets.emplace(active.begin(), active.end());
  }
  if (!sets.empty() || solution.y.cols() == 0) return sets;
  for (Index i = 0; i < solution.y.rows(); ++i) {
    if (solution.y(i, solution.y.cols() - 1) > 0) active.insert(i);
  }
  return {{active.begin(), active.end()}};
}

// R of one mode.
AllSizesBeside SizesOfMode(const Problem& problem, const Mode& mode, const DataSizes& sizes,
                           const TrajectoryErrors& errors) {
  const Matrix dynamics = DynamicsOf(mode);
  const Vector sources = SourcesOf(mode, sizes);
  AllSizesBeside all;
  SizesBeside& states = all.of(ComponentKind::kState);
  states = StatesBeside(dynamics.sparseView(), sources, problem.horizon, errors.x);
  if (errors.y.size() == 0) return all;
  ErrorsByCause guards = errors.w;
  for (const Index i : mode.active) {
    guards.own[i] = errors.y.own[i];
    guards.truncation[i] = errors.y.truncation[i];
    guards.rounding[i] = errors.y.rounding[i];
  }
  SizesBeside &of_y = all.of(ComponentKind::kPair), &of_w = all.of(ComponentKind::kSlack);
  const GuardRows rows = GuardRowsOf(mode, dynamics, sources, sizes);
  of_y = RowsBeside(rows.of_x.sparseView(), states, ComponentKind::kPair, guards, rows.of_sources);
  of_w = RowsBeside(rows.of_x.sparseView(), states, ComponentKind::kSlack, guards, rows.of_sources);
  // The w_i of an active pair is zero, or what rounding leaves of its terms.
  Matrix of_terms = problem.N.Dense().cwiseAbs();
  Vector sources_of_terms = sizes.g_terms;
  const Matrix M = problem.M.Dense().cwiseAbs();
  for (const Index i : mode.active) {
    of_terms += M.col(i) * rows.of_x.row(i);
    sources_of_terms += M.col(i) * rows.of_sources[i];
  }
  const SizesBeside of_summed =
      RowsBeside(of_terms.sparseView(), states, ComponentKind::kSlack, errors.w, sources_of_terms);
  const Matrix N = problem.N.Dense().cwiseAbs();
  SizesBeside of_speeds;  // of w_i' through x
  if (!(problem.M.Dense().diagonal().array() > 0).all()) {
    of_speeds = RowsBeside((N * dynamics.cwiseAbs()).sparseView(), states, ComponentKind::kPair, guards,
                           problem.N.AbsTimes(sources));
  }
  for (Index i = 0; i < guards.size(); ++i) {
    const bool is_active = std::binary_search(mode.active.begin(), mode.active.end(), i);
    if (!is_active) {
      // A y_i that is missing is w_i / M_ii, or holds w_i through x.
      const double divisor = problem.M.Dense()(i, i), moves = N.row(i).dot(problem.B.Dense().col(i).cwiseAbs());
      of_y.size[i] = divisor > 0 ? of_w.size[i] / divisor : moves > 0 ? of_speeds.size[i] / moves : 0;
      continue;
    }
    of_w.size[i] = of_summed.size[i];
    of_w.beside[static_cast<std::size_t>(i)] = of_summed.beside[static_cast<std::size_t>(i)];
  }
  if (errors.outputs.size() == 0) return all;
  // C x + D y, with y_S = guard · x + ....
  const Index outputs = errors.outputs.size();
  Matrix of_x = problem.outputs.C.Dense().topRows(outputs).cwiseAbs();
  Vector of_sources = Vector::Zero(outputs);
  const Matrix D = problem.outputs.D.Dense().topRows(outputs).cwiseAbs();
  for (const Index i : mode.active) {
    of_x += D.col(i) * rows.of_x.row(i);
    of_sources += D.col(i) * rows.of_sources[i];
  }
  all.of(ComponentKind::kOutput) =
      RowsBeside(of_x.sparseView(), states, ComponentKind::kOutput, errors.outputs, of_sources);
  return all;
}

}  // namespace

AllSizesBeside SizesBesideOf(const Problem& problem, Selection selection, const Solution& solution) {
  const TrajectoryErrors& errors = solution.accuracy.errors;
  AllSizesBeside all;
  for (const ComponentKind kind : kComponentKinds) all.of(kind) = OwnSizes(errors.of(kind), kind);
  auto sources = Sources::Create(problem);
  // Beyond that, elimination takes seconds; a method that has formed the modes has taken more.
  constexpr Index kMostRows = 1000;
  const bool may_form_modes = solution.method == Method::kEventDriven || problem.A.is_dense() ||
                              problem.num_states() + problem.num_constraints() <= kMostRows;
  if (!may_form_modes || !sources.ok()) return all;
  SourceSampler sampler(*sources);
  DataSizes sizes = SizesOfData(problem, IsAlwaysLipschitz(selection), sampler);
  sizes.x = sizes.x.cwiseMax(errors.x.own);
  const ModeMaker maker(problem);
  for (const std::vector<Index>& active : ActiveSetsOf(solution)) {
    if (const auto mode = maker.MakeEquations(active, sizes)) all.RaiseTo(SizesOfMode(problem, *mode, sizes, errors));
  }
  return all;
}

void JudgeBesideModes(const Problem& problem, Selection selection, const Options& options, Solution& solution) {
  JudgeComponents(
      options, [&] { return SizesBesideOf(problem, selection, solution); }, solution.accuracy);
}

}  // namespace dlcs
