// SPDX-License-Identifier: Apache-2.0
// Takes the trajectory at the nodes of the grid from the steps, and measures how well they satisfy the
// system.

#ifndef DLCS_CORE_EVENT_DRIVEN_EVENT_OUTPUT_H_
#define DLCS_CORE_EVENT_DRIVEN_EVENT_OUTPUT_H_

#include <utility>
#include <vector>

#include "core/discretization/grid.h"
#include "core/discretization/segment.h"
#include "core/discretization/step_sources.h"
#include "core/event_driven/smooth_step.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

class EventOutput {
 public:
  // The nodes of a smooth interval, sources left out, and w at them.
  struct SmoothInterval {
    Segment segment;
    Matrix w;
  };

  // Keeps references. `keeps_pieces`: the polynomials of all steps too, for dense output.
  EventOutput(const Problem& problem, const Grid& grid, bool keeps_pieces);

  // The part of `step` from its begin to `end`, which is at `s_end`: nodes in [begin, end), so that the value
  // at an event is that behind it. `x_begin` is the state at its begin as it was before the mode had it; `active` are
  // the pairs whose guard is y_i.
  void AddSmooth(const Vector& x_begin, const StepSources& sources, const SmoothStep& step,
                 const std::vector<Index>& active, double end, double s_end);
  // A step of the coupled march: x linear, y constant. `w` and `g` are those at the end.
  void AddMarched(double begin, double end, const Vector& x_begin, const Vector& x_end, const Vector& y,
                  const Vector& w, const Vector& g);
  // The left limits at the end of a smooth interval, where sources and state may jump. Gives the nodes of the smooth
  // interval.
  SmoothInterval EndInterval(double end, const Vector& x, const Vector& y, const Vector& w);
  // The nodes of a smooth interval that has not come to its end; no steps where there are less than two.
  SmoothInterval Finish() const;

  // What AddSmooth() and AddMarched() were given, as polynomials: where x is linear and y constant, of degree 1 and 0.
  std::vector<TrajectoryPiece> TakePieces() { return std::move(pieces_); }

  // Nodes are the ends of steps, midpoints the times inside them where the sources were looked at once more. Residuals
  // and defect are those of the row where they are largest relative to its own size, the largest sum of the sizes of
  // its terms so far, and in the unit of the sizes that they are compared with. A y_i that should be zero counts by
  // what it is to the rows that it acts on.
  Certificate certificate() const;

 private:
  bool HasNodeBefore(double end) const { return next_node_ < num_nodes_ && grid_.times[next_node_] < end; }
  void RaiseScale(const Vector& x);
  // The nodes in [sources.begin, end), where w of the step is `w`.
  void RecordNodes(const Vector& x_begin, const StepSources& sources, const SmoothStep& step, const LegendreSeries& w,
                   double end, double s_end);
  void Record(const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y, const Eigen::Ref<const Vector>& w);
  // How far pairs are from what they should be: y_i below zero, and w_i below zero, or from zero where y_i is positive.
  struct Misfit {
    Vector y, w;
  };
  // y and w at a time where x and g are these; `active` are the pairs with w_i = 0.
  void Measure(const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y, const Eigen::Ref<const Vector>& g,
               const std::vector<Index>& active, Misfit& misfit, double& complementarity);
  double Relative(const Misfit& misfit) const;
  double PartIn(const Matrix& matrix, Index column, const Vector& size) const;

  const Problem& problem_;
  const Grid& grid_;
  const bool keeps_pieces_;
  const Index num_nodes_;
  Segment segment_;
  Matrix w_;  // at its nodes
  Index next_node_ = 0;
  Certificate certificate_;
  Misfit at_nodes_, between_nodes_;
  Vector defect_, terms_;       // of x'; and the largest that its terms come to, on short steps too
  Vector w_size_, slope_size_;  // the largest so far, of the terms of w and x'
  std::vector<TrajectoryPiece> pieces_;
  Vector places_;  // of nodes in a step, and what P_0 ... P_K are there
  LegendreRows values_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_EVENT_OUTPUT_H_
