// SPDX-License-Identifier: Apache-2.0
// Outputs, which are quantities computed from a solution, and measurements, which are numbers computed from outputs.

#ifndef DLCS_CORE_PROBLEM_OUTPUTS_H_
#define DLCS_CORE_PROBLEM_OUTPUTS_H_

#include <optional>
#include <string>
#include <vector>

#include "core/linalg/structured_matrix.h"
#include "core/problem/time_function.h"
#include "core/types.h"

namespace dlcs {

// A solve is not a success if |z| of `output` reaches kReachedLimit times `value`.
struct OutputLimit {
  Index output = 0;
  double value = 0;  // > 0
};
inline constexpr double kReachedLimit = 0.999;

// z = C x + D y + h(t)
struct Outputs {
  std::vector<std::string> names;  // p; unique
  StructuredMatrix C;              // p × m
  StructuredMatrix D;              // p × n
  TimeFunction h;                  // p components
  Index hidden = 0;                // so many outputs at the end are not part of trajectories
  std::vector<OutputLimit> limits;

  Index size() const { return static_cast<Index>(names.size()); }
  Index shown() const { return size() - hidden; }
};

enum class MeasurementKind {
  kAverage,
  kRms,
  kIntegral,
  kMinimum,
  kMaximum,
  kPeakToPeak,
  kValue,    // at `at`
  kTime,     // `at` itself, a crossing
  kDelay,    // from `at` to `until`
  kSlope,    // the derivative with respect to time at `at`; at a kink the right derivative
  kFormula,  // of earlier measurements
};

enum class CrossingDirection { kEither, kRising, kFalling };

// A time that is given, or at which a quantity crosses a level.
struct MeasurementInstant {
  static constexpr int kLast = -1;

  std::optional<double> time;  // if set, the other fields are ignored
  std::vector<Index> outputs;  // the quantity, the product of these
  double level = 0;
  CrossingDirection direction = CrossingDirection::kEither;
  int number = 1;  // of the crossings in this direction after `after`: 1, 2, ... or kLast
  double after = 0;
};

struct Measurement {
  std::string name;  // unique
  MeasurementKind kind = MeasurementKind::kAverage;
  std::vector<Index> outputs;                    // the quantity, the product of these; not for kTime, kDelay, kFormula
  double begin = 0;                              // [begin, end] is measured, for the first six kinds
  std::optional<double> end;                     // absent: T
  std::optional<MeasurementInstant> at = {};     // for kValue, kTime, kDelay and kSlope
  std::optional<MeasurementInstant> until = {};  // for kDelay
  std::string formula = {};                      // for kFormula; its variables are names of earlier measurements
};

// Appends the violations of the outputs of a problem with m states and n pairs on [0, horizon]. Fields are named
// outputs.names[1], outputs.C, outputs.D, outputs.h (as in core/problem/time_function.h), outputs.hidden,
// outputs.limits[0].
void CheckOutputs(const Outputs& outputs, Index m, Index n, ViolationList& list);
// The same for measurements of them: measurements[0].at.number.
void CheckMeasurements(const std::vector<Measurement>& measurements, const Outputs& outputs, double horizon,
                       ViolationList& list);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_OUTPUTS_H_
