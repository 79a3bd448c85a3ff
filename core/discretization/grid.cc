// SPDX-License-Identifier: Apache-2.0

#include "core/discretization/grid.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/linalg/bounded_sum.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// Whether two times are the same time, rounded a few times. Given nodes may be arbitrarily close.
bool IsRounded(double a, double b) { return std::abs(a - b) <= RoundingOf(16) * std::max(a, b); }

Index StepsFor(double length, double longest_step) {
  return std::max<Index>(1, static_cast<Index>(std::ceil(length / longest_step * (1 - RoundingOf(16)) - kSameNode)));
}

// Appends equal steps over [begin, end] to `runs`.
void AppendRun(double begin, double end, double longest_step, bool starts_at_break, std::vector<Run>& runs) {
  Run run;
  run.first_node = runs.empty() ? 0 : runs.back().first_node + runs.back().steps;
  run.steps = StepsFor(end - begin, longest_step);
  run.begin = begin;
  run.end = end;
  run.step = (end - begin) / static_cast<double>(run.steps);
  run.starts_at_break = starts_at_break;
  runs.push_back(run);
}

// Appends the nodes of `run` behind its first one. The memory of twenty million takes a busy machine seconds.
void AppendTimes(const Run& run, std::vector<double>& times) {
  constexpr Index kNodesPerLook = 1 << 16;
  const double length = run.end - run.begin;
  for (Index k = 1; k < run.steps; ++k) {
    if (k % kNodesPerLook == 0) LookForStop();
    times.push_back(run.begin + length * (static_cast<double>(k) / static_cast<double>(run.steps)));
  }
  times.push_back(run.end);
}

// The output times strictly inside (begin, end) at which the smooth interval must be cut: none if all of them are nodes
// of equal steps over it, otherwise all, since cutting at one moves the nodes behind it.
std::vector<double> SplittingTimes(double begin, double end, double longest_step,
                                   const std::vector<double>& output_times) {
  const double step = (end - begin) / static_cast<double>(StepsFor(end - begin, longest_step));
  std::vector<double> inside;
  bool all_nodes = true;
  for (const double t : output_times) {
    if (t <= begin || t >= end || IsRounded(t, begin) || IsRounded(t, end)) continue;
    const double same = kSameNode * std::min(step, t - begin);
    if (!inside.empty() && t - inside.back() <= same) continue;
    inside.push_back(t);
    const double node = begin + step * std::round((t - begin) / step);
    all_nodes = all_nodes && node > begin && node < end && std::abs(t - node) <= same;
  }
  if (all_nodes) inside.clear();
  return inside;
}

// A time that must be a node. Of two times that are one node the one of higher rank stays.
struct Mark {
  double time;
  enum Rank { kGridTime, kOutputTime, kBreakPoint, kEnd } rank;
};

// The nodes that `options` ask for by grid_times, increasing.
std::vector<Mark> MarkedNodes(double horizon, const std::vector<double>& break_points, const Options& options) {
  std::vector<Mark> marks = {{0, Mark::kEnd}, {horizon, Mark::kEnd}};
  for (const double t : break_points) marks.push_back({t, Mark::kBreakPoint});
  for (const double t : options.output_times) marks.push_back({t, Mark::kOutputTime});
  for (const double t : options.grid_times) marks.push_back({t, Mark::kGridTime});
  std::sort(marks.begin(), marks.end(), [](const Mark& a, const Mark& b) { return a.time < b.time; });
  std::vector<Mark> nodes;
  for (const Mark& mark : marks) {
    if (nodes.empty() || !IsRounded(mark.time, nodes.back().time)) {
      nodes.push_back(mark);
    } else if (mark.rank > nodes.back().rank) {
      nodes.back() = mark;
    }
  }
  return nodes;
}

// A grid of given nodes: runs of steps that are equal to the rounding of their times.
Grid GridOfNodes(const std::vector<Mark>& nodes) {
  Grid grid;
  grid.times.push_back(nodes.front().time);
  for (size_t k = 1; k < nodes.size(); ++k) {
    const double begin = nodes[k - 1].time, end = nodes[k].time;
    const bool at_break = nodes[k - 1].rank >= Mark::kBreakPoint;
    if (at_break || std::abs(end - begin - grid.runs.back().step) > RoundingOf(16) * end) {
      grid.runs.push_back({.first_node = static_cast<Index>(k) - 1, .begin = begin, .starts_at_break = at_break});
    }
    Run& run = grid.runs.back();
    ++run.steps;
    run.end = end;
    run.step = (run.end - run.begin) / static_cast<double>(run.steps);
    grid.times.push_back(end);
    grid.longest_step = std::max(grid.longest_step, run.step);
  }
  return grid;
}

Index NearestNode(const std::vector<double>& times, double t) {
  const auto above = std::lower_bound(times.begin(), times.end(), t);
  if (above == times.begin()) return 0;
  if (above == times.end()) return static_cast<Index>(times.size()) - 1;
  const Index k = above - times.begin();
  return t - times[k - 1] < times[k] - t ? k - 1 : k;
}

// Equal steps between break points, cut at output times.
std::vector<Run> UniformRuns(double horizon, const std::vector<double>& break_points, const Options& options) {
  const Index wanted = options.num_steps > 0 ? options.num_steps : Options::kDefaultSteps;
  const double longest_step = options.step > 0 ? options.step : horizon / static_cast<double>(wanted);

  std::vector<Run> runs;
  std::vector<double> ends = break_points;
  ends.push_back(horizon);
  double begin = 0;
  for (const double end : ends) {
    bool at_break = true;
    for (const double split : SplittingTimes(begin, end, longest_step, options.output_times)) {
      AppendRun(begin, split, longest_step, at_break, runs);
      begin = split;
      at_break = false;
    }
    AppendRun(begin, end, longest_step, at_break, runs);
    begin = end;
  }
  return runs;
}

Grid UniformGrid(double horizon, const std::vector<double>& break_points, const Options& options) {
  Grid grid;
  grid.runs = UniformRuns(horizon, break_points, options);
  const Run& last = grid.runs.back();
  grid.times.reserve(static_cast<size_t>(last.first_node + last.steps) + 1);
  grid.times.push_back(0);
  for (const Run& run : grid.runs) {
    AppendTimes(run, grid.times);
    grid.longest_step = std::max(grid.longest_step, run.step);
  }
  return grid;
}

}  // namespace

Grid MakeGrid(double horizon, const std::vector<double>& break_points, const Options& options) {
  Grid grid = options.grid_times.empty() ? UniformGrid(horizon, break_points, options)
                                         : GridOfNodes(MarkedNodes(horizon, break_points, options));
  if (options.output_times_only) {
    for (const double t : options.output_times) {
      const Index node = NearestNode(grid.times, t);
      grid.times[node] = t;  // the caller's own number, at most 1e-9 steps away
      if (grid.output_nodes.empty() || grid.output_nodes.back() != node) grid.output_nodes.push_back(node);
    }
  } else {
    grid.output_nodes.resize(grid.times.size());
    std::iota(grid.output_nodes.begin(), grid.output_nodes.end(), Index{0});
  }
  return grid;
}

double CountSteps(double horizon, const std::vector<double>& break_points, const Options& options) {
  if (!options.grid_times.empty()) {
    return static_cast<double>(options.grid_times.size() + break_points.size() + options.output_times.size()) + 1;
  }
  const Run last = UniformRuns(horizon, break_points, options).back();
  return static_cast<double>(last.first_node + last.steps);
}

Grid Halve(const Grid& grid) {
  Grid halved;
  halved.longest_step = grid.longest_step / 2;
  halved.times.reserve(2 * grid.times.size() - 1);
  halved.times.push_back(grid.times.front());
  for (size_t k = 1; k < grid.times.size(); ++k) {
    halved.times.push_back((grid.times[k - 1] + grid.times[k]) / 2);
    halved.times.push_back(grid.times[k]);
  }
  for (Run run : grid.runs) {
    run.first_node *= 2;
    run.steps *= 2;
    run.step /= 2;
    halved.runs.push_back(run);
  }
  for (const Index node : grid.output_nodes) halved.output_nodes.push_back(2 * node);
  return halved;
}

Grid WithOtherSteps(const Grid& grid, Index factor, Index most_outputs) {
  constexpr Index kFewSteps = 4;
  const Index count = grid.num_steps();
  std::vector<char> is_break(grid.times.size(), 0), is_output(grid.times.size(), 0);
  for (const Run& run : grid.runs) is_break[run.first_node] = run.starts_at_break;
  is_break[0] = is_break[count] = 1;
  for (const Index node : grid.output_nodes) is_output[node] = 1;
  const bool few_outputs = 4 * static_cast<Index>(grid.output_nodes.size()) <= count;
  const auto stays = [&](Index node) { return is_break[node] || (few_outputs && is_output[node]); };

  std::vector<Mark> nodes = {{grid.times[0], Mark::kEnd}};
  std::vector<char> was_output = {is_output[0]};
  const auto add = [&](Index node) {
    nodes.push_back({grid.times[node], is_break[node] ? Mark::kBreakPoint : Mark::kGridTime});
    was_output.push_back(is_output[node]);
  };
  for (Index begin = 0; begin < count;) {
    Index end = begin + 1;
    while (!stays(end)) ++end;
    if (end - begin >= kFewSteps) {
      for (Index node = begin; node < end;) add(node = std::min(end, node + factor));
    } else {
      for (Index node = begin; node < end; ++node) {
        const double step = grid.times[node + 1] - grid.times[node];
        for (Index part = 1; part < factor; ++part) {
          nodes.push_back(
              {grid.times[node] + step * static_cast<double>(part) / static_cast<double>(factor), Mark::kGridTime});
          was_output.push_back(0);
        }
        add(node + 1);
      }
    }
    begin = end;
  }
  Grid other = GridOfNodes(nodes);
  const Index stride = other.num_steps() / std::max<Index>(1, most_outputs) + 1;
  for (Index node = 0; node <= other.num_steps(); ++node) {
    if (was_output[node] || node % stride == 0) other.output_nodes.push_back(node);
  }
  return other;
}

}  // namespace dlcs
