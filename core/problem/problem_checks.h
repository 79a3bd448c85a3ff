// SPDX-License-Identifier: Apache-2.0
// Checks that a differential and a plain linear complementarity problem share.

#ifndef DLCS_CORE_PROBLEM_PROBLEM_CHECKS_H_
#define DLCS_CORE_PROBLEM_PROBLEM_CHECKS_H_

#include <optional>
#include <string>

#include "core/linalg/structured_matrix.h"
#include "core/problem/formula_parameters.h"
#include "core/problem/solution_rule.h"
#include "core/problem/violation_list.h"
#include "core/types.h"

namespace dlcs {

// Shape ("must be " + `rule`) and finite entries.
void CheckMatrix(const Matrix& matrix, Index rows, Index columns, const std::string& rule, const std::string& field,
                 ViolationList& list);

void CheckMatrix(const StructuredMatrix& matrix, Index rows, Index columns, const std::string& rule,
                 const std::string& field, ViolationList& list);

// The same for a square matrix with at least one row. The violation of a matrix that is not square says so; the number
// of its rows is then taken as the expected size.
void CheckSquareMatrix(const Matrix& matrix, const std::string& rule, const std::string& field, ViolationList& list);
// In a Kronecker sum every factor must be square.
void CheckSquareMatrix(const StructuredMatrix& matrix, const std::string& rule, const std::string& field,
                       ViolationList& list);

// "1 component", "2 components"
std::string ComponentsText(Index count);

// Checks that `x0` has m finite components.
void CheckInitialState(const Vector& x0, Index m, ViolationList& list);

// Checks that `y0` is given only if `rule` starts from one, and that it has n components of at least 0.
void CheckStart(const std::optional<Vector>& y0, SolutionRule rule, Index n, ViolationList& list);

// Checks that `selector` is given if and only if `rule` needs it, that C is k × n, that b has k components, and that
// all entries are finite.
void CheckSelector(const std::optional<Selector>& selector, SolutionRule rule, Index n, ViolationList& list);

// Checks names (FaultOfParameterName()) and that values are finite. Fields are named parameters.NAME.
void CheckParameters(const FormulaParameters& parameters, ViolationList& list);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_PROBLEM_CHECKS_H_
