// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/band_factor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/matrix_classes/m_matrix.h"

namespace dlcs {
namespace {

constexpr Index kSize = EightBlock::kSize;

struct BlockRows {
  Index num_rows, reach;
  const std::uint8_t* is_used;
  EightBlock* factors;  // of the first row, on the diagonal

  EightBlock* At(Index row) const { return factors + row * (2 * reach + 1); }
  Index First(Index row) const { return std::max<Index>(0, row - reach); }
  Index Last(Index row) const { return std::min(num_rows - 1, row + reach); }
};

// Loads the entries of `row`: those of M_SS in S, those of the identity outside S.
template <typename V>
DLCS_INLINE void LoadRow(const BlockRows& rows, const EightBlock* of_M, const double* is_basic, Index row) {
  constexpr Index kWidth = sizeof(V) / sizeof(double);
  const double* const of_row = is_basic + row * kSize;
  for (Index to = rows.First(row); to <= rows.Last(row); ++to) {
    if (!rows.is_used[to]) continue;
    const EightBlock& from = of_M[to - row];
    EightBlock& block = rows.At(row)[to - row];
    for (Index j = 0; j < kSize; ++j) {
      const double of_column = is_basic[to * kSize + j];
      for (Index part = 0; part < kSize; part += kWidth) {
        const V kept = Load<V>(of_row + part) * of_column;
        Store(V(Load<V>(from.column(j) + part) * kept), block.column(j) + part);
      }
      if (to == row) block.column(j)[j] += 1 - of_column;
    }
  }
}

template <typename V>
DLCS_INLINE void EliminateRow(const BlockRows& rows, Index row, double* pivots) {
  EightBlock* const here = rows.At(row);
  EightBlock quotient;
  for (Index above = rows.First(row); above < row; ++above) {
    if (!rows.is_used[above]) continue;
    const EightBlock* const pivot = rows.At(above);
    eight_blocks::Multiply<V, false>(here[above - row], *pivot, quotient);
    for (Index to = above + 1; to <= rows.Last(above); ++to) {
      if (rows.is_used[to]) eight_blocks::Multiply<V, true>(quotient, pivot[to - above], here[to - row]);
    }
  }
  eight_blocks::Invert<V>(*here, pivots + row * kSize);
}

template <typename V>
DLCS_INLINE void FactorOneRow(const BlockRows& rows, const EightBlock* of_M, const double* is_basic, Index row,
                              double* pivots) {
  LoadRow<V>(rows, of_M, is_basic, row);
  EliminateRow<V>(rows, row, pivots);
}

using FactorsOneRow = void(const BlockRows&, const EightBlock*, const double*, Index, double*);
void FactorBaseline(const BlockRows& rows, const EightBlock* of_M, const double* is_basic, Index row, double* pivots) {
  FactorOneRow<Double2>(rows, of_M, is_basic, row, pivots);
}
DLCS_TARGET("avx2")
void FactorAvx2(const BlockRows& rows, const EightBlock* of_M, const double* is_basic, Index row, double* pivots) {
  FactorOneRow<Double4>(rows, of_M, is_basic, row, pivots);
}
DLCS_TARGET("avx512f")
void FactorAvx512(const BlockRows& rows, const EightBlock* of_M, const double* is_basic, Index row, double* pivots) {
  FactorOneRow<Double8>(rows, of_M, is_basic, row, pivots);
}

// sum := Σ blocks (row, to) x_to over first <= to <= last, those that are used.
template <typename V>
DLCS_INLINE void SumOfRow(const BlockRows& rows, Index row, Index first, Index last, const double* x, double* sum) {
  constexpr Index kWidth = sizeof(V) / sizeof(double);
  for (Index part = 0; part < kSize; part += kWidth) {
    V sums[4] = {};
    for (Index to = first; to <= last; ++to) {
      if (rows.is_used[to]) eight_blocks::AddTimes<V>(rows.At(row)[to - row], x + to * kSize, part, sums);
    }
    Store(eight_blocks::Total<V>(sums), sum + part);
  }
}

// z := D⁻¹ (x - L z), x := z - D⁻¹ U x.
template <typename V>
DLCS_INLINE void SolveRows(const BlockRows& rows, double* x) {
  alignas(64) double sum[kSize], right[kSize];
  for (Index row = 0; row < rows.num_rows; ++row) {
    if (!rows.is_used[row]) continue;
    double* const here = x + row * kSize;
    SumOfRow<V>(rows, row, rows.First(row), row - 1, x, sum);
    for (Index i = 0; i < kSize; ++i) here[i] -= sum[i];
    SumOfRow<V>(rows, row, row, row, x, right);
    for (Index i = 0; i < kSize; ++i) here[i] = right[i];
  }
  for (Index row = rows.num_rows - 2; row >= 0; --row) {
    if (!rows.is_used[row]) continue;
    double* const here = x + row * kSize;
    SumOfRow<V>(rows, row, row + 1, rows.Last(row), x, sum);
    std::copy_n(here, kSize, right);
    std::copy_n(sum, kSize, here);
    SumOfRow<V>(rows, row, row, row, x, sum);
    for (Index i = 0; i < kSize; ++i) here[i] = right[i] - sum[i];
  }
}

void SolveBaseline(const BlockRows& rows, double* x) { SolveRows<Double2>(rows, x); }
DLCS_TARGET("avx2") void SolveAvx2(const BlockRows& rows, double* x) { SolveRows<Double4>(rows, x); }
DLCS_TARGET("avx512f") void SolveAvx512(const BlockRows& rows, double* x) { SolveRows<Double8>(rows, x); }

}  // namespace

BandFactor::BandFactor(std::shared_ptr<const BandMatrix> M)
    : M_(std::move(M)),
      num_rows_((M_->size() + kSize - 1) / kSize),
      reach_((M_->bandwidth() + kSize - 1) / kSize),
      of_M_(static_cast<std::size_t>(num_rows_ * (2 * reach_ + 1))),
      factors_(of_M_.size()),
      former_(static_cast<std::size_t>(reach_ + 1)),
      basis_(static_cast<std::size_t>(M_->size()), 0),
      is_used_(static_cast<std::size_t>(num_rows_), 0),
      is_basic_(Vector::Zero(num_rows_ * kSize)),
      pivots_(Vector::Ones(num_rows_ * kSize)),
      x_(Vector::Zero(num_rows_ * kSize)) {
  const Index n = M_->size(), b = M_->bandwidth();
  for (Index i = 0; i < n; ++i) {
    EightBlock* const row = Row(of_M_, i / kSize);
    for (Index j = std::max<Index>(0, i - b); j <= std::min(n - 1, i + b); ++j) {
      row[j / kSize - i / kSize].column(j % kSize)[i % kSize] = M_->Row(i)[j - i];
    }
  }
}

void BandFactor::Factor(const Basis& basis) {
  if (!is_empty_ && basis == basis_) return;
  const Index n = M_->size();
  const auto next_change = [&](Index from) {
    if (is_empty_) return from;
    return std::mismatch(basis.begin() + from, basis.end(), basis_.begin() + from).first - basis.begin();
  };
  for (Index row = 0; row < num_rows_; ++row) {
    const Index begin = row * kSize, end = std::min(n, begin + kSize);
    for (Index i = begin; i < end; ++i) is_basic_[i] = basis[static_cast<std::size_t>(i)] ? 1 : 0;
    is_used_[static_cast<std::size_t>(row)] = is_basic_.segment(begin, end - begin).maxCoeff() > 0;
  }
  Index row = 0;
  for (Index change = next_change(0); change < n; change = next_change(row * kSize)) {
    row = std::max(row, change / kSize - reach_);  // the first that has a block in its columns
    for (Index agreeing = 0; row < num_rows_ && agreeing < reach_; ++row) {
      agreeing = FactorRow(basis, row) ? agreeing + 1 : 0;
    }
    if (row == num_rows_) break;
  }
  is_empty_ = false;
  basis_ = basis;
}

bool BandFactor::FactorRow(const Basis& basis, Index row) {
  static const auto factor = ChooseVersion<FactorsOneRow>(FactorBaseline, FactorAvx2, FactorAvx512);
  const auto begin = basis.begin() + row * kSize, end = basis.begin() + std::min(M_->size(), (row + 1) * kSize);
  const bool has_same_basis = !is_empty_ && std::equal(begin, end, basis_.begin() + row * kSize);
  if (!is_used_[static_cast<std::size_t>(row)]) return has_same_basis;
  EightBlock* const kept = Row(factors_, row);
  if (has_same_basis) std::copy_n(kept, former_.size(), former_.data());
  factor({num_rows_, reach_, is_used_.data(), Row(factors_, 0)}, Row(of_M_, row), is_basic_.data(), row,
         pivots_.data());
  return has_same_basis && std::memcmp(kept, former_.data(), former_.size() * sizeof(EightBlock)) == 0;
}

void BandFactor::Solve(Vector& x) {
  static const auto solve = ChooseVersion(SolveBaseline, SolveAvx2, SolveAvx512);
  x_.head(x.size()) = x;
  solve({num_rows_, reach_, is_used_.data(), Row(factors_, 0)}, x_.data());
  x = x_.head(x.size());
}

bool BandFactor::IsClearlyMMatrix(const BandMatrix& M) {
  const Index n = M.size(), b = M.bandwidth();
  for (Index i = 0; i < n; ++i) {
    const double* const row = M.Row(i);
    for (Index d = -b; d <= b; ++d) {
      if (d != 0 && !(row[d] <= 0)) return false;
    }
  }
  BandFactor factor(std::make_shared<const BandMatrix>(M));
  factor.Factor(Basis(static_cast<std::size_t>(n), 1));
  for (Index i = 0; i < n; ++i) {
    const double pivot = factor.pivots_[i];
    if (!(pivot > kClearPivot * M.Row(i)[0]) || !std::isfinite(pivot)) return false;
  }
  return true;
}

}  // namespace dlcs
