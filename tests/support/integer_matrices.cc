// SPDX-License-Identifier: Apache-2.0
#include "tests/support/integer_matrices.h"

#include <bit>
#include <cmath>
#include <cstddef>

namespace dlcs::testing {
namespace {

// Entry (col, row) of the adjugate of the submatrix of rows and columns `members`.
Integer Cofactor(const IntegerMatrix& a, const std::vector<Index>& members, std::size_t row, std::size_t col) {
  std::vector<Index> rows = members, cols = members;
  rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(row));
  cols.erase(cols.begin() + static_cast<std::ptrdiff_t>(col));
  return ExactDeterminant(a, rows, cols) * ((row + col) % 2 == 0 ? 1 : -1);
}

// B Bᵀ of rank `rank` at most: positive semidefinite.
IntegerMatrix Gram(const IntegerMatrix& b, std::int64_t rank) {
  IntegerMatrix a = b;
  for (std::size_t i = 0; i < b.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      a[i][j] = 0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(rank); ++k) a[i][j] += b[i][k] * b[j][k];
    }
  }
  return a;
}

// Whether the basic solution z of -M_RC z = e for R, C = `rows`, `cols` has z >= 0 and M_SC z <= -e.
bool VertexViolates(const IntegerMatrix& a, const std::vector<Index>& S, const std::vector<Index>& rows,
                    const std::vector<Index>& cols) {
  const Integer det = ExactDeterminant(a, rows, cols);
  if (det == 0) return false;
  // With the ones of e beside M, Cramer's rule gives z_c = -numerator_c / det.
  IntegerMatrix with_ones = a;
  for (auto& row : with_ones) row.push_back(1);
  const auto ones = static_cast<Index>(a.size());
  std::vector<Integer> numerators;
  for (std::size_t c = 0; c < cols.size(); ++c) {
    std::vector<Index> replaced = cols;
    replaced[c] = ones;
    numerators.push_back(ExactDeterminant(with_ones, rows, replaced));
    if (Sign(numerators.back()) * Sign(det) > 0) return false;
  }
  for (const Index i : S) {
    Integer image = 0;  // times -det
    for (std::size_t c = 0; c < cols.size(); ++c) {
      image += a[static_cast<std::size_t>(i)][static_cast<std::size_t>(cols[c])] * numerators[c];
    }
    if (det > 0 ? image < det : image > det) return false;
  }
  return true;
}

}  // namespace

int Sign(Integer value) { return (value > 0) - (value < 0); }

Integer ExactDeterminant(const IntegerMatrix& a, const std::vector<Index>& rows, const std::vector<Index>& cols) {
  const unsigned all = (1u << cols.size()) - 1;
  std::vector<Integer> minor(all + 1, 0);
  minor[0] = 1;
  for (unsigned set = 1; set <= all; ++set) {
    const auto row = static_cast<std::size_t>(rows[static_cast<std::size_t>(std::popcount(set)) - 1]);
    for (std::size_t c = 0; c < cols.size(); ++c) {
      if (!(set >> c & 1u)) continue;
      const int behind = std::popcount(set >> (c + 1));
      const Integer term = minor[set & ~(1u << c)] * a[row][static_cast<std::size_t>(cols[c])];
      minor[set] += behind % 2 == 0 ? term : -term;
    }
  }
  return minor[all];
}

std::vector<Index> Members(unsigned set) {
  std::vector<Index> members;
  for (Index i = 0; i < 32; ++i) {
    if (set >> i & 1u) members.push_back(i);
  }
  return members;
}

MinorTruth ExactMinorClasses(const IntegerMatrix& a) {
  MinorTruth truth;
  for (unsigned set = 1; set < 1u << a.size(); ++set) {
    const std::vector<Index> members = Members(set);
    const int sign = Sign(ExactDeterminant(a, members, members));
    const int alternating = members.size() % 2 == 0 ? 1 : -1;
    truth.nondegenerate &= sign != 0;
    truth.p &= sign > 0;
    truth.p0 &= sign >= 0;
    truth.n &= sign < 0;
    truth.np &= sign == alternating;
    truth.pn &= sign == -alternating;
  }
  return truth;
}

bool ExactlyStrictlySemicopositive(const IntegerMatrix& a) {
  for (unsigned set = 1; set < 1u << a.size(); ++set) {
    const std::vector<Index> members = Members(set);
    const int det = Sign(ExactDeterminant(a, members, members));
    for (std::size_t row = 0; row < members.size(); ++row) {
      int positive = 0, negative = 0;
      for (std::size_t col = 0; col < members.size(); ++col) {
        const int cofactor = Sign(Cofactor(a, members, row, col));
        positive += cofactor > 0;
        negative += cofactor < 0;
      }
      const int size = static_cast<int>(members.size());
      // M z = det e_row for the column z of the adjugate.
      if ((positive == size && det <= 0) || (negative == size && det >= 0)) return false;
    }
  }
  return true;
}

bool ExactlySemicopositive(const IntegerMatrix& a) {
  const unsigned sets = 1u << a.size();
  for (unsigned S = 1; S < sets; ++S) {
    for (unsigned rows = 1; rows < sets; ++rows) {
      for (unsigned cols = 1; cols < sets; ++cols) {
        if ((rows & ~S) != 0 || (cols & ~S) != 0 || std::popcount(rows) != std::popcount(cols)) continue;
        if (VertexViolates(a, Members(S), Members(rows), Members(cols))) return false;
      }
    }
  }
  return true;
}

CopositiveTruth ExactlyCopositive(const IntegerMatrix& a) {
  const IntegerMatrix A = DoubledSymmetricPart(a);
  CopositiveTruth truth;
  for (unsigned set = 1; set < 1u << a.size(); ++set) {
    const std::vector<Index> members = Members(set);
    const std::size_t size = members.size();
    const int det = Sign(ExactDeterminant(A, members, members));
    std::size_t positive = 0, negative = 0;  // of adj A_SS e where A_SS is nonsingular, else of its first column
    for (std::size_t i = 0; i < size; ++i) {
      Integer entry = 0;
      for (std::size_t j = 0; j < (det == 0 ? 1 : size); ++j) entry += Cofactor(A, members, j, i);
      positive += entry > 0;
      negative += entry < 0;
    }
    if (positive != size && negative != size) continue;
    const int sign = positive == size ? 1 : -1;
    if (det == 0) truth.strictly_copositive = false;
    if (det * sign < 0) truth = {false, false};
  }
  return truth;
}

IntegerMatrix DoubledSymmetricPart(const IntegerMatrix& a) {
  IntegerMatrix sum = a;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < a.size(); ++j) sum[i][j] = a[i][j] + a[j][i];
  }
  return sum;
}

Matrix AsDoubles(const IntegerMatrix& a, int exponent) {
  const auto n = static_cast<Index>(a.size());
  return Matrix::NullaryExpr(n, n, [&](Index i, Index j) {
    return std::ldexp(static_cast<double>(a[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]), exponent);
  });
}

IntegerMatrix IntegerMatrixGenerator::Any(Index n) {
  const auto size = static_cast<std::size_t>(n);
  IntegerMatrix a(size, std::vector<std::int64_t>(size));
  const std::int64_t kind = Integer(0, 11);
  const std::int64_t spread = Integer(1, 9);
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t j = 0; j < size; ++j) a[i][j] = Entry(kind, i == j, n, spread);
  }
  if (kind == 7 || kind == 10) a = Gram(a, Integer(1, n));
  if (kind == 10) {  // copositive, seldom positive semidefinite
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < size; ++j) a[i][j] += i == j ? -Integer(0, 2) : Integer(0, 20);
    }
  }
  if (kind == 8 && n > 1) {
    for (std::size_t j = 0; j < size; ++j) a[size - 1][j] = a[0][j] + (n > 2 ? a[1][j] : 0);  // singular
  }
  if (kind == 9) {
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < i; ++j) a[i][j] = -a[j][i];  // skew but for the diagonal
    }
  }
  return a;
}

std::int64_t IntegerMatrixGenerator::Entry(std::int64_t kind, bool diagonal, Index n, std::int64_t spread) {
  switch (kind) {
    case 0:  // diagonally dominant: P
      return diagonal ? (n - 1) * spread + Integer(0, 2) : Integer(-spread, spread);
    case 1:  // its negative: NP
      return diagonal ? -(n - 1) * spread - Integer(0, 2) : Integer(-spread, spread);
    case 2:  // Z, an M-matrix or nearly so
      return diagonal ? (n - 1) * spread / 2 + Integer(0, 4) : Integer(-spread, 0);
    case 3:  // near I - 2J: N
      return diagonal ? -100 : -200 + Integer(-spread, spread);
    case 4:  // near 2J - I: PN
      return diagonal ? 100 : 200 + Integer(-spread, spread);
    case 5:  // nonnegative, positive diagonal: type I
      return diagonal ? Integer(1, spread) : Integer(0, spread);
    case 9:
      return diagonal ? Integer(0, 1) : Integer(-spread, spread);
    case 10:
      return Integer(-4, 4);
    case 11:  // strictly semicopositive or nearly so, seldom P
      return diagonal ? Integer(1, 4) : Integer(0, 3) == 0 ? -Integer(1, 3) : Integer(0, spread);
    default:
      return Integer(-spread, spread);
  }
}

}  // namespace dlcs::testing
