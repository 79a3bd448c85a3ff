// SPDX-License-Identifier: Apache-2.0
// The times at which a formula in t has a kink or a jump: where comparisons, abs, min, max, sign, floor and ceil
// switch; and the times at which it has no finite value.

#ifndef DLCS_CORE_PROBLEM_FORMULA_SWITCHING_H_
#define DLCS_CORE_PROBLEM_FORMULA_SWITCHING_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/formula_syntax.h"
#include "core/problem/time_axis.h"
#include "core/types.h"

namespace dlcs {

// A time at which the formula has limits but no value, such as 0 in sin(t)/t.
struct FormulaGap {
  double from = 0, to = 0;  // the interval around it in which evaluation may give no value
  double left = 0, right = 0;
  bool jumps = false;  // the two differ by more than rounding
};

struct FormulaSwitching {
  // Inside (begin, end) of the search, increasing. Between two of them every switch that depends on t alone is decided,
  // except at isolated times where its operand touches zero.
  std::vector<double> times = {};
  // By how much each may be off, since the operand is the same number for so long: the switch of floor(t + 1e15)
  // is only seen to an eighth.
  std::vector<double> time_errors = {};
  // One entry more than `times`: for each smooth interval a time at which its switches are decided. NaN if they could
  // not be decided; then the formula is evaluated without fixed decisions.
  std::vector<double> inside = {};
  std::vector<FormulaGap> gaps = {};
  // Why the formula is refused, as in "has no finite value at t = 2: it grows beyond all bounds there"; or empty.
  std::string refusal = {};
  // What the search could not decide.
  std::vector<std::string> warnings = {};
};

// Searches [begin, end] by bisection. If the enclosure (core/problem/formula_enclosure.h) of a switch's operand
// excludes zero, the switch does not change in the interval. If that of its slope excludes zero, there is at most one
// switching time, found to the last bit. Otherwise the interval is divided. If the sign of the operand stays hidden by
// rounding, the intervals in which it does are reported as one switching time, with a warning if the operand may jump
// there. A formula in t alone is also searched for times without a finite value; poles and gaps are distinguished by
// the growth of the enclosures near them. Cost: for smooth formulas one or a few enclosures; about 10 µs per switching
// time; at most a second.
FormulaSwitching FindSwitchingTimes(const FormulaTree& tree, double begin, double end);

struct AnalyzedFormula {
  FormulaTree tree;
  FormulaSwitching switching;
};

// The tree and the switching times of `text`. Results are cached, since a problem may have the same formula in many
// components, and its break points are needed many times. Errors: as ReadFormula(). Safe from any thread.
absl::StatusOr<std::shared_ptr<const AnalyzedFormula>> AnalyzeFormula(const std::string& text,
                                                                      const FormulaVariables& variables, double begin,
                                                                      double end);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_SWITCHING_H_
