// SPDX-License-Identifier: Apache-2.0
// What y may be off by where rounding hides on which side of a jump it is.

#ifndef DLCS_CORE_EVENT_DRIVEN_JUMPS_NEAR_ZERO_H_
#define DLCS_CORE_EVENT_DRIVEN_JUMPS_NEAR_ZERO_H_

#include <memory>
#include <optional>
#include <vector>

#include "core/discretization/step_sources.h"
#include "core/event_driven/first_crossing.h"
#include "core/event_driven/sampled_errors.h"
#include "core/event_driven/smooth_step.h"
#include "core/lcp/basis/lcp_solver.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/problem.h"

namespace dlcs {

// What is not known of y where guards are as near to zero as their errors.
//
// Where y_i does not move w_i at once and its guard passes zero, y jumps: that y_i which holds w_i at zero through x
// (contact), or other y (relays). So while the guard is nearer to zero than its error, it is not known on which side of
// the jump y is. As at an event whose time is known no better, y is off by (y⁻ - y⁺) δt / T, with δt the time for which
// this lasts; beside relays x' is off by their jump, too.
//
// And where w_i is as near to zero as its rounding, a y_i > 0 may be hidden that moves x.
class JumpsNearZero {
 public:
  // Keeps a reference. Nothing jumps where y is a Lipschitz function of x.
  JumpsNearZero(const Problem& problem, Selection selection, bool y_is_lipschitz);

  // Adds those of a step up to `s_end`; of relays in modes where y is determined without x'. `begins_mode`: the step is
  // the first one of its mode; `ends_mode`: the guard that ends it, if one does. `of_state`: the errors of guards that
  // those of the state before the step, `x_error`, make. Samples g and g' where a guard comes near zero. Cost: K² for
  // each of the pairs, and an LCP where its guard comes near zero.
  void AddTo(const SmoothStep& step, const ErrorBounds& of_state, const Vector& x_error, double s_end, bool begins_mode,
             std::optional<Index> ends_mode, SourceSampler& sampler, StepSources& sources,
             OverlookedByCause& overlooked);

 private:
  // y of a pair, over the steps in a row on which its guard is near zero.
  struct OfPair {
    Index pair;
    double M;      // w_i by y_i at once
    double moves;  // w_i by y_i, a unit of time; its size
    bool lifts;    // moves w_i up
    Vector truncation = {}, rounding = {};
    bool leaves_event = false;  // the guard has been near zero, and rising, since its mode began

    void EndRow() { truncation = rounding = {}; }
  };
  void AddHidden(const OfPair& of, const SmoothStep& step, const ErrorBounds& of_state, double s_end,
                 std::optional<Index> ends_mode, SourceSampler& sampler, StepSources& sources,
                 OverlookedByCause& overlooked) const;
  void AddJump(OfPair& of, const SmoothStep& step, const ErrorBounds& of_state, const Vector& x_error, double s_end,
               bool begins_mode, bool ends_mode, SourceSampler& sampler, StepSources& sources,
               OverlookedByCause& overlooked);

  const Problem& problem_;
  const Selection selection_;
  const bool y_is_lipschitz_;
  std::vector<OfPair> pairs_;
  std::unique_ptr<LcpSolver> lcp_;  // for M, once it was needed
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_JUMPS_NEAR_ZERO_H_
