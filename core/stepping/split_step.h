// SPDX-License-Identifier: Apache-2.0
// The coupled LCP of a step, by factors of a banded matrix if possible.

#ifndef DLCS_CORE_STEPPING_SPLIT_STEP_H_
#define DLCS_CORE_STEPPING_SPLIT_STEP_H_

#include <functional>
#include <memory>
#include <optional>

#include "core/context/coupled_step.h"
#include "core/lcp/structured/splitting_solver.h"

namespace dlcs {

// LCP(q, M + K_0) for a P-matrix M. If M + K_0 is close to a banded M-matrix (SplitOffBand(); it is then an H-matrix
// with a positive diagonal, so its LCP has one solution), factors of the banded matrix are used, O(n) per step. The
// solver for dense matrices is made only if that fails.
class SplitStep {
 public:
  using MakeStep = std::function<std::unique_ptr<CoupledStep>()>;

  // Without a splitting it is a CoupledStep, made by `make_step`.
  SplitStep(std::optional<BandSplitting> splitting, MakeStep make_step);

  // Drops all state of earlier steps; `y` is that of the step before.
  void StartFrom(const Eigen::Ref<const Vector>& y);

  // As CoupledStep::Solve(). `y`: in a guess, of any sign.
  LcpStatus Solve(const Vector& q, const Vector& size, SelectionStats& departures, Eigen::Ref<Vector> y);

 private:
  std::optional<SplittingLcpSolver> splitting_;
  static constexpr Index kPatience = 3;  // failures of the splitting before it is given up
  Index patience_ = kPatience;
  MakeStep make_step_;
  std::unique_ptr<CoupledStep> step_;
  Vector start_;  // y to start from
  Vector tolerance_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_SPLIT_STEP_H_
