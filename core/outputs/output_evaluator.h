// SPDX-License-Identifier: Apache-2.0
// The outputs of a problem at the times of a solution.

#ifndef DLCS_CORE_OUTPUTS_OUTPUT_EVALUATOR_H_
#define DLCS_CORE_OUTPUTS_OUTPUT_EVALUATOR_H_

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "core/problem/time_function.h"

namespace dlcs {

// A Solution does not hold outputs, since they are cheap to compute from t, x and y. Not safe to share between threads,
// like TimeFunctionEvaluator.
class OutputEvaluator {
 public:
  // For a valid `problem`, which need not outlive the evaluator. Errors: those of TimeFunctionEvaluator::Create().
  static absl::StatusOr<OutputEvaluator> Create(const Problem& problem);
  // The same for some of the outputs, none of them hidden.
  static absl::StatusOr<OutputEvaluator> Create(const Problem& problem, const std::vector<Index>& outputs);

  Index size() const { return h_.size(); }  // including the hidden ones
  Index shown() const { return shown_; }

  // C x + D y + h(t), with the limit of h from `side`.
  Vector At(double t, Side side, const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y);

  // The same at increasing times, one for each column of `x` and `y`. h is the right limit, at the last time the left.
  Matrix Between(const Eigen::Ref<const Vector>& times, const Matrix& x, const Matrix& y);

  // The outputs as polynomials from `begin` to `end`, for those of x and y: column k holds the coefficients of P_k.
  // Absent where h is not known to be constant there.
  std::optional<Matrix> Polynomials(double begin, double end, const Matrix& x, const Matrix& y);

  // The size of the terms that At() adds up: |C| |x| + |D| |y|.
  Vector TermsOf(const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y) const;

  // All outputs at `column` of `solution`: the right limit (at T the left one), and the left limit.
  Vector AtColumn(const Solution& solution, Index column);
  Vector BeforeColumn(const Solution& solution, Index column);

  // The outputs that are not hidden at columns [first, first + count) of `solution`: limits
  // as in AtColumn().
  Matrix Columns(const Solution& solution, Index first, Index count);

  // The times of these columns at which y, w or an output jumps, with the left limits. If y or w does not jump, its
  // value is given.
  struct Limit {
    LeftLimit of_solution;
    Vector outputs;  // those that are not hidden
  };
  std::vector<Limit> LeftLimits(const Solution& solution, Index first, Index count);

 private:
  OutputEvaluator(StructuredMatrix C, StructuredMatrix D, Index shown, TimeAxis axis, TimeFunctionEvaluator h);

  StructuredMatrix C_, D_;
  Index shown_;
  TimeAxis axis_;
  TimeFunctionEvaluator h_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_OUTPUTS_OUTPUT_EVALUATOR_H_
