// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/positive_semidefinite.h"

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_lu.h"
#include "core/linalg/symmetric_eigenvalues.h"

namespace dlcs {

SymmetricSum SymmetricSumBelow(const Matrix& M) {
  SymmetricSum sum{.below = M + M.transpose(), .exact = true};
  const Matrix from_transpose = sum.below - M;
  const Matrix lost = (M - (sum.below - from_transpose)) + (M.transpose() - from_transpose);
  sum.exact = lost.isZero(0);
  for (Index k = 0; k < lost.size(); ++k) {
    double& entry = sum.below.reshaped()[k];
    if (lost.reshaped()[k] < 0) entry = std::nextafter(entry, -std::numeric_limits<double>::infinity());
  }
  return sum;
}

bool FormIsClearlyNegative(const Matrix& M, const Vector& z) {
  const BoundedSum form{z.dot(M * z), z.cwiseAbs().dot(M.cwiseAbs() * z.cwiseAbs())};
  return form.Sign(4 * M.rows()) < 0;
}

namespace {

// (M + Mᵀ)/2, with entries that are zero but for rounding set to zero.
Matrix SymmetricPart(const Matrix& M) {
  Matrix symmetric(M.rows(), M.cols());
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      const double sum = M(i, j) + M(j, i);
      symmetric(i, j) = std::abs(sum) <= RoundingOf(8) * std::abs(M(i, j)) ? 0 : sum / 2;
    }
  }
  return symmetric;
}

// Scales the rows and columns of a symmetric matrix with positive diagonal to unit diagonal.
Vector UnitDiagonalScale(const Matrix& symmetric) { return symmetric.diagonal().cwiseSqrt().cwiseInverse(); }

Matrix Scaled(const Matrix& symmetric, const Vector& scale) {
  return scale.asDiagonal() * symmetric * scale.asDiagonal();
}

// Whether the symmetric part, scaled to unit diagonal, is clearly strictly diagonally dominant, without making it.
bool IsClearlyDominant(const Matrix& M) {
  if (!(M.diagonal().array() > 0).all()) return false;
  const Vector scale = UnitDiagonalScale(M);
  Vector beside = Vector::Zero(M.rows());
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < j; ++i) {
      const double sum = std::abs(M(i, j) + M(j, i));
      if (sum == 0) continue;
      const double size = sum / 2 * scale[i] * scale[j];
      beside[i] += size;
      beside[j] += size;
    }
  }
  return MaxAbs(beside) <= 0.75;  // not where it is NaN
}

// Eigenvalues, increasing, of a symmetric matrix with positive diagonal after scaling to unit diagonal.
Vector UnitDiagonalEigenvalues(const Matrix& symmetric) {
  const Matrix scaled = Scaled(symmetric, UnitDiagonalScale(symmetric));
  return SymmetricEigenvalues(scaled);
}

double EigenvalueRounding(const Vector& eigenvalues) {
  return RoundingOf(8 * eigenvalues.size()) * eigenvalues.tail<1>()[0];
}

// The eigenvector of a symmetric matrix for its smallest eigenvalue, by inverse iteration. The shift is a little below
// that eigenvalue: the shifted matrix is nonsingular, and the shift is much closer to it than to the next one.
Vector Eigenvector(const Matrix& symmetric, double smallest) {
  const double below = smallest - RoundingOf(128) * MaxAbs(symmetric);
  const PanelLu factor(symmetric - below * Matrix::Identity(symmetric.rows(), symmetric.cols()));
  Vector z = Vector::LinSpaced(symmetric.rows(), 1, 2);  // at right angles to hardly anything
  for (int k = 0; k < 3; ++k) z = factor.Solve(z).col(0).normalized();
  return z;
}

Fact Refuted(std::string why, Vector z) {
  Fact fact{Answer::kNo, std::move(why)};
  fact.witness.z = std::move(z);
  return fact;
}

// z with a negative form where symmetric(i, i) = 0 and symmetric(i, j) is not zero.
Vector ZeroDiagonalWitness(const Matrix& symmetric, Index i, Index j) {
  Vector z = Vector::Unit(symmetric.rows(), j);
  z[i] = -(std::abs(symmetric(j, j)) + std::abs(symmetric(i, j))) / symmetric(i, j);
  return z;
}

}  // namespace

Fact TestPositiveSemidefinite(const Matrix& M) {
  // Gershgorin's circles, without the O(n³) of the eigenvalues.
  if (IsClearlyDominant(M)) {
    return {Answer::kYes, "its symmetric part, scaled to unit diagonal, is strictly diagonally dominant"};
  }
  const Matrix symmetric = SymmetricPart(M);
  if ((symmetric.array() == 0).all()) return {Answer::kYes, "its symmetric part is zero"};
  std::vector<Index> positive;
  for (Index i = 0; i < M.rows(); ++i) {
    if (symmetric(i, i) < 0) {
      return Refuted(absl::StrCat("M[", i, "][", i, "] = ", M(i, i), " is negative"), Vector::Unit(M.rows(), i));
    }
    if (symmetric(i, i) > 0) {
      positive.push_back(i);
      continue;
    }
    Index j = 0;
    if (symmetric.row(i).cwiseAbs().maxCoeff(&j) > 0) {
      return Refuted(absl::StrCat("M[", i, "][", i, "] = 0, but M[", i, "][", j, "] + M[", j, "][", i,
                                  "] = ", 2 * symmetric(i, j)),
                     ZeroDiagonalWitness(symmetric, i, j));
    }
  }
  const Matrix core = symmetric(positive, positive);
  const Vector scale = UnitDiagonalScale(core);
  const Matrix scaled = Scaled(core, scale);
  // The circles again, where the diagonal has zeros.
  const double beside = (scaled.cwiseAbs().rowwise().sum() - scaled.diagonal().cwiseAbs()).maxCoeff();
  if (scaled.allFinite() && beside <= 0.75 * scaled.diagonal().minCoeff()) {
    return {Answer::kYes, "its symmetric part, scaled to unit diagonal, is strictly diagonally dominant"};
  }
  const Vector eigenvalues = SymmetricEigenvalues(scaled);
  if (eigenvalues[0] < -EigenvalueRounding(eigenvalues)) {
    Vector z = Vector::Zero(M.rows());
    z(positive) = scale.cwiseProduct(Eigenvector(scaled, eigenvalues[0]));
    return Refuted(absl::StrCat("its symmetric part, scaled to unit diagonal, has the eigenvalue ", eigenvalues[0]),
                   std::move(z));
  }
  return {Answer::kYes,
          absl::StrCat("the smallest eigenvalue of its symmetric part, scaled to unit diagonal, is ", eigenvalues[0])};
}

std::optional<double> SmallestEigenvalueIfDefinite(const Matrix& M) {
  const Matrix symmetric = SymmetricPart(M);
  if (!(symmetric.diagonal().minCoeff() > 0)) return std::nullopt;
  const Vector scaled = UnitDiagonalEigenvalues(symmetric);
  if (!(scaled[0] > EigenvalueRounding(scaled))) return std::nullopt;
  const double smallest = SymmetricEigenvalues(symmetric)[0];
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
