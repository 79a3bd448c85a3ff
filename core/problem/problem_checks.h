// SPDX-License-Identifier: Apache-2.0
// Checks that a differential and a plain linear complementarity problem share.

#ifndef DLCS_CORE_PROBLEM_PROBLEM_CHECKS_H_
#define DLCS_CORE_PROBLEM_PROBLEM_CHECKS_H_

#include <optional>
#include <string>

#include "core/problem/problem.h"
#include "core/problem/violation_list.h"

namespace dlcs {

// Shape ("must be " + `rule`) and finite entries.
void CheckMatrix(const Matrix& matrix, Index rows, Index columns, const std::string& rule, const std::string& field,
                 ViolationList& list);

void CheckMatrix(const StructuredMatrix& matrix, Index rows, Index columns, const std::string& rule,
                 const std::string& field, ViolationList& list);

// The same of a square matrix with at least one row. One that is not square is told so, and its rows count.
void CheckSquareMatrix(const Matrix& matrix, const std::string& rule, const std::string& field, ViolationList& list);
// Of a Kronecker sum the factors are the square ones.
void CheckSquareMatrix(const StructuredMatrix& matrix, const std::string& rule, const std::string& field,
                       ViolationList& list);

// m finite components, as x0.
void CheckInitialState(const Vector& x0, Index m, ViolationList& list);

// Whether `selector` is given exactly where `rule` needs it, C is k × n, b has k components, and all are finite.
void CheckSelector(const std::optional<Selector>& selector, SolutionRule rule, Index n, ViolationList& list);

// Names (FaultOfParameterName()) and finite values, as parameters.NAME.
void CheckParameters(const FormulaParameters& parameters, ViolationList& list);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_PROBLEM_CHECKS_H_
