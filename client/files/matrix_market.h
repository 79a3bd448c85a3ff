// SPDX-License-Identifier: Apache-2.0
// Reads Matrix Market files (https://math.nist.gov/MatrixMarket/formats.html).

#ifndef DLCS_CLIENT_FILES_MATRIX_MARKET_H_
#define DLCS_CLIENT_FILES_MATRIX_MARKET_H_

#include <string>

#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// The matrix that `text` holds: coordinate or array; real, integer or pattern (every entry 1); general,
// symmetric or skew-symmetric, of which the file holds one triangle. Coordinates become a sparse matrix, an
// array a dense one. Complex and hermitian matrices are refused. Errors: InvalidArgument "source, line 3:
// what is wrong".
absl::StatusOr<v1::Matrix> ParseMatrixMarket(const std::string& text, const std::string& source);

// The same for the file at `path`. Errors: as above and as ReadTextFile().
absl::StatusOr<v1::Matrix> ReadMatrixMarket(const std::string& path);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_MATRIX_MARKET_H_
