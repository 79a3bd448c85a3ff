// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/semicopositive_sweep.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/linalg/decompositions.h"
#include "core/matrix_classes/principal_minors.h"
#include "core/matrix_classes/s_matrix.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

using Subset = std::uint32_t;
using Sign = std::optional<int>;

// The signs of all principal minors, that of the empty one included.
class MinorSigns {
 public:
  explicit MinorSigns(const Matrix& M) : signs_(std::size_t{1} << M.rows(), 1) {
    VisitPrincipalMinors(M, [this](const PrincipalMinor& minor) {
      signs_[minor.subset] = static_cast<signed char>(minor.sign.value_or(kOpen));
      return true;
    });
  }

  Sign of(Subset subset) const { return signs_[subset] == kOpen ? Sign() : Sign(signs_[subset]); }

 private:
  static constexpr signed char kOpen = 2;
  std::vector<signed char> signs_;  // one byte each: 1 MB for n = 20
};

// Which signs the entries of the adjugate of M_SS have, and what they say of its inverse, with `determinant`
// the sign of det M_SS.
class AdjugateSigns {
 public:
  explicit AdjugateSigns(Sign determinant) : determinant_(determinant) {}

  void See(Sign cofactor) {
    if (!cofactor) {
      open_ = true;
    } else {
      (*cofactor > 0 ? positive_ : *cofactor < 0 ? negative_ : zero_) = true;
    }
  }

  // Some entry of the inverse is positive, or the adjugate of a singular matrix is not of one sign.
  bool Harmless() const {
    if (positive_ && negative_) return true;
    if (!determinant_) return false;
    if (*determinant_ == 0) return zero_;
    return *determinant_ > 0 ? positive_ : negative_;
  }

  bool Open() const { return open_ || !determinant_; }

 private:
  Sign determinant_;
  bool positive_ = false, negative_ = false, zero_ = false, open_ = false;
};

Matrix WithoutRowAndColumn(const Matrix& A, Index row, Index column) {
  std::vector<Index> rows, columns;
  for (Index i = 0; i < A.rows(); ++i) {
    if (i != row) rows.push_back(i);
    if (i != column) columns.push_back(i);
  }
  return A(rows, columns);
}

// The (column, row) entry of the adjugate.
PrincipalMinor Cofactor(const Matrix& A, Index row, Index column) {
  PrincipalMinor cofactor{.subset = 0, .order = 0, .value = 1, .sign = 1};
  if (A.rows() > 1) cofactor = Determinant(WithoutRowAndColumn(A, row, column));
  if ((row + column) % 2 != 0) {
    cofactor.value = -cofactor.value;
    if (cofactor.sign) cofactor.sign = -*cofactor.sign;
  }
  return cofactor;
}

// The result is exact for multiples of one power of two because fmod is exact.
double GreatestCommonDivisor(double a, double b) {
  while (b != 0) a = std::exchange(b, std::fmod(a, b));
  return a;
}

// Returns z > 0 with Az < 0 beyond rounding, or an empty vector.
Vector NegativeImage(const Matrix& A) {
  Vector z = A.partialPivLu().solve(-Vector::Ones(A.rows()));
  return z.allFinite() && z.minCoeff() > 0 && ImageIsPositive(-A, z) ? z : Vector();
}

// For a singular A whose adjugate has one sign: returns z > 0 with Az = 0 exactly, or an empty vector.
Vector PositiveKernel(const Matrix& A) {
  Vector z(A.rows());
  for (Index i = 0; i < A.rows(); ++i) {
    const std::optional<double> cofactor = A.rows() == 1 ? 1 : ExactDeterminant(WithoutRowAndColumn(A, 0, i));
    if (!cofactor) return {};
    z[i] = std::abs(*cofactor);
  }
  double divisor = 0;
  for (const double entry : z) divisor = GreatestCommonDivisor(entry, divisor);
  if (!(divisor > 0)) return {};
  z /= divisor;
  return (A * z).isZero(0) ? z : Vector();
}

class Sweep {
 public:
  explicit Sweep(const Matrix& M) : M_(M), n_(M.rows()) {
    for (Index i = 0; i < n_; ++i) {
      Subset in_row = 0, in_column = 0;
      for (Index j = 0; j < n_; ++j) {
        if (i == j) continue;
        in_row |= Subset{M(i, j) < 0} << j;
        in_column |= Subset{M(j, i) < 0} << j;
      }
      negative_in_row_.push_back(in_row);
      negative_in_column_.push_back(in_column);
    }
  }

  SemicopositiveClasses Run() {
    for (Subset S = 1; S < Subset{1} << n_ && !Refuted(); ++S) {
      LookForStop();
      if (std::popcount(S) <= kSmall && EveryRowHasNegativeEntry(S)) Look(S);
    }
    for (Subset S = 1; S < Subset{1} << n_ && !Refuted(); ++S) {
      LookForStop();
      if (std::popcount(S) > kSmall && EveryRowHasNegativeEntry(S) && SignsAllowViolation(S)) Look(S);
    }
    const std::string all = absl::StrCat("of all ", (Subset{1} << n_) - 1, " principal submatrices ");
    Conclude(strict_, all + "none has a negative inverse or a positive kernel vector");
    Conclude(weak_, all + "none has a nonpositive inverse");
    return {std::move(strict_), std::move(weak_)};
  }

 private:
  static constexpr int kSmall = 3;  // up to this size no table of signs is worth its cost

  bool Refuted() const { return strict_.no() && weak_.no(); }

  // (M_SS z)_i <= 0 for z > 0 and m_ii >= 0 needs another negative entry in row i, or none but zeros. The
  // classes are those of the transpose as well.
  bool EveryRowHasNegativeEntry(Subset S) const {
    if (std::has_single_bit(S)) return true;
    for (Subset rest = S; rest != 0; rest &= rest - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(rest));
      if ((negative_in_row_[i] & S) == 0 || (negative_in_column_[i] & S) == 0) return false;
    }
    return true;
  }

  // Whether the diagonal of the adjugate, which is made of principal minors, leaves a violation possible.
  bool SignsAllowViolation(Subset S) {
    if (!signs_) signs_.emplace(M_);
    AdjugateSigns adjugate(signs_->of(S));
    for (Subset rest = S; rest != 0 && !adjugate.Harmless(); rest &= rest - 1) {
      adjugate.See(signs_->of(S & ~(rest & -rest)));
    }
    return !adjugate.Harmless();
  }

  void Look(Subset S) {
    const std::vector<Index> indices = IndicesOf(S);
    const Matrix A = M_(indices, indices);
    const Sign determinant = signs_ ? signs_->of(S) : Determinant(A).sign;
    AdjugateSigns adjugate(determinant);
    for (Index i = 0; i < A.rows(); ++i) {
      for (Index j = 0; j < A.cols(); ++j) {
        adjugate.See(Cofactor(A, i, j).sign);
        if (adjugate.Harmless()) return;
      }
    }
    const bool singular = determinant == 0;
    Vector z = !singular ? NegativeImage(A) : adjugate.Open() ? Vector() : PositiveKernel(A);
    if (z.size() > 0) {
      Refute(strict_, indices, z, singular ? "has M z = 0" : "has M z < 0");
      if (!singular) Refute(weak_, indices, z, "has M z < 0");
    } else {
      if (open_strict_ == 0) open_strict_ = S;
      if (open_weak_ == 0 && !singular) open_weak_ = S;
    }
  }

  static void Refute(Fact& fact, const std::vector<Index>& indices, const Vector& z, const char* property) {
    if (fact.no()) return;
    fact.answer = Answer::kNo;
    fact.why = absl::StrCat("some z > 0 ", property, " in the rows and columns {", absl::StrJoin(indices, ", "), "}");
    fact.witness.indices = indices;
    fact.witness.z = z;
  }

  void Conclude(Fact& fact, const std::string& why) const {
    if (fact.no()) return;
    const Subset open = &fact == &strict_ ? open_strict_ : open_weak_;
    if (open == 0) {
      fact = {Answer::kYes, why};
    } else {
      fact.why =
          absl::StrCat("rounding could decide in the rows and columns {", absl::StrJoin(IndicesOf(open), ", "), "}");
    }
  }

  const Matrix& M_;
  const Index n_;
  std::vector<Subset> negative_in_row_, negative_in_column_;  // beside the diagonal
  std::optional<MinorSigns> signs_;                           // computed when first needed
  Fact strict_, weak_;
  Subset open_strict_ = 0, open_weak_ = 0;
};

}  // namespace

SemicopositiveClasses SweepSemicopositive(const Matrix& M) { return Sweep(M).Run(); }

}  // namespace dlcs
