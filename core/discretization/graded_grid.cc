// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/graded_grid.h"

#include <algorithm>
#include <cmath>

#include "core/discretization/grid.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// The step allowed at the distance `behind` from a layer: step / 4^k, with the least k >= 0.
double AllowedStep(double step, double behind, double shortest) {
  const double longest = std::max(shortest, behind / kStepsBehindLayer);
  while (step > longest * (1 + kSameNode)) step /= kRatioOfLevels;
  return step;
}

// Appends steps no longer than `step` over [begin, end], to the last run if they continue it.
void Append(double begin, double end, double step, bool starts_at_break, Grid& grid) {
  const Index steps = std::max<Index>(1, static_cast<Index>(std::ceil((end - begin) / step - kSameNode)));
  const double length = (end - begin) / static_cast<double>(steps);
  if (std::abs(length - step) > kSameNode * step) step = length;  // lengths that agree to rounding are one length
  if (grid.runs.empty() || starts_at_break || grid.runs.back().step != step) {
    grid.runs.push_back({.first_node = grid.num_steps(), .begin = begin, .starts_at_break = starts_at_break});
  }
  Run& run = grid.runs.back();
  run.steps += steps;
  run.end = end;
  run.step = step;
  for (Index k = 1; k < steps; ++k) grid.times.push_back(begin + length * static_cast<double>(k));
  grid.times.push_back(end);
  grid.longest_step = std::max(grid.longest_step, length);
}

// Appends one step [begin, end] of `run`, divided so that its parts are short enough behind `layer`.
void AppendDivided(const Run& run, double begin, double end, double layer, double shortest, Grid& grid) {
  bool starts_at_break = run.starts_at_break && begin == run.begin;
  while (begin < end) {
    const double step = AllowedStep(run.step, begin - layer, shortest);
    double until = layer + kRatioOfLevels * kStepsBehindLayer * step;
    if (step == run.step || until > end - kSameNode * step) until = end;
    Append(begin, until, step, starts_at_break, grid);
    begin = until;
    starts_at_break = false;
  }
}

Grid Graded(const Grid& grid, const std::vector<double>& layers, double shortest) {
  Grid graded;
  graded.times.push_back(grid.times.front());
  std::vector<Index> new_nodes = {0};
  std::size_t next = 0;
  double layer = layers.front();
  for (const Run& run : grid.runs) {
    const double* times = grid.times.data() + run.first_node;
    while (next < layers.size() && layers[next] <= run.begin) layer = layers[next++];
    for (Index k = 0; k < run.steps; ++k) {
      AppendDivided(run, times[k], times[k + 1], layer, shortest, graded);
      new_nodes.push_back(graded.num_steps());
    }
  }
  for (const Index node : grid.output_nodes) {
    graded.output_nodes.push_back(new_nodes[static_cast<std::size_t>(node)]);
  }
  return graded;
}

}  // namespace

std::vector<double> LayerTimes(const Problem& problem, Sources& sources) {
  constexpr std::size_t kMost = 256;
  std::vector<double> layers = {0};
  const std::vector<double> break_points = BreakPoints(problem);
  if (break_points.size() > kMost) return layers;
  Vector before(problem.num_states() + problem.num_constraints()), behind(before.size());
  const auto sample = [&](double t, Side side, Vector& values) {
    sources.F(t, side, values.head(problem.num_states()));
    sources.G(t, side, values.tail(problem.num_constraints()));
  };
  for (const double t : break_points) {
    sample(t, Side::kLeft, before);
    sample(t, Side::kRight, behind);
    if (MaxAbs(behind - before) > kSameNode * std::max(MaxAbs(before), MaxAbs(behind))) layers.push_back(t);
  }
  return layers;
}

double FastestStep(const Problem& problem) {
  Vector rates = problem.A.AbsTimes(Vector::Ones(problem.num_states()));
  if (problem.has_mass()) rates = rates.cwiseQuotient(problem.E.Sparse().diagonal().cwiseAbs());
  return 1 / (4 * MaxAbs(rates));
}

Grid GradeBehind(const Grid& grid, const std::vector<double>& layers, double shortest, Index most_steps) {
  while (true) {
    Grid graded = Graded(grid, layers, shortest);
    if (graded.num_steps() <= grid.num_steps() + most_steps || shortest >= grid.longest_step) return graded;
    shortest *= kRatioOfLevels;
  }
}

}  // namespace dlcs
