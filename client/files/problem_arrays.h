// SPDX-License-Identifier: Apache-2.0
// A linear problem from a file of arrays: an .npz or .mat file with the variables A, B, N, M, x0 and T, and where they
// are not zero f and g.

#ifndef DLCS_CLIENT_FILES_PROBLEM_ARRAYS_H_
#define DLCS_CLIENT_FILES_PROBLEM_ARRAYS_H_

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// The problem in `bytes`, the whole content of such a file. f and g are constants; lists may be rows or columns. A
// variable with another name is an error, since it may be a slip. Errors: as ParseArrayFile(); InvalidArgument with one
// "source: variable rule" per line.
absl::StatusOr<v1::Problem> ParseProblemArrays(std::string_view bytes, const std::string& source);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_PROBLEM_ARRAYS_H_
