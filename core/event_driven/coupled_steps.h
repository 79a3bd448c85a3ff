// SPDX-License-Identifier: Apache-2.0
// Short steps of first order, for times at which no mode lasts.

#ifndef DLCS_CORE_EVENT_DRIVEN_COUPLED_STEPS_H_
#define DLCS_CORE_EVENT_DRIVEN_COUPLED_STEPS_H_

#include "core/discretization/step_cache.h"
#include "core/discretization/step_sources.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/problem.h"
#include "core/stepping/stepping.h"

namespace dlcs {

// exp-PC with error control, in bursts. It needs no smoothness of y, so it passes points where modes accumulate or
// where no mode of relative degree one determines y. Each burst without a lasting mode between is twice as long as the
// one before and may err four times as much, so that the solve survives a point that the tolerance cannot pass. Lengths
// are powers of two, so that cached matrix functions can be used again.
class CoupledSteps {
 public:
  // Keeps references.
  CoupledSteps(const Problem& problem, Selection selection, SourceSampler& sources);

  // Begins a burst at `t`, with steps that are shorter than `scale`, the length that steps in modes had.
  void BeginBurst(double t, double scale);
  Index burst() const { return burst_; }  // the number of its steps
  void EndBurst() { burst_ *= 2; }
  // A mode lasted: the next burst is short again.
  void ResetBursts() { burst_ = 1; }
  // Whether more steps would be needed at the pace so far than kMost.
  static constexpr Index kMost = 40000;
  bool AreHopeless(double t) const;

  struct Step {
    LcpStatus verdict = LcpStatus::kSolved;
    bool kept_selection = true;  // as LcpSolver::KeptSelection()
    double end = 0;
    Vector x;  // at the end, after two steps of half the length
    Vector y;
    Vector w;
    Vector g;
    Vector error;   // |x - that after one step|
    Vector inside;  // |x in the middle - the mean of begin and end|: how far the step is from a line
    Vector noise;   // the rounding error of both
    // By how much N x + g changes in the second half: w is off by as much inside the step, or y has changed.
    Vector w_inside;
  };
  // One step from `x` at `begin`, at most up to `limit`, so short that its errors are at most the share of `tolerance`
  // · `sizes` that a step of its length gets; they may be larger if the step is as short as steps can be. w_inside may
  // be anything, since w may jump.
  Step Take(double begin, double limit, const Eigen::Ref<const Vector>& x, const Vector& sizes, double tolerance);

  double length() const { return length_; }  // of the next step
  Index steps() const { return steps_; }     // that were taken
  Index lcps() const { return lcps_; }

 private:
  Step TakeHalves(double begin, double end, double length, const Eigen::Ref<const Vector>& x);
  LcpStatus TakeStep(double begin, double end, double length, const Eigen::Ref<const Vector>& x);

  const Problem& problem_;
  SourceSampler& sources_;
  StepCache<Stepper> steppers_;
  Segment segment_;  // one step
  SelectionStats departures_;
  double shortest_;
  double length_ = 0;
  double first_ = 0;  // where the first step began
  Index burst_ = 1;
  Index steps_ = 0;
  Index lcps_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_COUPLED_STEPS_H_
