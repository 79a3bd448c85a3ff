// SPDX-License-Identifier: Apache-2.0
// The mass matrix E of E x' = A x + B y + f, as finite elements bring one.

#ifndef DLCS_CORE_PROBLEM_MASS_FACTOR_H_
#define DLCS_CORE_PROBLEM_MASS_FACTOR_H_

#include <optional>
#include <string>
#include <vector>

#include "core/linalg/sparse/sparse_factor.h"
#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

// Solves with E. Rows and columns of E are scaled to entries of about one, since states have units.
class MassFactor {
 public:
  explicit MassFactor(SparseMatrix E);

  bool is_regular() const { return factor_->is_regular(); }

  // To rounding of each column, for a condition up to 1e12: refined with residuals of twice the digits, without which
  // the condition of E would be in E⁻¹A.
  Matrix Solve(const Matrix& right) const;

  // The largest components of a vector v with v'E = 0, or E v = 0 with `of_columns`, in increasing order; empty where
  // none is found. Inverse iteration with a small shift.
  std::vector<Index> Dependent(bool of_columns) const;

 private:
  Matrix SolveOnce(const Matrix& right) const;

  // right - E · solution.
  Matrix Residual(const Matrix& right, const Matrix& solution) const;

  template <typename Function>
  void ForEntries(Function function);

  Vector rows_, columns_;
  SparseMatrix E_, scaled_;
  std::optional<SparseFactor<double>> factor_;
};

// Why the square, finite E has no inverse to working precision: rows or columns of zeros, or the rows or columns that
// depend on each other. Empty where it has one. Rows and columns are scaled first, so that units do not matter. Cost:
// one factorization, sparse unless E is dense; where that is predicted to take minutes only zeros are looked for.
std::string WhySingular(const StructuredMatrix& E);

// Whether no entry off the diagonal of E is other than zero.
bool IsDiagonal(const StructuredMatrix& E);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_MASS_FACTOR_H_
