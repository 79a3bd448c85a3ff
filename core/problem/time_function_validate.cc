// SPDX-License-Identifier: Apache-2.0
// The rules that a TimeFunction must keep.

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>

#include "absl/status/status.h"
#include "core/format_number.h"
#include "core/problem/formula_syntax.h"
#include "core/problem/problem_checks.h"
#include "core/problem/time_function.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

std::string At(const std::string& name, std::size_t index) { return name + "[" + std::to_string(index) + "]"; }

// What the components of the function `field` of a problem are for.
const char* MeaningOf(const std::string& field) {
  if (field == "f" || field.starts_with("f.pieces")) return ", one for each state";
  if (field == "g" || field.starts_with("g.pieces")) return ", one for each pair";
  return "";
}

std::string SizeRule(Index found, Index size, const std::string& field) {
  return ComponentsText(found) + "; must be " + std::to_string(size) + MeaningOf(field);
}

// Checks one piece; the overloads follow the variant.
struct PieceRules {
  Index size;
  std::string field;
  ViolationList& list;

  void operator()(const ConstantFunction& constant) const {
    if (constant.value.size() != size) {
      list.Add(field, SizeRule(constant.value.size(), size, field));
    }
    list.AddNonFiniteComponents(constant.value, field);
  }

  void operator()(const FormulaFunction& function) const {
    if (static_cast<Index>(function.formulas.size()) != size) {
      list.Add(field, SizeRule(static_cast<Index>(function.formulas.size()), size, field));
    }
    std::set<std::string_view> sound;  // grids have the same formula at many points
    for (std::size_t i = 0; i < function.formulas.size() && !list.full(); ++i) {
      if (sound.count(function.formulas[i]) > 0) continue;
      const absl::StatusOr<FormulaTree> formula =
          ReadFormula(function.formulas[i], {.parameters = function.parameters});
      if (formula.ok()) {
        sound.insert(function.formulas[i]);
      } else {
        list.Add(At(field, i), std::string(formula.status().message()));
      }
    }
  }

  void operator()(const SampledFunction& samples) const {
    if (samples.times.empty()) list.Add(field + ".times", "empty; must hold at least one time");
    list.AddDisorder(samples.times, field + ".times");
    const auto columns = static_cast<Index>(samples.times.size());
    CheckShape(samples.values, columns, field + ".values", " (components x times)");
    list.AddNonFiniteEntries(samples.values, field + ".values");
  }

  void operator()(const PiecewisePolynomial& polynomials) const {
    const std::size_t count = polynomials.coefficients.size();
    if (count == 0) list.Add(field + ".coefficients", "empty; must hold at least one polynomial");
    if (polynomials.breaks.size() != count + 1) {
      list.Add(field + ".breaks", std::to_string(polynomials.breaks.size()) + " times; must be " +
                                      std::to_string(count + 1) + ", one more than the polynomials");
    }
    list.AddDisorder(polynomials.breaks, field + ".breaks");
    for (std::size_t p = 0; p < count; ++p) {
      const Matrix& coefficients = polynomials.coefficients[p];
      const std::string name = At(field + ".coefficients", p);
      CheckShape(coefficients, std::max<Index>(coefficients.cols(), 1), name, " (components x powers)");
      list.AddNonFiniteEntries(coefficients, name);
    }
  }

 private:
  void CheckShape(const Matrix& matrix, Index columns, const std::string& name, const char* meaning) const {
    if (matrix.rows() != size || matrix.cols() != columns) {
      list.Add(name, ShapeText(matrix.rows(), matrix.cols()) + "; must be " + ShapeText(size, columns) + meaning);
    }
  }
};

void ValidatePieces(const TimeFunction& function, Index size, const std::string& field, ViolationList& list) {
  if (function.pieces.empty()) list.Add(field, "no pieces; a time function has at least one");
  const bool single = function.pieces.size() == 1;
  for (std::size_t k = 0; k < function.pieces.size(); ++k) {
    const std::string name = single ? field : At(field + ".pieces", k);
    const double start = function.pieces[k].start;
    if (!std::isfinite(start)) {
      list.Add(name + ".start", NumberText(start) + "; every time must be finite");
    } else if (k > 0 && start <= function.pieces[k - 1].start) {
      list.Add(name + ".start", NumberText(start) + "; must be greater than the start before it, " +
                                    NumberText(function.pieces[k - 1].start));
    }
    std::visit(PieceRules{size, name, list}, function.pieces[k].function);
  }
}

}  // namespace

void Validate(const TimeFunction& function, Index size, const std::string& field, ViolationList& list) {
  if (!function.is_lifted()) return ValidatePieces(function, size, field, list);
  if (function.lift.rows() != size) {
    list.Add(field + ".lift",
             ShapeText(function.lift.rows(), function.lift.cols()) + "; must have " + std::to_string(size) + " rows");
  }
  list.AddNonFiniteEntries(function.lift, field + ".lift");
  ValidatePieces(function, function.lift.cols(), field + ".of", list);
}

std::vector<Violation> Validate(const TimeFunction& function, Index size, const std::string& field) {
  ViolationList list;
  Validate(function, size, field, list);
  return std::move(list).Take();
}

}  // namespace dlcs
