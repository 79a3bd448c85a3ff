// SPDX-License-Identifier: Apache-2.0
// A window of the iteration on states: consecutive steps, of one length or of several.

#ifndef DLCS_CORE_ITERATION_WINDOW_H_
#define DLCS_CORE_ITERATION_WINDOW_H_

#include <vector>

#include "core/context/solve_context.h"
#include "core/discretization/segment.h"
#include "core/iteration/window_model.h"
#include "core/laplace/kernel.h"
#include "core/stepping/stepping.h"

namespace dlcs {

// The parts of an iteration that depend on the step length alone.
struct StepTools {
  StepTools(SolveContext& context, double step)
      : stepper(MakeStepper(context, "exp-PL", step,
                            [&](double h) { return ExponentialPiecewiseLinear(context.problem, h); })),
        kernel(context.problem, stepper.scheme(), context.options.kernel, context.workers, *context.solution.kernel) {}
  const Scheme& scheme() const { return stepper.scheme(); }
  Stepper stepper;  // for single steps on which the iteration fails
  Kernel kernel;
};

// The steps of one run that lie in a window.
struct WindowPiece {
  StepTools* tools;
  Segment segment;
};

// Computes q by one convolution if all steps have one length, otherwise from the states.
class Window final : public WindowModel {
 public:
  // Empty, from the state `start` and the multiplier `y_start`. Keeps references to the first two.
  Window(SolveContext& context, const Vector& start, const Vector& y_start);

  // Appends a piece with its sources.
  void Append(StepTools& tools, Segment segment);
  const std::vector<WindowPiece>& pieces() const { return pieces_; }

  Index first_node() const override { return pieces_.front().segment.first_node; }
  Matrix Frozen() override;
  Matrix Constant() override;
  using WindowModel::Follow;
  void Follow(Matrix& q, const OnColumns& computed) override;
  Vector Sizes() const override;
  double KernelBound() override;
  void Finish() override { Propagate(); }
  LcpStatus SolveCoupledStep(SelectionStats& departures) override;

 private:
  // The tools of all pieces; null if the steps have several lengths, or if the blocks of the kernel grow too large.
  StepTools* SharedTools();
  // Fills x and y of all pieces from the start and y by the recursion of their schemes; returns q. Cost: O(m²) a step.
  Matrix Propagate();

  SolveContext& context_;
  const Vector& start_;
  std::vector<WindowPiece> pieces_;
  Matrix g_;       // n × steps + 1
  Matrix frozen_;  // q with y frozen
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_WINDOW_H_
