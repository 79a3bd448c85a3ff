// SPDX-License-Identifier: Apache-2.0
// The LCP of one step, with what its answers say about the selection.

#ifndef DLCS_CORE_CONTEXT_COUPLED_STEP_H_
#define DLCS_CORE_CONTEXT_COUPLED_STEP_H_

#include <memory>

#include "core/lcp/lcp.h"

namespace dlcs {

// Steps whose y is a solution of the coupled LCP, but not the selected one of LCP(N x + g, M) at its x; and steps where
// several minimizers tied.
struct SelectionStats {
  Index steps_off_selection = 0;
  Index steps_with_ties = 0;
};

class CoupledStep {
 public:
  // `solver` of LCP(q, M + K_0) for `n` constraints. Where y is linear between nodes it would ring off the selection.
  CoupledStep(std::unique_ptr<LcpSolver> solver, Index n, bool y_is_linear);

  // The next solve starts from the basis of `y`, whatever was solved before.
  void StartFrom(const Eigen::Ref<const Vector>& y);

  // Solves for `y`, starting from the basis of the step before; `size` is that of the numbers that q was summed from.
  // Counts what it finds in `departures`; a linear y off the selection is kInfeasible.
  LcpStatus Solve(const Vector& q, const Vector& size, SelectionStats& departures, Eigen::Ref<Vector> y);

 private:
  std::unique_ptr<LcpSolver> solver_;
  bool y_is_linear_;
  Basis basis_;
  Vector tolerance_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_COUPLED_STEP_H_
