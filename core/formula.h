// SPDX-License-Identifier: Apache-2.0
// Formulas in the variable `t`, and in states x1 ... xm and constraints y1 ... yn where there are any, read as
// Python reads them.
//
// Numbers, the variables, `pi`, `e`; + - * / and powers written ** or ^ (right-associative, binding closer than a
// sign: -t**2 is -(t**2)); comparisons < <= > >= == != with value 0 or 1, chained as in Python
// (0 < t < 1 means (0 < t)*(t < 1)); parentheses; the functions
//     sin cos tan asin acos atan sinh cosh tanh exp log log10 sqrt abs sign floor ceil min max
// (log is the natural logarithm; min and max take one argument or more). Nothing else: no assignment, no
// other names, one value. All numbers are doubles, and every operation is done in the order written. Where
// Python raises an error (1/0, sqrt(-1)) the value is the infinity or NaN of IEEE arithmetic, and NaN passes
// through min and max.
//
// The parser is muParser behind a grammar of ours (core/formula_syntax.h); this file pair is the only one
// that includes it.

#ifndef DLCS_CORE_FORMULA_H_
#define DLCS_CORE_FORMULA_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/formula_syntax.h"
#include "core/types.h"

namespace dlcs {

class Formula {
 public:
  // A formula in `t` and `variables`, by default none.
  // Errors: InvalidArgument with the position in `text` and the reason; an unknown name is named.
  // Cost: about 15 µs.
  static absl::StatusOr<Formula> Parse(const std::string& text, FormulaVariables variables = {});

  Formula(Formula&&) noexcept;
  Formula& operator=(Formula&&) noexcept;
  ~Formula();

  // Whether `t` occurs in it. A formula without any variable costs nothing to evaluate.
  bool DependsOnTime() const;
  // Which x and y occur in it, as indices from 0.
  const std::vector<Index>& states() const;
  const std::vector<Index>& constraints() const;

  // The value at `t`; not finite where the formula has none (division by zero, log of a negative number).
  // Not safe to call from several threads at once. Cost: about 35 ns.
  double Evaluate(double t);
  // The same where the formula has states and constraints; `x` and `y` hold at least those that occur.
  double Evaluate(double t, const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y);

 private:
  struct Impl;
  explicit Formula(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_FORMULA_H_
