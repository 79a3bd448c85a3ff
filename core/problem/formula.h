// SPDX-License-Identifier: Apache-2.0
// Formulas in `t`, and for nonlinear problems in states x1 ... xm and constraints y1 ... yn, with the syntax of Python.
//
// Numbers, the variables, `pi`, `e`, parameters (numbers with a name); + - * / and powers written ** or ^
// (right-associative, binding closer than a sign: -t**2 is -(t**2)); comparisons < <= > >= == != with value 0 or 1,
// chained as in Python (0 < t < 1 means (0 < t)*(t < 1)); parentheses; the functions
//     sin cos tan asin acos atan sinh cosh tanh exp log log10 sqrt abs sign floor ceil min max
// (log is the natural logarithm; min and max take one argument or more). Nothing else: no assignment, no
// other names, one value. All numbers are doubles, and every operation is done in the order written. Where
// Python raises an error (1/0, sqrt(-1)) the value is the infinity or NaN of IEEE arithmetic, and NaN passes
// through min and max.
//
// Where its switching times are known (core/problem/formula_switching.h), comparisons, sign, floor and ceil are decided
// once for the smooth interval between two of them. So a formula has both its limits at a switching time, even if that
// time is rounded.

#ifndef DLCS_CORE_PROBLEM_FORMULA_H_
#define DLCS_CORE_PROBLEM_FORMULA_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/formula_switching.h"
#include "core/problem/formula_syntax.h"
#include "core/types.h"

namespace dlcs {

class FormulaEnclosure;

class Formula {
 public:
  // A formula in `t` and `variables`, by default none, without switching times.
  // Errors: InvalidArgument with the position in `text` and the reason; an unknown name is named.
  // Cost: about 5 µs.
  static absl::StatusOr<Formula> Parse(const std::string& text, const FormulaVariables& variables = {});

  // A formula whose switching times are known; `axis` holds them as break points of the problem.
  Formula(std::shared_ptr<const AnalyzedFormula> analyzed, const TimeAxis& axis);
  Formula(Formula&&) noexcept;
  Formula& operator=(Formula&&) noexcept;
  ~Formula();

  // Whether `t` occurs in it. A formula without any variable costs nothing to evaluate.
  bool DependsOnTime() const { return analyzed_->tree.depends_on_t; }
  // Which x and y occur in it, as indices from 0.
  const std::vector<Index>& states() const { return analyzed_->tree.states; }
  const std::vector<Index>& constraints() const { return analyzed_->tree.constraints; }

  // The value at `t`, at a switching time the limit from `side`; not finite where the formula has none (division by
  // zero, log of a negative number). Not safe to call from several threads at once. Cost: about 3 ns per operation;
  // more for functions such as sin and exp.
  double Evaluate(double t, Side side = Side::kRight);
  // Whether the value is known to be the same at all times from `begin` to `end`: no time at which the formula may
  // switch is between them, and what is left does not depend on time.
  bool IsSteady(double begin, double end);
  // A bound of the rounding error of the value at `t`, also of a small difference of large terms; not finite where the
  // formula has no value. For formulas in t alone, away from its jumps. Cost: about 100 ns per operation.
  double RoundingAt(double t);
  // The derivative at `t`, the limit from `side`, and a bound of its rounding error, which is infinite where it is not
  // known. For formulas in t alone. Cost: about 100 ns per operation.
  struct Slope {
    double value, rounding;
  };
  Slope SlopeAt(double t, Side side);
  // The value where the formula has states and constraints; `x` and `y` hold at least those that occur.
  double Evaluate(double t, const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y,
                  Side side = Side::kRight);

 private:
  double EvaluateAt(double t, Side side);
  FormulaEnclosure& Enclosed();
  void EnterIntervalOf(double t, Side side);
  void EnterInterval(std::size_t interval);

  std::shared_ptr<const AnalyzedFormula> analyzed_;
  std::vector<double> switching_times_;  // as in the axis
  std::vector<int> computed_;            // the steps that are neither numbers nor variables
  // Those of them that are not constant in the interval of the last evaluation, and that the value needs.
  std::vector<int> varying_;
  std::vector<int> states_, constraints_;  // the steps of variables
  int time_ = -1;
  std::vector<double> values_;
  // Which steps vary there, and which of them the value needs.
  std::vector<bool> varies_, needed_;
  bool has_intervals_ = false;  // the formula has switches, and their times are known
  std::size_t interval_ = 0;    // the smooth interval of the last evaluation
  bool has_entered_ = false;
  bool is_decided_ = false;
  std::unique_ptr<FormulaEnclosure> enclosure_;  // made when needed
  double steady_rounding_ = -1;                  // of an interval in which nothing varies; below 0 if not known
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_H_
