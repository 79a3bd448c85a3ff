// SPDX-License-Identifier: Apache-2.0
#include "core/problem/mass_factor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/format_number.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/double_double.h"
#include "core/linalg/equilibration.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

template <typename Function>
void MassFactor::ForEntries(Function function) {
  for (Index j = 0; j < scaled_.outerSize(); ++j) {
    for (SparseMatrix::InnerIterator entry(scaled_, j); entry; ++entry) function(entry.row(), j, entry.valueRef());
  }
}

MassFactor::MassFactor(SparseMatrix E) : rows_(Vector::Ones(E.rows())), columns_(rows_), E_(std::move(E)), scaled_(E_) {
  constexpr int kSweeps = 3;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    Vector row = Vector::Zero(scaled_.rows()), column = Vector::Zero(scaled_.cols());
    ForEntries([&](Index i, Index j, double& value) {
      row[i] = std::max(row[i], std::abs(value));
      column[j] = std::max(column[j], std::abs(value));
    });
    const auto inverse_root = [](double size) { return size > 0 ? 1 / PowerOfTwo(std::sqrt(size)) : 1; };
    row = row.unaryExpr(inverse_root);
    column = column.unaryExpr(inverse_root);
    ForEntries([&](Index i, Index j, double& value) { value *= row[i] * column[j]; });
    rows_.array() *= row.array();
    columns_.array() *= column.array();
  }
  factor_.emplace(scaled_, SparseOrder(scaled_), 0, -1);
}

Matrix MassFactor::Solve(const Matrix& right) const {
  constexpr int kMaxSteps = 8;
  Matrix solution = SolveOnce(right);
  for (int step = 0; step < kMaxSteps; ++step) {
    const Matrix correction = SolveOnce(Residual(right, solution));
    const Vector size = RowMaxAbs(correction.transpose()), of_solution = RowMaxAbs(solution.transpose());
    if (!(size.array() < of_solution.array() || size.array() == 0).all()) break;
    solution += correction;
    if ((size.array() <= RoundingOf(4) * of_solution.array()).all()) break;
  }
  return solution;
}

std::vector<Index> MassFactor::Dependent(bool of_columns) const {
  constexpr double kShift = 1e-9, kZero = 1e-7, kCounts = 0.05;
  constexpr int kIterations = 4;
  SparseMatrix E = scaled_;
  if (!of_columns) E = SparseMatrix(scaled_.transpose());
  const SparseFactor<double> factor(E, SparseOrder(E), kShift, -1);
  Vector v = Vector::LinSpaced(E.rows(), 1, 1.5);
  for (int k = 0; k < kIterations && factor.is_regular(); ++k) v = factor.Solve(v).normalized();
  if (!factor.is_regular() || !(MaxAbs(E * v) <= kZero * MaxAbs(v))) return {};
  const double least = kCounts * MaxAbs(v);
  std::vector<Index> found;
  for (Index i = 0; i < v.size(); ++i) {
    if (std::abs(v[i]) > least) found.push_back(i);
  }
  return found;
}

Matrix MassFactor::SolveOnce(const Matrix& right) const {
  return columns_.asDiagonal() * factor_->Solve(rows_.asDiagonal() * right);
}

Matrix MassFactor::Residual(const Matrix& right, const Matrix& solution) const {
  Matrix residual(right.rows(), right.cols());
  std::vector<DoubleDouble> rest;
  for (Index column = 0; column < right.cols(); ++column) {
    LookForStop();
    rest.assign(right.col(column).begin(), right.col(column).end());
    for (Index j = 0; j < E_.outerSize(); ++j) {
      const double x = solution(j, column);
      if (x == 0) continue;
      for (SparseMatrix::InnerIterator entry(E_, j); entry; ++entry) {
        DoubleDouble& sum = rest[static_cast<std::size_t>(entry.row())];
        sum = sum - DoubleDouble(entry.value()) * x;
      }
    }
    for (Index i = 0; i < right.rows(); ++i) residual(i, column) = rest[static_cast<std::size_t>(i)].Rounded();
  }
  return residual;
}

namespace {

// "row 3", "rows 3 and 5", "rows 3, 5, 7 and 20 more".
std::string Listed(const char* what, const std::vector<Index>& indices) {
  constexpr std::size_t kMost = 6;
  std::vector<std::string> words;
  for (std::size_t k = 0; k < std::min(indices.size(), kMost); ++k) words.push_back(std::to_string(indices[k]));
  if (indices.size() > kMost) words.push_back(std::to_string(indices.size() - kMost) + " more");
  return std::string(what) + (indices.size() > 1 ? "s " : " ") + ListText(words);
}

std::vector<Index> ZerosOf(const Vector& sizes) {
  std::vector<Index> zeros;
  for (Index i = 0; i < sizes.size(); ++i) {
    if (sizes[i] == 0) zeros.push_back(i);
  }
  return zeros;
}

}  // namespace

std::string WhySingular(const StructuredMatrix& E) {
  const std::string what = "singular, so that E x' does not determine x': ";
  const Vector ones = Vector::Ones(E.rows());
  if (const auto zeros = ZerosOf(E.AbsTimes(ones)); !zeros.empty()) {
    return what + Listed("row", zeros) + (zeros.size() > 1 ? " are" : " is") +
           " zero. Such a row is an algebraic equation; eliminate a state by it";
  }
  const SparseMatrix sparse = E.Sparse();
  if (const auto zeros = ZerosOf(SparseMatrix(sparse.cwiseAbs()).transpose() * ones); !zeros.empty()) {
    return what + Listed("column", zeros) + (zeros.size() > 1 ? " are" : " is") + " zero";
  }
  constexpr double kMinutes = 1e11;
  if (!E.is_dense() && PredictFactor(sparse).multiplications > kMinutes) return "";
  const MassFactor factor(sparse);
  if (factor.is_regular()) return "";
  std::vector<Index> dependent = factor.Dependent(/*of_columns=*/false);
  const char* kind = "row";
  if (dependent.empty()) {
    dependent = factor.Dependent(/*of_columns=*/true);
    kind = "column";
  }
  if (dependent.empty()) return what + "it is singular to working precision";
  return what + Listed(kind, dependent) + " depend on each other to working precision";
}

bool IsDiagonal(const StructuredMatrix& E) {
  const SparseMatrix sparse = E.Sparse();
  for (Index j = 0; j < sparse.outerSize(); ++j) {
    for (SparseMatrix::InnerIterator entry(sparse, j); entry; ++entry) {
      if (entry.row() != j && entry.value() != 0) return false;
    }
  }
  return true;
}

}  // namespace dlcs
