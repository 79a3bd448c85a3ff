// SPDX-License-Identifier: Apache-2.0
// Encloses the values and slopes of a formula over an interval of time.

#ifndef DLCS_CORE_PROBLEM_FORMULA_ENCLOSURE_H_
#define DLCS_CORE_PROBLEM_FORMULA_ENCLOSURE_H_

#include <vector>

#include "core/problem/formula_tree.h"
#include "core/problem/interval.h"

namespace dlcs {

// `slope` contains all derivatives; it is the whole line if the value may jump.
struct Enclosure {
  Interval value;
  Interval slope;
};

class FormulaEnclosure {
 public:
  struct Assumptions {
    // A number that is not an integer means the interval of all reals that round to it.
    bool numbers_are_rounded = false;
    // Where the formula is enclosed it has a value: what rounding may move out of the domain of an operation, such as 1
    // - cos(0) of the root, is in it.
    bool has_value = false;
  };

  // Keeps a reference to `tree`. Only steps that depend on t alone are enclosed.
  explicit FormulaEnclosure(const FormulaTree& tree) : FormulaEnclosure(tree, Assumptions()) {}
  FormulaEnclosure(const FormulaTree& tree, Assumptions assumptions);

  // Encloses all steps over [lo, hi]. Values at `middle`, between them, make the enclosures narrower by the mean value
  // theorem. Cost: about 50 ns per step.
  void Evaluate(double lo, double middle, double hi);
  // Encloses only the values at `t`, those "at middle": a fifth of the cost.
  void EvaluateAt(double t);

  // The enclosure of the quantity that decides the switch `step`: the difference of its operands, or its operand.
  const Enclosure& decider(int step) const { return deciders_[static_cast<std::size_t>(step)]; }
  Interval decider_at_middle(int step) const { return middle_deciders_[static_cast<std::size_t>(step)]; }
  // Whether the switch is decided over the interval; for floor, whether its operand crosses no integer.
  static bool IsDecided(FormulaOperation operation, Interval decider);

  Interval value(int step) const { return all_[static_cast<std::size_t>(step)].value; }
  Interval slope(int step) const { return all_[static_cast<std::size_t>(step)].slope; }
  Interval value_at_middle(int step) const { return middle_[static_cast<std::size_t>(step)]; }
  // Whether some step may have no finite value.
  bool is_singular() const { return singular_; }
  bool is_singular_at_middle() const { return singular_at_middle_; }

  const std::vector<int>& computed() const { return computed_; }

 private:
  // `from_middle` is t - middle.
  void EncloseAll(Interval t, Interval from_middle);
  // Of a step that is no switch, for its operands; the slope also takes the value of the step.
  Interval ValueOfStep(const FormulaStep& step, Interval u, Interval v) const;
  static Interval SlopeOfStep(const FormulaStep& step, const Enclosure& a, const Enclosure& b, Interval value);

  const FormulaTree& tree_;
  Assumptions assumptions_;
  std::vector<int> computed_;  // steps that depend on t alone and are not t itself
  int time_ = -1;
  std::vector<Enclosure> all_, deciders_;
  std::vector<Interval> middle_, middle_deciders_;
  bool singular_ = false, singular_at_middle_ = false;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_ENCLOSURE_H_
