// SPDX-License-Identifier: Apache-2.0
// Where a polynomial first falls below zero, and how near to zero it comes.

#ifndef DLCS_CORE_EVENT_DRIVEN_FIRST_CROSSING_H_
#define DLCS_CORE_EVENT_DRIVEN_FIRST_CROSSING_H_

#include <optional>
#include <vector>

#include "core/discretization/legendre.h"

namespace dlcs {

// The first s in [-1, 1] after which the polynomial Σ_k series[k] P_k + `shift` is negative; absent if it is not
// negative anywhere. If it is negative at -1, the result is -1.
//
// No crossing is missed: a polynomial lies above the smallest of its Bernstein coefficients, so an interval without a
// negative coefficient needs no search; others are bisected, left half first. A polynomial that only touches zero (from
// above, to rounding) has no crossing. Only crossings before `before` are searched for. Accuracy: 1e-15 in s, where the
// root is simple. Cost: K² for most calls, some 50 K²/2 for a crossing.
std::optional<double> FirstCrossing(const LegendreVector& series, double shift, double before = 1);

// How far the polynomial Σ_k series[k] P_k + `shift` lies below zero on [-1, end], end > -1.
struct Dip {
  double depth = 0;  // the largest distance below zero
  double mean = 0;   // the mean distance over [-1, end], where values above zero count as zero
};

// Finds dips of any width, also between the points at which a polynomial is usually evaluated. Accuracy: a tenth of
// each value. Cost: K² if no Bernstein coefficient is negative, some 20 K² for a dip.
Dip DipBelowZero(const LegendreVector& series, double shift, double end);

// A part of a step, in s.
struct PartOfStep {
  double begin;
  double end;
};

// The parts of [-1, end] on which Σ_k series[k] P_k + `shift` is negative, in order. A part that begins at -1 or ends
// at `end` does so exactly. Accuracy: a fifth of their length together. Cost: K² if no Bernstein coefficient is
// negative, some 50 K² for each end of a part.
std::vector<PartOfStep> PartsBelowZero(const LegendreVector& series, double shift, double end);

// The lowest local minimum of Σ_k series[k] P_k inside (-1, end); of several within 1/12 of each other, one.
struct Minimum {
  double value;
  double curvature;  // the second derivative by s there
};
std::optional<Minimum> LowestMinimum(const LegendreVector& series, double end);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_FIRST_CROSSING_H_
