// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/positive_semidefinite.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <vector>

#include "absl/strings/str_cat.h"

namespace dlcs {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// (M + Mᵀ)/2, with entries that are zero but for rounding set to zero.
Matrix SymmetricPart(const Matrix& M) {
  Matrix symmetric(M.rows(), M.cols());
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      const double sum = M(i, j) + M(j, i);
      symmetric(i, j) = std::abs(sum) <= 4 * kEpsilon * std::abs(M(i, j)) ? 0 : sum / 2;
    }
  }
  return symmetric;
}

// Eigenvalues, increasing, of a symmetric matrix with positive diagonal after scaling to unit diagonal.
Vector UnitDiagonalEigenvalues(const Matrix& symmetric) {
  const Vector scale = symmetric.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix scaled = scale.asDiagonal() * symmetric * scale.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Matrix>(scaled, Eigen::EigenvaluesOnly).eigenvalues();
}

double EigenvalueRounding(const Vector& eigenvalues) {
  return 4 * kEpsilon * static_cast<double>(eigenvalues.size()) * eigenvalues.tail<1>()[0];
}

}  // namespace

Fact TestPositiveSemidefinite(const Matrix& M) {
  const Matrix symmetric = SymmetricPart(M);
  if ((symmetric.array() == 0).all()) return {Answer::kYes, "its symmetric part is zero"};
  std::vector<Index> positive;
  for (Index i = 0; i < M.rows(); ++i) {
    if (symmetric(i, i) < 0) {
      return {Answer::kNo, absl::StrCat("M[", i, "][", i, "] = ", M(i, i), " is negative")};
    }
    if (symmetric(i, i) > 0) {
      positive.push_back(i);
      continue;
    }
    Index j = 0;
    if (symmetric.row(i).cwiseAbs().maxCoeff(&j) > 0) {
      return {Answer::kNo, absl::StrCat("M[", i, "][", i, "] = 0, but M[", i, "][", j, "] + M[", j, "][", i,
                                        "] = ", 2 * symmetric(i, j))};
    }
  }
  const Vector eigenvalues = UnitDiagonalEigenvalues(symmetric(positive, positive));
  if (eigenvalues[0] < -EigenvalueRounding(eigenvalues)) {
    return {Answer::kNo,
            absl::StrCat("its symmetric part, scaled to unit diagonal, has the eigenvalue ", eigenvalues[0])};
  }
  return {Answer::kYes,
          absl::StrCat("the smallest eigenvalue of its symmetric part, scaled to unit diagonal, is ",
                       eigenvalues[0])};
}

std::optional<double> SmallestEigenvalueIfDefinite(const Matrix& M) {
  const Matrix symmetric = SymmetricPart(M);
  if (!(symmetric.diagonal().minCoeff() > 0)) return std::nullopt;
  const Vector scaled = UnitDiagonalEigenvalues(symmetric);
  if (!(scaled[0] > EigenvalueRounding(scaled))) return std::nullopt;
  const double smallest =
      Eigen::SelfAdjointEigenSolver<Matrix>(symmetric, Eigen::EigenvaluesOnly).eigenvalues()[0];
  if (!(smallest > 0)) return std::nullopt;
  return smallest;
}

bool IsSymmetricPartPositiveDefinite(const Matrix& M) {
  const Matrix symmetric = SymmetricPart(M);
  if (!(symmetric.diagonal().minCoeff() > 0)) return false;
  const Vector scaled = UnitDiagonalEigenvalues(symmetric);
  return scaled[0] > EigenvalueRounding(scaled);
}

}  // namespace dlcs
