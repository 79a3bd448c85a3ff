// SPDX-License-Identifier: Apache-2.0
// Several arrays of NumPy in one zip archive.

#ifndef DLCS_CLIENT_FILES_NPZ_FILE_H_
#define DLCS_CLIENT_FILES_NPZ_FILE_H_

#include <string_view>

#include "absl/status/statusor.h"
#include "client/files/stored_array.h"

namespace dlcs::client {

// The arrays in `bytes`, the whole content of an .npz file: its members NAME.npy, packed or not. Errors, which follow
// the name of the file: InvalidArgument if it is no zip archive, or if two members have the same name.
absl::StatusOr<StoredVariables> ParseNpz(std::string_view bytes, const Wanted& wanted, ReadingBudget& budget);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_NPZ_FILE_H_
