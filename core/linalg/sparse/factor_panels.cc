// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/factor_panels.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linalg/simd/elimination_loops.h"
#include "core/linalg/simd/simd_dispatch.h"

namespace dlcs {
namespace {

// Zeros that a panel may hold beside its entries: a pass over some is quicker than another panel.
constexpr double kZeros = 0.2;
constexpr Index kFewZeros = 16;
// Columns within a panel are eliminated one by one; between panels products of matrices are formed, which is quicker.
constexpr Index kWidest = 48;

// Sums in a fixed order, so that all registers give the same bits: eight lanes, and the rest.
DLCS_WIDE inline double DotProduct(const double* __restrict a, const double* __restrict b, Index count) {
  constexpr Index kLanes = 8;
  double sum = 0;
  Index i = 0;
  if (count >= kLanes) {
    double sums[kLanes] = {};
    for (; i + kLanes <= count; i += kLanes) {
      for (Index lane = 0; lane < kLanes; ++lane) sums[lane] += a[i + lane] * b[i + lane];
    }
    sum = ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
  }
  for (; i < count; ++i) sum += a[i] * b[i];
  return sum;
}

// sum = Σ_j x_j (column j), all columns `stride` apart.
DLCS_WIDE inline void Combine(const double* __restrict columns, Index stride, Index count, const double* __restrict x,
                              Index rows, double* __restrict sum) {
  const auto column = [&](Index j) DLCS_WIDE { return columns + j * stride; };
  Index j = count % 4;
  if (j == 0) std::fill_n(sum, rows, 0.0);
  if (j == 1) {
    for (Index i = 0; i < rows; ++i) sum[i] = x[0] * columns[i];
  }
  if (j == 2) {
    const double *const a = columns, *const b = column(1);
    for (Index i = 0; i < rows; ++i) sum[i] = x[0] * a[i] + x[1] * b[i];
  }
  if (j == 3) {
    const double *const a = columns, *const b = column(1), *const c = column(2);
    for (Index i = 0; i < rows; ++i) sum[i] = (x[0] * a[i] + x[1] * b[i]) + x[2] * c[i];
  }
  for (; j < count; j += 4) {
    const double *const a = column(j), *const b = column(j + 1), *const c = column(j + 2), *const d = column(j + 3);
    const double of_a = x[j], of_b = x[j + 1], of_c = x[j + 2], of_d = x[j + 3];
    for (Index i = 0; i < rows; ++i) sum[i] += (of_a * a[i] + of_b * b[i]) + (of_c * c[i] + of_d * d[i]);
  }
}

}  // namespace

FactorColumns PredictColumns(const SparseMatrix& matrix, const SparseMatrix& transpose) {
  const Index size = matrix.cols();
  FactorColumns columns{.parents = std::vector<int>(static_cast<std::size_t>(size), -1),
                        .entries = std::vector<Index>(static_cast<std::size_t>(size), 1)};
  std::vector<int> visitor(static_cast<std::size_t>(size));
  // Row k of L has entries along the paths from those of the matrix up to k.
  for (int k = 0; k < size; ++k) {
    visitor[static_cast<std::size_t>(k)] = k;
    for (const SparseMatrix* part : {&matrix, &transpose}) {
      for (SparseMatrix::InnerIterator entry(*part, k); entry && entry.row() < k; ++entry) {
        for (auto i = static_cast<std::size_t>(entry.row()); visitor[i] != k;) {
          visitor[i] = k;
          ++columns.entries[i];
          if (columns.parents[i] < 0) columns.parents[i] = k;
          i = static_cast<std::size_t>(columns.parents[i]);
        }
      }
    }
  }
  return columns;
}

FactorPanels::FactorPanels(const SparseMatrix& matrix, const SparseMatrix& transpose, bool is_symmetric)
    : is_symmetric_(is_symmetric) {
  const FactorColumns columns = PredictColumns(matrix, transpose);
  const auto entries_of = [&](Index column) { return columns.entries[static_cast<std::size_t>(column)]; };
  Index first = 0, entries = 0, zeros = 0;  // of the panel that begins at `first`
  for (Index column = 0; column < matrix.cols(); ++column) {
    const Index own = entries_of(column), width = column - first;
    if (width > 0) {
      // The rows of a column, but its own, are rows of its parent too.
      const bool is_parent = columns.parents[static_cast<std::size_t>(column - 1)] == column;
      const Index more = width * (own + 1 - entries_of(column - 1));
      const auto allowed = static_cast<Index>(kZeros * static_cast<double>(entries + own));
      if (!is_parent || width == kWidest || zeros + more > std::max(kFewZeros, allowed)) {
        AddPanel(first, column);
        first = column;
        entries = zeros = 0;
      } else {
        zeros += more;
      }
    }
    entries += own;
  }
  if (matrix.cols() > 0) AddPanel(first, matrix.cols());
  FindRows(matrix, transpose);
}

void FactorPanels::AddPanel(Index first, Index end) {
  panels_.push_back({.first = first, .width = end - first, .begin_of_rows = 0, .rows = 0, .begin_of_values = 0});
}

std::vector<std::size_t> FactorPanels::PanelOfColumns() const {
  std::vector<std::size_t> panel_of;
  for (std::size_t p = 0; p < panels_.size(); ++p) panel_of.insert(panel_of.end(), panels_[p].width, p);
  return panel_of;
}

// Those of the entries of the matrix, and of the panels whose first row is in this one.
void FactorPanels::FindRows(const SparseMatrix& matrix, const SparseMatrix& transpose) {
  const auto size = static_cast<std::size_t>(matrix.cols());
  const std::vector<std::size_t> panel_of = PanelOfColumns();
  std::vector<std::size_t> seen_by(size, panels_.size());
  std::vector<std::vector<std::size_t>> children(panels_.size());
  std::size_t values = 0;
  for (std::size_t p = 0; p < panels_.size(); ++p) {
    Panel& panel = panels_[p];
    panel.begin_of_rows = static_cast<Index>(rows_.size());
    const auto add = [&](int row) {
      if (row < panel.end() || seen_by[static_cast<std::size_t>(row)] == p) return;
      seen_by[static_cast<std::size_t>(row)] = p;
      rows_.push_back(row);
    };
    for (Index column = panel.first; column < panel.end(); ++column) {
      for (const SparseMatrix* part : {&matrix, &transpose}) {
        for (SparseMatrix::InnerIterator entry(*part, column); entry; ++entry) add(static_cast<int>(entry.row()));
      }
    }
    for (const std::size_t child : children[p]) {
      const Panel& of_child = panels_[child];
      for (Index i = 0; i < of_child.rows; ++i) add(RowsOf(of_child)[i]);
    }
    panel.rows = static_cast<Index>(rows_.size()) - panel.begin_of_rows;
    std::sort(rows_.begin() + panel.begin_of_rows, rows_.end());
    if (panel.rows > 0) children[panel_of[static_cast<std::size_t>(*RowsOf(panel))]].push_back(p);
    panel.begin_of_values = values;
    values += static_cast<std::size_t>(panel.width * panel.stride());
    most_rows_ = std::max(most_rows_, panel.rows);
  }
  rows_.shrink_to_fit();
  lower_.resize(values);
  if (!is_symmetric_) upper_.resize(values);
}

// Panel after panel: the entries of the matrix, less what the panels before it subtract, are eliminated.
struct FactorPanels::Factorization {
  Factorization(FactorPanels& factors, Index size) : factors_(factors), place_(static_cast<std::size_t>(size)) {}

  bool Make(const SparseMatrix& matrix, const SparseMatrix& transpose, double threshold) {
    const std::vector<Panel>& panels = factors_.panels_;
    // Those whose next row is in a panel wait for it: a list for each panel.
    constexpr std::size_t kNone = static_cast<std::size_t>(-1);
    std::vector<std::size_t> first_waiting(panels.size(), kNone), next_waiting(panels.size(), kNone);
    const std::vector<std::size_t> panel_of = factors_.PanelOfColumns();
    std::vector<Index> done(panels.size(), 0);  // rows
    const auto wait = [&](std::size_t p) {
      if (done[p] == panels[p].rows) return;
      std::size_t& list = first_waiting[panel_of[static_cast<std::size_t>(factors_.RowsOf(panels[p])[done[p]])]];
      next_waiting[p] = std::exchange(list, p);
    };
    for (std::size_t p = 0; p < panels.size(); ++p) {
      const Panel& panel = panels[p];
      for (Index j = 0; j < panel.width; ++j) place_[static_cast<std::size_t>(panel.first + j)] = j;
      for (Index i = 0; i < panel.rows; ++i) {
        place_[static_cast<std::size_t>(factors_.RowsOf(panel)[i])] = panel.width + i;
      }
      Insert(matrix, panel, factors_.lower_);
      if (!factors_.is_symmetric_) Insert(transpose, panel, factors_.upper_);
      for (std::size_t q = first_waiting[p]; q != kNone;) {
        const std::size_t next = next_waiting[q];
        done[q] = Subtract(panels[q], done[q], panel);
        wait(q);
        q = next;
      }
      if (!Eliminate(panel, threshold)) return false;
      wait(p);
    }
    return true;
  }

 private:
  // The lower triangle.
  void Insert(const SparseMatrix& matrix, const Panel& panel, std::vector<double>& values) const {
    for (Index j = 0; j < panel.width; ++j) {
      double* const column = values.data() + panel.begin_of_values + j * panel.stride();
      for (SparseMatrix::InnerIterator entry(matrix, panel.first + j); entry; ++entry) {
        if (entry.row() >= panel.first + j) column[place_[static_cast<std::size_t>(entry.row())]] = entry.value();
      }
    }
  }

  // Subtracts the products of `before`, of whose rows the first `done` are in panels before. Returns how many are in
  // these and `panel`.
  Index Subtract(const Panel& before, Index done, const Panel& panel) {
    const int* const rows = factors_.RowsOf(before);
    const Index end = std::lower_bound(rows + done, rows + before.rows, panel.end()) - rows;
    SubtractOne(before, done, end, panel, factors_.lower_, factors_.upper());
    if (!factors_.is_symmetric_) SubtractOne(before, done, end, panel, factors_.upper_, factors_.lower_);
    return end;
  }

  // values -= values · othersᵀ, for the rows from `begin` on and the columns that are its rows up to `end`.
  void SubtractOne(const Panel& before, Index begin, Index end, const Panel& panel, std::vector<double>& values,
                   const std::vector<double>& others) {
    const Index count = before.rows - begin, columns = end - begin, width = before.width, stride = before.stride();
    const std::size_t begin_of_values = before.begin_of_values + static_cast<std::size_t>(width + begin);
    const double* const other = others.data() + begin_of_values;
    factor_.resize(static_cast<std::size_t>(width * columns));
    for (Index k = 0; k < width; ++k) {
      for (Index c = 0; c < columns; ++c) factor_[static_cast<std::size_t>(c * width + k)] = other[k * stride + c];
    }
    product_.assign(static_cast<std::size_t>(count * columns), 0.0);
    SubtractProduct(count, columns, width, values.data() + begin_of_values, stride, factor_.data(), width,
                    product_.data(), count);
    const int* const rows = factors_.RowsOf(before) + begin;
    for (Index c = 0; c < columns; ++c) {
      double* const column = values.data() + panel.begin_of_values + (rows[c] - panel.first) * panel.stride();
      const double* const less = product_.data() + c * count;
      for (Index i = c; i < count; ++i) column[place_[static_cast<std::size_t>(rows[i])]] += less[i];
    }
  }

  bool Eliminate(const Panel& panel, double threshold) {
    const Index stride = panel.stride();
    double* const lower = factors_.lower_.data() + panel.begin_of_values;
    double* const upper = factors_.is_symmetric_ ? lower : factors_.upper_.data() + panel.begin_of_values;
    for (Index j = 0; j < panel.width; ++j) {
      SubtractColumns(lower, upper, j, stride);
      if (!factors_.is_symmetric_) SubtractColumns(upper, lower, j, stride);
      double *const of_lower = lower + j * stride, *const of_upper = upper + j * stride;
      const double pivot = of_lower[j];
      double largest = 0;
      for (Index i = j; i < stride; ++i) largest = std::max(largest, std::abs(of_lower[i]));
      const bool is_pivot = factors_.is_symmetric_ ? pivot > 0 : pivot != 0 && std::abs(pivot) >= threshold * largest;
      if (!is_pivot) return false;
      const double inverse = 1 / std::sqrt(std::abs(pivot)), signed_inverse = std::copysign(inverse, pivot);
      for (Index i = j + 1; i < stride; ++i) of_lower[i] *= signed_inverse;
      of_lower[j] = inverse;
      if (factors_.is_symmetric_) continue;
      for (Index i = j + 1; i < stride; ++i) of_upper[i] *= inverse;
      of_upper[j] = signed_inverse;
    }
    return true;
  }

  // Column j -= the ones before it times row j of `others`.
  void SubtractColumns(double* values, const double* others, Index j, Index stride) {
    factor_.resize(static_cast<std::size_t>(j));
    for (Index k = 0; k < j; ++k) factor_[static_cast<std::size_t>(k)] = others[k * stride + j];
    SubtractProduct(stride - j, 1, j, values + j, stride, factor_.data(), j, values + j * stride + j, stride);
  }

  FactorPanels& factors_;
  std::vector<Index> place_;  // of a row in the present panel
  std::vector<double> factor_, product_;
};

std::optional<FactorPanels> FactorPanels::Cholesky(const SparseMatrix& matrix) {
  FactorPanels factors(matrix, matrix, /*is_symmetric=*/true);
  if (!Factorization(factors, matrix.cols()).Make(matrix, matrix, 0)) return std::nullopt;
  return factors;
}

std::optional<FactorPanels> FactorPanels::Lu(const SparseMatrix& matrix, double threshold) {
  const SparseMatrix transpose = matrix.transpose();
  FactorPanels factors(matrix, transpose, /*is_symmetric=*/false);
  if (!Factorization(factors, matrix.cols()).Make(matrix, transpose, threshold)) return std::nullopt;
  return factors;
}

void FactorPanels::SolveForward(const std::vector<double>& values, Vector& x) const {
  Vector work(most_rows_);
  double *const sums = work.data(), *const solution = x.data();
  RunWide([&]() DLCS_WIDE {
    for (const Panel& panel : panels_) {
      const Index width = panel.width, stride = panel.stride();
      const double* const columns = values.data() + panel.begin_of_values;
      const int* const rows = RowsOf(panel);
      double* const own = solution + panel.first;
      bool is_zero = true;
      for (Index j = 0; j < width; ++j) is_zero = is_zero && own[j] == 0;
      if (is_zero) continue;
      if (width == 1) {  // as many panels of a grid in space are
        const double value = own[0] *= columns[0];
        for (Index i = 0; i < panel.rows; ++i) solution[rows[i]] -= value * columns[1 + i];
        continue;
      }
      for (Index j = 0; j < width; ++j) {
        const double* const column = columns + j * stride;
        const double value = own[j] * column[j];
        own[j] = value;
        for (Index i = j + 1; i < width; ++i) own[i] -= value * column[i];
      }
      Combine(columns + width, stride, width, own, panel.rows, sums);
      for (Index i = 0; i < panel.rows; ++i) solution[rows[i]] -= sums[i];
    }
  });
}

void FactorPanels::SolveBackward(Vector& x) const {
  Vector work(most_rows_);
  const double* const values = upper().data();
  double *const gathered = work.data(), *const solution = x.data();
  RunWide([&]() DLCS_WIDE {
    for (auto panel = panels_.rbegin(); panel != panels_.rend(); ++panel) {
      const Index width = panel->width, stride = panel->stride();
      const double* const columns = values + panel->begin_of_values;
      const int* const rows = RowsOf(*panel);
      double* const own = solution + panel->first;
      for (Index i = 0; i < panel->rows; ++i) gathered[i] = solution[rows[i]];
      for (Index j = width - 1; j >= 0; --j) {
        const double* const column = columns + j * stride;
        const double left = own[j] - DotProduct(column + width, gathered, panel->rows);
        own[j] = column[j] * (left - DotProduct(column + j + 1, own + j + 1, width - j - 1));
      }
    }
  });
}

double FactorPanels::bytes_of_rows() const {
  return static_cast<double>(sizeof(int) * rows_.size() + sizeof(Panel) * panels_.size());
}

double FactorPanels::bytes() const {
  return static_cast<double>(sizeof(double) * (lower_.size() + upper_.size())) + bytes_of_rows();
}

double FactorPanels::bytes_of_a_solve() const {
  return 2 * (static_cast<double>(sizeof(double) * lower_.size()) + bytes_of_rows());
}

}  // namespace dlcs
