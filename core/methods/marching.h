// SPDX-License-Identifier: Apache-2.0
// Marching: one coupled LCP per step, for any one-step scheme.

#ifndef DLCS_CORE_METHODS_MARCHING_H_
#define DLCS_CORE_METHODS_MARCHING_H_

#include <functional>
#include <memory>
#include <stop_token>

#include "core/lcp/lcp.h"
#include "core/methods/scheme.h"
#include "core/methods/solve_context.h"

namespace dlcs {

using SchemeFactory = std::function<Scheme(double step)>;

// A scheme with the solver of its coupled step LCP(q, M + K_0), K_0 = N y_after.
class Marcher {
 public:
  // Solver and scheme keep references to `problem`.
  Marcher(const Problem& problem, Scheme scheme, Selection selection);

  const Scheme& scheme() const { return scheme_; }

  // Marches all steps of `segment`, whose sources are given and whose x and y hold the start in column 0, filling
  // the other columns. Returns kSolved, or the verdict of the LCP that failed; `solved` is the number of steps
  // done, fewer than all also where `stop` was requested (looked at every step).
  // Cost: 2m² + 3mn and one warm LCP a step.
  LcpVerdict March(Segment& segment, const std::stop_token& stop, Index& solved);

  // Whether all solutions so far were those that the selection means. March() of a scheme with linear y stops before
  // the first step where not: its y would ring.
  bool kept_selection() const { return kept_selection_; }

 private:
  const Problem& problem_;
  Matrix abs_N_;
  Scheme scheme_;
  std::unique_ptr<LcpSolver> solver_;
  Basis basis_;
  Vector q_;
  Vector tolerance_;
  bool kept_selection_ = true;
};

// Marches the whole grid with the schemes of `make_scheme`. Returns whether the end was reached; otherwise
// the solution says why not.
bool MarchGrid(SolveContext& context, const SchemeFactory& make_scheme);

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_MARCHING_H_
