// SPDX-License-Identifier: Apache-2.0
// The declared shape of a matrix on the wire.

#ifndef DLCS_PROTO_WIRE_MATRIX_SHAPE_H_
#define DLCS_PROTO_WIRE_MATRIX_SHAPE_H_

#include <cstdint>

#include "dlcs/v1/solver.pb.h"

namespace dlcs {

struct WireShape {
  std::int64_t rows = 0;
  std::int64_t columns = 0;
};

// As declared, even if negative; does not allocate or read entries. 0 × 0 if no kind is set. For a Kronecker sum the
// products of the factors' shapes; the largest int64 if they overflow.
WireShape ShapeOf(const v1::Matrix& matrix);

}  // namespace dlcs

#endif  // DLCS_PROTO_WIRE_MATRIX_SHAPE_H_
