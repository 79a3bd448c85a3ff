// SPDX-License-Identifier: Apache-2.0
// Matrix Market files.
#include "client/files/matrix_json.h"
#include "client/files/matrix_market.h"
#include "server/wire/convert.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/small_limits.h"

namespace dlcs::fuzz {

void TryMatrixMarket(const std::string& input) {
  const absl::StatusOr<v1::Matrix> matrix = client::ParseMatrixMarket(input, "input");
  if (!matrix.ok()) return Require(!matrix.status().message().empty(), "a refusal says why");
  // A few bytes may name a sparse matrix of two billion rows, which the limits of a solve refuse.
  if (matrix->sparse().rows() > 20'000 || matrix->sparse().columns() > 20'000) return;
  std::vector<Violation> violations;
  (void)StructuredMatrixFromProto(*matrix, "A", violations);
  // Entries may stand in a file twice; that is all there is to refuse.
  Require(violations.empty() || matrix->has_sparse(), "what is read is a matrix");
}

}  // namespace dlcs::fuzz
