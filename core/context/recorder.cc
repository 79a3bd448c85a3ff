// SPDX-License-Identifier: Apache-2.0

#include "core/context/recorder.h"

#include <algorithm>

namespace dlcs {

Recorder::Recorder(const Grid& grid, Index num_states, Index num_constraints, Solution& solution)
    : grid_(grid), solution_(solution) {
  const Index count = static_cast<Index>(grid.output_nodes.size());
  solution_.times.resize(count);
  solution_.x.resize(num_states, count);
  solution_.y.resize(num_constraints, count);
  solution_.w.resize(num_constraints, count);
}

bool Recorder::IsBreak(Index node) const {
  const auto run = std::lower_bound(grid_.runs.begin(), grid_.runs.end(), node,
                                    [](const Run& a, Index first_node) { return a.first_node < first_node; });
  return run != grid_.runs.end() && run->first_node == node && run->starts_at_break;
}

void Recorder::Begin(Index first_node, const Eigen::Ref<const Vector>& y, const Eigen::Ref<const Vector>& w) {
  if (recorded_ == 0 || grid_.output_nodes[recorded_ - 1] != first_node) return;
  --recorded_;
  const auto y_before = solution_.y.col(recorded_), w_before = solution_.w.col(recorded_);
  // Elsewhere a w that is formed anew may differ by its rounding.
  if (y_before != y || (w_before != w && IsBreak(first_node))) {
    solution_.left_limits.push_back({recorded_, y_before, w_before});
  }
}

void Recorder::Take(Index node, const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y,
                    const Eigen::Ref<const Vector>& w) {
  solution_.times[recorded_] = grid_.times[node];
  solution_.x.col(recorded_) = x;
  solution_.y.col(recorded_) = y;
  solution_.w.col(recorded_) = w;
  ++recorded_;
}

void Recorder::Add(const Segment& segment, const Eigen::Ref<const Matrix>& w, Index begin, Index end) {
  const Index last_node = segment.first_node + end;
  if (begin == 0) Begin(segment.first_node, segment.y.col(0), w.col(0));
  while (recorded_ < static_cast<Index>(grid_.output_nodes.size()) && grid_.output_nodes[recorded_] <= last_node) {
    const Index node = grid_.output_nodes[recorded_];
    const Index column = node - segment.first_node;
    Take(node, segment.x.col(column), segment.y.col(column), w.col(column - begin));
  }
}

void Recorder::Finish() {
  solution_.times.resize(recorded_);
  solution_.x.conservativeResize(Eigen::NoChange, recorded_);
  solution_.y.conservativeResize(Eigen::NoChange, recorded_);
  solution_.w.conservativeResize(Eigen::NoChange, recorded_);
}

}  // namespace dlcs
