// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/symmetric_diagonals.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "core/linalg/simd/simd_dispatch.h"

namespace dlcs {
namespace {

template <typename Visit>
void ForEachEntry(const CompressedRows<double>& K, const Visit& visit) {
  for (Index i = 0; i < K.rows(); ++i) {
    for (int k = K.start[i]; k < K.start[i + 1]; ++k) visit(i, static_cast<Index>(K.column[k]), K.value[k]);
  }
}

double EntryAt(const CompressedRows<double>& K, Index i, int j) {
  const auto begin = K.column.begin() + K.start[i], end = K.column.begin() + K.start[i + 1];
  const auto found = std::lower_bound(begin, end, j);
  return found != end && *found == j ? K.value[found - K.column.begin()] : 0;
}

bool IsSymmetric(const CompressedRows<double>& K) {
  if (K.rows() != K.cols) return false;
  bool is_symmetric = true;
  ForEachEntry(K, [&](Index i, Index j, double value) {
    is_symmetric = is_symmetric && (i == j || EntryAt(K, j, static_cast<int>(i)) == value);
  });
  return is_symmetric;
}

// From the main one on, those with few gaps.
std::vector<Index> ShiftsOfDiagonals(const CompressedRows<double>& K) {
  constexpr double kFull = 0.6;
  std::unordered_map<Index, Index> counts;
  ForEachEntry(K, [&](Index i, Index j, double) {
    if (j >= i) ++counts[j - i];
  });
  std::vector<Index> shifts;
  for (const auto& [shift, count] : counts) {
    if (static_cast<double>(count) >= kFull * static_cast<double>(K.rows() - shift)) shifts.push_back(shift);
  }
  std::sort(shifts.begin(), shifts.end());
  return shifts;
}

}  // namespace

std::optional<SymmetricDiagonals> SymmetricDiagonals::Of(const CompressedRows<double>& K) {
  constexpr double kMostOthers = 0.15;
  if (!IsSymmetric(K)) return std::nullopt;
  SymmetricDiagonals made;
  made.size_ = K.rows();
  const std::vector<Index>& shifts = made.shifts_ = ShiftsOfDiagonals(K);
  for (const Index shift : shifts) made.diagonals_.emplace_back(Vector::Zero(made.size_ - shift));
  CompressedRows<double>& others = made.others_;
  others.cols = K.cols;
  ForEachEntry(K, [&](Index i, Index j, double value) {
    const Index shift = std::abs(j - i);
    const auto at = std::lower_bound(shifts.begin(), shifts.end(), shift);
    if (at != shifts.end() && *at == shift) {
      if (j >= i) made.diagonals_[at - shifts.begin()][i] = value;
      return;
    }
    if (made.rows_of_others_.empty() || made.rows_of_others_.back() != i) {
      made.rows_of_others_.push_back(i);
      others.start.push_back(others.start.back());
    }
    others.column.push_back(static_cast<int>(j));
    others.value.push_back(value);
    ++others.start.back();
  });
  if (static_cast<double>(others.nonzeros()) > kMostOthers * static_cast<double>(K.nonzeros())) return std::nullopt;
  return made;
}

void SymmetricDiagonals::MultiplyRows(const double* x, Index begin, Index end, double* product) const {
  constexpr Index kRows = 1024;  // whose sums stay in the nearest cache
  RunWide([&]() DLCS_WIDE {
    for (Index first = begin; first < end; first += kRows) {
      const Index last = std::min(first + kRows, end);
      double* __restrict sums = product + (first - begin);
      for (Index i = 0; i < last - first; ++i) sums[i] = 0;
      for (std::size_t k = 0; k < shifts_.size(); ++k) {
        const Index shift = shifts_[k];
        const double* __restrict entry = diagonals_[k].data();
        const Index above = std::min(last, size_ - shift);
        for (Index i = first; i < above; ++i) sums[i - first] += entry[i] * x[i + shift];
        if (shift == 0) continue;
        for (Index i = std::max(first, shift); i < last; ++i) sums[i - first] += entry[i - shift] * x[i - shift];
      }
    }
  });
  const auto rows = std::lower_bound(rows_of_others_.begin(), rows_of_others_.end(), begin);
  for (auto row = rows; row != rows_of_others_.end() && *row < end; ++row) {
    const auto at = row - rows_of_others_.begin();
    for (int k = others_.start[at]; k < others_.start[at + 1]; ++k) {
      product[*row - begin] += others_.value[k] * x[others_.column[k]];
    }
  }
}

}  // namespace dlcs
