// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/relative_degree.h"

#include <algorithm>
#include <cmath>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// Whether `row` B is not zero up to rounding, of which `bound` |B| has one part.
template <class AnyMatrix>
bool ReachesPairs(const Eigen::RowVectorXd& row, const Eigen::RowVectorXd& bound, const AnyMatrix& B,
                  const AnyMatrix& abs_B, int k) {
  const double rounding = RoundingOf(32 * row.size());
  const Eigen::RowVectorXd on_y = row * B, bound_on_y = bound * abs_B;
  return (on_y.array().abs() > rounding * k * bound_on_y.array()).any();
}

// The degree of one row of N, by N_i A^{k-1} and its bound |N_i| |A|^{k-1}, both up to the same factor.
template <class AnyMatrix>
std::optional<int> DegreeOf(const AnyMatrix& A, const AnyMatrix& abs_A, const AnyMatrix& B, const AnyMatrix& abs_B,
                            Eigen::RowVectorXd row) {
  Eigen::RowVectorXd bound = row.cwiseAbs();
  for (int k = 1; k <= A.rows(); ++k) {
    LookForStop();
    const double largest = bound.maxCoeff();
    if (!(largest > 0)) return std::nullopt;
    const double factor = std::exp2(-std::ilogb(largest));  // keeps high powers within range
    row *= factor;
    bound *= factor;
    if (ReachesPairs(row, bound, B, abs_B, k)) return k;
    row = (row * A).eval();
    bound = (bound * abs_A).eval();
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::optional<int>> RelativeDegrees(const Matrix& A, const Matrix& B, const Matrix& N, const Matrix& M) {
  const Matrix abs_A = A.cwiseAbs(), abs_B = B.cwiseAbs();
  std::vector<std::optional<int>> degrees(N.rows());
  for (Index i = 0; i < N.rows(); ++i) {
    degrees[i] = M.row(i).isZero(0) ? DegreeOf(A, abs_A, B, abs_B, N.row(i)) : 0;
  }
  return degrees;
}

std::vector<std::optional<int>> RelativeDegrees(const StructuredMatrix& A, const StructuredMatrix& B,
                                                const StructuredMatrix& N, const StructuredMatrix& M) {
  if (A.is_dense() || A.rows() <= 64) return RelativeDegrees(A.Dense(), B.Dense(), N.Dense(), M.Dense());
  const SparseMatrix sparse_B = B.Sparse(), abs_B = sparse_B.cwiseAbs();
  SparseMatrix sparse_A, abs_A;  // most rows do without
  const SparseMatrix rows_of_N = N.Sparse().transpose(), rows_of_M = M.Sparse().transpose();
  std::vector<std::optional<int>> degrees(static_cast<std::size_t>(N.rows()));
  for (Index i = 0; i < N.rows(); ++i) {
    std::optional<int>& degree = degrees[static_cast<std::size_t>(i)];
    degree = 0;
    if (MaxAbs(Vector(rows_of_M.col(i))) != 0) continue;
    LookForStop();
    const Eigen::RowVectorXd row = Vector(rows_of_N.col(i)).transpose();
    degree = 1;
    if (ReachesPairs<SparseMatrix>(row, row.cwiseAbs(), sparse_B, abs_B, 1)) continue;
    if (abs_A.rows() == 0) {
      sparse_A = A.Sparse();
      abs_A = sparse_A.cwiseAbs();
    }
    degree = DegreeOf(sparse_A, abs_A, sparse_B, abs_B, row);
  }
  return degrees;
}

std::optional<int> RelativeDegree(const Matrix& A, const Matrix& B, const Matrix& N) {
  std::optional<int> least;
  for (const std::optional<int>& degree : RelativeDegrees(A, B, N, Matrix::Zero(N.rows(), N.rows()))) {
    if (degree && (!least || *degree < *least)) least = degree;
  }
  return least;
}

std::vector<Index> ImpulsiveRows(const std::vector<std::optional<int>>& degrees) {
  std::vector<Index> rows;
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    if (degrees[i] && *degrees[i] >= 2) rows.push_back(static_cast<Index>(i));
  }
  return rows;
}

std::vector<Index> UnreachedRows(const std::vector<std::optional<int>>& degrees) {
  std::vector<Index> rows;
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    if (!degrees[i]) rows.push_back(static_cast<Index>(i));
  }
  return rows;
}

std::string DescribeRows(const std::vector<Index>& rows, const std::vector<std::optional<int>>& degrees) {
  constexpr std::size_t kNamed = 5;
  std::string text = rows.size() == 1 ? "constraint " : "constraints ";
  for (std::size_t k = 0; k < std::min(rows.size(), kNamed); ++k) {
    if (k > 0) text += ", ";
    text += std::to_string(rows[k]);
    if (const auto& degree = degrees[rows[k]]) text += " (relative degree " + std::to_string(*degree) + ")";
  }
  if (rows.size() > kNamed) text += " and " + std::to_string(rows.size() - kNamed) + " more";
  return text;
}

}  // namespace dlcs
