// SPDX-License-Identifier: Apache-2.0
// A strict JSON parser whose errors name the place and the reason.

#ifndef DLCS_CLIENT_FILES_JSON_TEXT_H_
#define DLCS_CLIENT_FILES_JSON_TEXT_H_

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/statusor.h"

namespace dlcs::client {

// Larger input files are refused: a dense system of this size is beyond every server's message limit.
inline constexpr std::size_t kMaxFileBytes = std::size_t{256} << 20;

// The whole content of the file at `path`; `-` reads standard input. Errors: NotFound, PermissionDenied,
// FailedPrecondition (a directory, a failed read), ResourceExhausted (more than `limit_bytes`); each names
// the file.
absl::StatusOr<std::string> ReadFileBytes(const std::string& path, std::size_t limit_bytes = kMaxFileBytes);

// The same as text: TextOf() its bytes (client/files/encoding.h).
absl::StatusOr<std::string> ReadTextFile(const std::string& path, std::size_t limit_bytes = kMaxFileBytes);

// How a file is called in messages: its path, or "standard input" for `-`.
std::string SourceName(const std::string& path);

// Parses one JSON value. Stricter than the usual reader: a key given twice in one object, nesting deeper than 32, more
// than 8,388,608 lists and objects, and numbers beyond the range of double are errors. NaN, Infinity, comments, single
// quotes and trailing commas get specific error messages. `source` is the file's name for messages. Errors:
// InvalidArgument with source, line and column.
absl::StatusOr<nlohmann::json> ParseJson(const std::string& text, const std::string& source);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_JSON_TEXT_H_
