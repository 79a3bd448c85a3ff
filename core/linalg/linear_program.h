// SPDX-License-Identifier: Apache-2.0
// Small dense linear programs, by COIN-OR CLP.

#ifndef DLCS_CORE_LINALG_LINEAR_PROGRAM_H_
#define DLCS_CORE_LINALG_LINEAR_PROGRAM_H_

#include <limits>

#include "core/types.h"

namespace dlcs {

inline constexpr double kUnbounded = std::numeric_limits<double>::infinity();

// By as much a solution may violate rows and bounds, and a cost may be off: CLP's tolerances, for data of size one.
inline constexpr double kProgramTolerance = 1e-9;
// A number that is larger, in data of size one, is no such error, not even where some of them are added up; a factor of
// 4 leaves it above one. Numbers near it stay undecided, or are tried and then checked by arithmetic.
inline constexpr double kProgramMargin = 1e-8;

// minimize costᵀz  subject to  row_lower <= rows z <= row_upper,  lower <= z <= upper;  ±kUnbounded for no bound.
struct LinearProgram {
  Vector cost;
  Matrix rows;
  Vector row_lower, row_upper;
  Vector lower, upper;
};

// `variables` variables z >= 0 without cost, and `rows` rows without bounds: to be filled in.
LinearProgram MakeLinearProgram(Index rows, Index variables);

enum class LinearProgramVerdict { kOptimal, kInfeasible, kUnboundedBelow, kFailed };

struct LinearProgramSolution {
  LinearProgramVerdict verdict = LinearProgramVerdict::kFailed;
  Vector z;              // kOptimal only
  Vector row_duals;      // kOptimal only: multipliers of the rows
  double objective = 0;  // kOptimal only
};

// Solves by CLP's dual simplex, with tolerances of 1e-9 on rows and bounds: an answer that must hold exactly is to be
// checked by the caller. Safe to call from several threads. Dense: for up to some hundred rows and variables.
LinearProgramSolution SolveLinearProgram(const LinearProgram& program);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_LINEAR_PROGRAM_H_
