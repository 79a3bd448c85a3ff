// SPDX-License-Identifier: Apache-2.0
// A formula as the list of its operations, each after its operands: the result of parsing, and the input of evaluation,
// enclosures and the search for switching times.

#ifndef DLCS_CORE_PROBLEM_FORMULA_TREE_H_
#define DLCS_CORE_PROBLEM_FORMULA_TREE_H_

#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

#include "core/types.h"

namespace dlcs {

enum class FormulaOperation : std::uint8_t {
  kNumber,
  kTime,
  kState,
  kConstraint,
  kNegate,
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kPower,
  kLess,
  kLessEqual,
  kGreater,
  kGreaterEqual,
  kEqual,
  kNotEqual,
  kMin,
  kMax,
  kSin,
  kCos,
  kTan,
  kAsin,
  kAcos,
  kAtan,
  kSinh,
  kCosh,
  kTanh,
  kExp,
  kLog,
  kLog10,
  kSqrt,
  kAbs,
  kSign,
  kFloor,
  kCeil,
};

struct FormulaStep {
  FormulaOperation operation = FormulaOperation::kNumber;
  int a = -1, b = -1;  // the operands, as indices of earlier steps
  double number = 0;   // of kNumber
  Index index = 0;     // of kState and kConstraint, from 0
  // The value depends on t and on no other variable. (A value that depends on no variable is a kNumber.)
  bool of_time_alone = false;
};

struct FormulaTree {
  std::vector<FormulaStep> steps;  // the last one is the value; equal steps occur once
  bool depends_on_t = false;
  // Indices from 0 of the x and y in the text, each once, in the order of their first occurrence.
  std::vector<Index> states;
  std::vector<Index> constraints;
};

// Appends steps to a tree. Operations on numbers are evaluated at once, with the result that evaluation would give.
class FormulaTreeBuilder {
 public:
  int Number(double value);
  int Time();
  int State(Index i);
  int Constraint(Index i);
  int Operation(FormulaOperation operation, int a, int b = -1);
  // The tree whose value is step `root`.
  FormulaTree Take(int root) &&;

 private:
  int Append(const FormulaStep& step);

  FormulaTree tree_;
  std::unordered_multimap<std::size_t, int> by_hash_;
};

// Whether the operation has a kink or a jump at a switching time: of comparisons, min and max where their operands are
// equal, of abs and sign where the operand is 0, of floor and ceil where it is a whole number.
inline bool IsComparison(FormulaOperation operation) {
  return operation >= FormulaOperation::kLess && operation <= FormulaOperation::kNotEqual;
}
inline bool IsExtremum(FormulaOperation operation) {
  return operation == FormulaOperation::kMin || operation == FormulaOperation::kMax;
}
inline bool IsRounding(FormulaOperation operation) {
  return operation == FormulaOperation::kFloor || operation == FormulaOperation::kCeil;
}
inline bool IsSwitch(FormulaOperation operation) {
  return IsComparison(operation) || IsExtremum(operation) || operation >= FormulaOperation::kAbs;
}
// A switch whose value may jump.
inline bool MayJump(FormulaOperation operation) {
  return IsSwitch(operation) && !IsExtremum(operation) && operation != FormulaOperation::kAbs;
}

// The value of `operation`, which is not a variable, for operands `a` and `b`. Where Python raises an error it is the
// infinity or NaN of IEEE arithmetic, and NaN passes through min, max and sign: std::min and std::max drop it,
// depending on its place, and a formula without a value must not look like one with.
inline double ValueOf(FormulaOperation operation, double a, double b) {
  using enum FormulaOperation;
  switch (operation) {
    case kNumber:
    case kTime:
    case kState:
    case kConstraint:
      break;
    case kNegate:
      return -a;
    case kAdd:
      return a + b;
    case kSubtract:
      return a - b;
    case kMultiply:
      return a * b;
    case kDivide:
      return a / b;
    case kPower:
      return std::pow(a, b);
    case kLess:
      return a < b;
    case kLessEqual:
      return a <= b;
    case kGreater:
      return a > b;
    case kGreaterEqual:
      return a >= b;
    case kEqual:
      return a == b;
    case kNotEqual:
      return a != b;
    case kMin:
      return std::isnan(a) || !(std::isnan(b) || b < a) ? a : b;
    case kMax:
      return std::isnan(a) || !(std::isnan(b) || b > a) ? a : b;
    case kSin:
      return std::sin(a);
    case kCos:
      return std::cos(a);
    case kTan:
      return std::tan(a);
    case kAsin:
      return std::asin(a);
    case kAcos:
      return std::acos(a);
    case kAtan:
      return std::atan(a);
    case kSinh:
      return std::sinh(a);
    case kCosh:
      return std::cosh(a);
    case kTanh:
      return std::tanh(a);
    case kExp:
      return std::exp(a);
    case kLog:
      return std::log(a);
    case kLog10:
      return std::log10(a);
    case kSqrt:
      return std::sqrt(a);
    case kAbs:
      return std::fabs(a);
    case kSign:
      return std::isnan(a) ? a : (a > 0) - (a < 0);
    case kFloor:
      return std::floor(a);
    case kCeil:
      return std::ceil(a);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

// The decision of the switch `step` for the `values` of its operands: for abs the sign, for min and max the index of
// the operand (0 or 1), for the others the value.
inline double DecisionOf(const FormulaStep& step, const std::vector<double>& values) {
  const double a = values[static_cast<std::size_t>(step.a)];
  const double b = step.b < 0 ? 0 : values[static_cast<std::size_t>(step.b)];
  if (step.operation == FormulaOperation::kAbs) return a < 0 ? -1 : 1;
  const double value = ValueOf(step.operation, a, b);
  return IsExtremum(step.operation) ? value != a : value;
}

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_TREE_H_
