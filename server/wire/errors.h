// SPDX-License-Identifier: Apache-2.0
// The errors of a call, as absl::Status that carries violations (core/problem/violation_list.h) or google.rpc details.
//
// A detail is a payload keyed by its type URL ("type.googleapis.com/google.rpc.ErrorInfo"), so that an error is
// the same object in the process of the command line and behind a server; server/wire/status.h puts it on the
// wire.

#ifndef DLCS_SERVER_WIRE_ERRORS_H_
#define DLCS_SERVER_WIRE_ERRORS_H_

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "core/problem/violation_list.h"

namespace dlcs {

// The longest message of an error: errors travel in HTTP/2 headers (server/wire/status.h).
inline constexpr std::size_t kMaxMessageBytes = 512;

// INVALID_ARGUMENT that carries `violations` (ViolationsOf() in core/problem/violation_list.h), which are not empty.
// The message names the first one and how many there are.
absl::Status InvalidRequest(const std::vector<Violation>& violations);

// The limit of a refusal, named as in GetCapabilitiesResponse, its value, and the requested value.
struct LimitCase {
  std::string limit;
  double value = 0;
  double requested = 0;
};

// RESOURCE_EXHAUSTED with ErrorInfo (metadata: limit, value, requested): SERVER_BUSY with RetryInfo if `retry_after` is
// given, else LIMIT_EXCEEDED. The time to try again is added to `message`.
absl::Status Refused(const std::string& message, const LimitCase& limit,
                     std::optional<std::chrono::milliseconds> retry_after);

// RESOURCE_EXHAUSTED with ErrorInfo LIMIT_EXCEEDED (metadata: limit, value, requested): the request exceeds `limit`,
// named as in GetCapabilitiesResponse, and trying again does not help.
absl::Status LimitExceeded(const std::string& limit, std::int64_t value, std::int64_t requested);

// RESOURCE_EXHAUSTED with ErrorInfo SERVER_BUSY (metadata: limit, value) and RetryInfo: `limit` is used up by other
// requests at the moment.
absl::Status ServerBusy(const std::string& limit, std::int64_t value, std::chrono::milliseconds retry_after);

// UNAVAILABLE with ErrorInfo SHUTTING_DOWN.
absl::Status ShuttingDown();

// The status to send to callers: `status` with an ErrorInfo, added according to its code if it has none. An UNAVAILABLE
// of the job store gets the reason STORE_UNAVAILABLE, so that callers can distinguish it from a server that cannot be
// reached.
absl::Status ForCallers(absl::Status status);

// Text from a caller for use in a message: quoted, shortened, without control characters and invalid UTF-8.
std::string Quoted(std::string_view text);

}  // namespace dlcs

#endif  // DLCS_SERVER_WIRE_ERRORS_H_
