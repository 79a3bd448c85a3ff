// SPDX-License-Identifier: Apache-2.0
// Numbers of the engine as repeated fields.

#ifndef DLCS_SERVER_WIRE_CONVERT_DENSE_H_
#define DLCS_SERVER_WIRE_CONVERT_DENSE_H_

#include "core/types.h"
#include "google/protobuf/repeated_field.h"

namespace dlcs {

using Doubles = google::protobuf::RepeatedField<double>;

// Appends the entries of a vector or, column after column, of a matrix.
template <typename Dense>
void Append(const Dense& dense, Doubles& values) {
  values.Reserve(values.size() + static_cast<int>(dense.size()));
  if constexpr ((Dense::Flags & Eigen::DirectAccessBit) != 0 && !Dense::IsRowMajor) {
    if (dense.innerStride() == 1 && (dense.outerStride() == dense.rows() || dense.cols() == 1)) {
      values.Add(dense.data(), dense.data() + dense.size());  // as one block
      return;
    }
  }
  for (Index column = 0; column < dense.cols(); ++column) {
    for (Index row = 0; row < dense.rows(); ++row) values.AddAlreadyReserved(dense(row, column));
  }
}

}  // namespace dlcs

#endif  // DLCS_SERVER_WIRE_CONVERT_DENSE_H_
