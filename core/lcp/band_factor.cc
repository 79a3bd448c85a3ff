// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/band_factor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/linalg/simd.h"

// Functions that take or return vectors are inlined, so no caller sees the convention that the warning is about.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace dlcs {
namespace {

constexpr Index kAlign = 8;

}  // namespace

BandFactor::BandFactor(std::shared_ptr<const BandMatrix> M)
    : M_(std::move(M)),
      basis_(static_cast<std::size_t>(M_->size()), 0),
      b_((std::max<Index>(1, M_->bandwidth()) + kAlign - 1) / kAlign * kAlign),
      rows_(static_cast<std::size_t>(M_->size() * (2 * b_ + 1) + kAlign)),
      scratch_(static_cast<std::size_t>(b_ + kAlign)),
      inverse_(static_cast<std::size_t>(M_->size())),
      padded_(static_cast<std::size_t>(M_->size() + 2 * b_)),
      former_(static_cast<std::size_t>(b_ * b_)) {}

void BandFactor::Factor(const Basis& basis) {
  constexpr Index kRows = 32;  // at once: a change dies away within one to three such blocks
  const Index n = M_->size(), rows_at_once = std::max(kRows, b_);
  const auto next_change = [&](Index from) {
    return is_empty_ ? from : std::mismatch(basis.begin() + from, basis.end(), basis_.begin() + from).first - basis.begin();
  };
  Index end = 0;
  for (Index change = next_change(0); change < n; change = next_change(end)) {
    bool agrees = false;
    for (Index first = std::max(end, change - b_); first < n && !agrees; first = end) {
      end = std::min(n, first + rows_at_once);
      KeepBefore(first, end);
      Load(basis, first, end);
      Eliminate(basis, first, end);
      agrees = !is_empty_ && AgreesBefore(basis, first, end);
    }
  }
  is_empty_ = false;
  basis_ = basis;
}

void BandFactor::KeepBefore(Index first, Index end) {
  double* former = former_.data();
  for (Index i = std::max(first, end - b_); i < end; ++i, former += b_) std::copy_n(Upper(i), b_, former);
}

bool BandFactor::AgreesBefore(const Basis& basis, Index first, Index end) const {
  if (end - first < b_) return false;
  const double* former = former_.data();
  for (Index i = end - b_; i < end; ++i, former += b_) {
    const auto at = static_cast<std::size_t>(i);
    if (basis[at] != basis_[at]) return false;
    if (basis[at] && std::memcmp(Upper(i), former, static_cast<std::size_t>(b_) * sizeof(double)) != 0) return false;
  }
  return true;
}

void BandFactor::Load(const Basis& of_rows, Index first, Index end) {
  RunWide([=, n = M_->size(), width = M_->bandwidth(), all_entries = M_->Row(0), all_rows = rows_.data() + b_,
           stride = 2 * b_ + 1, basis = of_rows.data()]() DLCS_WIDE {
    for (Index i = first; i < end; ++i) {
      if (!basis[i]) continue;
      const Index from = std::max(-width, -i), count = std::min(width, n - 1 - i) - from + 1;
      const double* __restrict entries = all_entries + i * (2 * width + 1) + from;
      const std::uint8_t* __restrict basic = basis + i + from;
      double* __restrict row = all_rows + i * stride + from;
      for (Index d = 0; d < count; ++d) row[d] = basic[d] ? entries[d] : 0;
    }
  });
}

namespace {

// A row stands so that its entry of column c is a multiple of eight numbers, and c, from the start of all. So the
// vectors of a row are the same for eight pivots, from columns that are multiples of eight on. Beside the b entries
// behind the pivot `upper`, the row of U, is zero, and what stands there in rows before or behind stays what it is.
struct BandRows {
  Index first, end, band;
  const std::uint8_t* basis;
  double *rows, *inverses, *upper;
};

// The rows from `first` up to `end`; kBand is the band where that is known, and otherwise 0.
template <typename V, Index kBand>
DLCS_INLINE void EliminateRows(const BandRows& all) {
  constexpr Index kWidth = sizeof(V) / sizeof(double);
  const auto [first, end, band, basis, rows, inverses, upper] = all;
  const Index b = kBand > 0 ? kBand : band;
  for (Index k = std::max<Index>(0, first - b); k < end; ++k) {
    if (!basis[k]) continue;
    const Index begin = (k + 1) / kAlign * kAlign, before = k + 1 - begin;
    double* const diagonal = rows + k * (2 * b + 1) + b;
    if (k >= first) {
      const double inverse = 1 / *diagonal;
      inverses[k] = inverse;
      for (Index d = 1; d <= b; ++d) diagonal[d] *= inverse;
    }
    for (Index d = 0; d < before; ++d) upper[d] = 0;
    for (Index d = 0; d < b; ++d) upper[before + d] = diagonal[d + 1];
    for (Index d = before + b; d < b + kAlign; ++d) upper[d] = 0;
    const Index last = std::min(k + b, end - 1);
    for (Index i = std::max(k + 1, first); i <= last; ++i) {
      if (!basis[i]) continue;
      const double factor = rows[i * 2 * b + b + k];
      double* const row = rows + i * 2 * b + b + begin;
      for (Index d = 0; d < b + kAlign; d += kWidth) {
        V left, right;
        std::memcpy(&left, upper + d, sizeof(V));
        std::memcpy(&right, row + d, sizeof(V));
        right -= factor * left;
        std::memcpy(row + d, &right, sizeof(V));
      }
    }
  }
}

template <typename V>
DLCS_INLINE void EliminateBand(const BandRows& all) {
  switch (all.band) {
    case 8:
      return EliminateRows<V, 8>(all);
    case 16:
      return EliminateRows<V, 16>(all);
    case 24:
      return EliminateRows<V, 24>(all);
    default:
      return EliminateRows<V, 0>(all);
  }
}

void EliminateBaseline(const BandRows& all) { EliminateBand<Double2>(all); }
DLCS_TARGET("avx2") void EliminateAvx2(const BandRows& all) { EliminateBand<Double4>(all); }
DLCS_TARGET("avx512f") void EliminateAvx512(const BandRows& all) { EliminateBand<Double8>(all); }

}  // namespace

void BandFactor::Eliminate(const Basis& basis, Index first, Index end) {
  static const auto eliminate = ChooseVersion(EliminateBaseline, EliminateAvx2, EliminateAvx512);
  eliminate({first, end, b_, basis.data(), rows_.data(), inverse_.data(), scratch_.data()});
}

namespace {

// Σ coefficient[d] z[d] for 3 <= d <= b, b even, with strides of 1 or -1: in two sums, which do not wait for each
// other.
template <int stride>
double SumOfFar(const double* coefficient, const double* z, Index b) {
  double even = 0, odd = 0;
  for (Index d = b; d > 2; d -= 2) {
    even += coefficient[stride * d] * z[stride * d];
    odd += coefficient[stride * (d - 1)] * z[stride * (d - 1)];
  }
  return even + odd;
}

}  // namespace

// The two nearest neighbours come last, from registers: each entry waits for the one before.
void BandFactor::Solve(Vector& x) {
  const Index n = M_->size(), stride = 2 * b_ + 1;
  double* const z = padded_.data() + b_;
  double last = 0, before = 0;
  for (Index i = 0; i < n; ++i) {
    double value = 0;
    if (basis_[static_cast<std::size_t>(i)]) {
      const double* const row = rows_.data() + i * stride + b_;
      value = x[i] - SumOfFar<-1>(row, z + i, b_) - row[-2] * before - row[-1] * last;
      value *= inverse_[static_cast<std::size_t>(i)];
    }
    before = last;
    z[i] = last = value;
  }
  last = before = 0;
  for (Index i = n - 1; i >= 0; --i) {
    double value = 0;
    if (basis_[static_cast<std::size_t>(i)]) {
      const double* const row = rows_.data() + i * stride + b_;
      value = z[i] - SumOfFar<1>(row, z + i, b_) - row[2] * before - row[1] * last;
    }
    before = last;
    x[i] = z[i] = last = value;
  }
}

bool BandFactor::IsClearlyMMatrix(const BandMatrix& M) {
  constexpr double kClearlyPositive = 1e-7;
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
    const double pivot = 1 / factor.inverse_[static_cast<std::size_t>(i)];
    if (!(pivot > kClearlyPositive * M.Row(i)[0]) || !std::isfinite(1 / pivot)) return false;
  }
  return true;
}

}  // namespace dlcs
