// SPDX-License-Identifier: Apache-2.0
// The interface of a window to the iteration, independent of how states are propagated.

#ifndef DLCS_CORE_ITERATION_WINDOW_MODEL_H_
#define DLCS_CORE_ITERATION_WINDOW_MODEL_H_

#include "core/context/coupled_step.h"
#include "core/propagator/propagator.h"
#include "core/types.h"

namespace dlcs {

// Consecutive steps from a given start. Columns are the nodes 0..steps; q stands for N x + g.
class WindowModel {
 public:
  virtual ~WindowModel() = default;

  virtual Index first_node() const = 0;
  Index steps() const { return y.cols() - 1; }

  // q for y frozen at its start value, which all columns of `y` are set to. Call it first.
  virtual Matrix Frozen() = 0;
  // q for the constant state.
  virtual Matrix Constant() = 0;
  // Computes q from y, in the memory of `q` if it has the right size, and gives blocks of its columns to `computed`.
  virtual void Follow(Matrix& q, const OnColumns& computed) = 0;
  void Follow(Matrix& q) {
    Follow(q, [](Index, Index) {});
  }
  // For each row of q the size of the terms that it is the sum of.
  virtual Vector Sizes() const = 0;
  // κ h, where κ bounds the kernel per unit of time. NaN if the steps have several lengths.
  virtual double KernelBound() = 0;
  // To be called when y is final: computes the states, certificate and output.
  virtual void Finish() = 0;
  // Solves the single step of the window by the coupled LCP(q, M + K_0) instead of iterating.
  virtual LcpStatus SolveCoupledStep(SelectionStats& departures) = 0;

  Matrix y;  // n × steps + 1; column 0 is given, the others are the iterate's
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_WINDOW_MODEL_H_
