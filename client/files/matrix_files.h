// SPDX-License-Identifier: Apache-2.0
// Files of matrices that are read otherwise than whole.

#ifndef DLCS_CLIENT_FILES_MATRIX_FILES_H_
#define DLCS_CLIENT_FILES_MATRIX_FILES_H_

#include <functional>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Reads a matrix that a problem file names at `place`, as in A, in the file at `path`. Where that is read by rows, what
// stands for it in the problem is a matrix of its shape without entries. Nothing for a file that is to be read whole.
using MatrixFiles =
    std::function<std::optional<absl::StatusOr<v1::Matrix>>(const std::string& place, const std::string& path)>;

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_MATRIX_FILES_H_
