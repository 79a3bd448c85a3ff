// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/quadratic_form.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/linalg/bounded_sum.h"
#include "core/matrix_classes/minor_classes.h"
#include "core/matrix_classes/p_matrix.h"
#include "core/matrix_classes/positive_semidefinite.h"

namespace dlcs {
namespace {

Fact RefutedByForm(const Matrix& M, std::string why, Vector z) {
  Fact fact{Answer::kNo, std::move(why)};
  fact.witness.value = z.dot(M * z);
  fact.witness.z = std::move(z);
  return fact;
}

std::vector<Index> NonzeroRows(const Matrix& M) {
  std::vector<Index> rows;
  for (Index i = 0; i < M.rows(); ++i) {
    if ((M.row(i).array() != 0).any()) rows.push_back(i);
  }
  return rows;
}

// Whether no diagonal entry of `sum` is below the sum of the others of its row in size, which makes it
// positive semidefinite. One such entry is compared without rounding; of several the sum is taken too large.
bool IsDiagonallyDominant(const Matrix& sum) {
  for (Index i = 0; i < sum.rows(); ++i) {
    double others = 0;
    Index count = 0;
    for (Index j = 0; j < sum.cols(); ++j) {
      if (j == i || sum(i, j) == 0) continue;
      others += std::abs(sum(i, j));
      ++count;
    }
    if (count > 1) others *= 1 + RoundingOf(4 * count);
    if (!(sum(i, i) >= others)) return false;
  }
  return true;
}

// Yes where the rows of `sum` that are not zero make a positive definite matrix, or where the diagonal
// dominates.
std::optional<Fact> SemidefiniteByRows(const Matrix& sum) {
  const std::vector<Index> rows = NonzeroRows(sum);
  if (rows.empty()) return Fact{Answer::kYes, "its symmetric part is zero"};
  if (IsDiagonallyDominant(sum)) {
    return Fact{Answer::kYes, "its symmetric part is diagonally dominant, with no negative diagonal entry"};
  }
  if (!IsSymmetricPartPositiveDefinite(sum(rows, rows))) return std::nullopt;
  return Fact{Answer::kYes, "the rows of its symmetric part that are not zero make a positive definite matrix"};
}

Fact AtTheBoundary() {
  return {Answer::kUnknown, "the smallest eigenvalue of its symmetric part is zero to working precision"};
}

// The minors of M + Mᵀ are those of the symmetric part times 2^k.
Fact OfSymmetricPart(Fact fact) {
  if (fact.witness.value) *fact.witness.value /= std::exp2(static_cast<double>(fact.witness.indices.size()));
  fact.why = absl::StrCat("of its symmetric part (doubled): ", fact.why);
  return fact;
}

Fact Definite(const Matrix& M, const std::optional<Matrix>& sum, const Fact& semidefinite) {
  if (const auto smallest = SmallestEigenvalueIfDefinite(M)) {
    Fact fact{Answer::kYes, absl::StrCat("the smallest eigenvalue of its symmetric part is ", *smallest)};
    fact.witness.value = *smallest;
    return fact;
  }
  if (semidefinite.no()) return semidefinite;
  for (Index i = 0; i < M.rows(); ++i) {
    if (!(M(i, i) > 0)) {
      return RefutedByForm(M, absl::StrCat("M[", i, "][", i, "] = ", M(i, i), " is not positive"),
                           Vector::Unit(M.rows(), i));
    }
  }
  if (sum && M.rows() <= kMaxExactSize) return OfSymmetricPart(ClassifyByMinors(*sum).p);
  return AtTheBoundary();
}

Fact Semidefinite(const Matrix& M, const std::optional<Matrix>& sum) {
  if (IsSymmetricPartPositiveDefinite(M)) return {Answer::kYes, "positive definite"};
  if (Fact tolerant = TestPositiveSemidefinite(M); tolerant.no() && FormIsClearlyNegative(M, tolerant.witness.z)) {
    return RefutedByForm(M, tolerant.why, tolerant.witness.z);
  }
  if (!sum) return AtTheBoundary();
  if (auto by_rows = SemidefiniteByRows(*sum)) return *std::move(by_rows);
  if (M.rows() <= kMaxExactSize) return OfSymmetricPart(ClassifyByMinors(*sum).p0);
  return AtTheBoundary();
}

}  // namespace

QuadraticFormClasses ClassifyQuadraticForm(const Matrix& M) {
  const SymmetricSum rounded = SymmetricSumBelow(M);
  const std::optional<Matrix> sum = rounded.exact ? std::optional(rounded.below) : std::nullopt;
  QuadraticFormClasses classes;
  classes.positive_semidefinite = Semidefinite(M, sum);
  classes.positive_definite = Definite(M, sum, classes.positive_semidefinite);
  return classes;
}

}  // namespace dlcs
