// SPDX-License-Identifier: Apache-2.0
#include "core/problem/problem_checks.h"

#include <cmath>

#include "core/format_number.h"

namespace dlcs {

std::string ComponentsText(Index count) { return std::to_string(count) + (count == 1 ? " component" : " components"); }

namespace {

template <class AnyMatrix>
void CheckAnyMatrix(const AnyMatrix& matrix, Index rows, Index columns, const std::string& rule,
                    const std::string& field, ViolationList& list) {
  if (matrix.rows() != rows || matrix.cols() != columns) {
    list.Add(field, ShapeText(matrix.rows(), matrix.cols()) + "; must be " + rule);
  }
  list.AddNonFiniteEntries(matrix, field);
}

template <class AnyMatrix>
void CheckAnySquareMatrix(const AnyMatrix& matrix, const std::string& rule, const std::string& field,
                          ViolationList& list) {
  if (matrix.rows() == 0) {
    list.Add(field, "0 rows; must be " + rule + " with at least one row");
  } else {
    CheckMatrix(matrix, matrix.rows(), matrix.rows(), "square, " + rule, field, list);
  }
}

}  // namespace

void CheckMatrix(const Matrix& matrix, Index rows, Index columns, const std::string& rule, const std::string& field,
                 ViolationList& list) {
  CheckAnyMatrix(matrix, rows, columns, rule, field, list);
}

void CheckMatrix(const StructuredMatrix& matrix, Index rows, Index columns, const std::string& rule,
                 const std::string& field, ViolationList& list) {
  CheckAnyMatrix(matrix, rows, columns, rule, field, list);
}

void CheckSquareMatrix(const Matrix& matrix, const std::string& rule, const std::string& field, ViolationList& list) {
  CheckAnySquareMatrix(matrix, rule, field, list);
}

void CheckSquareMatrix(const StructuredMatrix& matrix, const std::string& rule, const std::string& field,
                       ViolationList& list) {
  if (const KroneckerSum* sum = matrix.kronecker_sum()) {
    if (sum->factors.empty()) list.Add(field + ".kronecker_sum", "no factors; a Kronecker sum has at least one factor");
    for (std::size_t k = 0; k < sum->factors.size(); ++k) {
      const SparseMatrix& factor = sum->factors[k];
      if (factor.rows() == factor.cols() && factor.rows() > 0) continue;
      list.Add(field + ".kronecker_sum.factors[" + std::to_string(k) + "]",
               ShapeText(factor.rows(), factor.cols()) + "; must be square, with at least one row");
    }
  }
  CheckAnySquareMatrix(matrix, rule, field, list);
}

void CheckParameters(const FormulaParameters& parameters, ViolationList& list) {
  for (const auto& [name, value] : parameters) {
    const std::string fault = FaultOfParameterName(name);
    if (!fault.empty()) list.Add("parameters." + name, fault);
    if (!std::isfinite(value)) list.Add("parameters." + name, NumberText(value) + "; must be finite");
  }
}

void CheckInitialState(const Vector& x0, Index m, ViolationList& list) {
  if (x0.size() != m) {
    list.Add("x0", ComponentsText(x0.size()) + "; must be m = " + std::to_string(m) + " (from A)");
  }
  list.AddNonFiniteComponents(x0, "x0");
}

void CheckStart(const std::optional<Vector>& y0, SolutionRule rule, Index n, ViolationList& list) {
  if (!y0) return;
  if (rule != SolutionRule::kHistory) list.Add("y0", "given; only the rule history starts from one");
  if (y0->size() != n) {
    list.Add("y0", ComponentsText(y0->size()) + "; must be n = " + std::to_string(n) + " (from M)");
  }
  for (Index i = 0; i < y0->size(); ++i) {
    const double value = (*y0)[i];
    if (std::isfinite(value) && value >= 0) continue;
    list.Add("y0[" + std::to_string(i) + "]", NumberText(value) + "; must be finite and at least 0");
  }
}

void CheckSelector(const std::optional<Selector>& selector, SolutionRule rule, Index n, ViolationList& list) {
  const bool needed = rule == SolutionRule::kMinimizer;
  if (needed && !selector) list.Add("selector", "missing; the rule minimizer needs C and b");
  if (!needed && selector) list.Add("selector", "given; only the rule minimizer takes one");
  if (!selector) return;
  const auto& [C, b] = *selector;
  if (C.rows() == 0 || C.cols() != n) {
    list.Add("selector.C",
             ShapeText(C.rows(), C.cols()) + "; must be k x n, k >= 1, n = " + std::to_string(n) + " (from M)");
  }
  list.AddNonFiniteEntries(C, "selector.C");
  if (b.size() != C.rows()) {
    list.Add("selector.b", ComponentsText(b.size()) + "; must be one per row of C: " + std::to_string(C.rows()));
  }
  list.AddNonFiniteComponents(b, "selector.b");
}

}  // namespace dlcs
