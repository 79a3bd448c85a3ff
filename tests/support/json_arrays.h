// SPDX-License-Identifier: Apache-2.0
// Vectors and matrices as JSON lists.

#ifndef DLCS_TESTS_SUPPORT_JSON_ARRAYS_H_
#define DLCS_TESTS_SUPPORT_JSON_ARRAYS_H_

#include <cstddef>
#include <nlohmann/json.hpp>

#include "core/types.h"

namespace dlcs::testing {

inline Vector ReadVector(const nlohmann::json& entries) {
  Vector vector(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) vector[static_cast<Index>(i)] = entries[i].get<double>();
  return vector;
}

// `rows` is a list of rows.
inline Matrix ReadMatrix(const nlohmann::json& rows) {
  Matrix matrix(rows.size(), rows.empty() ? 0 : rows[0].size());
  for (std::size_t i = 0; i < rows.size(); ++i) matrix.row(static_cast<Index>(i)) = ReadVector(rows[i]).transpose();
  return matrix;
}

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_JSON_ARRAYS_H_
