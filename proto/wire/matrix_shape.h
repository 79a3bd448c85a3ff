// SPDX-License-Identifier: Apache-2.0
// The shape that a matrix on the wire says it has.

#ifndef DLCS_PROTO_WIRE_MATRIX_SHAPE_H_
#define DLCS_PROTO_WIRE_MATRIX_SHAPE_H_

#include <cstdint>

#include "dlcs/v1/solver.pb.h"

namespace dlcs {

struct WireShape {
  std::int64_t rows = 0;
  std::int64_t columns = 0;
};

// As declared, negative numbers too; nothing is allocated and no entry is looked at. 0 × 0 where no kind is
// set. Of a Kronecker sum the products of the factors' shapes, the largest int64 where they overflow.
WireShape ShapeOf(const v1::Matrix& matrix);

}  // namespace dlcs

#endif  // DLCS_PROTO_WIRE_MATRIX_SHAPE_H_
