// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/matrix_shape.h"

#include <limits>

namespace dlcs {
namespace {

std::int64_t SaturatedProduct(std::int64_t a, std::int64_t b) {
  std::int64_t product = 0;
  return __builtin_mul_overflow(a, b, &product) ? std::numeric_limits<std::int64_t>::max() : product;
}

WireShape ShapeOfSum(const v1::KroneckerSum& sum) {
  if (sum.factors().empty()) return {};
  WireShape shape{1, 1};
  for (const v1::Matrix& factor : sum.factors()) {
    // A sum among the factors is refused elsewhere, so its own factors, which may nest, are no matter here.
    const WireShape of_factor = factor.has_kronecker_sum() ? WireShape() : ShapeOf(factor);
    shape = {SaturatedProduct(shape.rows, of_factor.rows), SaturatedProduct(shape.columns, of_factor.columns)};
  }
  return shape;
}

}  // namespace

WireShape ShapeOf(const v1::Matrix& matrix) {
  switch (matrix.kind_case()) {
    case v1::Matrix::kDense:
      return {matrix.dense().rows(), matrix.dense().columns()};
    case v1::Matrix::kSparse:
      return {matrix.sparse().rows(), matrix.sparse().columns()};
    case v1::Matrix::kKroneckerSum:
      return ShapeOfSum(matrix.kronecker_sum());
    case v1::Matrix::KIND_NOT_SET:
      break;
  }
  return {};
}

}  // namespace dlcs
