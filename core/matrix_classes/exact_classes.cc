// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/exact_classes.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/linalg/exact_program.h"

namespace dlcs {
namespace {

Fact Beyond(Index n, Index most) {
  return {Answer::kUnknown,
          n > most ? absl::StrCat("n = ", n, " is beyond the exact test (n <= ", most, ") and no other test decides")
                   : "the entries are too far apart in size for the exact test, and no other decides"};
}

Fact With(Answer answer, std::string why, Vector z) {
  Fact fact{answer, std::move(why)};
  fact.witness.z = std::move(z);
  return fact;
}

std::optional<IntegerForm> Integers(const Matrix& M, Index most) {
  return M.rows() <= most ? AsIntegers(M) : std::nullopt;
}

BigInteger DeterminantOf(const BigMatrix& A) {
  if (A.empty()) return 1;
  BigInteger sum = 0;
  for (std::size_t k = 0; k < A.size(); ++k) {
    if (A[0][k] == 0) continue;
    BigMatrix minor;
    for (std::size_t i = 1; i < A.size(); ++i) {
      BigVector row = A[i];
      row.erase(row.begin() + static_cast<std::ptrdiff_t>(k));
      minor.push_back(std::move(row));
    }
    const BigInteger term = A[0][k] * DeterminantOf(minor);
    if (k % 2 == 0) {
      sum += term;
    } else {
      sum -= term;
    }
  }
  return sum;
}

BigMatrix Without(const BigMatrix& A, std::size_t row, std::size_t column) {
  BigMatrix rest = A;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(row));
  for (BigVector& entries : rest) entries.erase(entries.begin() + static_cast<std::ptrdiff_t>(column));
  return rest;
}

BigInteger Product(const BigVector& a, const BigVector& b) {
  BigInteger sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

BigVector Negative(BigVector v) {
  for (BigInteger& entry : v) entry = -entry;
  return v;
}

bool IsZero(const BigVector& v) {
  for (const BigInteger& entry : v) {
    if (entry != 0) return false;
  }
  return true;
}

BigVector TruncateUtf8(BigVector v) {
  BigInteger divisor = 0;
  for (const BigInteger& entry : v) divisor = gcd(divisor, entry);
  if (divisor > 1) {
    for (BigInteger& entry : v) entry /= divisor;
  }
  return v;
}

// Looks for q that no full complementary cone of M holds, all of them or the feasible ones. If there are such q, some
// are next to a facet of a full cone, whose neighbor beyond the facet is not there: it is flat, or lies on the same
// side. So a generic point of each such facet, moved beyond it by next to nothing, must be in another cone.
class HoleSearch {
 public:
  HoleSearch(const BigMatrix& M, bool feasible_only) : M_(M), n_(M.size()), feasible_only_(feasible_only) {
    for (unsigned S = 0; S < 1u << n_; ++S) AddCone(S);
  }

  // Whether there is none; hole() is one.
  bool Run() {
    for (unsigned S = 0; S < 1u << n_; ++S) {
      for (std::size_t i = 0; i < n_; ++i) {
        if ((S >> i & 1u) == 0 && !IsCoveredBeyond(S, i)) return false;
      }
    }
    return true;
  }
  bool gave_up() const { return programs_ > kMaxPrograms; }
  const BigVector& hole() const { return hole_; }

 private:
  static constexpr int kMaxPrograms = 5000;

  BigVector Generator(unsigned S, std::size_t j) const {
    BigVector column(n_, 0);
    if ((S >> j & 1u) == 0) {
      column[j] = 1;
    } else {
      for (std::size_t i = 0; i < n_; ++i) column[i] = -M_[i][j];
    }
    return column;
  }

  // { q : H q >= 0 }, H the inverse of the generators up to a positive factor.
  void AddCone(unsigned S) {
    BigMatrix C;  // the generators as rows
    for (std::size_t j = 0; j < n_; ++j) C.push_back(Generator(S, j));
    const BigInteger determinant = DeterminantOf(C);
    if (determinant == 0) return;
    BigMatrix H;
    for (std::size_t j = 0; j < n_; ++j) H.push_back(TruncateUtf8(Cofactors(C, j, determinant > 0)));
    cones_.push_back(std::move(H));
  }

  // At right angles to all rows but row j, with the sign of that of row j times the determinant.
  static BigVector Cofactors(const BigMatrix& C, std::size_t j, bool keep_sign) {
    BigVector result(C.size());
    for (std::size_t k = 0; k < C.size(); ++k) {
      result[k] = DeterminantOf(Without(C, j, k));
      if (((j + k) % 2 == 0) != keep_sign) result[k] = -result[k];
    }
    return result;
  }

  bool IsCoveredBeyond(unsigned S, std::size_t i) {
    BigMatrix generators;
    for (std::size_t j = 0; j < n_; ++j) generators.push_back(Generator(S, j));
    BigVector beyond = TruncateUtf8(Cofactors(generators, i, true));
    const BigInteger one = Product(beyond, generators[i]), other = Product(beyond, Generator(S | 1u << i, i));
    if (one * other < 0 || (one == 0 && other == 0)) return true;
    if (one > 0 || other > 0) beyond = Negative(std::move(beyond));
    generators.erase(generators.begin() + static_cast<std::ptrdiff_t>(i));
    facet_ = std::move(generators);
    beyond_ = std::move(beyond);
    seen_.clear();
    for (const BigMatrix& H : cones_) {
      BigMatrix rows;
      bool serves = true;
      for (const BigVector& h : H) {
        BigVector row = OnFacet(h);
        if (!IsZero(row)) {
          rows.push_back(std::move(row));
        } else if (Product(h, beyond_) <= 0) {
          serves = false;
        }
      }
      if (serves) seen_.push_back(std::move(rows));
    }
    region_.clear();
    for (std::size_t k = 0; k + 1 < n_; ++k) {
      region_.emplace_back(n_ - 1, 0);
      region_.back()[k] = 1;
    }
    return IsCovered();
  }

  // h p for p = Σ λ_k (generator k of the facet), as a function of λ.
  BigVector OnFacet(const BigVector& h) const {
    BigVector row;
    for (const BigVector& generator : facet_) row.push_back(Product(h, generator));
    return TruncateUtf8(std::move(row));
  }

  // Of region_ = { λ : h λ > 0 for all h }.
  bool IsCovered() {
    if (++programs_ > kMaxPrograms) return false;
    const std::optional<BigVector> inside = FindInside(region_, n_ - 1);
    if (!inside) return true;
    const BigVector lambda = TruncateUtf8(*inside);
    const std::size_t size = region_.size();
    bool covered = true;
    if (const BigMatrix* const cone = ConeOf(lambda)) {
      for (const BigVector& h : *cone) {
        region_.push_back(Negative(h));
        covered = IsCovered();
        region_.pop_back();
        if (!covered) break;
        region_.push_back(h);
      }
    } else if (const auto u = feasible_only_ ? Excluder(PointAt(lambda)) : std::nullopt) {
      const BigVector h = OnFacet(*u);
      if (!IsZero(h)) {
        region_.push_back(h);
        covered = IsCovered();
      }
    } else {
      covered = false;
      MakeHole(lambda);
    }
    region_.resize(size);
    return covered;
  }

  const BigMatrix* ConeOf(const BigVector& lambda) const {
    for (const BigMatrix& rows : seen_) {
      bool inside = true;
      for (std::size_t k = 0; k < rows.size() && inside; ++k) inside = Product(rows[k], lambda) >= 0;
      if (inside) return &rows;
    }
    return nullptr;
  }

  BigVector PointAt(const BigVector& lambda) const {
    BigVector point(n_, 0);
    for (std::size_t k = 0; k < lambda.size(); ++k) {
      for (std::size_t i = 0; i < n_; ++i) point[i] += lambda[k] * facet_[k][i];
    }
    return point;
  }

  // u >= 0 with Mᵀu <= 0 and uᵀq <= 0, u != 0: q is not inside the set of feasible ones. Absent where it is.
  std::optional<BigVector> Excluder(const BigVector& q) const {
    BigMatrix A(n_, BigVector(2 * n_ + 1, 0));
    for (std::size_t i = 0; i < n_; ++i) {
      A[i][0] = q[i];
      for (std::size_t j = 0; j < n_; ++j) A[i][1 + j] = M_[i][j];
      A[i][1 + n_ + i] = -1;
    }
    ExactFeasibility found = SolveExactly(A, BigVector(n_, 1));
    if (found.feasible) return std::nullopt;
    return std::move(found.v);
  }

  // So close to the facet that no cone contains it and, if required, that it is feasible.
  void MakeHole(const BigVector& lambda) {
    constexpr int kNearest = 400;
    for (int k = 0; k <= kNearest; ++k) {
      hole_ = PointAt(lambda);
      for (std::size_t i = 0; i < n_; ++i) hole_[i] = (hole_[i] << k) + beyond_[i];
      bool held = false;
      for (const BigMatrix& H : cones_) {
        bool inside = true;
        for (const BigVector& h : H) inside = inside && Product(h, hole_) >= 0;
        held = held || inside;
      }
      if (!held && !(feasible_only_ && Excluder(hole_))) return;
    }
  }

  const BigMatrix& M_;
  const std::size_t n_;
  const bool feasible_only_;
  std::vector<BigMatrix> cones_;
  BigMatrix facet_;              // generators of the facet looked at
  BigVector beyond_;             // its normal
  std::vector<BigMatrix> seen_;  // the cones as they meet it
  BigMatrix region_;
  BigVector hole_;
  int programs_ = 0;
};

Fact Covers(const Matrix& M, bool feasible_only) {
  const auto form = Integers(M, kMaxExactQ);
  if (!form) return Beyond(M.rows(), kMaxExactQ);
  HoleSearch search(form->entries, feasible_only);
  if (search.Run()) {
    return {Answer::kYes, feasible_only ? "the complementary cones cover all feasible q"
                                        : "the complementary cones cover the whole space"};
  }
  if (search.gave_up()) return {Answer::kUnknown, "the complementary cones divide the space into too many pieces"};
  // LCP(q, R M C) is LCP(R⁻¹ q, M) in other units.
  Vector q = AsDoubles(search.hole()).cwiseQuotient(form->row);
  return With(
      Answer::kNo,
      feasible_only ? "some q is feasible, and no complementary cone holds it" : "no complementary cone holds some q",
      std::move(q));
}

// X of the choice `alpha` (core/matrix_classes/hidden_z_choices.h), by the alternative: w >= 0, Σw = 1, and multipliers
// a, b >= 0 with Gᵀw = Σ_{i != j} (a_ij e_i + b_ij M_i) for every j.
std::optional<BigMatrix> ExactXForChoice(const BigMatrix& M, unsigned alpha) {
  const std::size_t n = M.size();
  const auto G = [&](std::size_t l, std::size_t k) -> BigInteger {
    if ((alpha >> l & 1u) != 0) return M[l][k];
    return l == k ? 1 : 0;
  };
  const std::size_t of_b = n, of_a = n + n * n;
  BigMatrix A(n * n + 1, BigVector(n + 2 * n * n, 0));
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t k = 0; k < n; ++k) {
      BigVector& row = A[j * n + k];
      for (std::size_t l = 0; l < n; ++l) row[l] = G(l, k);
      for (std::size_t i = 0; i < n; ++i) {
        if (i != j) row[of_b + j * n + i] = -M[i][k];
      }
      if (k != j) row[of_a + j * n + k] = -1;
    }
  }
  for (std::size_t l = 0; l < n; ++l) A[n * n][l] = 1;
  BigVector b(n * n + 1, 0);
  b.back() = 1;
  const ExactFeasibility found = SolveExactly(A, b);
  if (found.feasible) return std::nullopt;
  BigMatrix X(n, BigVector(n, 0));
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t k = 0; k < n; ++k) X[k][j] = -found.v[j * n + k];
  }
  return X;
}

}  // namespace

Fact ExactlyS(const Matrix& M) {
  const auto form = Integers(M, kMaxExactS);
  if (!form) return Beyond(M.rows(), kMaxExactS);
  const std::size_t n = form->entries.size();
  BigMatrix A = form->entries;
  for (std::size_t i = 0; i < n; ++i) {
    A[i].resize(2 * n, 0);
    A[i][n + i] = -1;
  }
  const ExactFeasibility found = SolveExactly(A, BigVector(n, 1));
  if (found.feasible) {
    Vector z = AsDoubles(BigVector(found.z.begin(), found.z.begin() + static_cast<std::ptrdiff_t>(n)));
    return With(Answer::kYes, "some z >= 0 has Mz > 0", z.cwiseProduct(form->column));
  }
  return With(Answer::kNo, "some z >= 0, z != 0, has Mᵀz <= 0", AsDoubles(found.v).cwiseProduct(form->row));
}

Fact ExactlyR0(const Matrix& M) {
  const auto form = Integers(M, kMaxExactR0);
  if (!form) return Beyond(M.rows(), kMaxExactR0);
  const std::size_t n = form->entries.size();
  for (unsigned S = 1; S < 1u << n; ++S) {
    BigMatrix A(n + 1, BigVector(2 * n, 0));
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        if ((S >> j & 1u) != 0) A[i][j] = form->entries[i][j];
      }
      if ((S >> i & 1u) == 0) A[i][n + i] = -1;
      if ((S >> i & 1u) != 0) A[n][i] = 1;
    }
    BigVector b(n + 1, 0);
    b.back() = 1;
    ExactFeasibility found = SolveExactly(A, b);
    if (!found.feasible) continue;
    found.z.resize(n);
    return With(Answer::kNo, "some z >= 0, z != 0, solves LCP(0, M)", AsDoubles(found.z).cwiseProduct(form->column));
  }
  return {Answer::kYes, "no choice of active constraints has a solution of LCP(0, M) but 0"};
}

Fact ExactlyQ(const Matrix& M) { return Covers(M, false); }

Fact ExactlyQ0(const Matrix& M) { return Covers(M, true); }

Fact ExactlyHiddenZ(const Matrix& M) {
  const auto form = Integers(M, kMaxExactHiddenZ);
  if (!form) return Beyond(M.rows(), kMaxExactHiddenZ);
  const Index n = M.rows();
  for (unsigned alpha = 0; alpha < 1u << n; ++alpha) {
    const std::optional<BigMatrix> X = ExactXForChoice(form->entries, alpha);
    if (!X) continue;
    BigVector all;
    for (const BigVector& row : *X) all.insert(all.end(), row.begin(), row.end());
    const Vector entries = AsDoubles(all);
    Fact fact{Answer::kYes, "X and Y of (4.10) were found in exact arithmetic"};
    fact.witness.X = form->column.asDiagonal() * Matrix(entries.reshaped<Eigen::RowMajor>(n, n));
    return fact;
  }
  return {Answer::kNo, "no choice of r_j = 0 or s_j = 0, j = 1, ..., n, allows an X, in exact arithmetic"};
}

}  // namespace dlcs
