// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/diagonals.h"

#include <algorithm>

#include "core/linalg/simd/simd_dispatch.h"

namespace dlcs {

std::optional<Diagonals> Diagonals::Of(const Eigen::SparseMatrix<double>& matrix) {
  constexpr std::size_t kMax = 8;
  using Entry = Eigen::SparseMatrix<double>::InnerIterator;
  Diagonals made;
  std::vector<Diagonal>& diagonals = made.diagonals_;
  const auto find = [&](Index shift) {
    return std::find_if(diagonals.begin(), diagonals.end(), [&](const Diagonal& of) { return of.shift == shift; });
  };
  for (Index j = 0; j < matrix.outerSize(); ++j) {
    for (Entry entry(matrix, j); entry; ++entry) {
      const Index shift = j - entry.row();
      if (find(shift) != diagonals.end()) continue;
      if (diagonals.size() == kMax) return std::nullopt;
      const Index first = std::max<Index>(0, -shift);
      diagonals.push_back({first, shift, Vector(std::min(matrix.rows(), matrix.cols() - shift) - first)});
    }
  }
  Index length = 0;
  for (const Diagonal& diagonal : diagonals) length += diagonal.entries.size();
  if (matrix.nonZeros() != length) return std::nullopt;
  for (Index j = 0; j < matrix.outerSize(); ++j) {
    for (Entry entry(matrix, j); entry; ++entry) {
      Diagonal& diagonal = *find(j - entry.row());
      diagonal.entries[entry.row() - diagonal.first] = entry.value();
    }
  }
  std::sort(diagonals.begin(), diagonals.end(), [](const Diagonal& a, const Diagonal& b) { return a.shift < b.shift; });
  return made;
}

void Diagonals::Multiply(const Eigen::Ref<const Matrix>& values, Eigen::Ref<Matrix> product) const {
  product.setZero();
  AddProduct(values, product);
}

void Diagonals::AddProduct(const Eigen::Ref<const Matrix>& values, Eigen::Ref<Matrix> sum) const {
  for (Index c = 0; c < values.cols(); ++c) {
    for (const Diagonal& diagonal : diagonals_) {
      const Index length = diagonal.entries.size();
      const double* const all_entries = diagonal.entries.data();
      const double* const column = values.col(c).data() + diagonal.first + diagonal.shift;
      double* const sums = sum.col(c).data() + diagonal.first;
      RunWide([=]() DLCS_WIDE {
        const double* __restrict entry = all_entries;
        const double* __restrict value = column;
        double* __restrict to = sums;
        for (Index i = 0; i < length; ++i) to[i] += entry[i] * value[i];
      });
    }
  }
}

}  // namespace dlcs
