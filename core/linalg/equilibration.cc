// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/equilibration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace dlcs {
namespace {

// The distance to size one halves (in the exponent) with every round: doubles need ten or so, long chains of indices a
// few more.
constexpr int kRounds = 14;
constexpr double kNoEntry = -std::numeric_limits<double>::infinity();

// log2 |M_ij| rounded down; -infinity for zeros.
Matrix BinaryExponents(const Matrix& M) {
  return M.unaryExpr([](double entry) { return entry == 0 ? kNoEntry : static_cast<double>(std::ilogb(entry)); });
}

// 2^exponent; scales beyond 2^±500 would only matter next to overflow.
Vector PowersOfTwo(const Vector& exponents) {
  return exponents.unaryExpr([](double e) { return std::ldexp(1.0, static_cast<int>(std::clamp(e, -500.0, 500.0))); });
}

// Rows and columns are the two sides of a graph with an edge for each entry. Along a tree of every connected part the
// entries are brought to exponent zero. The tree depends on the zeros of M alone, so what comes out does not depend on
// the units of rows and columns.
class Tree {
 public:
  explicit Tree(const Matrix& exponents)
      : exponents_(exponents), row_(Vector::Zero(exponents.rows())), column_(Vector::Zero(exponents.cols())) {
    std::vector<bool> seen_row(static_cast<std::size_t>(row_.size())),
        seen_column(static_cast<std::size_t>(column_.size()));
    for (Index root = 0; root < column_.size(); ++root) {
      if (!seen_column[root]) Grow(root, seen_row, seen_column);
    }
  }

  const Vector& row() const { return row_; }
  const Vector& column() const { return column_; }

  // Only the products of the factors of a row and a column count: in each connected part both are made of the same size
  // on average, so that a right-hand side neither overflows nor underflows where the matrix does not.
  void Balance(Vector& row, Vector& column) const {
    for (const Part& part : parts_) {
      double of_rows = 0, of_columns = 0;
      for (const Index i : part.rows) of_rows += row[i];
      for (const Index j : part.columns) of_columns += column[j];
      const double shift = std::floor(
          (of_rows / static_cast<double>(part.rows.size()) - of_columns / static_cast<double>(part.columns.size())) /
          2);
      for (const Index i : part.rows) row[i] -= shift;
      for (const Index j : part.columns) column[j] += shift;
    }
  }

 private:
  struct Part {
    std::vector<Index> rows, columns;
  };

  void Grow(Index root, std::vector<bool>& seen_row, std::vector<bool>& seen_column) {
    std::vector<Index> rows, columns = {root};
    seen_column[root] = true;
    std::size_t next_row = 0;
    for (std::size_t next = 0; next < columns.size(); ++next) {
      const Index j = columns[next];
      for (Index i = 0; i < row_.size(); ++i) {
        if (seen_row[i] || exponents_(i, j) == kNoEntry) continue;
        seen_row[i] = true;
        row_[i] = -exponents_(i, j) - column_[j];
        rows.push_back(i);
      }
      for (; next_row < rows.size(); ++next_row) {
        const Index i = rows[next_row];
        for (Index k = 0; k < column_.size(); ++k) {
          if (seen_column[k] || exponents_(i, k) == kNoEntry) continue;
          seen_column[k] = true;
          column_[k] = -exponents_(i, k) - row_[i];
          columns.push_back(k);
        }
      }
    }
    if (!rows.empty()) parts_.push_back({std::move(rows), std::move(columns)});
  }

  const Matrix& exponents_;
  Vector row_, column_;
  std::vector<Part> parts_;  // those with entries
};

// The same for one factor per index. An index with a diagonal entry is brought to exponent zero or one there; those
// without follow along a tree from the others, and where there is none a cycle of odd length fixes them.
class SymmetricTree {
 public:
  explicit SymmetricTree(const Matrix& exponents)
      : exponents_(exponents), scale_(Vector::Zero(exponents.rows())), seen_(static_cast<std::size_t>(scale_.size())) {
    std::vector<Index> reached;
    for (Index i = 0; i < scale_.size(); ++i) {
      if (exponents_(i, i) == kNoEntry) continue;
      scale_[i] = -std::floor(exponents_(i, i) / 2);
      seen_[i] = true;
      reached.push_back(i);
    }
    Grow(reached);
    for (Index root = 0; root < scale_.size(); ++root) {
      if (seen_[root]) continue;
      seen_[root] = true;
      std::vector<Index> part = {root};
      Fix(part, Grow(part));
    }
  }

  const Vector& scale() const { return scale_; }

 private:
  // Completes `reached`; returns whether each is an odd number of edges away from its root.
  std::vector<bool> Grow(std::vector<Index>& reached) {
    std::vector<bool> odd(reached.size());
    for (std::size_t next = 0; next < reached.size(); ++next) {
      const Index i = reached[next];
      for (Index j = 0; j < scale_.size(); ++j) {
        if (seen_[j] || exponents_(i, j) == kNoEntry) continue;
        seen_[j] = true;
        scale_[j] = -exponents_(i, j) - scale_[i];
        reached.push_back(j);
        odd.push_back(!odd[next]);
      }
    }
    return odd;
  }

  void Fix(const std::vector<Index>& part, const std::vector<bool>& odd) {
    for (std::size_t a = 0; a < part.size(); ++a) {
      for (std::size_t b = a + 1; b < part.size(); ++b) {
        const double exponent = exponents_(part[a], part[b]);
        if (odd[a] != odd[b] || exponent == kNoEntry) continue;
        const double shift = (odd[a] ? 1 : -1) * std::floor((exponent + scale_[part[a]] + scale_[part[b]]) / 2);
        for (std::size_t k = 0; k < part.size(); ++k) scale_[part[k]] += odd[k] ? -shift : shift;
        return;
      }
    }
  }

  const Matrix& exponents_;
  Vector scale_;
  std::vector<bool> seen_;
};

Vector Rounded(const Vector& exponents) {
  return exponents.unaryExpr([](double e) { return std::round(e); });
}

double FiniteOrZero(double exponent) { return exponent == kNoEntry ? 0 : exponent; }

// Moves the exponents of each row, then those of each column, to mean zero, a few times, and adds these changes to
// `row` and `column`. A tree may start from an entry that is tiny beside all others.
void CenterExponents(Matrix& exponents, Vector& row, Vector& column) {
  constexpr int kSweeps = 6;
  const Matrix has_entry = (exponents.array() != kNoEntry).cast<double>();
  const Vector in_row = has_entry.rowwise().sum().cwiseMax(1), in_column = has_entry.colwise().sum().cwiseMax(1);
  const auto entries = [&] { return (exponents.array() == kNoEntry).select(0, exponents); };
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    const Vector of_rows = entries().rowwise().sum().cwiseQuotient(in_row);
    exponents.colwise() -= of_rows;
    row -= of_rows;
    const Vector of_columns = entries().colwise().sum().transpose().cwiseQuotient(in_column);
    exponents.rowwise() -= of_columns.transpose();
    column -= of_columns;
  }
}

}  // namespace

Vector SymmetricEquilibration(const Matrix& M) {
  const Index n = M.rows();
  Matrix exponents = BinaryExponents(M.cwiseAbs().cwiseMax(M.cwiseAbs().transpose()));
  const Vector start = SymmetricTree(exponents).scale();
  exponents.colwise() += start;
  exponents.rowwise() += start.transpose();
  Vector scale = Vector::Zero(n), largest(n);
  for (int round = 0; round < kRounds; ++round) {
    for (Index i = 0; i < n; ++i) largest[i] = FiniteOrZero((exponents.col(i) + scale).maxCoeff() + scale[i]);
    scale -= largest / 2;
  }
  return PowersOfTwo(start + Rounded(scale));
}

Equilibration EquilibrateRowsAndColumns(const Matrix& M) {
  const Index rows = M.rows(), columns = M.cols();
  if (rows == 0 || columns == 0) return {Vector::Ones(rows), Vector::Ones(columns)};
  Matrix exponents = BinaryExponents(M);
  const Tree tree(exponents);
  exponents.colwise() += tree.row();
  exponents.rowwise() += tree.column().transpose();
  Vector start_row = Vector::Zero(rows), start_column = Vector::Zero(columns);
  CenterExponents(exponents, start_row, start_column);
  Vector row = Vector::Zero(rows), column = Vector::Zero(columns), of_rows(rows), of_columns(columns);
  for (int round = 0; round < kRounds; ++round) {
    of_rows.setConstant(kNoEntry);
    for (Index j = 0; j < columns; ++j) {
      of_rows = of_rows.cwiseMax((exponents.col(j).array() + column[j]).matrix());
      of_columns[j] = FiniteOrZero((exponents.col(j) + row).maxCoeff() + column[j]);
    }
    of_rows = (of_rows + row).unaryExpr(&FiniteOrZero);
    if (std::max(of_rows.cwiseAbs().maxCoeff(), of_columns.cwiseAbs().maxCoeff()) < 0.5) break;
    row -= of_rows / 2;
    column -= of_columns / 2;
  }
  row = tree.row() + Rounded(start_row + row);
  column = tree.column() + Rounded(start_column + column);
  tree.Balance(row, column);
  return {PowersOfTwo(row), PowersOfTwo(column)};
}

double PowerOfTwo(double size) { return size > 0 && std::isfinite(size) ? std::ldexp(1.0, std::ilogb(size)) : 1.0; }

Matrix Scaled(const Matrix& M, const Equilibration& scale) {
  Matrix scaled(M.rows(), M.cols());
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      // In the order that does not overflow on the way.
      const bool row_first = (scale.row[i] < 1) == (std::abs(M(i, j)) > 1);
      scaled(i, j) = row_first ? M(i, j) * scale.row[i] * scale.column[j] : M(i, j) * scale.column[j] * scale.row[i];
    }
  }
  return scaled;
}

}  // namespace dlcs
