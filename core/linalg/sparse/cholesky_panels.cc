// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/cholesky_panels.h"

#include <algorithm>

#include "core/linalg/simd/simd_dispatch.h"

namespace dlcs {
namespace {

// Zeros that a panel may hold beside its entries: a pass over some is quicker than another panel.
constexpr double kZeros = 0.2;
constexpr Index kFewZeros = 8;

Index EntriesOfColumn(const SparseMatrix& L, Index column) {
  return L.outerIndexPtr()[column + 1] - L.outerIndexPtr()[column];
}

// Whether all rows of the column before `column`, but its own, are rows of `column`: it is its parent in the
// elimination tree.
bool IsParentOfTheOneBefore(const SparseMatrix& L, Index column) {
  const Index begin = L.outerIndexPtr()[column - 1];
  return EntriesOfColumn(L, column - 1) > 1 && L.innerIndexPtr()[begin + 1] == column;
}

// The sums of eight lanes in a fixed order, so that all registers give the same bits.
struct Lanes {
  static constexpr Index kCount = 8;
  double sums[kCount] = {};

  double Total() const {
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
  }
};

DLCS_WIDE inline double DotProduct(const double* __restrict a, const double* __restrict b, Index count) {
  Lanes lanes;
  Index i = 0;
  for (; i + Lanes::kCount <= count; i += Lanes::kCount) {
    for (Index lane = 0; lane < Lanes::kCount; ++lane) lanes.sums[lane] += a[i + lane] * b[i + lane];
  }
  for (Index lane = 0; i < count; ++i, ++lane) lanes.sums[lane] += a[i] * b[i];
  return lanes.Total();
}

// sum = Σ_j x_j (column j), all columns `stride` apart.
DLCS_WIDE inline void Combine(const double* __restrict columns, Index stride, Index count, const double* __restrict x,
                              Index rows, double* __restrict sum) {
  std::fill_n(sum, rows, 0.0);
  Index j = 0;
  for (; j + 4 <= count; j += 4) {
    const double *const a = columns + j * stride, *const b = a + stride, *const c = b + stride, *const d = c + stride;
    const double of_a = x[j], of_b = x[j + 1], of_c = x[j + 2], of_d = x[j + 3];
    for (Index i = 0; i < rows; ++i) sum[i] += (of_a * a[i] + of_b * b[i]) + (of_c * c[i] + of_d * d[i]);
  }
  for (; j < count; ++j) {
    const double* const a = columns + j * stride;
    const double of_a = x[j];
    for (Index i = 0; i < rows; ++i) sum[i] += of_a * a[i];
  }
}

}  // namespace

CholeskyPanels::CholeskyPanels(const SparseMatrix& L) {
  values_.reserve(static_cast<std::size_t>(L.nonZeros()));
  Index first = 0, entries = 0, zeros = 0;  // of the panel that begins at `first`
  for (Index column = 0; column < L.cols(); ++column) {
    const Index own = EntriesOfColumn(L, column), width = column - first;
    if (width > 0) {
      const Index more = width * (own + 1 - EntriesOfColumn(L, column - 1));
      const auto allowed = static_cast<Index>(kZeros * static_cast<double>(entries + own));
      if (!IsParentOfTheOneBefore(L, column) || zeros + more > std::max(kFewZeros, allowed)) {
        AddPanel(L, first, column);
        first = column;
        entries = zeros = 0;
      } else {
        zeros += more;
      }
    }
    entries += own;
  }
  if (L.cols() > 0) AddPanel(L, first, L.cols());
}

void CholeskyPanels::AddPanel(const SparseMatrix& L, Index first, Index end) {
  const Index width = end - first;
  const int* const row_of = L.innerIndexPtr();
  const int *const begin_of_last = row_of + L.outerIndexPtr()[end - 1], *const end_of_last =
                                                                            row_of + L.outerIndexPtr()[end];
  const Panel panel{.first = first,
                    .width = width,
                    .begin_of_rows = static_cast<Index>(rows_.size()),
                    .rows = end_of_last - begin_of_last - 1,
                    .begin_of_values = values_.size()};
  rows_.insert(rows_.end(), begin_of_last + 1, end_of_last);
  const Index stride = width + panel.rows;
  values_.resize(values_.size() + static_cast<std::size_t>(width * stride));
  const int* const rows = rows_.data() + panel.begin_of_rows;
  for (Index j = 0; j < width; ++j) {
    double* const column = values_.data() + panel.begin_of_values + j * stride;
    Index below = 0;
    for (SparseMatrix::InnerIterator entry(L, first + j); entry; ++entry) {
      if (entry.row() == first + j) {
        column[j] = 1 / entry.value();
      } else if (entry.row() < end) {
        column[entry.row() - first] = entry.value();
      } else {
        while (rows[below] != entry.row()) ++below;
        column[width + below] = entry.value();
      }
    }
  }
  most_rows_ = std::max(most_rows_, panel.rows);
  panels_.push_back(panel);
}

void CholeskyPanels::SolveForward(Vector& x) const {
  Vector work(most_rows_);
  double *const sums = work.data(), *const solution = x.data();
  RunWide([&]() DLCS_WIDE {
    for (const Panel& panel : panels_) {
      const Index width = panel.width, stride = panel.stride();
      const double* const values = values_.data() + panel.begin_of_values;
      const int* const rows = rows_.data() + panel.begin_of_rows;
      double* const own = solution + panel.first;
      bool is_zero = true;
      for (Index j = 0; j < width; ++j) is_zero = is_zero && own[j] == 0;
      if (is_zero) continue;
      for (Index j = 0; j < width; ++j) {
        const double* const column = values + j * stride;
        const double value = own[j] * column[j];
        own[j] = value;
        for (Index i = j + 1; i < width; ++i) own[i] -= value * column[i];
      }
      Combine(values + width, stride, width, own, panel.rows, sums);
      for (Index i = 0; i < panel.rows; ++i) solution[rows[i]] -= sums[i];
    }
  });
}

void CholeskyPanels::SolveBackward(Vector& x) const {
  Vector work(most_rows_);
  double *const gathered = work.data(), *const solution = x.data();
  RunWide([&]() DLCS_WIDE {
    for (auto panel = panels_.rbegin(); panel != panels_.rend(); ++panel) {
      const Index width = panel->width, stride = panel->stride();
      const double* const values = values_.data() + panel->begin_of_values;
      const int* const rows = rows_.data() + panel->begin_of_rows;
      double* const own = solution + panel->first;
      for (Index i = 0; i < panel->rows; ++i) gathered[i] = solution[rows[i]];
      for (Index j = width - 1; j >= 0; --j) {
        const double* const column = values + j * stride;
        const double left = own[j] - DotProduct(column + width, gathered, panel->rows);
        own[j] = column[j] * (left - DotProduct(column + j + 1, own + j + 1, width - j - 1));
      }
    }
  });
}

double CholeskyPanels::bytes() const {
  return static_cast<double>(sizeof(double) * values_.size() + sizeof(int) * rows_.size() +
                             sizeof(Panel) * panels_.size());
}

}  // namespace dlcs
