// SPDX-License-Identifier: Apache-2.0
// Files of single complementarity problems: one LCP, or one DCP and its paths.

#ifndef DLCS_CLIENT_FILES_LCP_FILE_H_
#define DLCS_CLIENT_FILES_LCP_FILE_H_

#include <string>

#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Errors of all as ParseProblem() and ReadProblemFile() (client/files/problem_file.h).

// One LCP: the keys M and q, and rule and selector where several solutions are possible.
absl::StatusOr<v1::SolveLcpRequest> ParseLcp(const std::string& text, const std::string& source);
absl::StatusOr<v1::SolveLcpRequest> ReadLcpFile(const std::string& path);

// One DCP: the keys M and q, an object with `times` and `values`, a row of values per time (dcp.schema.json).
absl::StatusOr<v1::SolveDcpRequest> ParseDcp(const std::string& text, const std::string& source);
absl::StatusOr<v1::SolveDcpRequest> ReadDcpFile(const std::string& path);

// A path: `times` and `values` at the top, or under the key `v`, as `dlcs dcp --format json` prints it.
absl::StatusOr<v1::PiecewiseLinearPath> ReadPathFile(const std::string& path);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_LCP_FILE_H_
