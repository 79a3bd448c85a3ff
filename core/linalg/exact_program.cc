// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/exact_program.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

constexpr int kMantissaBits = 53;

struct Odd {
  std::int64_t mantissa;  // odd, or zero
  int exponent;
};

Odd OddPartOf(double value) {
  if (value == 0) return {0, 0};
  int exponent = 0;
  const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(value, &exponent), kMantissaBits));
  const int zeros = std::countr_zero(static_cast<std::uint64_t>(mantissa));
  return {mantissa / (std::int64_t{1} << zeros), exponent - kMantissaBits + zeros};
}

// A tableau of integers over one denominator.
class Tableau {
 public:
  Tableau(const BigMatrix& A, const BigVector& b) : rows_(A.size()), columns_(A.empty() ? 0 : A.front().size()) {
    for (std::size_t i = 0; i < rows_; ++i) {
      flipped_.push_back(b[i] < 0);
      BigVector row(width(), 0);
      for (std::size_t j = 0; j < columns_; ++j) row[j] = flipped_[i] ? BigInteger(-A[i][j]) : A[i][j];
      row[columns_ + i] = 1;
      row[right()] = flipped_[i] ? BigInteger(-b[i]) : b[i];
      table_.push_back(std::move(row));
      basic_.push_back(columns_ + i);
    }
    // What the artificial variables add up to falls by this where a variable enters.
    BigVector cost(width(), 0);
    for (const BigVector& row : table_) {
      for (std::size_t j = 0; j < columns_; ++j) cost[j] -= row[j];
      cost[right()] -= row[right()];
    }
    table_.push_back(std::move(cost));
  }

  ExactFeasibility Run() {
    while (true) {
      LookForStop();
      const std::size_t entering = Entering();
      if (entering == columns_) break;
      Pivot(Leaving(entering), entering);
    }
    ExactFeasibility result;
    result.feasible = table_.back()[right()] == 0;
    if (result.feasible) {
      result.z.assign(columns_, 0);
      result.factor = denominator_;
      for (std::size_t i = 0; i < rows_; ++i) {
        if (basic_[i] < columns_) result.z[basic_[i]] = table_[i][right()];
      }
    } else {
      for (std::size_t i = 0; i < rows_; ++i) {
        const BigInteger multiplier = denominator_ - table_.back()[columns_ + i];
        result.v.push_back(flipped_[i] ? BigInteger(-multiplier) : multiplier);
      }
    }
    return result;
  }

 private:
  std::size_t width() const { return columns_ + rows_ + 1; }
  std::size_t right() const { return columns_ + rows_; }

  std::size_t Entering() const {
    std::size_t j = 0;
    while (j < columns_ && table_.back()[j] >= 0) ++j;
    return j;
  }

  // Never without one: the sum of the artificial variables is bounded below.
  std::size_t Leaving(std::size_t entering) const {
    std::size_t best = rows_;
    for (std::size_t i = 0; i < rows_; ++i) {
      if (table_[i][entering] <= 0) continue;
      if (best == rows_) {
        best = i;
        continue;
      }
      const BigInteger left = table_[i][right()] * table_[best][entering];
      const BigInteger right_side = table_[best][right()] * table_[i][entering];
      if (left < right_side || (left == right_side && basic_[i] < basic_[best])) best = i;
    }
    return best;
  }

  void Pivot(std::size_t pivot_row, std::size_t column) {
    const BigVector& pivots = table_[pivot_row];
    const BigInteger pivot = pivots[column];
    for (std::size_t i = 0; i <= rows_; ++i) {
      if (i == pivot_row) continue;
      const BigInteger factor = table_[i][column];
      for (std::size_t j = 0; j < width(); ++j) {
        BigInteger& entry = table_[i][j];
        if (factor == 0 && entry == 0) continue;
        entry *= pivot;
        if (factor != 0) entry -= factor * pivots[j];
        entry /= denominator_;  // without a rest
      }
    }
    denominator_ = pivot;
    basic_[pivot_row] = column;
  }

  std::size_t rows_, columns_;
  BigMatrix table_;  // the last row is the cost
  std::vector<std::size_t> basic_;
  std::vector<bool> flipped_;
  BigInteger denominator_ = 1;
};

}  // namespace

std::optional<IntegerForm> AsIntegers(const Matrix& M) {
  constexpr int kMaxBits = 128;
  const auto rows = static_cast<std::size_t>(M.rows());
  IntegerForm form{BigMatrix(rows, BigVector(static_cast<std::size_t>(M.cols()), 0)), Vector::Ones(M.rows()),
                   Vector::Ones(M.cols())};
  std::vector<int> of_row(rows, 0);
  for (Index i = 0; i < M.rows(); ++i) {
    bool first = true;
    for (Index j = 0; j < M.cols(); ++j) {
      if (M(i, j) == 0) continue;
      const int exponent = OddPartOf(M(i, j)).exponent;
      of_row[i] = first ? exponent : std::min(of_row[i], exponent);
      first = false;
    }
    form.row[i] = std::ldexp(1.0, -of_row[i]);
  }
  for (Index j = 0; j < M.cols(); ++j) {
    int of_column = 0;
    bool first = true;
    for (Index i = 0; i < M.rows(); ++i) {
      if (M(i, j) == 0) continue;
      const int exponent = OddPartOf(M(i, j)).exponent - of_row[i];
      of_column = first ? exponent : std::min(of_column, exponent);
      first = false;
    }
    for (Index i = 0; i < M.rows(); ++i) {
      const Odd odd = OddPartOf(M(i, j));
      if (odd.mantissa == 0) continue;
      const int shift = odd.exponent - of_row[i] - of_column;
      if (shift > kMaxBits - kMantissaBits) return std::nullopt;
      form.entries[i][j] = BigInteger(odd.mantissa) << shift;
    }
    form.column[j] = std::ldexp(1.0, -of_column);
  }
  return form;
}

ExactFeasibility SolveExactly(const BigMatrix& A, const BigVector& b) { return Tableau(A, b).Run(); }

// Either some x has h x > 0 for all rows, or some λ >= 0, λ != 0, has Hᵀλ = 0 (Gordan).
std::optional<BigVector> FindInside(const BigMatrix& rows, std::size_t columns) {
  BigMatrix A(columns + 1, BigVector(rows.size(), 1));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    for (std::size_t j = 0; j < columns; ++j) A[j][k] = rows[k][j];
  }
  BigVector b(columns + 1, 0);
  b.back() = 1;
  if (rows.empty()) return BigVector(columns, 1);
  const ExactFeasibility found = SolveExactly(A, b);
  if (found.feasible) return std::nullopt;
  BigVector x(found.v.begin(), found.v.end() - 1);
  for (BigInteger& entry : x) entry = -entry;
  return x;
}

Vector AsDoubles(const BigVector& integers) {
  BigInteger divisor = 0;
  for (const BigInteger& entry : integers) divisor = gcd(divisor, entry);
  Vector result(static_cast<Index>(integers.size()));
  for (std::size_t i = 0; i < integers.size(); ++i)
    result[static_cast<Index>(i)] = divisor == 0 ? 0 : static_cast<double>(BigInteger(integers[i] / divisor));
  return result;
}

}  // namespace dlcs
