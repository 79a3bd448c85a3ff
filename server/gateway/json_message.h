// SPDX-License-Identifier: Apache-2.0
// Messages of the contract as proto3 JSON with the names of the contract, as `dlcs --format json` prints them.

#ifndef DLCS_SERVER_GATEWAY_JSON_MESSAGE_H_
#define DLCS_SERVER_GATEWAY_JSON_MESSAGE_H_

#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "google/protobuf/descriptor.h"

namespace dlcs {

struct JsonBounds {
  // Of the message. The JSON of many short numbers takes a quarter of that.
  std::size_t max_bytes = std::numeric_limits<std::size_t>::max();
  // Called before each piece of the JSON; false ends the conversion.
  std::function<bool()> is_wanted = [] { return true; };
  // A piece takes some ten milliseconds at most, unless a text in it is longer.
  std::size_t piece_bytes = std::size_t{32} << 10;
};

// An empty `json` stands for an empty message, so that "curl -X POST" lists the jobs. Errors: InvalidArgument with the
// field or the place; ResourceExhausted beyond max_bytes; Cancelled.
absl::StatusOr<std::string> JsonToMessage(const google::protobuf::Descriptor& type, const std::string& json,
                                          const JsonBounds& bounds = {});

// Errors: Internal for bytes that are no such message, or that have no JSON.
absl::StatusOr<std::string> MessageToJson(const google::protobuf::Descriptor& type, const std::string& message);

// `text` from a client with bytes that are not UTF-8 replaced, for the message of a status, which must be UTF-8.
std::string ValidUtf8(std::string_view text);

}  // namespace dlcs

#endif  // DLCS_SERVER_GATEWAY_JSON_MESSAGE_H_
