// SPDX-License-Identifier: Apache-2.0

#include "core/methods/recorder.h"

namespace dlcs {

Recorder::Recorder(const Grid& grid, Index num_states, Index num_constraints, Solution& solution)
    : grid_(grid), solution_(solution) {
  const Index count = static_cast<Index>(grid.output_nodes.size());
  solution_.times.resize(count);
  solution_.x.resize(num_states, count);
  solution_.y.resize(num_constraints, count);
}

void Recorder::Add(const Segment& segment) {
  const Index last_node = segment.first_node + segment.steps;
  if (recorded_ > 0 && grid_.output_nodes[recorded_ - 1] == segment.first_node) {
    --recorded_;
    const auto y_before = solution_.y.col(recorded_);
    if (y_before != segment.y.col(0)) solution_.left_limits.push_back({recorded_, y_before});
  }
  while (recorded_ < static_cast<Index>(grid_.output_nodes.size()) &&
         grid_.output_nodes[recorded_] <= last_node) {
    const Index node = grid_.output_nodes[recorded_];
    const Index column = node - segment.first_node;
    solution_.times[recorded_] = grid_.times[node];
    solution_.x.col(recorded_) = segment.x.col(column);
    solution_.y.col(recorded_) = segment.y.col(column);
    ++recorded_;
  }
}

void Recorder::Finish() {
  solution_.times.resize(recorded_);
  solution_.x.conservativeResize(Eigen::NoChange, recorded_);
  solution_.y.conservativeResize(Eigen::NoChange, recorded_);
}

}  // namespace dlcs
