// SPDX-License-Identifier: Apache-2.0
// Which mode a state goes on in.

#ifndef DLCS_CORE_EVENT_DRIVEN_MODE_SEARCH_H_
#define DLCS_CORE_EVENT_DRIVEN_MODE_SEARCH_H_

#include <map>
#include <memory>
#include <vector>

#include "core/discretization/step_cache.h"
#include "core/discretization/step_sources.h"
#include "core/event_driven/mode.h"
#include "core/lcp/lcp.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/problem.h"

namespace dlcs {

// Finds active sets, and keeps the modes that were made.
//
// The set that holds behind t is that of y at t + h as h → 0: where y_i and w_i both vanish at t their
// derivatives decide, and then higher ones. One coupled LCP does all of that at once,
//
//     0 <= y ⟂ N (x̂ + h B y + h²/2 A B y) + g(t + h) + M y >= 0,    x̂ the state at t + h for y = 0,
//
// with a step h so short that the Taylor polynomial of second order serves, and long enough that a derivative
// stands out of rounding. Its basis is a proposal: the caller finds out how long it lasts.
class ModeSearch {
 public:
  // Keeps references.
  ModeSearch(const Problem& problem, Selection selection, SourceSampler& sources);

  struct Proposal {
    LcpStatus verdict = LcpStatus::kPivotLimit;
    bool kept_selection = true;  // as LcpSolver::KeptSelection()
    const Mode* mode = nullptr;  // null where the LCP failed, or the basis does not determine y
  };
  // For the state `x` at `t`. `scale` is a time in which the system changes, `longest` the time to the next
  // break point; `attempt` 0, 1, ... kAttempts - 1 takes other steps: shorter ones, for modes that end soon,
  // and then longer ones, which see past modes that are shorter than rounding. The LCP is started from the
  // last active set, or from that of GuessBehind().
  static constexpr int kAttempts = 6;
  Proposal Find(double t, const Eigen::Ref<const Vector>& x, double scale, double longest, int attempt);

  // The next search starts from the active set of `mode` with index `guard`, which ended it, exchanged: where
  // the numbers of an event are as small as the rounding of the LCP, that guess is as good a solution as any.
  void GuessBehind(const Mode& mode, Index guard);

  // `mode`, which a proposal held, drawn back to its constraints (core/event_driven/mode.h) as fast as rounding takes a
  // state of the sizes `x` off, for sources of the sizes `f` and `g`; no row gets larger terms than it has.
  const Mode& DrawnBack(const Mode& mode, const Vector& x, const Vector& f, const Vector& g);

  Index lcps() const { return lcps_; }
  Index modes_made() const { return modes_made_; }

 private:
  // A mode, null where there is none, and what DrawBack() made of it for powers of two as rates.
  struct Kept {
    std::unique_ptr<Mode> mode;
    std::map<std::vector<int>, std::unique_ptr<Mode>> drawn_back;
  };
  const Mode* ModeOf(const Basis& basis);

  const Problem& problem_;
  SourceSampler& sources_;
  Matrix abs_N_;
  double norm_A_;
  StepCache<LcpSolver> solvers_;
  std::map<std::vector<Index>, Kept> modes_;  // by their active sets
  Basis basis_;
  Vector y_, f_begin_, f_end_, g_, predicted_, q_, tolerance_;
  Index lcps_ = 0;
  Index modes_made_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MODE_SEARCH_H_
