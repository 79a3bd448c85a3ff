// SPDX-License-Identifier: Apache-2.0
// The JSON that all commands print: that of proto3 with the field names of the contract. Enumerators are strings, and
// so are integers of 64 bits, times (RFC 3339, in UTC), durations ("1.5s") and numbers that are not finite ("NaN").
// Fields that are not set are printed with their default, except messages and optional fields. Doubles are written with
// 15 digits or, where these do not give the same bits, with 17.

#ifndef DLCS_CLIENT_CLI_OUTPUT_MESSAGE_JSON_H_
#define DLCS_CLIENT_CLI_OUTPUT_MESSAGE_JSON_H_

#include <google/protobuf/message.h>

#include <cstdio>
#include <string>

#include "client/result/ensemble_result.h"
#include "client/result/solve_result.h"

namespace dlcs::client {

// `message` on one line.
std::string JsonLine(const google::protobuf::Message& message);

// v1::SolveResult on one line, as JsonLine() would print it (except that a negative zero is -0.0, which JSON readers
// understand). Written without building the whole text in memory, since a trajectory may be large.
void PrintJson(const std::string& title, const SolveResult& result, std::FILE* out);

// v1::MemberResult likewise.
void PrintJson(const MemberResult& member, std::FILE* out);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_MESSAGE_JSON_H_
