// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/sparse_class.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// The first entry that `is_bad`, column by column, as the reason for a no.
template <typename Predicate>
std::optional<Fact> FindEntry(const SparseMatrix& M, const char* what, const Predicate& is_bad) {
  for (Index j = 0; j < M.cols(); ++j) {
    for (SparseMatrix::InnerIterator it(M, j); it; ++it) {
      if (!is_bad(it.row(), j, it.value())) continue;
      Fact fact{Answer::kNo, absl::StrCat("M[", it.row(), "][", j, "] = ", it.value(), what)};
      fact.witness.indices = {std::min<Index>(it.row(), j), std::max<Index>(it.row(), j)};
      if (it.row() == j) fact.witness.indices.pop_back();
      fact.witness.value = it.value();
      return fact;
    }
  }
  return std::nullopt;
}

// The first diagonal entry that is not positive, or negative where zero is `allowed`.
std::optional<Fact> FindDiagonal(const SparseMatrix& M, bool zero_allowed) {
  const Vector diagonal = M.diagonal();
  for (Index i = 0; i < diagonal.size(); ++i) {
    if (diagonal[i] > 0 || (zero_allowed && diagonal[i] == 0)) continue;
    Fact fact{Answer::kNo, absl::StrCat("M[", i, "][", i, "] = ", diagonal[i], " is not positive")};
    fact.witness.indices = {i};
    fact.witness.value = diagonal[i];
    return fact;
  }
  return std::nullopt;
}

SparseMatrix Comparison(const SparseMatrix& M) {
  SparseMatrix result = M;
  for (Index j = 0; j < M.cols(); ++j) {
    for (SparseMatrix::InnerIterator it(result, j); it; ++it) {
      it.valueRef() = it.row() == j ? std::abs(it.value()) : -std::abs(it.value());
    }
  }
  return result;
}

// Whether M v > 0 beyond the rounding of the sums.
bool IsImagePositive(const SparseMatrix& M, const Vector& v) {
  const Index most_terms = M.nonZeros() - M.rows() + 1;
  return BoundedProduct(M, v).AllPositive(RoundingOfProduct(most_terms));
}

SparseMatrix SymmetricPart(const SparseMatrix& M) { return (M + SparseMatrix(M.transpose())) * 0.5; }

std::string DescribeSparse(const MatrixClass& known, bool skew) {
  if (known.zero) return "zero (index one where N B allows)";
  if (known.p.yes() && known.z.yes()) return "P- and Z-matrix (nonsingular M-matrix)";
  if (known.p.yes()) return absl::StrCat("P-matrix (", known.p.why, ")");
  if (known.z.yes()) {
    return absl::StrCat("Z-matrix, ", known.p.no() ? "not a P-matrix (" : "perhaps a P-matrix (", known.p.why, ")");
  }
  if (skew) return "skew-symmetric, hence positive semidefinite";
  return absl::StrCat("of no known class: ", known.p.why);
}

Fact TestP(const SparseMatrix& M, const MatrixClass& known, const Fact& definite, std::optional<double>& lipschitz) {
  if (std::optional<Fact> bad = FindDiagonal(M, false)) return *std::move(bad);
  const Fact comparison = TestMMatrix(Comparison(M));
  if (comparison.yes()) {
    // v = ⟨M⟩⁻¹1 up to rounding, and ‖⟨M⟩⁻¹‖_∞ = ‖⟨M⟩⁻¹1‖_∞.
    lipschitz = MaxAbs(comparison.witness.z);
    Fact fact{Answer::kYes, known.z.yes()
                                ? "a Z-matrix with M v > 0 for some v > 0 (nonsingular M-matrix)"
                                : "an H-matrix with positive diagonal: diagonally dominant after column scaling"};
    fact.witness.z = comparison.witness.z;
    return fact;
  }
  if (known.z.yes()) return comparison;
  if (definite.yes()) return {Answer::kYes, "its symmetric part is positive definite"};
  return {Answer::kUnknown,
          absl::StrCat("n = ", M.rows(), ", neither an H-matrix nor with a positive definite symmetric part")};
}

Fact TestSemidefinite(const SparseMatrix& M, const Fact& definite) {
  if (definite.yes()) return definite;
  if (std::optional<Fact> bad = FindDiagonal(M, true)) return *std::move(bad);
  const auto off_diagonal = [](Index i, Index j, double value) { return i != j && value != 0; };
  if (!FindEntry(SymmetricPart(M), "", off_diagonal)) {
    return {Answer::kYes, "its symmetric part is diagonal, without a negative entry"};
  }
  return {Answer::kUnknown, "its symmetric part is not proven to be positive definite"};
}

}  // namespace

Fact TestZMatrix(const SparseMatrix& M) {
  const auto bad = [](Index i, Index j, double value) { return i != j && value > 0; };
  if (std::optional<Fact> no = FindEntry(M, " is positive, off the diagonal", bad)) return *std::move(no);
  return {Answer::kYes, "no off-diagonal entry is positive"};
}

Fact TestMMatrix(const SparseMatrix& M) {
  Eigen::SparseLU<SparseMatrix> lu(M);
  if (lu.info() != Eigen::Success) return {Answer::kUnknown, "singular, or nearly so"};
  const Vector v = lu.solve(Vector::Ones(M.rows()));
  if (v.allFinite() && IsImagePositive(M, v)) {
    const bool yes = (v.array() > 0).all();
    Fact fact{yes ? Answer::kYes : Answer::kNo,
              yes ? "M v > 0 for some v > 0" : "M v > 0 for some v that is not positive"};
    fact.witness.z = v;
    return fact;
  }
  return {Answer::kUnknown, "a Z-matrix that is singular to working precision"};
}

Fact TestPositiveDefinite(const SparseMatrix& M) {
  const Fact unknown{Answer::kUnknown, "not proven by a factorization"};
  SparseMatrix part = SymmetricPart(M);
  if (FindDiagonal(part, false)) return unknown;
  const Vector scale = part.diagonal().unaryExpr([](double d) { return std::exp2(-std::round(std::log2(d) / 2)); });
  part = scale.asDiagonal() * part * scale.asDiagonal();
  Eigen::SimplicialLDLT<SparseMatrix> ldlt(part);
  if (ldlt.info() != Eigen::Success) return unknown;
  const double terms = static_cast<double>(ldlt.matrixL().nestedExpression().nonZeros() + 3 * M.rows());
  ldlt.setShift(-RoundingOf(16) * (terms + MaxAbs(part.cwiseAbs() * Vector::Ones(M.rows()))));
  ldlt.factorize(part);
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().array() > 0).all()) return unknown;
  return {Answer::kYes, "the factorization of its symmetric part has positive pivots"};
}

MatrixClass ClassifySparse(const SparseMatrix& M) {
  MatrixClass known;
  known.size = M.rows();
  const Vector row_sums = M.cwiseAbs() * Vector::Ones(M.cols());
  known.zero = (row_sums.array() == 0).all();
  known.zero_row = (row_sums.array() == 0).any();
  known.z = TestZMatrix(M);
  const Fact definite = TestPositiveDefinite(M);
  known.p = TestP(M, known, definite, known.lipschitz);
  known.positive_semidefinite = TestSemidefinite(M, definite);
  const SparseMatrix part = SymmetricPart(M);
  known.description = DescribeSparse(known, part.nonZeros() == 0 || MaxAbs(Vector(part.coeffs())) == 0);
  return known;
}

}  // namespace dlcs
