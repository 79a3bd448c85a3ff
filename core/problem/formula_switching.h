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

// A time without a value that has limits, as 0 of sin(t)/t.
struct FormulaGap {
  double from = 0, to = 0;  // where the formula, as it stands, may have none
  double left = 0, right = 0;
  bool jumps = false;  // the two differ by more than rounding
};

struct FormulaSwitching {
  // Inside (begin, end) of the search, increasing. Between two of them every switch that depends on t alone is decided,
  // but at isolated times where its operand touches zero.
  std::vector<double> times = {};
  // One more: a time of each smooth interval at which its switches are decided; NaN where they could not be told apart,
  // and the formula is evaluated as it stands.
  std::vector<double> inside = {};
  std::vector<FormulaGap> gaps = {};
  // Why the formula can not be taken, as in "has no finite value at t = 2: it grows beyond all bounds there"; or empty.
  std::string refusal = {};
  // What could not be found out.
  std::vector<std::string> warnings = {};
};

// Searches [begin, end] by bisection. Where the enclosure (core/problem/formula_enclosure.h) of a switch's operand
// excludes zero nothing switches; where that of its slope does there is at most one time, found to the last bit; else
// the interval is cut. Where rounding of the operand alone hides its sign, whatever the interval, one switching time
// stands for all that may be there: none is lost that lies further from the next than that; where the operand may jump
// it is said. A formula in t alone is searched for times without finite value too: poles are told from gaps by the
// growth of enclosures on the way there. Cost: for smooth formulas one enclosure or a few; some 10 µs a switching time;
// a second at most.
FormulaSwitching FindSwitchingTimes(const FormulaTree& tree, double begin, double end);

struct AnalyzedFormula {
  FormulaTree tree;
  FormulaSwitching switching;
};

// The tree and the switching times of `text`, made once for all who ask for the same: problems have a formula in many
// components, and are asked for their break points many times. Errors: as ReadFormula(). Safe from any thread.
absl::StatusOr<std::shared_ptr<const AnalyzedFormula>> AnalyzeFormula(const std::string& text,
                                                                      const FormulaVariables& variables, double begin,
                                                                      double end);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_SWITCHING_H_
