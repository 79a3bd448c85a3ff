// SPDX-License-Identifier: Apache-2.0
#include "core/driver/source_resolution.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "core/context/component_errors.h"
#include "core/discretization/resolved_cells.h"
#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/linalg/weyl_sequence.h"

namespace dlcs {
namespace {

// The last output time that is not after t.
Index ColumnAt(double t, const std::vector<double>& times) {
  const auto after = std::upper_bound(times.begin(), times.end(), t);
  return std::max<Index>(after - times.begin() - 1, 0);
}

// Raises `sizes` to the sizes of those `values` that are finite.
void RaiseTo(const Vector& values, Vector& sizes) {
  sizes = values.array().isFinite().select(sizes.cwiseMax(values.cwiseAbs()), sizes);
}

// Of component i, without the two steps in which it is largest.
double LargestOfRegularSteps(const std::vector<Vector>& differences, Index i) {
  constexpr std::size_t kSingularSteps = 2;
  std::vector<double> of_steps(differences.size());
  std::transform(differences.begin(), differences.end(), of_steps.begin(), [i](const Vector& all) { return all[i]; });
  const auto rank = static_cast<std::ptrdiff_t>(std::min(kSingularSteps, of_steps.size() - 1));
  std::nth_element(of_steps.begin(), of_steps.begin() + rank, of_steps.end(), std::greater<>());
  return of_steps[static_cast<std::size_t>(rank)];
}

// The parabola through the values at the ends and the middle of a step.
struct StepParabola {
  StepParabola(const SourcesAt& sources, double begin, double end, Index column)
      : left(sources(begin, Side::kRight, column)),
        middle(sources(0.5 * (begin + end), Side::kRight, column)),
        right(sources(end, Side::kLeft, column)) {}

  // How far `value` is from it at the part s of the step.
  Vector DistanceOf(const Vector& value, double s) const {
    return value - (1 - s) * (1 - 2 * s) * left - 4 * s * (1 - s) * middle - s * (2 * s - 1) * right;
  }

  Vector left, middle, right;
};

}  // namespace

double UnresolvedSources(const Grid& grid, const Solution& solution, const SourcesAt& sources) {
  constexpr Index kMinSteps = 16, kMaxSteps = 64, kMaxValues = 1 << 22;
  constexpr double kCoarse = 0.05;
  if (grid.num_steps() == 0 || solution.times.empty()) return 0;
  const Index values_of_step = 5 * (solution.x.rows() + solution.w.rows());
  const Index most_steps = std::clamp(kMaxValues / values_of_step, kMinSteps, kMaxSteps);
  const Index stride = (grid.num_steps() + most_steps - 1) / most_steps;
  std::vector<Vector> from_line, from_parabola;  // one for each step
  Vector largest;
  int points = 0;
  for (Index k = 0; k < grid.num_steps(); k += stride) {
    const double begin = grid.times[static_cast<std::size_t>(k)], end = grid.times[static_cast<std::size_t>(k) + 1];
    const Index column = ColumnAt(begin, solution.times);
    const StepParabola parabola(sources, begin, end, column);
    const Vector &left = parabola.left, &middle = parabola.middle, &right = parabola.right;
    if (largest.size() == 0) largest = Vector::Zero(left.size());
    RaiseTo(left, largest);
    RaiseTo(right, largest);
    RaiseTo(middle, largest);
    from_parabola.push_back(Vector::Zero(left.size()));
    from_line.push_back(Vector::Zero(left.size()));
    RaiseTo(middle - 0.5 * (left + right), from_line.back());
    for (int point = 0; point < 2; ++point) {
      const double s = WeylValue(++points);
      const Vector inside = sources(begin + s * (end - begin), Side::kRight, column);
      RaiseTo(inside, largest);
      RaiseTo(inside - (1 - s) * left - s * right, from_line.back());
      RaiseTo(parabola.DistanceOf(inside, s), from_parabola.back());
    }
  }
  double unresolved = 0;
  for (Index i = 0; i < largest.size(); ++i) {
    const bool is_f = i < solution.x.rows();
    const double moved = is_f ? MaxAbs(solution.x.row(i)) : MaxAbs(solution.w.row(i - solution.x.rows()));
    const auto part = [&](const std::vector<Vector>& differences) {
      const double difference = LargestOfRegularSteps(differences, i);
      return difference > 0 ? std::min(difference / largest[i], (is_f ? grid.times.back() : 1) * difference / moved)
                            : 0;
    };
    const double coarse = part(from_line);
    unresolved = std::max({unresolved, part(from_parabola), coarse > kCoarse ? coarse : 0});
  }
  return unresolved;
}

void AddMissedPulses(const Grid& grid, const Problem& problem, const SourcesAt& sources, Unresolved& unresolved) {
  // Where all of time is full of cells, it is not pulses that are missed: UnresolvedSources() sees that.
  const Index most_cells = 20 * (grid.num_steps() + 1000);
  const Index num_states = problem.num_states(), num_constraints = problem.num_constraints();
  const ResolvedCells::Points& points = ResolvedCells::PointsOfCell();
  ResolvedCells cells(problem);
  if (cells.is_empty()) return;
  const Vector ones = Vector::Ones(num_states);
  const Vector masses = problem.has_mass() ? Vector(problem.E.AbsTimes(ones)) : ones;  // lumped
  const Vector rates = problem.A.Diagonal().cwiseAbs().cwiseQuotient(masses);
  ComponentValues &missed = unresolved.missed, &all = unresolved.all;
  missed = all = {.x = Vector::Zero(num_states), .w = Vector::Zero(num_constraints)};
  Vector remembered = Vector::Zero(num_states), remembered_of_all = remembered;
  double last = 0;
  Index count = 0;
  for (Index k = 0; k < grid.num_steps(); ++k) {
    if (count >= most_cells) {
      unresolved.searched = grid.times[static_cast<std::size_t>(k)];
      break;
    }
    const double begin = grid.times[static_cast<std::size_t>(k)], end = grid.times[static_cast<std::size_t>(k) + 1];
    double reached = begin;
    for (Index made = 0; reached < end && count + made < most_cells; made += ResolvedCells::kMostOfAStep) {
      reached = cells.Reach(reached, end);
    }
    const auto inside = cells.CellsIn(begin, reached);
    if (inside.empty()) continue;
    count += static_cast<Index>(inside.size());
    const Vector kept = (-(end - last) * rates.array()).exp();
    remembered = remembered.cwiseProduct(kept);
    remembered_of_all = remembered_of_all.cwiseProduct(kept);
    last = end;
    const StepParabola parabola(sources, begin, end, 0);
    Vector area = Vector::Zero(num_states), area_of_all = area;
    for (const auto& [from, to] : inside) {
      for (std::size_t j = 0; j < points.part.size(); ++j) {
        const double t = from + (to - from) * points.part[j], weight = (to - from) * points.weight[j];
        const Vector both = sources(t, Side::kLeft, 0);
        const Vector distance = parabola.DistanceOf(both, (t - begin) / (end - begin));
        area_of_all += weight * both.head(num_states).cwiseAbs();
        area += weight * distance.head(num_states);
        RaiseTo(both.tail(num_constraints), all.w);
        RaiseTo(distance.tail(num_constraints), missed.w);
      }
    }
    remembered += area.cwiseAbs().cwiseQuotient(masses);
    remembered_of_all += area_of_all.cwiseQuotient(masses);
    RaiseTo(remembered, missed.x);
    RaiseTo(remembered_of_all, all.x);
  }
}

void CountUnresolved(const Unresolved& unresolved, Solution& solution) {
  constexpr double kSmallEnough = 1e-3;
  TrajectoryErrors& errors = solution.accuracy.errors;
  double part = unresolved.part > kSmallEnough ? unresolved.part : 0;
  const auto count = [&part](const Vector& missed, const Vector& all, ErrorsByCause& of_kind) {
    for (Index i = 0; i < std::min(missed.size(), of_kind.truncation.size()); ++i) {
      if (missed[i] == 0) continue;
      const double of_size = missed[i] / std::max({missed[i], all[i], of_kind.own[i]});
      part = std::max(part, of_size);
      if (of_size > kSmallEnough) of_kind.truncation[i] = NanMax(of_kind.truncation[i], missed[i]);
    }
  };
  if (std::isfinite(unresolved.searched)) {
    solution.warnings.push_back("f and g vary so fast that they were searched for short pulses only until t = " +
                                FormatNumber(unresolved.searched) + ": what steps miss behind it is not in the error.");
  }
  count(unresolved.missed.x, unresolved.all.x, errors.x);
  count(unresolved.missed.w, unresolved.all.w, errors.w);
  RaiseTruncation(part, errors);
  if (!(part > kSmallEnough)) return;
  solution.warnings.push_back("Inside the steps f or g differs by " + FormatNumber(part) +
                              " of its size from what the steps see of it: take shorter steps, or set a tolerance.");
}

}  // namespace dlcs
