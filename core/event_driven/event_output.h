// SPDX-License-Identifier: Apache-2.0
// Evaluates the steps at the nodes of the grid, and measures how well they satisfy the system.

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

  // Adds the part of `step` up to `end`, which is at `s_end`: the nodes in [begin, end), so that the value at an event
  // is that after it. `x_begin` is the state at the begin before its projection onto the constraints of the mode;
  // `active` are the pairs whose guard is y_i.
  void AddSmooth(const Vector& x_begin, const StepSources& sources, const SmoothStep& step,
                 const std::vector<Index>& active, double end, double s_end);
  // Adds a coupled step of first order: x linear, y constant. `w` and `g` are those at the end.
  void AddCoupled(double begin, double end, const Vector& x_begin, const Vector& x_end, const Vector& y,
                  const Vector& w, const Vector& g);
  // Ends a smooth interval with its left limits, since sources and state may jump there. Returns the nodes of the
  // interval.
  SmoothInterval EndInterval(double end, const Vector& x, const Vector& y, const Vector& w);
  // Takes the nodes of the unfinished smooth interval; no steps if there are fewer than two nodes.
  SmoothInterval Finish();

  // The steps as polynomials; those of AddCoupled() have degree 1 in x and 0 in y.
  std::vector<TrajectoryPiece> TakePieces() { return std::move(pieces_); }

  // Here nodes are the ends of steps, and midpoints the additional times inside them at which the sources were checked.
  // Residuals and defect are those of the row in which they are largest relative to the row's size (the largest sum of
  // the absolute values of its terms so far), in the unit of the scales that they are compared with. A y_i that should
  // be zero is measured by its effect on the rows in which it occurs. What `rounding` of x explains is no defect:
  // beside a state that is zero by symmetry x' is rounding, and so is its defect.
  Certificate certificate(const Vector& rounding) const;

 private:
  bool HasNodeBefore(double end) const { return next_node_ < num_nodes_ && grid_.times[next_node_] < end; }
  void RaiseScale(const Vector& x);
  // The nodes in [sources.begin, end), where w of the step is `w`.
  void RecordNodes(const Vector& x_begin, const StepSources& sources, const SmoothStep& step, const LegendreSeries& w,
                   double end, double s_end);
  void Record(const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y, const Eigen::Ref<const Vector>& w);
  // The violation of complementarity by each pair: how far y_i is below zero, and how far w_i is below zero or, if y_i
  // is positive, from zero.
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
  Vector defect_, terms_;       // the defect of x', and the largest size of its terms, on short steps too
  Vector w_size_, slope_size_;  // the largest size so far of the terms of w and x'
  std::vector<TrajectoryPiece> pieces_;
  Vector places_, along_;  // positions of nodes in a step; values_ holds P_0 ... P_K there
  LegendreRows values_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_EVENT_OUTPUT_H_
