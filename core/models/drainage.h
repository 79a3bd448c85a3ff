// SPDX-License-Identifier: Apache-2.0
// Ground water between drains that take water in but give none back.

#ifndef DLCS_CORE_MODELS_DRAINAGE_H_
#define DLCS_CORE_MODELS_DRAINAGE_H_

#include <string>

#include "absl/status/statusor.h"
#include "core/problem/problem.h"

namespace dlcs {

// The water table h above the drains, in a field without flow through its edges, the unit interval or square:
//     h_t = c Δh + recharge(t) - Σ_d y_d δ(s - s_d),   y_d = k max(0, h(s_d)),   h(0) = 1/2.
// A drain carries y_d where the table is above it, and nothing where it is below.
struct DrainageModel {
  Index cells = 64;                              // in each direction
  Index dimensions = 1;                          // 1 or 2
  Index drains = 4;                              // in each direction, evenly spaced
  double coefficient = 0.05;                     // c > 0, transmissivity over storage
  double conductance = 1;                        // k > 0
  double horizon = 4;                            // T
  std::string recharge = "max(0, sin(2*pi*t))";  // a formula in t
};

// Finite volumes: x is h in the cells, A is c/Δs² times a Kronecker sum of Neumann's differences, B = -1/volume in the
// cells of the drains, and y_d / k - h >= 0 is N = -1 there, M = I/k. Errors: InvalidArgument, one line per broken
// rule.
absl::StatusOr<Problem> MakeDrainageProblem(const DrainageModel& model);

}  // namespace dlcs

#endif  // DLCS_CORE_MODELS_DRAINAGE_H_
