// SPDX-License-Identifier: Apache-2.0
// Messages of the contract as the JSON that all commands print.

#ifndef DLCS_CLIENT_CLI_MESSAGE_JSON_H_
#define DLCS_CLIENT_CLI_MESSAGE_JSON_H_

#include <google/protobuf/message.h>

#include <string>

namespace dlcs::client {

// One line: an object with the fields that are set, in the order and by the names of the contract, "create_time". Numbers are
// numbers, those of 64 bits too, and null where they are not finite; enumerators are strings, and so are times (RFC 3339, in UTC)
// and durations ("1.5s"), as in the JSON of protobuf.
std::string JsonLine(const google::protobuf::Message& message);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_MESSAGE_JSON_H_
