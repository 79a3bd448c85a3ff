// SPDX-License-Identifier: Apache-2.0
// Vector-valued functions of time: the sources f(t) and g(t) of a problem.
//
// A TimeFunction is data: a list of pieces, each valid from its start to that of the next. A piece is a constant,
// samples on a grid, a piecewise polynomial, or one formula per component. The value at the start of a piece is the
// right limit. If few functions make many components, f(t) = lift ψ(t), the pieces are those of ψ.
// TimeFunctionEvaluator is the compiled form.

#ifndef DLCS_CORE_PROBLEM_TIME_FUNCTION_H_
#define DLCS_CORE_PROBLEM_TIME_FUNCTION_H_

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "core/linalg/structured_matrix.h"
#include "core/problem/formula_parameters.h"
#include "core/problem/time_axis.h"
#include "core/types.h"

namespace dlcs {

class ViolationList;
struct AnalyzedFormula;

struct ConstantFunction {
  Vector value;
};

// One formula in `t` per component; the language is described in core/problem/formula.h.
struct FormulaFunction {
  std::vector<std::string> formulas;
  FormulaParameters parameters = {};
};

// Linear interpolation of `values.col(k)` at `times[k]`; constant before the first and after the last time.
struct SampledFunction {
  std::vector<double> times;  // strictly increasing, at least one
  Matrix values;              // components × times
};

// On [breaks[p], breaks[p+1]): Σ_k coefficients[p].col(k) · (t - breaks[p])^k. The first polynomial extends
// to the left, the last to the right. Every inner break is a break point of the function.
struct PiecewisePolynomial {
  std::vector<double> breaks;        // strictly increasing: one more than `coefficients`
  std::vector<Matrix> coefficients;  // components × (degree + 1)
};

using TimePiece = std::variant<ConstantFunction, FormulaFunction, SampledFunction, PiecewisePolynomial>;

struct TimeFunction {
  struct Piece {
    double start = 0;  // the first piece also holds before its start
    TimePiece function;
  };
  std::vector<Piece> pieces;  // starts strictly increasing, at least one piece
  // Components × those of the pieces; 0 × 0 stands for the identity.
  StructuredMatrix lift = {};

  bool is_lifted() const { return lift.size() > 0; }
  // The components that the pieces have, for a function of `size` components.
  Index inner_size(Index size) const { return is_lifted() ? lift.cols() : size; }
  // The pieces without the lift: ψ.
  TimeFunction Inner() const { return {.pieces = pieces}; }

  static TimeFunction Constant(Vector value);
  static TimeFunction Zero(Index size);
  static TimeFunction Formulas(std::vector<std::string> formulas);
  static TimeFunction Sampled(std::vector<double> times, Matrix values);
};

// Evaluates a TimeFunction. Not safe to share between threads (formulas hold their variable), cheap
// to move, some 5 µs per formula to make.
class TimeFunctionEvaluator {
 public:
  // With an `axis` (AxisOf() of a problem) both limits are correct at all of its break points: pieces start and
  // formulas switch exactly there, in spite of rounding. Without one both limits of a formula are its value.
  // Errors: InvalidArgument as the first entry of Validate() below.
  static absl::StatusOr<TimeFunctionEvaluator> Create(const TimeFunction& function, Index size,
                                                      const TimeAxis& axis = {});

  TimeFunctionEvaluator(TimeFunctionEvaluator&&) noexcept;
  TimeFunctionEvaluator& operator=(TimeFunctionEvaluator&&) noexcept;
  ~TimeFunctionEvaluator();

  Index size() const;
  // Writes the limit of the function at `t` from `side` to `out` (size() entries). Where a formula has no
  // finite value the entry is not finite; the caller decides what that means.
  void Evaluate(double t, Side side, Eigen::Ref<Vector> out);
  // Whether all components are known to be constant from the right limit at `begin` to the left limit at `end`.
  bool IsSteady(double begin, double end);
  // Writes bounds of the rounding errors of the values at `t`, where no piece starts and nothing jumps; of a formula
  // also where it is a small difference of large terms. Cost: some ten times that of Evaluate() for formulas.
  void RoundingAt(double t, Eigen::Ref<Vector> out);
  // The derivative at `t`, the limit from `side`, and bounds of its rounding errors, infinite where it is not known.
  void SlopeAt(double t, Side side, Eigen::Ref<Vector> out, Eigen::Ref<Vector> rounding);

 private:
  struct Impl;
  explicit TimeFunctionEvaluator(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Everything wrong with `function` as a function with `size` components: times out of order, shapes, non-finite
// numbers, formulas that do not parse (with the position and the reason). Formulas are not evaluated; Validate(Problem)
// does that at sample times.
// Fields are named, with `field` = "f": f[1] for a component of a constant or its formula, f.times[3], f.values[1][3],
// f.breaks[2], f.coefficients[2][1][0] (polynomial, component, power). Where there is more than one piece, f.pieces[2]
// takes the place of f in all of these, and f.pieces[2].start is its start. For a lifted function f.lift is the matrix,
// and f.of takes the place of f in all of these.
std::vector<Violation> Validate(const TimeFunction& function, Index size, const std::string& field);
// The same, appended to a longer list.
void Validate(const TimeFunction& function, Index size, const std::string& field, ViolationList& list);

// A formula of a time function with its analysis on the part of [0, horizon] where its piece is valid.
struct AnalyzedComponent {
  std::size_t piece;
  Index component;  // the first one with this text
  std::shared_ptr<const AnalyzedFormula> formula;
};
// Each different formula of each piece of the valid `function`; stops after the eighth refused one. Cost: that of
// AnalyzeFormula() (core/problem/formula_switching.h).
std::vector<AnalyzedComponent> AnalyzeFormulas(const TimeFunction& function, double horizon);

// The times strictly inside (0, horizon) where a piece or a polynomial of the valid `function` starts or a formula
// switches, increasing and distinct.
std::vector<double> BreakPoints(const TimeFunction& function, double horizon);

// Those of formulas that rounding in a formula hides for longer than doubles hide any time, increasing.
struct UncertainTime {
  double time = 0;
  double error = 0;  // by how much it may be off
};
std::vector<UncertainTime> UncertainBreakPoints(const TimeFunction& function, double horizon);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_TIME_FUNCTION_H_
