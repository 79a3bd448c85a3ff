// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/outer_product.h"

#include <cmath>
#include <utility>
#include <vector>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/simd/simd_dispatch.h"

namespace dlcs {

namespace {

// The diagonal of a diagonal matrix; empty if the matrix has other entries.
Vector DiagonalOf(const SparseMatrix& matrix) {
  if (matrix.rows() != matrix.cols()) return {};
  Vector diagonal = Vector::Zero(matrix.rows());
  for (Index j = 0; j < matrix.outerSize(); ++j) {
    for (SparseMatrix::InnerIterator entry(matrix, j); entry; ++entry) {
      if (entry.row() != j) return {};
      diagonal[j] = entry.value();
    }
  }
  return diagonal;
}

}  // namespace

SeparableMatrix::SeparableMatrix(SparseMatrix matrix) : matrix_(std::move(matrix)), diagonal_(DiagonalOf(matrix_)) {}

void SeparableMatrix::Multiply(const Eigen::Ref<const Matrix>& values, Eigen::Ref<Matrix> product) const {
  if (!is_diagonal()) {
    product.noalias() = matrix_ * values;
    return;
  }
  eigen_assert(values.cols() == product.cols());
  const bool in_place = values.data() == product.data();
  for (Index j = 0; j < values.cols(); ++j) {
    RunWide([=, rows = values.rows(), factors = diagonal_.data(), from_column = values.col(j).data(),
             to_column = product.col(j).data()]() DLCS_WIDE {
      const double* __restrict factor = factors, * __restrict from = from_column;
      double* __restrict to = to_column;
      if (in_place) {
        for (Index i = 0; i < rows; ++i) to[i] *= factor[i];
      } else {
        for (Index i = 0; i < rows; ++i) to[i] = from[i] * factor[i];
      }
    });
  }
}

void SeparableMatrix::AddProduct(const Eigen::Ref<const Matrix>& base, const Eigen::Ref<const Matrix>& values,
                                 Eigen::Ref<Matrix> sum) const {
  if (!is_diagonal()) {
    sum = base;
    sum.noalias() += matrix_ * values;
    return;
  }
  eigen_assert(base.cols() == sum.cols() && values.cols() == sum.cols());
  const bool in_place = base.data() == sum.data();
  for (Index j = 0; j < values.cols(); ++j) {
    RunWide([=, rows = values.rows(), factors = diagonal_.data(), base_column = base.col(j).data(),
             from_column = values.col(j).data(), to_column = sum.col(j).data()]() DLCS_WIDE {
      const double* __restrict factor = factors, * __restrict from = from_column, * __restrict before = base_column;
      double* __restrict to = to_column;
      if (in_place) {
        for (Index i = 0; i < rows; ++i) to[i] += from[i] * factor[i];
      } else {
        for (Index i = 0; i < rows; ++i) to[i] = before[i] + from[i] * factor[i];
      }
    });
  }
}

namespace {

struct Place {
  Index along, across;
};

Place PlaceOf(Index row, const Axis& axis) {
  const Index outer = row / axis.faster;
  return {outer % axis.length, outer / axis.length * axis.faster + row % axis.faster};
}

}  // namespace

std::optional<OuterProduct> AsOuterProduct(const SparseMatrix& matrix, const Axis& axis) {
  double largest = 0;
  Place pivot{0, 0};
  Index pivot_column = 0;
  for (Index c = 0; c < matrix.outerSize(); ++c) {
    for (SparseMatrix::InnerIterator entry(matrix, c); entry; ++entry) {
      if (std::abs(entry.value()) <= std::abs(largest)) continue;
      largest = entry.value();
      pivot = PlaceOf(entry.row(), axis);
      pivot_column = c;
    }
  }
  OuterProduct form{Vector::Zero(axis.length), SparseMatrix(matrix.rows() / axis.length, matrix.cols())};
  if (largest == 0) return form;

  // The line through the pivot along the axis, and the points with its place on the axis.
  std::vector<Eigen::Triplet<double>> across;
  for (Index c = 0; c < matrix.outerSize(); ++c) {
    for (SparseMatrix::InnerIterator entry(matrix, c); entry; ++entry) {
      const Place place = PlaceOf(entry.row(), axis);
      if (c == pivot_column && place.across == pivot.across) form.along[place.along] = entry.value() / largest;
      if (place.along == pivot.along) across.emplace_back(place.across, c, entry.value());
    }
  }
  form.across.setFromTriplets(across.begin(), across.end());

  Index explained = 0;
  for (Index c = 0; c < matrix.outerSize(); ++c) {
    for (SparseMatrix::InnerIterator entry(matrix, c); entry; ++entry) {
      const Place place = PlaceOf(entry.row(), axis);
      const double product = form.along[place.along] * form.across.coeff(place.across, c);
      if (!(std::abs(product - entry.value()) <= RoundingOf(9) * std::abs(largest))) return std::nullopt;
      if (product != 0) ++explained;
    }
  }
  const auto nonzeros = [](const auto& values) { return (values.array() != 0).count(); };
  const Index of_product =
      nonzeros(form.along) * nonzeros(Eigen::Map<const Vector>(form.across.valuePtr(), form.across.nonZeros()));
  if (explained != of_product) return std::nullopt;
  return form;
}

}  // namespace dlcs
