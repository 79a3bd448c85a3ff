// SPDX-License-Identifier: Apache-2.0
// Collects the trajectory at the output nodes.

#ifndef DLCS_CORE_CONTEXT_RECORDER_H_
#define DLCS_CORE_CONTEXT_RECORDER_H_

#include "core/discretization/grid.h"
#include "core/discretization/segment.h"
#include "core/problem/solution.h"

namespace dlcs {

class Recorder {
 public:
  // Allocates the output of `grid` in `solution`; both must outlive the recorder.
  Recorder(const Grid& grid, Index num_states, Index num_constraints, Solution& solution);

  // Copies the output nodes of `segment`; the columns of `w` are its nodes. Segments come in order. The first node of a
  // segment overwrites the last node of the one before, so a break point keeps its right limits. Where y differs, or w
  // at a break point, the left limits are kept in Solution::left_limits.
  void Add(const Segment& segment, const Eigen::Ref<const Matrix>& w) { Add(segment, w, 0, segment.steps); }
  // The same for the steps [begin, end) only; the first call for a segment has begin = 0. The columns of `w` are the
  // nodes begin..end.
  void Add(const Segment& segment, const Eigen::Ref<const Matrix>& w, Index begin, Index end);

  // The same for a smooth interval whose states are known at some nodes only. Begin() starts it at `first_node` with
  // the right limits, ...
  void Begin(Index first_node, const Eigen::Ref<const Vector>& y, const Eigen::Ref<const Vector>& w);
  // ... and Take() adds `node`, the next output node.
  void Take(Index node, const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y,
            const Eigen::Ref<const Vector>& w);

  Index recorded() const { return recorded_; }
  // The time of the last recorded node; 0 if there is none.
  double reached() const {
    return recorded_ > 0 ? grid_.times[grid_.output_nodes[static_cast<std::size_t>(recorded_ - 1)]] : 0;
  }
  // Resumes where the first `recorded` columns of the solution are filled in already.
  void ResumeFrom(Index recorded) { recorded_ = recorded; }

  // Cuts the solution down to what was recorded.
  void Finish();

 private:
  bool IsBreak(Index node) const;

  const Grid& grid_;
  Solution& solution_;
  Index recorded_ = 0;  // output nodes
};

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_RECORDER_H_
