// SPDX-License-Identifier: Apache-2.0
// Matrix files that are not read as a whole.

#ifndef DLCS_CLIENT_FILES_MATRIX_FILES_H_
#define DLCS_CLIENT_FILES_MATRIX_FILES_H_

#include <functional>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Reads a matrix that a problem file names at `place`, as in A, in the file at `path`. If the file is read by rows,
// returns a matrix of its shape without entries in its place. Absent for a file that is read as a whole.
using MatrixFiles =
    std::function<std::optional<absl::StatusOr<v1::Matrix>>(const std::string& place, const std::string& path)>;

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_MATRIX_FILES_H_
