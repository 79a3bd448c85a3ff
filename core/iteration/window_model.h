// SPDX-License-Identifier: Apache-2.0
// What the iteration asks of a window, however the states are carried.

#ifndef DLCS_CORE_ITERATION_WINDOW_MODEL_H_
#define DLCS_CORE_ITERATION_WINDOW_MODEL_H_

#include "core/context/coupled_step.h"
#include "core/types.h"

namespace dlcs {

// Consecutive steps from a given start. Columns are the nodes 0..steps; q stands for N x + g.
class WindowModel {
 public:
  virtual ~WindowModel() = default;

  virtual Index first_node() const = 0;
  Index steps() const { return y.cols() - 1; }

  // q of the equation with y frozen at its start, which `y` holds in all columns. To be called first.
  virtual Matrix Frozen() = 0;
  // q for the constant state.
  virtual Matrix Constant() = 0;
  // q that follows from y, in the memory of `q` where that has the size.
  virtual void Follow(Matrix& q) = 0;
  // For each row of q the size of the numbers that it was summed from.
  virtual Vector Sizes() const = 0;
  // κ h: the kernel is at most κ a unit of time. NaN where the steps have several lengths.
  virtual double KernelBound() = 0;
  // y is final: makes what is to be filed.
  virtual void Finish() = 0;
  // Takes the one step of the window by LCP(q, M + K_0) instead; whether it was solved.
  virtual LcpStatus March(SelectionStats& departures) = 0;

  Matrix y;  // n × steps + 1; column 0 is given, the others are the iterate's
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_WINDOW_MODEL_H_
