// SPDX-License-Identifier: Apache-2.0
#include "core/driver/source_resolution.h"

#include <algorithm>
#include <functional>
#include <vector>

#include "core/context/component_errors.h"
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

}  // namespace

double UnresolvedSources(const Grid& grid, const Solution& solution, const SourcesAt& sources) {
  constexpr Index kMaxSteps = 64;
  constexpr double kCoarse = 0.05;
  if (grid.num_steps() == 0 || solution.times.empty()) return 0;
  const Index stride = (grid.num_steps() + kMaxSteps - 1) / kMaxSteps;
  std::vector<Vector> from_line, from_parabola;  // one for each step
  Vector largest;
  int points = 0;
  for (Index k = 0; k < grid.num_steps(); k += stride) {
    const double begin = grid.times[static_cast<std::size_t>(k)], end = grid.times[static_cast<std::size_t>(k) + 1];
    const Index column = ColumnAt(begin, solution.times);
    const Vector left = sources(begin, Side::kRight, column), right = sources(end, Side::kLeft, column);
    const Vector middle = sources(0.5 * (begin + end), Side::kRight, column);
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
      RaiseTo(inside - (1 - s) * (1 - 2 * s) * left - 4 * s * (1 - s) * middle - s * (2 * s - 1) * right,
              from_parabola.back());
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

void CountUnresolved(double unresolved, Solution& solution) {
  constexpr double kSmallEnough = 1e-3;
  if (!(unresolved > kSmallEnough)) return;
  RaiseTruncation(unresolved, solution.accuracy.errors);
  solution.warnings.push_back("Inside the steps f or g differs by " + FormatNumber(unresolved) +
                              " of its size from what the steps see of it: take shorter steps, or set a tolerance.");
}

}  // namespace dlcs
