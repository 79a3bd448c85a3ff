// SPDX-License-Identifier: Apache-2.0
// The dynamic input-output model of an economy with n commodities.

#ifndef DLCS_CORE_MODELS_INPUT_OUTPUT_H_
#define DLCS_CORE_MODELS_INPUT_OUTPUT_H_

#include <optional>

#include "absl/status/statusor.h"
#include "core/analysis/findings.h"
#include "core/problem/problem.h"

namespace dlcs {

// (4.6) of [Chen & Xiang 2013], core/analysis/PAPERS.md:
//     x' = A x + B y + f(t),   0 <= y ⟂ (I - C) y - x >= 0,   x(0) = demand:
// the supply y covers the demand x and what production itself consumes, C y.
struct InputOutputModel {
  Matrix C;       // n × n, >= 0
  Matrix A, B;    // n × n: how demand and supply make the demand grow
  Vector demand;  // n
  double horizon = 0;
  TimeFunction f;  // n components
};

// (4.7): every column sum of C is at most 1; (4.8): every row sum is. Sums within 1e-14 n of 1 are 1.
struct InputOutputFacts {
  Fact column_sums, row_sums;  // (4.7), (4.8); a "no" names the sum: indices {j}, value the sum
  Fact columns_all_strict, columns_one_strict, rows_all_strict, rows_one_strict;
  Fact irreducible;                  // the graph of C is strongly connected
  Fact condition;                    // the condition of the paper, which implies that I - C is an M-matrix
  Fact m_matrix;                     // I - C is a nonsingular M-matrix; with X = (I - C)⁻¹ >= 0 for yes
  std::optional<double> kappa;       // ‖A‖ + ‖(I - C)⁻¹‖‖B‖, where m_matrix is yes
  std::optional<double> step_bound;  // 1/(3κ): Newton's method converges (Theorem 3.2); infinite for κ = 0
};

// The problem: N = -I, M = I - C, g = 0, least element. Errors: InvalidArgument, one line per broken rule.
absl::StatusOr<Problem> MakeInputOutputProblem(const InputOutputModel& model);

// The facts about a valid model. The conditions are sufficient; `m_matrix` is decided by itself, by elimination. O(n³).
InputOutputFacts AnalyzeInputOutput(const InputOutputModel& model);
AnalysisSection InputOutputSection(const InputOutputModel& model);

}  // namespace dlcs

#endif  // DLCS_CORE_MODELS_INPUT_OUTPUT_H_
