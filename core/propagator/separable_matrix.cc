// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/separable_matrix.h"

#include <utility>

namespace dlcs {
namespace {

// Of a matrix that has no other entries, otherwise empty.
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
  if (is_diagonal()) {
    product.array() = values.array().colwise() * diagonal_.array();
  } else {
    product.noalias() = matrix_ * values;
  }
}

void SeparableMatrix::AddProduct(const Eigen::Ref<const Matrix>& values, Eigen::Ref<Matrix> sum) const {
  if (is_diagonal()) {
    sum.array() += values.array().colwise() * diagonal_.array();
  } else {
    sum.noalias() += matrix_ * values;
  }
}

}  // namespace dlcs
