// SPDX-License-Identifier: Apache-2.0
// Files of arrays, recognized by their content: .npy, .npz, .mat, and binary files of PETSc.

#ifndef DLCS_CLIENT_FILES_ARRAY_FILE_H_
#define DLCS_CLIENT_FILES_ARRAY_FILE_H_

#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/files/stored_array.h"

namespace dlcs::client {

// Whether `bytes` begin as such a file does.
bool IsArrayFile(std::string_view bytes);

// The arrays in `bytes`, the whole content of such a file. That of an .npy file or of PETSc has no name. Errors, which
// begin with `source`: InvalidArgument if it is no such file, and those of ParseNpz() and ParseMat().
absl::StatusOr<StoredVariables> ParseArrayFile(std::string_view bytes, const std::string& source, const Wanted& wanted);

// One array of the file at `path`, by the name of its variable, which may be left out where the file holds only one.
// Errors, which name file and variable: as above and as ReadFileBytes(); NotFound if there is no such variable;
// InvalidArgument if `variable` is left out where there are several, or cannot be read.
absl::StatusOr<StoredArray> ReadStoredArray(const std::string& path, const std::optional<std::string>& variable);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_ARRAY_FILE_H_
