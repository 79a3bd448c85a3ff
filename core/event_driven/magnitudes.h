// SPDX-License-Identifier: Apache-2.0
// The sizes of states, sources and constraints, which errors are compared with.

#ifndef DLCS_CORE_EVENT_DRIVEN_MAGNITUDES_H_
#define DLCS_CORE_EVENT_DRIVEN_MAGNITUDES_H_

#include "core/discretization/step_sources.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// Sizes of states and sources, to compare the terms of equations by: largest absolute values, only their orders of
// magnitude matter.
struct DataSizes {
  Vector x;
  Vector f;
  Vector g;
  // Of the terms that a formula is summed from: the sources may be small differences.
  Vector f_terms = {}, g_terms = {};
};

// The sizes that the data suggest before the solve. A state has the size of x0, or of the value at which it would
// settle (or that it would reach by T) with the sources, the other states and, if `y_is_lipschitz`, the y_i that
// balance N x + g in M_ii y_i. A state that would stay zero has the size at which N x + g would change noticeably.
// `sampler` is evaluated at 17 times.
DataSizes SizesOfData(const Problem& problem, bool y_is_lipschitz, SourceSampler& sampler);

// The noise of states and guards is a bound, of which so much is mostly there.
inline constexpr double kOfNoise = 1.0 / 16;

// What rounding may make of x at the end of a step.
struct StateRounding {
  explicit StateRounding(Index size) : bound(Vector::Zero(size)), samples(Matrix::Zero(size, 3)) {}

  Vector bound;
  // m × 3, since rounding errors may cancel in a guard: for two choices of signs, and that of the constraints at the
  // start of the step that follows.
  Matrix samples;
};

// The sizes that errors are compared with: the largest values of each component so far. Components have units
// of their own.
struct Magnitudes {
  // At x0. `options` are those of the solve, whose steps are chosen for the relative error `tolerance`.
  Magnitudes(const Problem& problem, const Options& options, double tolerance);

  // Sets x_reach to what A x and f, here `dynamics` x and f of the size `f_size`, can make of x in the time 1/`rate`.
  void RaiseReach(const Matrix& dynamics, double rate, const Vector& f_size);

  Vector x;
  Vector y;
  Vector w;
  Vector outputs;  // those that are not hidden
  // The size that x may reach in a short time, in the units of each component. A component that starts at zero and
  // grows like a high power of time has no relative accuracy at first: errors below a tiny part of this size are
  // accepted.
  Vector x_reach;
  // Sizes below which absolute tolerances hold: each divided by the tolerance, 0 where none is given.
  Vector x_given, y_given, w_given;
  // The part of the bounds of the rounding of guards that a step may be off by. They are far above what rounding is, so
  // that much of that may be truncation.
  double allowed_rounding = 1;
  // That of the step before. In a fast state it decays at once, in a boundary layer that does not count as an error.
  StateRounding rounding;
  // Samples of the errors of x at the start of the step, one a column; none at 0.
  Matrix errors;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MAGNITUDES_H_
