// SPDX-License-Identifier: Apache-2.0
// Reads Matrix Market files (https://math.nist.gov/MatrixMarket/formats.html).

#ifndef DLCS_CLIENT_FILES_MATRIX_MARKET_H_
#define DLCS_CLIENT_FILES_MATRIX_MARKET_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// The header of a file.
struct MarketHead {
  bool is_coordinate = false;
  bool is_pattern = false;                     // every entry is 1
  bool is_symmetric = false, is_skew = false;  // the file has one triangle
  std::int64_t rows = 0, columns = 0;
  std::int64_t entries = 0;  // of coordinates, as the file has them
  std::size_t bytes = 0;     // of the file before its entries
  std::int64_t line = 1;     // the last one of these

  bool is_half() const { return is_symmetric || is_skew; }
};

// `text` begins as the file does. Errors: as ParseMatrixMarket().
absl::StatusOr<MarketHead> ParseMarketHead(std::string_view text, const std::string& source);

// Called with each entry of the matrix, from 0: twice for one off the diagonal of one triangle.
using MarketEntry = std::function<void(std::int32_t row, std::int32_t column, double value)>;

// Whole lines of the coordinates of a file, the first of which is number `line`. Returns the number of entries in them.
// Errors: as ParseMatrixMarket().
absl::StatusOr<std::int64_t> ParseMarketLines(std::string_view text, std::int64_t line, const MarketHead& head,
                                              const std::string& source, const MarketEntry& add);

// The matrix that `text` holds: coordinate or array; real, integer or pattern (every entry 1); general,
// symmetric or skew-symmetric, of which the file holds one triangle. Coordinates become a sparse matrix, an
// array a dense one. Complex and hermitian matrices are refused. Errors: InvalidArgument "source, line 3:
// what is wrong".
absl::StatusOr<v1::Matrix> ParseMatrixMarket(const std::string& text, const std::string& source);

// The same for the file at `path`. Errors: as above and as ReadTextFile().
absl::StatusOr<v1::Matrix> ReadMatrixMarket(const std::string& path);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_MATRIX_MARKET_H_
