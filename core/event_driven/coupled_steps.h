// SPDX-License-Identifier: Apache-2.0
// Short steps of first order, for times at which no mode lasts.

#ifndef DLCS_CORE_EVENT_DRIVEN_COUPLED_STEPS_H_
#define DLCS_CORE_EVENT_DRIVEN_COUPLED_STEPS_H_

#include <stop_token>

#include "core/discretization/step_cache.h"
#include "core/discretization/step_sources.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/problem.h"
#include "core/stepping/stepping.h"

namespace dlcs {

// exp-PC, one step at a time. It needs no smoothness of y, so it passes points where modes accumulate or where no mode
// of relative degree one determines y. Lengths are powers of two, so that cached matrix functions can be used again.
class CoupledSteps {
 public:
  // Keeps references.
  CoupledSteps(const Problem& problem, Selection selection, SourceSampler& sources);

  struct Step {
    LcpStatus verdict = LcpStatus::kSolved;
    bool kept_selection = true;  // as LcpSolver::KeptSelection()
    Vector x;                    // at the end, after two steps of half the length
    Vector y;
    Vector w;
    Vector g;
    Vector error;   // |x - that after one step|
    Vector inside;  // |x in the middle - the mean of begin and end|: how far the step is from a line
    Vector noise;   // the rounding error of both
  };
  // One step from `x` at `begin` to `end`, and two of half the length. `length` is end - begin without rounding, the
  // key of the cached matrix functions.
  Step Take(double begin, double end, double length, const Eigen::Ref<const Vector>& x);

  Index lcps() const { return lcps_; }

 private:
  LcpStatus TakeSteps(double begin, double end, double length, const Eigen::Ref<const Vector>& x);

  const Problem& problem_;
  SourceSampler& sources_;
  StepCache<Stepper> steppers_;
  Segment segment_;  // one step
  SelectionStats departures_;
  Index lcps_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_COUPLED_STEPS_H_
