// SPDX-License-Identifier: Apache-2.0
#include "core/context/coupled_step.h"

#include <utility>

#include "core/context/solve_context.h"
#include "core/lcp/basis/tolerance.h"

namespace dlcs {

CoupledStep::CoupledStep(std::unique_ptr<LcpSolver> solver, Index n, bool y_is_linear)
    : solver_(std::move(solver)), y_is_linear_(y_is_linear), basis_(static_cast<std::size_t>(n), 0), tolerance_(n) {}

void CoupledStep::StartFrom(const Eigen::Ref<const Vector>& y) {
  for (Index i = 0; i < y.size(); ++i) basis_[static_cast<std::size_t>(i)] = y[i] > 0;
}

LcpStatus CoupledStep::Solve(const Vector& q, const Vector& size, SelectionStats& departures, Eigen::Ref<Vector> y) {
  tolerance_ = kLcpTolerance * size;
  const LcpStatus verdict = solver_->Solve(q, tolerance_, basis_, y);
  if (verdict != LcpStatus::kSolved) return verdict;
  if (!solver_->KeptSelection()) {
    ++departures.steps_off_selection;
    if (y_is_linear_) return LcpStatus::kInfeasible;
  }
  if (!solver_->IsOnlyChoice()) ++departures.steps_with_ties;
  return verdict;
}

}  // namespace dlcs
