// SPDX-License-Identifier: Apache-2.0
#include "core/periodic/oscillation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/format_number.h"
#include "core/periodic/period_map.h"

namespace dlcs {
namespace {

constexpr int kSamples = 16;      // of a piece
// Where the section is in the range of its state: thresholds of symmetric circuits are in the middle, and there y
// jumps.
constexpr double kSection = 0.38;

double SampleTime(const TrajectoryPiece& piece, int k) {
  return k == kSamples ? piece.end : piece.begin + (piece.end - piece.begin) * k / kSamples;
}

struct Crossing {
  double time;
  Vector state, y;
};

// The time in the piece between `from` and `to` at which state `i` passes `level`.
Crossing Locate(const TrajectoryPiece& piece, Index i, double level, double from, double to) {
  for (int k = 0; k < 60; ++k) {
    const double middle = from + (to - from) / 2;
    (StateAt(piece, middle)[i] < level ? from : to) = middle;
  }
  return {to, StateAt(piece, to), BranchAt(piece, to)};
}

// Where state `section` passes `level` upwards, from the time `begin` on.
std::vector<Crossing> UpwardCrossings(const Solution& solution, Index section, double level, double begin) {
  std::vector<Crossing> crossings;
  bool was_below = false;
  for (const TrajectoryPiece& piece : solution.pieces) {
    for (int k = 0; k <= kSamples; ++k) {
      const double time = SampleTime(piece, k);
      if (time < begin) continue;
      const bool is_below = StateAt(piece, time)[section] < level;
      // Between two pieces too, whose values there differ by rounding.
      if (was_below && !is_below) {
        crossings.push_back(Locate(piece, section, level, SampleTime(piece, std::max(0, k - 1)), time));
      }
      was_below = is_below;
    }
  }
  return crossings;
}

}  // namespace

std::variant<Oscillation, std::string> FindOscillation(const Solution& solution, double horizon) {
  const Index m = solution.x.rows();
  const double begin = horizon / 2;
  Vector low = Vector::Constant(m, std::numeric_limits<double>::infinity()), high = -low, size = Vector::Zero(m);
  for (const TrajectoryPiece& piece : solution.pieces) {
    for (int k = 0; k <= kSamples; ++k) {
      const double time = SampleTime(piece, k);
      const Vector x = StateAt(piece, time);
      size = size.cwiseMax(x.cwiseAbs());
      if (time < begin) continue;
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
  }
  const Vector range = high - low;
  // Those that vary most first, relative to their sizes.
  const Vector part = (size.array() > 0).select(range.cwiseQuotient(size), 0);
  std::vector<Index> sections;
  for (Index i = 0; i < m; ++i) {
    if (part[i] > kAtRest) sections.push_back(i);
  }
  std::stable_sort(sections.begin(), sections.end(), [&](Index a, Index b) { return part[a] > part[b]; });
  const std::string until = "[0, " + FormatNumber(horizon) + "]";
  if (sections.empty()) {
    return "No oscillation was found: the solution from x0 comes to rest on " + until +
           ". Start from another x0, or follow it for longer.";
  }
  std::vector<Crossing> crossings;
  for (const Index section : sections) {
    crossings = UpwardCrossings(solution, section, low[section] + kSection * range[section], begin);
    if (crossings.size() >= 2) break;
  }
  if (crossings.size() < 2) {
    return "No oscillation was found: the solution from x0 passes no state twice on the second half of " + until +
           ". Follow it for several periods.";
  }
  // The last crossing comes nearest to the one a period before: the way to a limit cycle is longer the earlier it was.
  // Where it has arrived, all differences are errors.
  const Crossing& last = crossings.back();
  Vector distances(static_cast<Index>(crossings.size()) - 1);
  for (Index k = 0; k < distances.size(); ++k) {
    const Crossing& earlier = crossings[static_cast<std::size_t>(k)];
    distances[k] = 0;
    for (Index i = 0; i < m; ++i) {
      if (range[i] > kAtRest * size[i]) {
        distances[k] = std::max(distances[k], std::abs(last.state[i] - earlier.state[i]) / range[i]);
      }
    }
  }
  const double nearest = std::max(distances.minCoeff(), solution.accuracy.error);
  Index back = distances.size() - 1;
  while (back > 0 && !(distances[back] <= nearest)) --back;
  return Oscillation{last.state, last.y, last.time - crossings[static_cast<std::size_t>(back)].time};
}

}  // namespace dlcs
