// SPDX-License-Identifier: Apache-2.0
// Measures the outputs of a solution, and compares them with their limits.

#ifndef DLCS_CORE_OUTPUTS_MEASURE_OUTPUTS_H_
#define DLCS_CORE_OUTPUTS_MEASURE_OUTPUTS_H_

#include "absl/status/status.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// Whether MeasureOutputs() has anything to do.
bool HasMeasurements(const Problem& problem);

// Sets measurements and reached_limits of `solution`, a solution of the valid `problem`. From its pieces integrals are
// exact up to rounding, and crossings, minima and maxima are found by 65 samples on each piece and then to rounding
// accuracy: two crossings of one piece between two samples are missed. A level is crossed where the quantity passes
// from one side to the other; the passage may be a jump, and may rest on the level. What does not occur, or lies beyond
// the end of the solution, has a reason in place of a value. Without pieces the times of the trajectory must be all
// nodes (`has_all_nodes`); between output times alone nothing is measured. Cost: some microseconds for each output and
// piece.
absl::Status MeasureOutputs(const Problem& problem, bool has_all_nodes, Solution& solution);

}  // namespace dlcs

#endif  // DLCS_CORE_OUTPUTS_MEASURE_OUTPUTS_H_
