// SPDX-License-Identifier: Apache-2.0
// Predicts the memory of a solve before anything is allocated.

#ifndef DLCS_CORE_DRIVER_MEMORY_PREDICTION_H_
#define DLCS_CORE_DRIVER_MEMORY_PREDICTION_H_

#include "core/discretization/grid.h"
#include "core/driver/propagator_choice.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"

namespace dlcs {

// Bytes that this process holds at the same time: matrices or factors of the propagator, the kernel, the columns of a
// run, the trajectory. Accurate to a factor of about two. The fill of sparse factors is assumed to be that of a
// two-dimensional grid, unless `propagator` knows it.
double PredictBytes(const Problem& problem, const Grid& grid, Method method, const PropagatorChoice& propagator);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_MEMORY_PREDICTION_H_
