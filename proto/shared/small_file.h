// SPDX-License-Identifier: Apache-2.0
// Reads small files: tokens, certificates, keys.

#ifndef DLCS_PROTO_SHARED_SMALL_FILE_H_
#define DLCS_PROTO_SHARED_SMALL_FILE_H_

#include <string>

#include "absl/status/statusor.h"

namespace dlcs {

// The text in `file`, at most 1 MB, without a byte order mark. Errors: InvalidArgument with the file and what is wrong.
absl::StatusOr<std::string> ReadSmallFile(const std::string& file);

}  // namespace dlcs

#endif  // DLCS_PROTO_SHARED_SMALL_FILE_H_
