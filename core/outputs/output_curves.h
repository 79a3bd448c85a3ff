// SPDX-License-Identifier: Apache-2.0
// Outputs as functions on [0, T], from a solution.

#ifndef DLCS_CORE_OUTPUTS_OUTPUT_CURVES_H_
#define DLCS_CORE_OUTPUTS_OUTPUT_CURVES_H_

#include <vector>

#include "absl/status/statusor.h"
#include "core/discretization/legendre.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// On [begin, end] row i of `z` is the series of the i-th of some outputs, in s from -1 to 1.
struct CurvePiece {
  double begin = 0;
  double end = 0;
  LegendreSeries z;

  double s_of(double t) const { return 2 * (t - begin) / (end - begin) - 1; }
  double t_of(double s) const { return begin + (end - begin) * (1 + s) / 2; }
};

// The accuracy of curves, as a part of the largest value of an output. What differs by less does not differ.
inline constexpr double kCurveAccuracy = 1e-12;

// The `outputs` of the valid `problem` on the part of [0, T] that `solution` covers, piece by piece. Of a solution with
// pieces (Options::keep_pieces) the polynomials of its steps, cut in halves until a series holds h(t) too; otherwise
// straight lines between the times of the trajectory, with both limits at each of them. With `levels`, one for each
// output, pieces on which no output reaches its level in size may be left out. Looks for a stop.
absl::StatusOr<std::vector<CurvePiece>> OutputCurves(const Problem& problem, const Solution& solution,
                                                     const std::vector<Index>& outputs, const Vector& levels = {});

}  // namespace dlcs

#endif  // DLCS_CORE_OUTPUTS_OUTPUT_CURVES_H_
