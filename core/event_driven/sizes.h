// SPDX-License-Identifier: Apache-2.0
// The sizes of states, sources and constraints, which errors are compared with.

#ifndef DLCS_CORE_EVENT_DRIVEN_SIZES_H_
#define DLCS_CORE_EVENT_DRIVEN_SIZES_H_

#include "core/discretization/step_sources.h"
#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// Sizes of states and sources, to compare the terms of equations by: largest absolute values, only their orders of
// magnitude matter.
struct DataSizes {
  Vector x;
  Vector f;
  Vector g;
};

// The sizes that the data suggest before the solve. A state has the size of x0, or of the value at which it would
// settle (or that it would reach by T) with the sources, the other states and, if `y_is_lipschitz`, the y_i that
// balance N x + g in M_ii y_i. A state that would stay zero has the size at which N x + g would change noticeably.
// `sampler` is evaluated at 17 times.
DataSizes SizesOfData(const Problem& problem, bool y_is_lipschitz, SourceSampler& sampler);

// The sizes that errors are compared with: the largest values of each component so far. Components have units
// of their own.
struct Magnitudes {
  // At x0.
  explicit Magnitudes(const Problem& problem);

  // Sets x_reach to what A x and f, here `dynamics` x and f of the size `f_size`, can make of x in the time 1/`rate`.
  void RaiseReach(const Matrix& dynamics, double rate, const Vector& f_size);

  Vector x;
  Vector y;
  Vector w;
  // The size that x may reach in a short time, in the units of each component. A component that starts at zero and
  // grows like a high power of time has no relative accuracy at first: errors below a tiny part of this size are
  // accepted.
  Vector x_reach;
  Vector By, g;  // if y is a Lipschitz function of x
  // The rounding error of x on the step before. In a fast state it decays at once, in a boundary layer that does not
  // count as an error.
  Vector x_noise;
  // m × 3: rounding errors at the end of that step for two choices of signs, since they may cancel in a guard; and that
  // of the constraints at the start of this one.
  Matrix rounding;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_SIZES_H_
