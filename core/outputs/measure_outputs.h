// SPDX-License-Identifier: Apache-2.0
// Measures the outputs of a solution, and compares them with their limits.

#ifndef DLCS_CORE_OUTPUTS_MEASURE_OUTPUTS_H_
#define DLCS_CORE_OUTPUTS_MEASURE_OUTPUTS_H_

#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/outputs/periodic_extension.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// Whether MeasureOutputs() has anything to do.
bool HasMeasurements(const Problem& problem);

// Sets measurements and reached_limits of `solution`, a solution of the valid `problem`. From its pieces integrals are
// exact up to rounding, and all crossings, minima and maxima of its polynomials are found, up to 1e-12 of the largest
// size of the quantity. An h(t) that is no polynomial is known at the 13 nodes of each part of a piece
// (core/outputs/output_curves.h): what it does between two of them alone is missed. A level is crossed where the
// quantity passes from one side to the other; the passage may be a jump, and may rest on the level. What does not
// occur, or lies beyond the end of the solution, has a reason in place of a value. Without pieces the times of the
// trajectory must be all nodes (`has_all_nodes`); between output times alone nothing is measured.
// Limits are then compared at these times, after the solve did so at its nodes (core/context/limit_watch.h). Cost: some
// microseconds for each output and piece.
//
// With `extension` the solution is one period, `problem` is that of this period but for its measurements, and these are
// of the solution repeated for ever; results have notes that say what was measured. Times in them are of the period,
// but for values that are times or delays.
absl::Status MeasureOutputs(const Problem& problem, bool has_all_nodes, Solution& solution,
                            const std::optional<PeriodicExtension>& extension = {});

// The averages over time of the outputs that are not hidden, of a solution with pieces; exact where MeasureOutputs()
// is. Empty if there are none, or the solve is stopped. Errors and cost: as there.
absl::StatusOr<Vector> MeanOutputs(const Problem& problem, const Solution& solution);

}  // namespace dlcs

#endif  // DLCS_CORE_OUTPUTS_MEASURE_OUTPUTS_H_
