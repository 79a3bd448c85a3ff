// SPDX-License-Identifier: Apache-2.0
// The LCP of one step, and whether its solutions agree with the selection.

#ifndef DLCS_CORE_CONTEXT_COUPLED_STEP_H_
#define DLCS_CORE_CONTEXT_COUPLED_STEP_H_

#include <memory>

#include "core/lcp/lcp.h"

namespace dlcs {

// Counts steps whose y solves the coupled LCP but is not the selected solution of LCP(N x + g, M) at its x, and steps
// where several minimizers tied.
struct SelectionStats {
  Index steps_off_selection = 0;
  Index steps_with_ties = 0;
};

class CoupledStep {
 public:
  // `solver` solves LCP(q, M + K_0) with `n` constraints. With `y_is_linear` (y linear between nodes) a step whose y is
  // not the selected solution fails, since y would oscillate from there on.
  CoupledStep(std::unique_ptr<LcpSolver> solver, Index n, bool y_is_linear);

  // The next solve starts from the basis of `y`, whatever was solved before.
  void StartFrom(const Eigen::Ref<const Vector>& y);

  // Solves for `y`, starting from the basis of the step before. `size`: n entries, the size of the terms that q is the
  // sum of. Adds to the counts in `departures`. kInfeasible if y is linear and not the selected solution.
  LcpStatus Solve(const Vector& q, const Vector& size, SelectionStats& departures, Eigen::Ref<Vector> y);

 private:
  std::unique_ptr<LcpSolver> solver_;
  bool y_is_linear_;
  Basis basis_;
  Vector tolerance_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_COUPLED_STEP_H_
